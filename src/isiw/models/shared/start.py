"""Where windows start in a design space: what is known of people and of the rig, and the chance that neither holds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from isiw.checks import Checked, MeanAndSd, Number, Positive, Share, ascending
from isiw.design import DesignSpace
from isiw.models.shared.draws import normal_below
from isiw.models.shared.scales import require_sum_of_one
from isiw.types import Array, FloatArray

BEFORE_MS: Final = 100.0
"""How far before the range a window may start."""

KNOT_MS: Final = 1.0
MAX_KNOTS: Final = 4000
LEAST_MASS: Final = 1e-6
LEAST_DENSITY: Final = 1e-30
"""Of a start that can be [1/ms]; smaller ones are taken for it, so that logarithms and shares are numbers."""

ROBOT_HIT_DELAY_MS: Final = (180.0, 6.2)
"""Mean and SD over people of the tapping robot's hit delay [ms]; 172–188 ms were measured (dissertation, 4.2)."""

OTHER_HIT_DELAY_MS: Final = (20.0, 300.0)
"""Between these lies the hit delay of any other rig [ms]."""


@dataclass(frozen=True)
class Span(Checked):
    """Starts that are uniform between two ISIs, with normal blur.

    Args:
        share: probability of this span among all.
        low_ms: earliest start [ms].
        high_ms: latest start [ms].
        sd_ms: SD of the blur [ms].
    """

    share: Share
    low_ms: Number
    high_ms: Number
    sd_ms: Positive = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        ascending("Span.low_ms and Span.high_ms", (self.low_ms, self.high_ms))

    def density(self, start_ms: Array) -> FloatArray:
        """Density at some starts [1/ms], same shape."""
        low, high = (normal_below((start_ms - edge) / self.sd_ms) for edge in (self.low_ms, self.high_ms))
        density: FloatArray = (low - high) / (self.high_ms - self.low_ms)
        return density

    def later(self, mean_ms: float, sd_ms: float, share: float = 1.0) -> Span:
        """The same counted from an earlier event."""
        blur_ms = math.hypot(self.sd_ms, sd_ms)
        return Span(share * self.share, self.low_ms + mean_ms, self.high_ms + mean_ms, blur_ms)


TAP_SPANS: Final = (Span(0.635, 0.0, 115.0), Span(0.365, -30.0, 260.0, 20.0))
"""Where windows start after a tap; some wide ones start before it (`isiw.models.particles.profile`)."""


class Knots(NamedTuple):
    """A law of starts that is straight between some of them, each of shape (k,)."""

    start_ms: FloatArray  # evenly spaced
    density: FloatArray  # [1/ms]
    below: FloatArray  # probability of an earlier start
    usual: FloatArray  # probability that a start is of the usual span, whatever the rig


