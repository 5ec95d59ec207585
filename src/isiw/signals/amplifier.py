"""What an amplifier does to the EMG of a sweep: it runs into its limits, or blanks the pulse's artefact and more."""

from __future__ import annotations

import math

import numpy as np

from isiw.errors import InvalidValueError
from isiw.types import ArrayLike, BoolArray, FloatArray

FLAT_MS = 1.0
FAR_OUT = 10.0
"""A limit is farther from the sweep's middle than this many times the median distance from it."""

FAR_OUT_STEPS = 30.0
"""And farther than this many steps of the converter: of EMG at rest, a coarse one shows a few codes only."""

MAD_TO_SD = 1.4826  # of a normal distribution

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
    """Whether the EMG of one sweep ran into a limit of its amplifier.

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
