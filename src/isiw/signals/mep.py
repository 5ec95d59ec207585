"""The MEP's amplitude and the background EMG before the pulse."""

from __future__ import annotations

import numpy as np

from isiw.errors import InvalidValueError
from isiw.types import ArrayLike, FloatArray

__all__ = ["background_rms_uv", "mep_amplitude"]

MEP_WINDOW_MS = (15.0, 35.0)
MIN_BACKGROUND_MS = 40.0
GUARD_MS = 2.0  # the artefact may begin before the nominal time of the pulse


def _samples(w: int, rate_hz: float, start_ms: float, end_ms: float) -> slice:
    """Samples from start to end after the sweep's first sample, both included."""
    first, last = (round(time_ms * rate_hz / 1e3) for time_ms in (start_ms, end_ms))
    if first < 0 or last >= w:
        raise InvalidValueError(
            "the sweep does not hold the whole interval",
            got=f"{w * 1e3 / rate_hz:.1f} ms",
            expected=f"{start_ms:.1f} to {end_ms:.1f} ms after its first sample",
            remedy="Record longer sweeps.",
        )
    return slice(first, last + 1)


def mep_amplitude(
    emg_mv: ArrayLike, rate_hz: float, t_tms_ms: float, window_ms: tuple[float, float] = MEP_WINDOW_MS
) -> FloatArray:
    """Peak-to-peak amplitude of the MEP [mV], shape (...); a single sweep gives a scalar.

    Args:
        emg_mv: EMG [mV], shape (..., w); an offset does not matter.
        rate_hz: sampling rate [Hz].
        t_tms_ms: time of the magnetic pulse from the sweep's first sample [ms].
        window_ms: where the MEP is looked for, from the pulse [ms].

    Raises:
        InvalidValueError: the sweep does not hold the window.
    """
    emg = np.asarray(emg_mv, dtype=np.float64)
    window = _samples(emg.shape[-1], rate_hz, t_tms_ms + window_ms[0], t_tms_ms + window_ms[1])
    return np.asarray(np.ptp(emg[..., window], axis=-1))


def background_rms_uv(emg_mv: ArrayLike, rate_hz: float, t_tms_ms: float) -> FloatArray:
    """Background EMG: RMS about its mean of all there is before the pulse [µV], shape (...).

    Args:
        emg_mv: EMG [mV], shape (..., w).
        rate_hz: sampling rate [Hz].
        t_tms_ms: time of the magnetic pulse from the sweep's first sample [ms].

    Raises:
        InvalidValueError: less than 40 ms before the pulse.
    """
    emg = np.asarray(emg_mv, dtype=np.float64)
    if t_tms_ms - GUARD_MS < MIN_BACKGROUND_MS:
        raise InvalidValueError(
            "too little EMG before the pulse",
            got=f"{t_tms_ms:.1f} ms",
            expected=f"at least {MIN_BACKGROUND_MS + GUARD_MS:g} ms",
            remedy="Record longer sweeps.",
        )
    before = _samples(emg.shape[-1], rate_hz, 0.0, t_tms_ms - GUARD_MS)
    return np.asarray(1e3 * emg[..., before].std(axis=-1))
