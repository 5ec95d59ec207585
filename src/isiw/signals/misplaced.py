"""Responses of the EMG outside the MEP window: the time of the pulse is wrong, or the window does not fit the muscle.

A response is what stands clearly out of the EMG at rest where neither pulse nor tap leave their artefacts. One alone
says little. Where several in a row come equally long after the pulse, at ISIs that differ, and none within the window,
they are taken for the MEP.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from isiw.signals.doubts import REPEATED, Doubt, DoubtKind
from isiw.signals.faults import tap_span_ms
from isiw.signals.limits import ARTEFACT_MS, SignalLimits
from isiw.signals.units import EMG_UNITS_MV
from isiw.trials import Sweep, Trial
from isiw.types import BoolArray, FloatArray

__all__ = ["Misplaced", "doubt_of_artefact", "doubt_of_place", "is_artefact", "kinds_asked", "misplaced_after"]

SOUGHT_MS = (ARTEFACT_MS, 80.0)
"""Where a response is looked for [ms after the pulse]: behind the pulse's artefact, and before the person moves."""

QUIET = 8.0
CLEAR = 12.0
"""Peak-to-peak amplitude over the RMS at rest: up to the one there is no MEP in the window, from the other on there is
a response outside. In 330 recorded and simulated sweeps without an MEP it was 7.3 outside at most."""

LEAST_MV = 0.02
SPAN_MS = 10.0
"""How far from its largest deflection a response reaches."""

TAIL = 1.5
"""Before the window nothing counts where the pulse's own artefact is larger by this factor: it may be its end."""

NEAR_MS = 5.0
"""So near the window an artefact that is larger than what is within it has not ended yet."""

IN_A_ROW = 4
ALIKE_MS = 4.0
DIFFERING_MS = 15.0
"""So many come equally long after the pulse, while the tap, and with it its reflexes, comes at times that differ."""

VARIES = 1.5
"""From the smallest to the largest of several MEPs it is more than this; the end of an artefact is always the same."""

_ASK_OF_ARTEFACT = "Does the stimulator's artefact reach into the window? Or do MEPs begin earlier?"
_ASK = "Is the time of the pulse right? Does the window fit the muscle? Or is it the stimulator's artefact?"


@dataclass(frozen=True)
class Misplaced:
    """A response outside the MEP window.

    Args:
        at_ms: its centre [ms after the pulse].
        size_mv: its peak-to-peak amplitude [mV].
        isi_ms: the trial's ISI [ms]; None for TMS alone.
    """

    at_ms: float
    size_mv: float
    isi_ms: float | None


def misplaced_after(
    earlier: Sequence[Misplaced], sweep: Sweep, trial: Trial, limits: SignalLimits
) -> tuple[Misplaced, ...]:
    """The responses outside the window since the last one within it, after one more trial that counts.

    Args:
        earlier: those before.
        sweep: the trial's sweep.
        trial: as it was judged.
        limits: what it was judged by.
    """
    rest_mv = (trial.background_rms_uv or 0.0) / 1000
    if trial.mep_mv is None or trial.t_tms_ms is None or not rest_mv:
        return tuple(earlier)
    if trial.mep_mv > QUIET * rest_mv:
        return ()
    found = _outside(sweep, trial, limits.mep_window_ms)
    if found is None or found.size_mv < max(CLEAR * rest_mv, LEAST_MV):
        return tuple(earlier)
    return (*earlier, found)


def doubt_of_place(misplaced: Sequence[Misplaced], limits: SignalLimits) -> Doubt | None:
    """What is odd about responses outside the window; None where there are few, or another cause is likely.

    Args:
        misplaced: those since the last one within it.
        limits: say where the window is.
    """
    alike = _last_alike(misplaced)
    if len(alike) < IN_A_ROW or not _follow_the_pulse(alike):
        return None
    at_ms = statistics.median(one.at_ms for one in alike)
    first_ms, last_ms = limits.mep_window_ms
    sizes_mv = [one.size_mv for one in alike]
    if at_ms < first_ms and max(sizes_mv) < VARIES * min(sizes_mv):
        return None
    text = (
        f"In {len(alike)} trials the EMG has a response at about {at_ms:.0f} ms after the pulse, outside the MEP "
        f"window of {first_ms:g}–{last_ms:g} ms, and none within it."
    )
    return Doubt(DoubtKind.MISPLACED, f"{text} {_ASK}")


def is_artefact(sweep: Sweep, trial: Trial, limits: SignalLimits) -> bool:
    """Whether what is in the MEP window comes out of something larger before it: the end of the pulse's artefact.

    Args:
        sweep: the trial's sweep.
        trial: as it was judged.
        limits: say where the window is.
    """
    rest_mv = (trial.background_rms_uv or 0.0) / 1000
    if trial.mep_mv is None or trial.t_tms_ms is None or trial.mep_mv <= QUIET * rest_mv:
        return False
    emg_mv, since_ms, tap = _since_pulse(sweep, trial)
    first_ms, last_ms = limits.mep_window_ms
    before = (since_ms >= max(SOUGHT_MS[0], first_ms - NEAR_MS)) & (since_ms < first_ms) & ~tap
    within = (since_ms >= first_ms) & (since_ms <= last_ms)
    return _is_tail(emg_mv, within, before)


