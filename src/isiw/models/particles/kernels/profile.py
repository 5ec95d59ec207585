"""The facilitation of a particle by ISI, as `isiw.models.particles.shapes` has it, in loops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from isiw.compiled import bell, exp, exp2, log, loop
from isiw.models.particles.kernels import records as field
from isiw.models.particles.shapes import APART_SD, PEAK_SD, PEAKS_AT, TOGETHER, ShapeKind

_f = np.float32
_NIL, _HALF, _ONE, _TWO = _f(0.0), _f(0.5), _f(1.0), _f(2.0)
_PLATEAU, _SKEWED, _TWO_PEAK = (_f(kind) for kind in (ShapeKind.PLATEAU, ShapeKind.SKEWED, ShapeKind.TWO_PEAK))
_FIRST_PEAK, _SECOND_PEAK = _f(PEAKS_AT[0]), _f(PEAKS_AT[1])
_PEAK_SD, _APART_SD, _TOGETHER = _f(PEAK_SD), _f(APART_SD), _f(TOGETHER)
_SQUARED = _f(-2.0 / math.log(2.0))
_FURTHEST = _f(34.0)  # squares of the distance from the peak, in flanks: behind it facilitation is below 1e-29


@loop
def facilitations(particle: Any, isi_ms: Any, level: Any, count: int) -> None:
    """Write the facilitation of a particle at some ISIs, in 0–1; negative where the tap depresses."""
    kind, form = particle[field.SHAPE], particle[field.FORM]
    start, width = particle[field.START], particle[field.WIDTH]
    if particle[field.PRESENT] == _NIL:
        for i in range(count):
            level[i] = _NIL
    elif kind == _TWO_PEAK:
        apart = abs(form) > _TOGETHER
        per_sd = _ONE / (_APART_SD if apart else _PEAK_SD)
        lower = (abs(form) - _TOGETHER) / (_ONE - _TOGETHER) if apart else abs(form) / _TOGETHER
        lower = _ONE - _f(0.7) * lower
        first, second = (lower, _ONE) if form < _NIL else (_ONE, lower)
        for i in range(count):
            share = (isi_ms[i] - start) / width
            a, b = (share - _FIRST_PEAK) * per_sd, (share - _SECOND_PEAK) * per_sd
            level[i] = first * bell(a) + second * bell(b)
    else:
        peak_at = _HALF + _f(0.33) * form if kind == _SKEWED else _HALF
        rise, fall = -_ONE / (peak_at * width), _ONE / ((_ONE - peak_at) * width)
        peak = start + peak_at * width
        if kind == _PLATEAU:
            power = exp(_f(0.75) * (form + _ONE))
            for i in range(count):
                offset = isi_ms[i] - peak
                offset = max(offset * rise, offset * fall)
                square = exp(power * log(min(max(offset * offset, _f(1e-12)), _f(1e6))))
                level[i] = exp2(_SQUARED * min(square, _FURTHEST))
        else:
            for i in range(count):
                offset = isi_ms[i] - peak
                offset = max(offset * rise, offset * fall)
                level[i] = exp2(_SQUARED * min(offset * offset, _FURTHEST))
    if particle[field.DEPTH] > _NIL:
        per_flank, depth = _TWO / particle[field.LOW_WIDTH], particle[field.DEPTH]
        middle = particle[field.LOW_START] + _HALF * particle[field.LOW_WIDTH]
        for i in range(count):
            offset = (isi_ms[i] - middle) * per_flank
            level[i] -= depth * exp2(_SQUARED * min(offset * offset, _FURTHEST))
