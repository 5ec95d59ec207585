"""ISI–MEP response profiles: how strongly a tap facilitates, as a share of its best ISI.

A profile is a value that maps ISIs counted from the impact to facilitation in 0–1. The families are those that have
been seen or argued for: a Gaussian [Kim2020, 4.2], skewed and flat-topped ones (8.1, appendix B), and two peaks
(electrical conditioning has two facilitation windows). Above the motor threshold a tap may depress the MEP too, and
facilitation is negative there (8.1.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Protocol

import numpy as np

from isiw.checks import Checked, Number, Positive, Share, number
from isiw.errors import InvalidValueError
from isiw.types import ArrayLike, FloatArray


class Profile(Protocol):
    """Facilitation by ISI: at most 1, and negative where the tap depresses the MEP."""

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        """Facilitation at ISIs counted from the impact [ms], same shape."""


@dataclass(frozen=True)
class PeakProfile(Checked):
    """One peak whose flanks fall to exp(-2) at both ends of its span.

    Args:
        start_ms: where the rising flank has exp(-2) of the peak [ms from the impact].
        width_ms: from there to the same level of the falling flank [ms].
        peak_at: where the peak lies, as a share of the width; 0.5 is symmetric.
        exponent: 2 is Gaussian (SD = width/4 if symmetric), more is flatter on top with steeper flanks.
    """

    start_ms: Number
    width_ms: Positive
    peak_at: Annotated[float, partial(number, above=0, below=1)] = 0.5
    exponent: Positive = 2.0

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        """Facilitation in 0–1 at ISIs counted from the impact [ms], same shape."""
        share = (np.asarray(isi_ms, dtype=np.float64) - self.start_ms) / self.width_ms - self.peak_at
        flank = np.where(share < 0, self.peak_at, 1.0 - self.peak_at)
        return np.asarray(np.exp(-2.0 * np.abs(share / flank) ** self.exponent))


@dataclass(frozen=True)
class TwoPeakProfile(Checked):
    """Two Gaussians at 0.27 and 0.73 of the span, each with an SD of width/7.5.

    Args:
        start_ms: start of the span [ms from the impact].
        width_ms: width of the span [ms].
        first: height of the first peak.
        second: height of the second peak; the higher of the two has 1.

    Raises:
        InvalidValueError: an invalid span or height.
    """

    start_ms: Number
    width_ms: Positive
    first: Share
    second: Share

    def __post_init__(self) -> None:
        super().__post_init__()
        if 1 not in {self.first, self.second}:
            raise InvalidValueError("the higher peak has height 1", got=(self.first, self.second))

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        """Facilitation in 0–1 at ISIs counted from the impact [ms], same shape."""
        share = (np.asarray(isi_ms, dtype=np.float64) - self.start_ms) / self.width_ms
        peaks = [np.exp(-0.5 * ((share - at) * 7.5) ** 2) for at in (0.27, 0.73)]
        return np.asarray(self.first * peaks[0] + self.second * peaks[1])


@dataclass(frozen=True)
class OpposedProfile(Checked):
    """A segment that facilitates and one that depresses, in either order.

    Args:
        facilitated: the facilitation.
        depressed: where the tap depresses, as a share of the deepest depression.
        depth: the deepest depression, in units of the largest facilitation.
    """

    facilitated: PeakProfile
    depressed: PeakProfile
    depth: Positive

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        """Facilitation at ISIs counted from the impact [ms], negative where the tap depresses, same shape."""
        return self.facilitated(isi_ms) - self.depth * self.depressed(isi_ms)
