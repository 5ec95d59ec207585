"""The MEP in an EMG sweep: amplitude, onset latency, presence; and the EMG before the pulse, with its hum and drift.

The amplitude is peak to peak in a window after the pulse [Kim2020, 5.2.3]. The onset is where the deviation from rest
last rose out of the noise before the first sample that is surely of the MEP. Hum and drift are fitted to the EMG at
rest, and go on below the MEP.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.signals.spans import MEP_WINDOW_MS, TAP_MS
from isiw.signals.waveforms import (
    PULSE_GUARD_MS,
    as_waveforms,
    crossing_before,
    cut,
    first_true,
    level_and_noise,
    per_waveform,
    samples,
)
from isiw.sweeps import Channel
from isiw.trials import Trial
from isiw.types import ArrayLike, BoolArray, FloatArray, IntArray

PRESENT_MV = 0.05  # the field's convention [Rossini2015]; 1.7 % of resting sweeps exceed it
BACKGROUND_MS = 100.0

MIN_BACKGROUND_MS = 40.0
"""The least EMG at rest that says how relaxed the muscle is."""

TAP_SPAN_MS = 50.0
"""How long after an impact the EMG may show it: the artefact, begun within 30 ms, and its end."""

SURE_SHARE = 0.2
SURE_SD = 6.0
ONSET_SD = 4.0

EARLIEST_ONSET_MS = 10.0
"""No MEP begins sooner after the pulse."""


def mep_amplitude(
    emg_mv: ArrayLike, rate_hz: float, t_tms_ms: float, window_ms: tuple[float, float] = MEP_WINDOW_MS
) -> float:
    """Peak-to-peak amplitude of the MEP in one sweep [mV].

    Args:
        emg_mv: EMG [mV], shape (w,).
        rate_hz: sampling rate [Hz].
        t_tms_ms: the magnetic pulse [ms from the first sample].
        window_ms: where the MEP is sought [ms after the pulse]; `MEP_WINDOWS_MS` has one for each muscle group.

    Raises:
        InvalidValueError: a waveform that is not a recording, or a window that it does not hold.
    """
    _require_one(emg_mv)
    return float(mep_amplitudes(emg_mv, rate_hz, t_tms_ms, window_ms)[0])


def mep_amplitudes(
    emg_mv: ArrayLike,
    rate_hz: float,
    t_tms_ms: ArrayLike,
    window_ms: tuple[float, float] = MEP_WINDOW_MS,
    *,
    blank_ms: tuple[ArrayLike, ArrayLike] | None = None,
) -> FloatArray:
    """Peak-to-peak amplitude of the MEP in each of n sweeps [mV], shape (n,).

    Args:
        emg_mv: EMG [mV], shape (n, w).
        rate_hz: sampling rate [Hz].
        t_tms_ms: the magnetic pulse [ms from the first sample], one or shape (n,).
        window_ms: where the MEP is sought [ms after the pulse].
        blank_ms: start and end [ms from the first sample] of a span that is not the MEP's, such as the artefact of the
            tap; NaN for none. What is left of the window counts; nothing left gives NaN.

    Raises:
        InvalidValueError: a waveform that is not a recording, or a window that it does not hold.
    """
    waves = as_waveforms(emg_mv, rate_hz, "EMG")
    pulse = per_waveform(t_tms_ms, waves)
    segment, times = _window(waves, rate_hz, pulse, window_ms)
    counts = np.ones(segment.shape, dtype=bool)
    if blank_ms is not None:
        start, stop = (per_waveform(edge, waves)[:, None] for edge in blank_ms)
        counts = ~((times >= start) & (times <= stop))
    high = np.max(segment, axis=-1, initial=-math.inf, where=counts)
    low = np.min(segment, axis=-1, initial=math.inf, where=counts)
    return np.where(counts.any(axis=-1), high - low, math.nan)


def mep_onset(
    emg_mv: ArrayLike, rate_hz: float, t_tms_ms: float, window_ms: tuple[float, float] = MEP_WINDOW_MS
) -> float | None:
    """Latency of the MEP in one sweep [ms after the pulse], or None if no MEP stands out of the noise.

    Args:
        emg_mv: EMG [mV], shape (w,).
        rate_hz: sampling rate [Hz].
        t_tms_ms: the magnetic pulse [ms from the first sample], after at least 40 ms of rest.
        window_ms: where the MEP is sought [ms after the pulse].

    Raises:
        InvalidValueError: a waveform that is not a recording, too little rest, or a window that it does not hold.
    """
    _require_one(emg_mv)
    latency = float(mep_onsets(emg_mv, rate_hz, t_tms_ms, window_ms)[0])
    return None if math.isnan(latency) else latency


def mep_onsets(
    emg_mv: ArrayLike, rate_hz: float, t_tms_ms: ArrayLike, window_ms: tuple[float, float] = MEP_WINDOW_MS
) -> FloatArray:
    """Latency of the MEP in each of n sweeps [ms after the pulse], NaN where none stands out, shape (n,).

    Args:
        emg_mv: EMG [mV], shape (n, w).
        rate_hz: sampling rate [Hz].
        t_tms_ms: the magnetic pulse [ms from the first sample], one or shape (n,), after at least 40 ms of rest.
        window_ms: where the MEP is sought [ms after the pulse].

    Raises:
        InvalidValueError: a waveform that is not a recording, too little rest, or a window that it does not hold.
    """
    waves = as_waveforms(emg_mv, rate_hz, "EMG")
    pulse = per_waveform(t_tms_ms, waves)
    segment, times = _window(waves, rate_hz, pulse, (EARLIEST_ONSET_MS, window_ms[1]))
    rest = _quiet(waves, rate_hz, pulse, per_waveform(None, waves))
    if rest is None:
        raise _too_little_rest()
    level, noise = level_and_noise(rest)
    deviation = np.abs(segment - level)
    in_window = times - pulse[:, None] >= window_ms[0]
    amplitude = mep_amplitudes(waves, rate_hz, pulse, window_ms)[:, None]
    sure = first_true(in_window & (deviation > np.maximum(SURE_SHARE * amplitude, SURE_SD * noise)))
    onset = crossing_before(deviation, ONSET_SD * noise, sure)
    latency: FloatArray = times[:, 0] - pulse + onset * 1000 / rate_hz
    return latency


def mep_present(
    emg_mv: ArrayLike,
    rate_hz: float,
    t_tms_ms: ArrayLike,
    window_ms: tuple[float, float] = MEP_WINDOW_MS,
    *,
    least_mv: float = PRESENT_MV,
) -> BoolArray:
    """True for each of n sweeps that holds an MEP: large enough, and clear of its own noise, shape (n,).

    Args:
        emg_mv: EMG [mV], shape (n, w).
        rate_hz: sampling rate [Hz].
        t_tms_ms: the magnetic pulse [ms from the first sample], one or shape (n,).
        window_ms: where the MEP is sought [ms after the pulse].
        least_mv: the least peak-to-peak amplitude [mV].
    """
    stands_out = ~np.isnan(mep_onsets(emg_mv, rate_hz, t_tms_ms, window_ms))
    present: BoolArray = stands_out & (mep_amplitudes(emg_mv, rate_hz, t_tms_ms, window_ms) >= least_mv)
    return present


def background_rms(
    emg_mv: ArrayLike,
    rate_hz: float,
    t_tms_ms: ArrayLike,
    t_hit_ms: ArrayLike | None = None,
    *,
    tap_ms: float = TAP_SPAN_MS,
) -> FloatArray:
    """RMS of the EMG about its mean in the last 100 ms of rest before the pulse [mV], shape (n,).

    Args:
        emg_mv: EMG [mV], shape (n, w).
        rate_hz: sampling rate [Hz].
        t_tms_ms: the magnetic pulse [ms from the first sample], one or shape (n,).
        t_hit_ms: the impact [ms from the first sample], NaN or None if unknown.
        tap_ms: how long after the impact the EMG may show it [ms]; that is passed over.

    Raises:
        InvalidValueError: a waveform that is not a recording, a pulse after its end, or less than 40 ms of rest.
    """
    rms_mv = known_background_rms(emg_mv, rate_hz, t_tms_ms, t_hit_ms, tap_ms=tap_ms)
    if rms_mv is None:
        raise _too_little_rest()
    return rms_mv


def known_background_rms(
    emg_mv: ArrayLike, rate_hz: float, t_tms_ms: ArrayLike, t_hit_ms: ArrayLike | None, *, tap_ms: float
) -> FloatArray | None:
    """As `background_rms`, but None if a sweep has too little rest."""
    waves = as_waveforms(emg_mv, rate_hz, "EMG")
    pulse = per_waveform(t_tms_ms, waves)
    if (pulse > 1000 * waves.shape[-1] / rate_hz + PULSE_GUARD_MS).any():
        raise InvalidValueError(
            "the sweep ends before the pulse",
            got=f"pulse at {pulse.max():g} ms in a sweep of {waves.shape[-1] * 1000 / rate_hz:g} ms",
            remedy="Pulse times count from the sweep's first sample.",
        )
    rest = _quiet(waves, rate_hz, pulse, per_waveform(t_hit_ms, waves), tap_ms)
    return None if rest is None else np.asarray(np.nanstd(rest, axis=-1), dtype=np.float64)


def _too_little_rest() -> InvalidValueError:
    return InvalidValueError(
        "too little EMG before the pulse to know its background",
        expected=f"at least {MIN_BACKGROUND_MS:g} ms of rest",
        found=Kind.TOO_LITTLE_REST,
    )


def _require_one(emg_mv: ArrayLike) -> None:
    if np.ndim(emg_mv) != 1:
        raise InvalidValueError(
            "one sweep is a vector", got=np.shape(emg_mv), expected="shape (w,)", remedy="Use the plural for batches."
        )


def _window(
    waves: FloatArray, rate_hz: float, pulse_ms: FloatArray, window_ms: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """The samples in a window after the pulse and their times [ms], both of shape (n, samples)."""
    if not window_ms[0] < window_ms[1]:
        raise InvalidValueError("the MEP window is empty", got=window_ms, expected="start < end")
    # A rounding error must not drop the sample at the window's edge.
    start = np.ceil((pulse_ms + window_ms[0]) * rate_hz / 1000 - 1e-6)
    stop = (pulse_ms + window_ms[1]) * rate_hz / 1000 + 1e-6
    if not (np.isfinite(pulse_ms).all() and (start >= 0).all() and (stop < waves.shape[-1]).all()):
        raise InvalidValueError(
            "the sweep does not hold the MEP window",
            got=f"pulse at {pulse_ms.min():g} ms in a sweep of {waves.shape[-1] * 1000 / rate_hz:g} ms",
            expected=f"samples {window_ms[0]:g} to {window_ms[1]:g} ms after the pulse",
            remedy="Pulse times count from the sweep's first sample.",
            found=Kind.MISSING_CHANNEL,
        )
    first = start.astype(np.int64)
    count = math.floor((window_ms[1] - window_ms[0]) * rate_hz / 1000 + 1e-6) + 1
    times = (first[:, None] + np.arange(count)) * 1000 / rate_hz
    return cut(waves, first, count), times


def _quiet(
    waves: FloatArray, rate_hz: float, pulse_ms: FloatArray, hit_ms: FloatArray, tap_ms: float = TAP_SPAN_MS
) -> FloatArray | None:
    """The last 100 ms of rest before each pulse, else NaN, shape (n, samples); None if there is too little of it."""
    reach = round((BACKGROUND_MS + tap_ms) * rate_hz / 1000)
    if not np.isfinite(pulse_ms).all():
        raise InvalidValueError("the time of the pulse must be finite", got=pulse_ms)
    stop = np.minimum(np.floor((pulse_ms - PULSE_GUARD_MS) * rate_hz / 1000).astype(np.int64), waves.shape[-1])
    columns = (stop - reach)[:, None] + np.arange(reach)
    since_hit = columns * 1000 / rate_hz - hit_ms[:, None]
    resting = (columns >= 0) & ~((since_hit >= 0) & (since_hit <= tap_ms))
    later = np.cumsum(resting[:, ::-1], axis=-1)[:, ::-1]  # resting samples from here to the pulse
    resting &= later <= round(BACKGROUND_MS * rate_hz / 1000)
    if (resting.sum(axis=-1) < samples(MIN_BACKGROUND_MS, rate_hz)).any():
        return None
    return np.where(resting, cut(waves, stop - reach, reach), math.nan)


MAINS_HZ: Final = (50.0, 60.0)
REST_S: Final = 0.3
"""The last EMG at rest to which both are fitted [s]: longer, and the mains would drift out of phase."""

LEAST_S: Final = 0.06
"""Three periods: in fewer, slow drift looks like hum."""

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