def doubt_of_artefact(in_a_row: int, limits: SignalLimits) -> Doubt | None:
    """What is odd about artefacts in the MEP window; None where there are few.

    Args:
        in_a_row: how many trials in a row had one.
        limits: say where the window is.
    """
    if in_a_row < IN_A_ROW:
        return None
    text = (
        f"In {in_a_row} trials in a row the EMG is much larger just before the MEP window, which begins "
        f"{limits.mep_window_ms[0]:g} ms after the pulse, than within it. {_ASK_OF_ARTEFACT}"
    )
    return Doubt(DoubtKind.ARTEFACT, text)


def kinds_asked(reasons: Iterable[str]) -> frozenset[DoubtKind]:
    """Which doubts about sweeps were the reason of a pause; no amplitude shows them again.

    Args:
        reasons: why a session paused.
    """
    asked = {_ASK: DoubtKind.MISPLACED, _ASK_OF_ARTEFACT: DoubtKind.ARTEFACT, REPEATED.text: DoubtKind.REPEATED}
    return frozenset(kind for reason in reasons for ask, kind in asked.items() if ask in reason)


def _last_alike(misplaced: Sequence[Misplaced]) -> list[Misplaced]:
    """The last ones, back to the first that comes at another time after the pulse."""
    alike: list[Misplaced] = []
    for one in reversed(misplaced):
        if abs(one.at_ms - misplaced[-1].at_ms) > ALIKE_MS:
            break
        alike.append(one)
    return alike


def _follow_the_pulse(misplaced: Sequence[Misplaced]) -> bool:
    """Whether they follow the pulse, and not the tap."""
    isis_ms = [one.isi_ms for one in misplaced if one.isi_ms is not None]
    return len(isis_ms) < len(misplaced) or max(isis_ms) - min(isis_ms) >= DIFFERING_MS


def _outside(sweep: Sweep, trial: Trial, window_ms: tuple[float, float]) -> Misplaced | None:
    """The largest response outside the window; None where nothing can be told from pulse and tap."""
    emg_mv, since_ms, tap = _since_pulse(sweep, trial)
    before = (since_ms >= SOUGHT_MS[0]) & (since_ms < window_ms[0]) & ~tap
    behind = (since_ms > window_ms[1]) & (since_ms <= SOUGHT_MS[1]) & ~tap
    artefact = (since_ms >= -1.0) & (since_ms < SOUGHT_MS[0])
    found = [] if _is_tail(emg_mv, before, artefact) else [_largest(emg_mv, since_ms, before, trial)]
    found.append(_largest(emg_mv, since_ms, behind, trial))
    return max((one for one in found if one is not None), key=lambda one: one.size_mv, default=None)


def _since_pulse(sweep: Sweep, trial: Trial) -> tuple[FloatArray, FloatArray, BoolArray]:
    """The EMG about its level at rest [mV], its times [ms after the pulse], and which samples may show the tap."""
    emg = sweep.channels["emg"]
    times_ms = emg.t0_ms + np.arange(emg.values.size) * 1000 / emg.rate_hz
    since_ms, tap = times_ms - (trial.t_tms_ms or 0.0), _of_tap(times_ms, trial)
    at_rest = (since_ms < -1.0) & ~tap
    level = np.median(emg.values[at_rest] if at_rest.any() else emg.values)
    return EMG_UNITS_MV[emg.unit] * (emg.values - level), since_ms, tap


def _of_tap(times_ms: FloatArray, trial: Trial) -> BoolArray:
    """Which samples may show the tap."""
    span_ms = tap_span_ms(trial)
    if span_ms is None:
        return np.zeros(times_ms.shape, dtype=bool)
    return (times_ms >= span_ms[0]) & (times_ms <= span_ms[1])


def _is_tail(emg_mv: FloatArray, before: BoolArray, artefact: BoolArray) -> bool:
    if not before.any() or not artefact.any():
        return False
    return bool(np.abs(emg_mv[artefact]).max() > TAIL * np.abs(emg_mv[before]).max())


def _largest(emg_mv: FloatArray, since_ms: FloatArray, sought: BoolArray, trial: Trial) -> Misplaced | None:
    if not emg_mv[sought].any():
        return None
    top_ms = since_ms[sought][np.abs(emg_mv[sought]).argmax()]
    near = sought & (np.abs(since_ms - top_ms) <= SPAN_MS)
    power = emg_mv[near] ** 2
    at_ms = float((since_ms[near] * power).sum() / power.sum())  # wherever noise puts the larger of its turns
    return Misplaced(at_ms, float(np.ptp(emg_mv[near])), trial.isi_ms)
