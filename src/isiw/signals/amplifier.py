"""What an amplifier does to the EMG of a sweep: it runs into its limits, or blanks the pulse's artefact and more."""

from __future__ import annotations

import math

import numpy as np

from isiw.errors import InvalidValueError
from isiw.types import ArrayLike, BoolArray, FloatArray

__all__ = ["is_blanked", "is_saturated"]

FLAT_MS = 1.0
FAR_OUT = 10.0
"""A limit is farther from the sweep's middle than this many times the median distance from it."""

FAR_OUT_STEPS = 30.0
"""And farther than this many steps of the converter: of EMG at rest, a coarse one shows a few codes only."""

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
            exactly one value for 1 ms or longer, far out of the sweep's usual range, is taken for a limit.
        span_ms: the part of the sweep that counts [ms from the first sample]; artefacts may run into limits elsewhere.

    Raises:
        InvalidValueError: no EMG in that part.
    """
    emg = np.asarray(emg_mv, dtype=np.float64)
    first, last = (min(edge * rate_hz / 1000, emg.size) for edge in span_ms)
    counts = emg[math.floor(first) : math.ceil(last) + 1]
    if not counts.size:
        raise InvalidValueError("there is no EMG in the part that counts", got=span_ms, expected="a part of the sweep")
    if full_scale_mv is not None and np.abs(counts).max() >= NEARLY_FULL * full_scale_mv:
        return True
    level = np.median(emg)
    samples = max(3, round(FLAT_MS * rate_hz / 1000))
    tops = (float(counts.max()), float(counts.min()))
    flat = [top for top in tops if top != level and _longest_run(counts == top) >= samples]
    if not flat:
        return False
    usual, step = np.median(np.abs(emg - level)), np.diff(np.unique(emg)).min()
    return any(abs(top - level) > max(FAR_OUT * usual, FAR_OUT_STEPS * step) for top in flat)


def is_blanked(emg_mv: FloatArray, rate_hz: float, pulse_ms: float, span_ms: tuple[float, float]) -> bool:
    """Whether the amplifier held one value for a part of the MEP's window, much longer than before the pulse.

    Args:
        emg_mv: EMG of one sweep [mV], shape (w,).
        rate_hz: sampling rate [Hz].
        pulse_ms: the magnetic pulse [ms from the first sample].
        span_ms: the MEP's window [ms from the first sample].
    """
    before, first, last = (math.floor(edge_ms * rate_hz / 1000) for edge_ms in (pulse_ms, *span_ms))
    filled = int((emg_mv[:before] != emg_mv[0]).argmax())  # a rig may fill up what it did not record
    held = _longest_run(np.diff(emg_mv[first : last + 1]) == 0)
    at_rest = _longest_run(np.diff(emg_mv[filled:before]) == 0)
    return held * 1000 / rate_hz >= BLANKED_MS and held > BLANKED_TIMES * at_rest


def _longest_run(mask: BoolArray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))
