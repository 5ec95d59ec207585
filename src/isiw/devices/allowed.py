"""What limits say about the next stimulus: whether it may come, and when."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from isiw.devices.limits import Limits, PulseLimits
from isiw.errors import LimitExceededError

_GRID_TOLERANCE_MS = 1e-6
_SAME_PCT_MSO = 0.01  # what a conversion on the way may lose


def require_left(limits: PulseLimits, delivered: int) -> None:
    """Raise LimitExceededError if so many deliveries leave none."""
    if delivered >= limits.max_pulses:
        raise LimitExceededError(
            f"the limit of {limits.max_pulses} pulses is reached",
            remedy="This stimulus was not delivered. For more pulses raise max_pulses in the limits.",
        )


def require_intensity(limits: PulseLimits, pct_rmt: float | None) -> None:
    """Raise LimitExceededError if an intensity to be set [% RMT] is beyond the limits; None sets none."""
    most = limits.max_intensity_pct_rmt
    if pct_rmt is not None and not (most is not None and pct_rmt <= most):
        raise LimitExceededError(
            "the intensity is beyond the limits",
            got=f"{pct_rmt:g} % RMT",
            expected="no intensity to be set" if most is None else f"at most {most:g} % RMT",
            remedy="This stimulus was not delivered. Write max_intensity_pct_rmt under [limits] if your ethics "
            "approval allows it.",
        )


def require_state(limits: PulseLimits, coil_c: float | None = None, intensity_pct_mso: float | None = None) -> None:
    """Raise LimitExceededError if the coil is hot, the intensity another one, or what is limited not reported."""
    own = limits.intensity_pct_mso
    if limits.max_coil_c is not None and not (coil_c is not None and coil_c <= limits.max_coil_c):
        way_on = "Let the device's readiness() report coil_c" if coil_c is None else "Let the coil cool"
        raise LimitExceededError(
            "the coil is too hot, or its temperature is not known",
            got="no temperature" if coil_c is None else f"{coil_c:g} °C",
            expected=f"at most {limits.max_coil_c:g} °C",
            remedy=f"This stimulus was not delivered. {way_on}, then resume the session.",
        )
    if own is not None and (intensity_pct_mso is None or abs(intensity_pct_mso - own) > _SAME_PCT_MSO):
        reporting = "Let the device's readiness() report intensity_pct_mso"
        raise LimitExceededError(
            "the intensity is not the session's, or is not known",
            got="no intensity" if intensity_pct_mso is None else f"{intensity_pct_mso:g} % MSO",
            expected=f"{own:g} % MSO",
            remedy="This stimulus was not delivered. "
            f"{reporting if intensity_pct_mso is None else 'Set the intensity back'}, then resume the session.",
        )


def require_isi(limits: Limits, isi_ms: float) -> None:
    """Raise LimitExceededError if an ISI is beyond the range, or off the grid."""
    if not limits.low_ms <= isi_ms <= limits.high_ms:
        raise LimitExceededError(
            "the ISI is beyond the limits",
            got=isi_ms,
            expected=f"{limits.low_ms:g} to {limits.high_ms:g} ms",
            remedy="This stimulus was not delivered. Narrow the design space to the limits; widen the limits only "
            "if your ethics approval allows it.",
        )
    if limits.isis_ms and isi_ms not in limits.isis_ms:
        raise LimitExceededError(
            "the ISI is not one of those that the limits list",
            got=isi_ms,
            expected=f"one of {', '.join(f'{one:g}' for one in limits.isis_ms)} ms",
            remedy="This stimulus was not delivered. Use the same list in the design space and in the limits.",
        )
    if limits.step_ms and math.fabs(math.remainder(isi_ms - limits.low_ms, limits.step_ms)) > _GRID_TOLERANCE_MS:
        raise LimitExceededError(
            "the ISI is not on the grid of the limits",
            got=isi_ms,
            expected=f"{limits.low_ms:g} ms and steps of {limits.step_ms:g} ms",
            remedy="This stimulus was not delivered. Use the same low_ms and step_ms in the design space and in "
            "the limits.",
        )


def earliest_s(limits: PulseLimits, times_s: Sequence[float], since_s: float) -> float:
    """When the next stimulus may come at the earliest [s], after earlier ones at these times [s], which ascend.

    A session waits a whole interval before its first stimulus from when it began, or went on [s].
    """
    if not times_s:
        return since_s + limits.iti_s
    earliest = [max(since_s, times_s[-1]) + limits.iti_s]
    if limits.max_block_pulses is not None:
        last = times_s[-limits.max_block_pulses :]
        is_block = all(after - before < limits.rest_s for before, after in pairwise(last))
        if is_block and len(last) == limits.max_block_pulses:
            earliest.append(times_s[-1] + limits.rest_s)
    if limits.max_period_pulses is not None and len(times_s) >= limits.max_period_pulses:
        earliest.append(times_s[-limits.max_period_pulses] + limits.period_s)
    return max(earliest)