@dataclass(frozen=True)
class StartPrior(Checked):
    """Where windows start.

    Args:
        spans: starts counted from the impact; the first is the usual one.
        hit_delay_ms: mean and SD of the impact on the clock of the valve, of a person unknown [ms], as the rig states
            it; None if it does not: then it is the tapping robot's with a probability of `p_robot`, else anything
            from 20 to 300 ms.
        p_robot: how probable it is that a rig that does not state its hit delay is the tapping robot.
        p_anywhere: probability that the start lies anywhere in the range instead, or up to 100 ms before it; more in a
            range that only a part of the usual starts lies in.
    """

    spans: tuple[Span, ...] = TAP_SPANS
    hit_delay_ms: MeanAndSd | None = None
    p_robot: Share = 0.5
    p_anywhere: Share = 0.04

    def __post_init__(self) -> None:
        super().__post_init__()
        require_sum_of_one("the shares of StartPrior.spans", (span.share for span in self.spans))

    def knots(self, space: DesignSpace) -> Knots:
        """Evenly spaced starts in a space, with their density and the probability of earlier ones."""
        return _knots(space, self)

    def log_density(self, start_ms: Array, space: DesignSpace) -> FloatArray:
        """Log density at some starts, same shape; -inf where no start can be."""
        knots_ms, density, *_ = self.knots(space)
        at = np.log(np.maximum(np.interp(start_ms, knots_ms, density), LEAST_DENSITY))
        return np.where((start_ms >= knots_ms[0]) & (start_ms <= knots_ms[-1]), at, -np.inf)

    def usual(self, start_ms: Array, space: DesignSpace) -> FloatArray:
        """Probability that some starts are of the usual span, whatever the rig, same shape."""
        knots = self.knots(space)
        share: FloatArray = np.interp(start_ms, knots.start_ms, knots.usual, left=0.0, right=0.0)
        return share

    def as_usual(self, kept: float) -> StartPrior:
        """The same with less probability of all but the usual span."""
        first, *others = self.spans
        less = tuple(replace(span, share=kept * span.share) for span in others)
        usual = replace(first, share=1.0 - math.fsum(span.share for span in less))
        return replace(self, spans=(usual, *less), p_anywhere=kept * self.p_anywhere)

    def hit_delays(self, space: DesignSpace) -> list[tuple[float, float, float]]:
        """Probability, mean and SD of the impact on the clock of a space [ms], as far as it is known."""
        if space.reference == "impact":
            return [(1.0, 0.0, 0.0)]
        if self.hit_delay_ms is not None:
            return [(1.0, *self.hit_delay_ms)]
        low_ms, high_ms = OTHER_HIT_DELAY_MS
        other = 0.5 * (low_ms + high_ms), (high_ms - low_ms) / math.sqrt(12.0)
        return [(self.p_robot, *ROBOT_HIT_DELAY_MS), (1.0 - self.p_robot, *other)]

    def in_space(self, space: DesignSpace) -> tuple[Span, ...]:
        """The spans on the clock of a space."""
        if space.reference == "impact":
            return self.spans
        if self.hit_delay_ms is not None:
            return tuple(span.later(*self.hit_delay_ms) for span in self.spans)
        robot = [span.later(*ROBOT_HIT_DELAY_MS, share=self.p_robot) for span in self.spans]
        return (*robot, *(_with_any_hit_delay(span, 1.0 - self.p_robot) for span in self.spans))


def _with_any_hit_delay(span: Span, share: float) -> Span:
    """Starts in a span after any other rig's impact: the wider of the two laws, blurred by the narrower."""
    low_ms, high_ms = OTHER_HIT_DELAY_MS
    middle_ms, sd_ms = 0.5 * (span.low_ms + span.high_ms), (span.high_ms - span.low_ms) / math.sqrt(12.0)
    return Span(share * span.share, low_ms + middle_ms, high_ms + middle_ms, math.hypot(span.sd_ms, sd_ms))


@lru_cache(maxsize=64)
def _knots(space: DesignSpace, prior: StartPrior) -> Knots:
    low_ms, high_ms = space.low_ms - BEFORE_MS, space.high_ms
    knots_ms = np.linspace(low_ms, high_ms, min(MAX_KNOTS, math.ceil((high_ms - low_ms) / KNOT_MS) + 1))
    spans = (1.0 - prior.p_anywhere) * np.stack([span.share * span.density(knots_ms) for span in prior.in_space(space)])
    even = np.full_like(knots_ms, 1.0 / (high_ms - low_ms))
    mixed = spans.sum(0) + prior.p_anywhere * even
    # The first of all spans is there once for each kind of rig.
    usual = spans[:: len(prior.spans)].sum(0) / np.maximum(mixed, LEAST_DENSITY)
    below = _integral(knots_ms, mixed)
    if below[-1] < LEAST_MASS:
        mixed, below = even, _integral(knots_ms, even)
    # Given that it lies in the range: the further that is from where starts usually are, the more "anywhere" counts.
    return Knots(knots_ms, mixed / below[-1], below / below[-1], usual)


def _integral(x: FloatArray, y: FloatArray) -> FloatArray:
    """Of what is straight between its knots, from the first to each, (k,)."""
    below = np.zeros_like(x)
    np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x), out=below[1:])
    return below
