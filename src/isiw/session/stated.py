"""Checks of what is stated for a session: that it has an effect, and the unit that is meant.

What earlier logs state is not checked by these, so that it stays readable.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from isiw.design import DesignSpace
from isiw.devices.limits import PulseLimits
from isiw.errors import InvalidValueError
from isiw.findings import refused, require_percent
from isiw.signals.limits import ARTEFACT_MS, SignalLimits
from isiw.signals.plausible import implausible_scale, require_amplitude
from isiw.signals.spans import MEP_WINDOW_MS
from isiw.trials import Trial
from isiw.visit import Visit, VisitProtocol, interval_s

MOST_COIL_C = 60.0
"""No coil that touches a person may be as hot as that [°C]."""

MOST_DAY = 9999
"""Nobody comes so often; a date as a number is larger."""


def require_limits(limits: PulseLimits) -> None:
    """Raise InvalidValueError if a limit limits nothing, or is probably in another unit.

    The interval alone may keep what a rest or a period asks for, or be in ms, and no coil be as hot as its limit.
    """
    interval_s("Limits.min_iti_s", limits.iti_s)
    require_percent("Limits.intensity_pct_mso", limits.intensity_pct_mso)
    require_percent("Limits.max_intensity_pct_rmt", limits.max_intensity_pct_rmt)
    if limits.max_coil_c is not None and limits.max_coil_c > MOST_COIL_C:
        raise InvalidValueError(
            "Limits.max_coil_c is hotter than a coil may be that touches a person, so it would have no effect",
            got=limits.max_coil_c,
            expected=f"at most {MOST_COIL_C:g} °C",
            remedy="Is it in °F, or in tenths of a degree? Write it in °C, such as 40.",
        )
    if limits.max_block_pulses is not None and limits.rest_s <= limits.iti_s:
        raise InvalidValueError(
            "the rest of the limits is no longer than the interval between two stimuli, so it would have no effect",
            got=f"rest_s {limits.rest_s:g}, min_iti_s {limits.iti_s:g}",
            expected=f"rest_s above {limits.iti_s:g}",
            remedy="Set a longer rest_s [s], or leave out max_block_pulses and rest_s.",
        )
    # At the shortest interval n stimuli take so long that the next one comes when the first is n intervals old.
    if limits.max_period_pulses is not None and limits.period_s <= limits.max_period_pulses * limits.iti_s:
        raise InvalidValueError(
            "the period limit has no effect: at the shortest interval no more than max_period_pulses fit into it",
            got=f"period_s {limits.period_s:g}, max_period_pulses {limits.max_period_pulses}, "
            f"min_iti_s {limits.iti_s:g}",
            expected=f"period_s above {limits.max_period_pulses * limits.iti_s:g}",
            remedy="Set a longer period_s [s] or fewer max_period_pulses, or leave out both.",
        )


def require_given(trials: Iterable[Trial]) -> None:
    """Raise if intensities or amplitudes of trials that were given before are probably in another unit."""
    meps_mv = []
    for trial in trials:
        require_percent("the intensity of a trial that was given before", trial.intensity_pct_rmt)
        if trial.told and trial.mep_mv is not None:
            require_amplitude(trial.mep_mv)
            meps_mv.append(trial.mep_mv)
    if (found := implausible_scale(meps_mv)) is not None:
        raise refused(found, max(meps_mv))


def require_protocol(protocol: VisitProtocol, min_iti_s: float) -> None:
    """Raise if the intervals are as long as the rests, so that these are none, or no longer than the limits' own.

    Args:
        protocol: the protocol.
        min_iti_s: the interval of the limits, which holds if the protocol has none [s].

    Raises:
        InvalidValueError: a rest that is no longer than the longest interval, intervals that the limits replace, or
            an intensity of TMS alone where there is none, or in another unit.
    """
    require_percent("the protocol's alone_pct_rmt", protocol.alone_pct_rmt)
    if protocol.alone_pct_rmt is not None and not protocol.tms_alone:
        raise InvalidValueError(
            "an intensity of TMS alone has no effect in a protocol without TMS alone",
            got=f"alone_pct_rmt = {protocol.alone_pct_rmt:g}",
            remedy="Set a share tms_alone, or leave out alone_pct_rmt.",
        )
    if protocol.iti_s is not None and protocol.iti_s[1] <= min_iti_s and protocol.iti_s != (min_iti_s, min_iti_s):
        raise InvalidValueError(
            "the protocol's intervals are no longer than the limits allow at least, so they would have no effect",
            got=f"iti_s {protocol.iti_s[0]:g} to {protocol.iti_s[1]:g}, min_iti_s {min_iti_s:g}",
            expected=f"intervals up to more than {min_iti_s:g} s",
            remedy="Set a longer iti_s [s] in the protocol, or a shorter min_iti_s in the limits.",
        )
    longest_s = min_iti_s if protocol.iti_s is None else protocol.iti_s[1]
    if protocol.block_trials is not None and protocol.rest_s <= longest_s:
        raise InvalidValueError(
            "the protocol's rest is no longer than the longest interval between two trials, so it would have no effect",
            got=f"rest_s {protocol.rest_s:g}, longest interval {longest_s:g}",
            expected=f"rest_s above {longest_s:g}",
            remedy="Set a longer rest_s [s], or leave out block_trials and rest_s.",
        )


def require_visit(visit: Visit, assumed_pct_rmt: float | None = None) -> None:
    """Raise if the day is a date, or an intensity is probably in another unit, or not the one that is assumed.

    Args:
        visit: the visit.
        assumed_pct_rmt: the intensity that the strategy assumes [% RMT]; None if it assumes none.

    Raises:
        InvalidValueError: a day that is none, an intensity below 3 %, or one other than the strategy's.
    """
    if visit.day is not None and visit.day > MOST_DAY:
        raise InvalidValueError(
            "the visit's day is the number of the person's visit, from 1, and no date",
            got=visit.day,
            expected=f"at most {MOST_DAY}",
        )
    noted = visit.intensity_pct_rmt
    require_percent("the visit's intensity_pct_rmt", noted)
    require_percent("the visit's intensity_pct_mso", visit.intensity_pct_mso)
    if noted is not None and assumed_pct_rmt is not None and not math.isclose(noted, assumed_pct_rmt):
        raise InvalidValueError(
            "the visit and the strategy state different intensities of the pulse",
            got=f"{assumed_pct_rmt:g} % of RMT in the strategy",
            expected=f"{noted:g}, as the visit says",
            remedy="Correct intensity_pct_rmt under [visit] or under [strategy.settings] (in Python of isiw.Visit "
            f"or make_strategy(..., intensity_pct_rmt={noted:g})).",
        )


def require_signals(signals: SignalLimits, space: DesignSpace) -> None:
    """Raise where the window would hold the pulse's own artefact, or a tolerance would have no effect.

    Raises:
        InvalidValueError: the MEP window begins less than 3 ms after the pulse, as also where its first ms is in s; or
            a tolerance that is wider than the space's.
    """
    if signals.isi_tolerance_ms is not None and signals.isi_tolerance_ms > space.tolerance_ms:
        raise InvalidValueError(
            "SignalLimits.isi_tolerance_ms is wider than the design space's tolerance, so it would have no effect",
            got=signals.isi_tolerance_ms,
            expected=f"at most {space.tolerance_ms:g} ms",
            remedy="Leave it out, or widen tolerance_ms of the design space.",
        )
    if signals.mep_window_ms[0] < ARTEFACT_MS:
        raise InvalidValueError(
            "SignalLimits.mep_window_ms begins in the pulse's artefact, which would be measured as an MEP",
            got=signals.mep_window_ms,
            expected=f"from {ARTEFACT_MS:g} ms after the pulse on, such as {MEP_WINDOW_MS}",
            remedy="Set when MEPs of this muscle begin [ms].",
        )
