"""Mains hum: a wave of 50 or 60 Hz in the EMG at rest, which adds to the amplitude of every MEP."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from isiw.signals.mep import PULSE_GUARD_MS
from isiw.trials import Channel, Trial
from isiw.types import BoolArray, FloatArray, IntArray

MAINS_HZ: Final = (50.0, 60.0)
REST_S: Final = 0.3
"""The last EMG at rest to which the wave is fitted [s]: longer, and the mains would drift out of phase."""

LEAST_S: Final = 0.06
"""Three periods: in fewer, slow drift looks like hum."""

TAP_MS: Final = 150.0
"""How long after the hit the tap may move the EMG, its reflexes included [ms]."""

LEAST_MV: Final = 0.01
LEAST_SHARE: Final = 0.6
"""Share of the variance at rest. In 49 ms of 262 recorded sweeps a few have more, with a wave of 7 µV at most."""


class Hum(NamedTuple):
    """The wave: its frequency, its peak-to-peak amplitude [mV], and its course over a whole waveform [mV]."""

    frequency_hz: float
    size_mv: float
    course_mv: FloatArray


def mains_hum(emg_mv: FloatArray, rate_hz: float, at_rest: BoolArray) -> Hum | None:
    """The hum in a waveform, if it is most of the EMG at rest, and large enough to matter; else None."""
    times_s = np.arange(emg_mv.size) / rate_hz
    resting = np.flatnonzero(at_rest)[-max(1, round(REST_S * rate_hz)) :]
    if resting.size < LEAST_S * rate_hz or not np.isfinite(emg_mv[resting]).all():
        return None
    fits = (_fitted(emg_mv, times_s, resting, frequency_hz) for frequency_hz in MAINS_HZ)
    hum, left = min(fits, key=lambda fit: fit[1])
    return hum if hum.size_mv >= LEAST_MV and left <= 1 - LEAST_SHARE else None


def at_rest(emg: Channel, trial: Trial) -> BoolArray:
    """Which samples of a trial's EMG are before the pulse, and not the tap's, shape (w,)."""
    times_ms = emg.t0_ms + np.arange(emg.values.size) * 1000 / emg.rate_hz
    resting = times_ms < (-np.inf if trial.t_tms_ms is None else trial.t_tms_ms - PULSE_GUARD_MS)
    begins = [at_ms for at_ms in (trial.t_valve_ms, trial.t_hit_ms) if at_ms is not None]
    if begins:
        ends_ms = np.inf if trial.t_hit_ms is None else trial.t_hit_ms + TAP_MS
        resting &= (times_ms < min(begins) - PULSE_GUARD_MS) | (times_ms > ends_ms)
    return resting


def _fitted(emg_mv: FloatArray, times_s: FloatArray, resting: IntArray, frequency_hz: float) -> tuple[Hum, float]:
    """The wave of a frequency, and the share of the variance at rest that it leaves."""
    phase = 2 * np.pi * frequency_hz * times_s
    waves = np.stack([np.cos(phase), np.sin(phase), np.ones_like(phase)], axis=-1)
    weights, *_ = np.linalg.lstsq(waves[resting], emg_mv[resting], rcond=None)
    course_mv = waves[:, :2] @ weights[:2]
    left = np.var(emg_mv[resting] - course_mv[resting]) / max(float(np.var(emg_mv[resting])), 1e-30)
    return Hum(frequency_hz, 2 * float(np.hypot(*weights[:2])), course_mv), float(left)
