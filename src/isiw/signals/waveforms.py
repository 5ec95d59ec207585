"""Waveforms, one a row: checked, their level and noise at rest, crossings to a fraction of a sample, and saturation."""

from __future__ import annotations

import math
from numbers import Real

import numpy as np

from isiw.errors import InvalidValueError
from isiw.findings import RATE_HZ, Kind
from isiw.types import ArrayLike, BoolArray, FloatArray, IntArray

PULSE_GUARD_MS = 1.0
"""How long before the nominal pulse its artefact may begin."""

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


FLAT_MS = 1.0
FAR_OUT = 10.0
"""A limit is farther from the sweep's middle than this many times the median distance from it."""

FAR_OUT_STEPS = 30.0
"""And farther than this many steps of the converter: of EMG at rest, a coarse one shows a few codes only."""

PLATEAU_MS, PLATEAU_SAMPLES = 2.0, 6
PLATEAU_SD, FLANK_SD = 1.5, 6.0
STEEPNESS = 1.5
"""On the limit of an amplifier that saturates before the converter there is the converter's noise alone, less than EMG
at rest has. The top of an MEP is within 1.5 SD of that for less than 1.4 ms, and rounded: within 6 SD it lasts twice as
long."""

FAR_OUT_SD = 60.0
"""Nearer to the sweep's middle the noise at rest hides whether a top is rounded."""

BLANKED_MS = 5.0
BLANKED_TIMES = 3
"""An amplifier that blanks the pulse's artefact holds one value; a coarse converter repeats one at rest as well."""

NEARLY_FULL = 0.999
"""The largest code of a converter lies below its full scale: by a step of one in 2,048 where it has 12 bits."""


def is_saturated(
    emg_mv: ArrayLike,
    rate_hz: float,
    full_scale_mv: float | None = None,
    *,
    span_ms: tuple[float, float] = (0.0, math.inf),
) -> bool:
    """True if the EMG of one sweep ran into a limit of its amplifier.

    Args:
        emg_mv: EMG [mV], shape (w,).
        rate_hz: sampling rate [Hz].
        full_scale_mv: the largest value that the amplifier can show [mV]. With and without it, a top that stays at
            exactly one value for 1 ms or longer, far out of the sweep's usual range, is taken for a limit; so is one
            that stays there for 2 ms or longer with less noise than the EMG has, between steep flanks.
        span_ms: the part of the sweep that counts [ms from the first sample]; artefacts may run into limits elsewhere.

    Raises:
        InvalidValueError: no EMG in that part.
    """
    emg = np.asarray(emg_mv, dtype=np.float64)
    first, last = (min(max(edge * rate_hz / 1000, 0.0), emg.size) for edge in span_ms)
    counts = emg[math.floor(first) : math.ceil(last) + 1]
    if not counts.size:
        raise InvalidValueError("there is no EMG in the part that counts", got=span_ms, expected="a part of the sweep")
    if full_scale_mv is not None and np.abs(counts).max() >= NEARLY_FULL * full_scale_mv:
        return True
    level = float(np.median(emg))
    return _has_flat_top(emg, counts, level, rate_hz) or any(
        _has_plateau(sign * (emg - level), math.floor(first) + int((sign * counts).argmax()), rate_hz)
        for sign in (1.0, -1.0)
    )


def _has_flat_top(emg: FloatArray, counts: FloatArray, level: float, rate_hz: float) -> bool:
    """Whether a top stays at exactly one value, as at the converter's own limit."""
    samples = max(3, round(FLAT_MS * rate_hz / 1000))
    tops = (float(counts.max()), float(counts.min()))
    flat = [top for top in tops if top != level and _longest_run(counts == top) >= samples]
    if not flat:
        return False
    usual, step = np.median(np.abs(emg - level)), np.diff(np.unique(emg)).min()
    return any(abs(top - level) > max(FAR_OUT * usual, FAR_OUT_STEPS * step) for top in flat)


def _has_plateau(upright: FloatArray, top: int, rate_hz: float) -> bool:
    """Whether the EMG stays at its top longer than noise and a rounded top allow."""
    noise = MAD_TO_SD * float(np.median(np.abs(upright)))
    if noise == 0 or upright[top] <= FAR_OUT_SD * noise:
        return False
    plateau = _width(upright, top, PLATEAU_SD * noise)
    least = max(PLATEAU_SAMPLES, PLATEAU_MS * rate_hz / 1000)
    return plateau >= least and _width(upright, top, FLANK_SD * noise) <= STEEPNESS * plateau


def _width(emg_mv: FloatArray, top: int, depth_mv: float) -> int:
    """For how many samples about its top the EMG stays within so much of it; the top of a part may be on a flank."""
    away = np.flatnonzero(np.abs(emg_mv - emg_mv[top]) > depth_mv)
    after = int(np.searchsorted(away, top))
    first = int(away[after - 1]) + 1 if after else 0
    last = int(away[after]) if after < away.size else emg_mv.size
    return last - first


def is_blanked(emg_mv: FloatArray, rate_hz: float, pulse_ms: float, span_ms: tuple[float, float]) -> bool:
    """Whether the amplifier held one value for a part of the MEP's window, much longer than before the pulse."""
    before, first, last = (max(0, math.floor(edge_ms * rate_hz / 1000)) for edge_ms in (pulse_ms, *span_ms))
    filled = int((emg_mv[:before] != emg_mv[0]).argmax())  # a rig may fill up what it did not record
    held = _longest_run(np.diff(emg_mv[first : last + 1]) == 0)
    at_rest = _longest_run(np.diff(emg_mv[filled:before]) == 0)
    return held * 1000 / rate_hz >= BLANKED_MS and held > BLANKED_TIMES * at_rest


def _longest_run(mask: BoolArray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))
