"""Facilitation by ISI, as believed: profiles flexible enough for skew, plateau and two peaks, in torch.

The simulated people of `isiw.subjects.responses` have shapes of their own; this is the model's view of any person.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from isiw.lazy import torch
from isiw.models.protocol import Tensor

PEAKS_AT = (0.27, 0.73)
PEAK_SD = 1 / 7.5
APART_SD = 1 / 12.0
"""SD of two peaks that are windows of their own, as a share of the span: the valley between them is below the rule."""

TOGETHER = 0.75
"""Up to which form, of either sign, two peaks are one window."""


class ShapeKind(IntEnum):
    """Families of profiles."""

    GAUSSIAN = 0
    SKEWED = 1
    PLATEAU = 2
    TWO_PEAK = 3


class Shape(NamedTuple):
    """Profiles of many particles; all fields have the particles' shape (..., p)."""

    kind: Tensor  # one of `ShapeKind`
    start_ms: Tensor  # where the rising flank has exp(-2) of the peak
    width_ms: Tensor  # of the span
    form: Tensor  # in -1..1: position of the peak, flatness, or the lower of two peaks, in one window up to `TOGETHER`


def facilitation(shape: Shape, isi_ms: Tensor) -> Tensor:
    """Facilitation in 0–1."""
    peak_at = _peak_at(shape)
    rise_ms, fall_ms = peak_at * shape.width_ms, (1.0 - peak_at) * shape.width_ms
    offset_ms = isi_ms - (shape.start_ms + rise_ms).unsqueeze(-1)
    # Before the peak the first is positive, behind it the second.
    offset = torch.maximum(offset_ms * (-1.0 / rise_ms).unsqueeze(-1), offset_ms * (1.0 / fall_ms).unsqueeze(-1))
    square = offset.square_().clamp_(1e-12, 1e6)
    # Powers and second peaks are dear, and few particles have them.
    flat, double = (_which(shape, kind) for kind in (ShapeKind.PLATEAU, ShapeKind.TWO_PEAK))
    square[flat] = square[flat].pow(_flatness(shape.form[flat]).unsqueeze(-1))
    level = square.mul_(-2.0 / math.log(2.0)).exp2_()  # much faster than powers of e
    level[double] = _two_peaks(_of(shape, double), isi_ms.expand_as(level)[double])
    return level


def reaches(shape: Shape, level: Tensor, isi_ms: Tensor) -> Tensor:
    """Where facilitation reaches a level: profiles of one peak are solved for the crossings, not evaluated."""
    peak_at = _peak_at(shape)
    peak_ms = shape.start_ms + peak_at * shape.width_ms
    away = (-0.5 * level.log()).sqrt()  # of the crossings from the peak, in flanks; NaN where no ISI reaches the level
    away = torch.where(shape.kind == ShapeKind.PLATEAU, away.pow(1.0 / _flatness(shape.form)), away) * shape.width_ms
    first_ms, last_ms = peak_ms - peak_at * away, peak_ms + (1.0 - peak_at) * away
    reached = (isi_ms >= first_ms.unsqueeze(-1)) & (isi_ms <= last_ms.unsqueeze(-1))
    double = _which(shape, ShapeKind.TWO_PEAK)
    reached[double] = _two_peaks(_of(shape, double), isi_ms) >= level[double].unsqueeze(-1)
    return reached


def highest_facilitation(shape: Shape, low_ms: float, high_ms: float) -> Tensor:
    """Largest facilitation in a range of ISIs; profiles fall off on both sides of their peaks."""
    peaks_ms = torch.stack([shape.start_ms + at * shape.width_ms for at in (_peak_at(shape), *PEAKS_AT)], dim=-1)
    return facilitation(shape, peaks_ms.clamp(low_ms, high_ms)).amax(-1).clamp_max(1.0)


def _peak_at(shape: Shape) -> Tensor:
    """Where a profile of one peak has it, as a share of the span, shape (..., p)."""
    return torch.where(shape.kind == ShapeKind.SKEWED, 0.5 + 0.33 * shape.form, 0.5)


def _flatness(form: Tensor) -> Tensor:
    """The power of a plateau's flanks, in squares of the distance from its middle."""
    return torch.exp(0.75 * (form + 1.0))


def _which(shape: Shape, kind: ShapeKind) -> tuple[Tensor, ...]:
    """Indices of the profiles of a family."""
    return (shape.kind == kind).nonzero(as_tuple=True)


def _of(shape: Shape, which: tuple[Tensor, ...]) -> Shape:
    return Shape(*(field[which] for field in shape))


def _two_peaks(shape: Shape, isi_ms: Tensor) -> Tensor:
    """Facilitation of profiles with two peaks, fields of shape (n,), at ISIs of shape (n or 1, t)."""
    form, start_ms, width_ms = (field.unsqueeze(-1) for field in (shape.form, shape.start_ms, shape.width_ms))
    share = (isi_ms - start_ms) / width_ms
    apart = form.abs() > TOGETHER
    sd = torch.full_like(form, PEAK_SD).masked_fill_(apart, APART_SD)
    lower = 1.0 - 0.7 * torch.where(apart, (form.abs() - TOGETHER) / (1.0 - TOGETHER), form.abs() / TOGETHER)
    heights = torch.where(form < 0, lower, 1.0), torch.where(form < 0, 1.0, lower)
    first, second = (
        height * share.sub(at).div_(sd).square_().mul_(-0.5).exp_()
        for height, at in zip(heights, PEAKS_AT, strict=True)
    )
    return first + second
