"""Mains hum and a drifting baseline: both are in the EMG at rest already, are fitted there, and go on below the MEP.

The mains add a wave of 50 or 60 Hz to every MEP. An electrode that dries or moves lets the level of the EMG drift.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from isiw.signals.waveforms import PULSE_GUARD_MS
from isiw.trials import Channel, Trial
from isiw.types import BoolArray, FloatArray, IntArray

MAINS_HZ: Final = (50.0, 60.0)
REST_S: Final = 0.3
"""The last EMG at rest to which both are fitted [s]: longer, and the mains would drift out of phase."""

LEAST_S: Final = 0.06
"""Three periods: in fewer, slow drift looks like hum."""

TAP_MS: Final = 150.0
"""How long after the hit the tap may move the EMG, its reflexes included [ms]."""

LEAST_MV, SPAN_S = 0.01, 0.1
"""The least hum from peak to peak, and the least drift in the EMG that says whether a muscle is at rest."""

LEAST_SHARE: Final = 0.6
"""Share of the variance at rest. In 49 ms of 262 recorded sweeps a few have more, with a wave of 7 µV at most."""


class Disturbance(NamedTuple):
    """What is no EMG, each 0 if there is none; and both and only the drift over a whole waveform [mV], shape (w,)."""

    hum_hz: float
    hum_mv: float
    drift_mv_s: float
    course_mv: FloatArray
    drift_course_mv: FloatArray


def disturbance(emg_mv: FloatArray, rate_hz: float, at_rest: BoolArray) -> Disturbance | None:
    """Hum and drift of a waveform, each if it is most of the EMG at rest without the other, and large enough."""
    resting = np.flatnonzero(at_rest)[-max(1, round(REST_S * rate_hz)) :]
    if resting.size < LEAST_S * rate_hz or not np.isfinite(emg_mv[resting]).all():
        return None
    times_s = np.arange(emg_mv.size) / rate_hz
    return min((_fitted(emg_mv, times_s, resting, hz) for hz in MAINS_HZ), key=lambda fit: fit[1])[0]


def at_rest(emg: Channel, trial: Trial) -> BoolArray:
    """Which samples of a trial's EMG are before the pulse, and not the tap's, shape (w,)."""
    times_ms = emg.t0_ms + np.arange(emg.values.size) * 1000 / emg.rate_hz
    resting = times_ms < (-np.inf if trial.t_tms_ms is None else trial.t_tms_ms - PULSE_GUARD_MS)
    begins = [at_ms for at_ms in (trial.t_valve_ms, trial.t_hit_ms) if at_ms is not None]
    if begins:
        ends_ms = np.inf if trial.t_hit_ms is None else trial.t_hit_ms + TAP_MS
        resting &= (times_ms < min(begins) - PULSE_GUARD_MS) | (times_ms > ends_ms)
    return resting


def _fitted(
    emg_mv: FloatArray, times_s: FloatArray, resting: IntArray, hum_hz: float
) -> tuple[Disturbance | None, float]:
    """What a wave of this frequency and a line fit, if it is much; and the variance at rest that both leave."""
    phase, since_s = 2 * np.pi * hum_hz * times_s, times_s - times_s[resting].mean()
    parts = np.stack([np.cos(phase), np.sin(phase), since_s, np.ones_like(phase)], axis=-1)
    weights, *_ = np.linalg.lstsq(parts[resting], emg_mv[resting], rcond=None)
    wave_mv, line_mv, at_rest_mv = parts[:, :2] @ weights[:2], weights[2] * since_s, emg_mv[resting]
    left = float(np.var(at_rest_mv - wave_mv[resting] - line_mv[resting]))
    hum_mv, drift_mv_s = 2 * float(np.hypot(*weights[:2])), float(weights[2])
    is_hum = hum_mv >= LEAST_MV and left <= (1 - LEAST_SHARE) * np.var(at_rest_mv - line_mv[resting])
    is_drift = abs(drift_mv_s) * SPAN_S >= LEAST_MV and left <= (1 - LEAST_SHARE) * np.var(
        at_rest_mv - wave_mv[resting]
    )
    if not (is_hum or is_drift):
        return None, left
    drift_course = line_mv * is_drift
    found = Disturbance(hum_hz, hum_mv * is_hum, drift_mv_s * is_drift, wave_mv * is_hum + drift_course, drift_course)
    return found, left
