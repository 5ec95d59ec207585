"""Measures of an MEP beside its amplitude: onset, duration, area and, in a contracted muscle, the silent period.

Duration and area are from onset to end, the area that of the rectified EMG [Jackson2019]; the silent period is from the
pulse until the moving SD of the EMG is back at its mean from before [Summers2020], to the sample.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from isiw.errors import InvalidValueError
from isiw.signals.limits import EMG_UNITS_MV, SignalLimits
from isiw.signals.mep import ONSET_SD, SURE_SD, SURE_SHARE, at_rest, disturbance, mep_onset
from isiw.signals.tap import TapResponses, hit_of
from isiw.signals.waveforms import level_and_noise, samples
from isiw.sweeps import Channel
from isiw.trials import Trial
from isiw.types import FloatArray

LATEST_END_MS: Final = 80.0
"""No MEP ends later after the pulse."""

BEFORE_MS: Final = (-100.0, -5.0)
MOVING_MS: Final = 10.0
"""The contraction before the pulse, and the length over which the moving SD is taken."""


class Measures(NamedTuple):
    """Of one MEP, each NaN if it is not known: onset after the pulse, duration, area, and silent period."""

    mep_onset_ms: float = math.nan
    mep_duration_ms: float = math.nan
    mep_area_mv_ms: float = math.nan
    silent_period_ms: float = math.nan


def measures(emg: Channel, trial: Trial, limits: SignalLimits, taps: TapResponses | None = None) -> Measures:
    """The measures of a trial that counts and whose EMG shows an MEP, without the mean of what the tap alone evokes."""
    if not trial.told or trial.t_tms_ms is None:
        return Measures()
    emg_mv = EMG_UNITS_MV[emg.unit] * emg.values
    found = disturbance(emg_mv, emg.rate_hz, at_rest(emg, trial))
    emg_mv = emg_mv if found is None else emg_mv - found.course_mv
    pulse_ms = trial.t_tms_ms - emg.t0_ms
    since_ms = np.arange(emg_mv.size) * 1000 / emg.rate_hz - pulse_ms
    if taps is not None and (hit_ms := hit_of(trial)) is not None:
        emg_mv = taps.without(emg_mv, since_ms + trial.t_tms_ms - hit_ms)
    try:
        onset_ms = mep_onset(emg_mv, emg.rate_hz, pulse_ms, limits.mep_window_ms)
    except InvalidValueError:  # too little rest before the pulse
        return Measures()
    end_ms = None if onset_ms is None else _end_ms(emg_mv, since_ms, onset_ms)
    silent_ms = _silent_ms(emg_mv, since_ms, emg.rate_hz, end_ms) if limits.contracted else math.nan
    if onset_ms is None or end_ms is None:
        return Measures(silent_period_ms=silent_ms)
    within = (since_ms >= onset_ms) & (since_ms <= end_ms)
    level_mv = float(np.median(emg_mv[since_ms < 0]))
    area_mv_ms = float(np.abs(emg_mv[within] - level_mv).sum()) * 1000 / emg.rate_hz
    return Measures(onset_ms, end_ms - onset_ms, area_mv_ms, silent_ms)


def _end_ms(emg_mv: FloatArray, since_ms: FloatArray, onset_ms: float) -> float:
    """When the EMG is back in its noise after the last that is surely of the MEP [ms after the pulse]."""
    rest = emg_mv[None, (since_ms > -100.0) & (since_ms < -1.0)]
    level, noise = (float(each.item()) for each in level_and_noise(rest))
    sought = (since_ms >= onset_ms) & (since_ms <= LATEST_END_MS)
    deviation, times_ms = np.abs(emg_mv[sought] - level), since_ms[sought]
    sure = np.flatnonzero(deviation > max(SURE_SHARE * np.ptp(emg_mv[sought]), SURE_SD * noise))
    last = int(sure[-1]) if sure.size else 0
    back = np.flatnonzero(deviation[last:] <= ONSET_SD * noise)
    return float(times_ms[last + back[0]] if back.size else times_ms[-1])


def _silent_ms(emg_mv: FloatArray, since_ms: FloatArray, rate_hz: float, end_ms: float | None) -> float:
    """Until when after the pulse a contracted muscle is silent [ms], or NaN.

    In the first stretch whose SD is that of before, it is the first sample that is as far off: EMG that comes back
    stronger fills a part of the stretch only.
    """
    length = samples(MOVING_MS, rate_hz)
    if end_ms is None or length < 2 or emg_mv.size < length:
        return math.nan
    sds = np.lib.stride_tricks.sliding_window_view(emg_mv, length).std(axis=-1)
    starts_ms = since_ms[: sds.size]
    before = (starts_ms >= BEFORE_MS[0]) & (starts_ms <= BEFORE_MS[1] - MOVING_MS)
    if not before.any():
        return math.nan
    after = np.flatnonzero(starts_ms >= end_ms)
    quiet = after[sds[after] < sds[before].mean()]
    back = after[(after > quiet[0]) & (sds[after] >= sds[before].mean())] if quiet.size else quiet
    if not back.size:
        return math.nan
    stretch = emg_mv[back[0] : back[0] + length]
    return float(since_ms[back[0] + (np.abs(stretch - stretch.mean()) >= sds[before].mean()).argmax()])
