"""What every detector needs: checked waveforms, level and noise at rest, crossings to a fraction of a sample.

All of it works on many sweeps at once, one waveform a row, shape (n, w).
"""

from __future__ import annotations

import math
from numbers import Real

import numpy as np

from isiw.errors import InvalidValueError
from isiw.findings import RATE_HZ, Kind
from isiw.types import ArrayLike, BoolArray, FloatArray, IntArray

MIN_REST_MS = 20.0
REST_MS = 200.0
"""The last part of the rest, where a baseline that drifts is nearest to what it will be."""

MAD_TO_SD = 1.4826  # of a normal distribution

MORE_THAN_A_GLITCH = 0.005
"""The share of samples at rest that differ from the median, from which on the least of it is a converter's step."""


def as_waveforms(values: ArrayLike, rate_hz: float, name: str = "waveform") -> FloatArray:
    """Waveforms as a float array, checked to be recordings at all."""
    try:
        waves = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidValueError(
            f"the {name} is no array of numbers", remedy="Are the sweeps of one length? Cut them to the shortest."
        ) from error
    if not (isinstance(rate_hz, Real) and math.isfinite(rate_hz) and rate_hz >= RATE_HZ.least):
        raise InvalidValueError(
            f"the {name}'s sampling rate is too low to measure anything",
            got=rate_hz,
            expected=f"at least {RATE_HZ.least:g} Hz",
            remedy=RATE_HZ.slip(rate_hz) if isinstance(rate_hz, Real) else None,
        )
    if waves.ndim == 0 or waves.size == 0:
        raise InvalidValueError(f"the {name} is empty", got=waves.shape, expected="shape (..., w)")
    low, high = waves.min(axis=-1), waves.max(axis=-1)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise InvalidValueError(f"the {name} has samples that are not finite")
    if (low == high).any():
        raise InvalidValueError(
            f"the {name} is constant", got=float(low.flat[0]), remedy="Check that the sensor is connected."
        )
    return waves.reshape(-1, waves.shape[-1])


def is_recording(values: FloatArray) -> bool:
    """Whether one waveform, shape (w,), was recorded at all: samples, all finite, and not a flat line."""
    return bool(values.size and np.isfinite(values).all() and values.min() < values.max())


def per_waveform(value: ArrayLike | None, waves: FloatArray) -> FloatArray:
    """One number for each waveform, shape (n,); None becomes NaN."""
    number = np.asarray(math.nan if value is None else value, dtype=np.float64)
    if number.size not in {1, len(waves)}:
        raise InvalidValueError(
            "there must be one time for all sweeps, or one for each", got=number.size, expected=f"1 or {len(waves)}"
        )
    return np.broadcast_to(number.reshape(-1) if number.ndim else number, waves.shape[:1]).astype(np.float64)


def samples(duration_ms: float, rate_hz: float) -> int:
    """How many whole samples a duration holds, whatever its rounding: the one rule for what a sweep must hold."""
    return math.floor(duration_ms * rate_hz / 1000 + 1e-6)


def rest_level(waves: FloatArray, stop: int, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Level and noise SD of each waveform while nothing happens: the reading at rest, robust against outliers."""
    stop = min(stop, waves.shape[-1])
    if stop < samples(MIN_REST_MS, rate_hz):
        raise InvalidValueError(
            "too little of the sweep is at rest to know its noise",
            got=f"{1000 * stop / rate_hz:.1f} ms",
            expected=f"at least {MIN_REST_MS:g} ms before the first stimulus",
            found=Kind.TOO_LITTLE_REST,
        )
    return level_and_noise(waves[:, max(0, stop - round(REST_MS * rate_hz / 1000)) : stop])


def level_and_noise(rest: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Level and noise SD of waveforms at rest, robust against outliers."""
    median, mean = (np.nanmedian, np.nanmean) if np.isnan(rest).any() else (np.median, np.mean)
    level = median(rest, axis=-1, keepdims=True)
    size = np.abs(rest - level)
    mad = median(size, axis=-1, keepdims=True)
    # A coarse converter reads the same number most of the time; its MAD is 0, its RMS is not.
    rms = np.sqrt(mean(size**2, axis=-1, keepdims=True))
    step = np.min(size, axis=-1, keepdims=True, where=size > 0, initial=math.inf)
    is_coarse = (size > 0).mean(axis=-1, keepdims=True) >= MORE_THAN_A_GLITCH
    coarse = np.where(is_coarse, np.clip(rms, step / math.sqrt(12), step), 0.0)
    return level, np.maximum(np.maximum(MAD_TO_SD * mad, 0.25 * rms), coarse)


def cut(waves: FloatArray, start: IntArray, count: int) -> FloatArray:
    """`count` samples of each waveform from its own `start` on, shape (n, count); ends are held."""
    columns = np.clip(start[:, None] + np.arange(count), 0, waves.shape[-1] - 1)
    return np.take_along_axis(waves, columns, axis=-1)


def first_true(mask: BoolArray) -> IntArray:
    """Index of each row's first true sample, -1 where there is none, shape (n,)."""
    found: IntArray = np.where(mask.any(axis=-1), mask.argmax(axis=-1), -1)
    return found


def crossing_before(waves: FloatArray, level: FloatArray, stop: IntArray) -> FloatArray:
    """Where each waveform last rose through a level before a sample that is above it."""
    columns = np.arange(waves.shape[-1])
    below = (waves <= level) & (columns < stop[:, None])
    last = waves.shape[-1] - 1 - first_true(below[:, ::-1])
    known = (stop >= 0) & (last < waves.shape[-1])
    at = np.where(known, last, 0)
    rows = np.arange(len(waves))
    before, after = waves[rows, at], waves[rows, np.minimum(at + 1, waves.shape[-1] - 1)]
    rise = after - before
    share = np.divide(level[:, 0] - before, rise, out=np.zeros_like(rise), where=rise > 0)
    return np.where(known, at + share, math.nan)
