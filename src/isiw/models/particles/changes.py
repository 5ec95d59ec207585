"""What may change in the course of a session, whatever the ISI.

A coil that is re-seated, an electrode or a gain multiplies everything that is evoked from some trial on; another
intensity moves it along the recruitment curve; habituation and plasticity change the enhancement from trial to trial
[Kim2020, 4.5, 5.4.1]. A particle has one change or none; a wide drift is a law of its own (`SessionPrior`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from isiw.change import LIKELY_CHANGE
from isiw.change import Change as EstimatedChange
from isiw.checks import Checked, Positive, Share
from isiw.errors import InvalidValueError
from isiw.models.particles.mixture import Mixture
from isiw.models.shared.draws import normal_below
from isiw.models.shared.scales import PositiveLaw, Scale
from isiw.types import Array, BoolArray, FloatArray, IntArray

INTENSITY_PCT: Final = 9.0
"""By how much the intensity changes, where it does, at a size of 1 [% RMT]."""

FADING: Final = 0.04
"""By how many halves the enhancement changes from trial to trial at a size of 1: to a half within 25 trials."""

GROWN_AFTER: Final = 40.0
"""After so many trials an enhancement that grows is whole."""


MATTERS: Final = math.log(1.5)
"""A smaller change, natural log, is not worth saying."""


class ChangeKind(IntEnum):
    """What changes."""

    NONE = 0
    LEVEL = 1
    INTENSITY = 2
    ENHANCEMENT = 3
    SCALE = 4


@dataclass(frozen=True)
class ChangePrior(Checked):
    """Of what changes within a session beside a slow drift.

    Args:
        level: probability that everything evoked becomes larger or smaller at some trial.
        intensity: probability that the intensity changes at some trial.
        enhancement: probability that the enhancement fades or grows.
        scale: probability that all amplitudes become larger or smaller at some trial, the EMG floor's among them.
        trial: how many trials come before a change.
        size_sd: SD of the size of a change: of a level, natural log.
        noted: after how many trials each change was noted that somebody saw.
        noted_share: probability that a noted change is one of the amplitudes.
    """

    level: Share = 0.08
    intensity: Share = 0.07
    enhancement: Share = 0.06
    scale: Share = 0.05
    trial: PositiveLaw = Scale(20.0, 1.1)
    size_sd: Positive = 1.0
    noted: tuple[int, ...] = ()
    noted_share: Share = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._usual[0] <= 0:
            raise InvalidValueError(
                "there must be room for no change at all", got=self._usual[1:], expected="less than 1"
            )

    @property
    def _usual(self) -> tuple[float, ...]:
        """Probabilities of the kinds where nothing was noted."""
        changes = self.level, self.intensity, self.enhancement, self.scale
        return 1.0 - sum(changes), *changes

    @property
    def _steps(self) -> float:
        """Probability of a change at some trial where nothing was noted."""
        return self.level + self.intensity + self.scale

    @property
    def _unnoted(self) -> float:
        """Probability that nothing was the change of any note."""
        return (1.0 - self.noted_share) ** len(self.noted)

    @property
    def shares(self) -> tuple[float, ...]:
        """Probabilities of the kinds, in the order of `ChangeKind`; what is noted is a change at some trial."""
        noted = (1.0 - self._unnoted) / max(self._steps, 1e-9)
        steps = {ChangeKind.LEVEL, ChangeKind.INTENSITY, ChangeKind.SCALE}
        each = zip(ChangeKind, self._usual, strict=True)
        return tuple(share * (self._unnoted + noted * (kind in steps)) for kind, share in each)

    @cached_property
    def mixtures(self) -> dict[str, Mixture]:
        """Of the log of the trial before which a change comes, and of its size."""
        steps = self._unnoted * max(self._steps, 1e-9)  # a law is needed where no change comes, too
        left, shares = 1.0, []
        for _ in self.noted:  # the last note first
            shares.append(left * self.noted_share)
            left *= 1.0 - self.noted_share
        laws = [(steps, self.trial.log_law)]
        # Of a note after n trials: between trial n and the next, nearly all of it.
        laws += [
            (share, Scale(trials - 0.5, 0.2 / trials).log_law)
            for share, trials in zip(shares, reversed(self.noted), strict=True)
        ]
        return {
            "changed": Mixture.of([(share, [law]) for share, law in laws]),
            "change": Mixture.of([(1.0, [(0.0, self.size_sd)])]),
        }

    def noting(self, trials: int) -> ChangePrior:
        """The same where somebody noted a change after so many trials."""
        return replace(self, noted=(*self.noted, trials))

    def as_usual(self, kept: float) -> ChangePrior:
        """The same with a part of the probability of changes that nobody noted."""
        level, intensity, enhancement, scale = (kept * share for share in self._usual[1:])
        return replace(self, level=level, intensity=intensity, enhancement=enhancement, scale=scale)

    def untouched(self, trials: int) -> float:
        """Probability that nothing has changed any of so many trials."""
        law, shares = self.mixtures["changed"], self.shares
        later = normal_below((law.means - math.log(max(trials - 1, 0.5))) / law.sds)[:, 0]
        steps = 1.0 - shares[ChangeKind.NONE] - shares[ChangeKind.ENHANCEMENT]
        return shares[ChangeKind.NONE] + steps * float((law.shares * later).sum())

    def where_noted(self, size: tuple[int, int], rng: np.random.Generator) -> tuple[IntArray, FloatArray]:
        """Changes at the last note: their kinds (b, p), and log trial and size (b, p, 2)."""
        place = rng.random(size) * self._steps
        kind = np.where(place < self.level + self.intensity, ChangeKind.INTENSITY, ChangeKind.SCALE)
        kind = np.where(place < self.level, ChangeKind.LEVEL, kind)
        after = self.noted[-1] - 0.01 - 0.98 * rng.random(size)
        return kind, np.stack((np.log(after), self.size_sd * rng.standard_normal(size)), axis=-1)


class Change(NamedTuple):
    """What changes in a session, fields (b, p); logarithms are natural."""

    after: Array  # how many trials come before it
    log_gain: Array  # of everything evoked from then on
    shift_pct_rmt: Array  # by how much the pulse is stronger from then on
    fading: Array  # by how many halves the enhancement fades from trial to trial; negative where it grows
    log_scale: Array  # of all amplitudes from then on, the EMG floor's among them

    @classmethod
    def of(cls, kind: IntArray, log_after: Array, size: Array, curved: BoolArray) -> Change:
        """What latents mean; without a recruitment curve an intensity is a level."""
        shifted = (kind == ChangeKind.INTENSITY) & curved
        levelled = (kind == ChangeKind.LEVEL) | ((kind == ChangeKind.INTENSITY) & ~curved)
        fading = np.where(kind == ChangeKind.ENHANCEMENT, FADING * size, 0.0)
        gain, shift = np.where(levelled, size, 0.0), np.where(shifted, INTENSITY_PCT * size, 0.0)
        return cls(np.exp(log_after), gain, shift, fading, np.where(kind == ChangeKind.SCALE, size, 0.0))

    def enhancement(self, trials: int) -> Array:
        """The share of the enhancement that there is after so many trials, (b, p)."""
        age = np.where(self.fading > 0, trials, max(GROWN_AFTER - trials, 0.0))
        share: Array = np.exp2(-np.abs(self.fading) * age)
        return share

    def steps(self, trials: int) -> tuple[Array, Array]:
        """Log of what amplitudes are multiplied by, and the shift [% RMT], at the last of so many trials, (b, p)."""
        there = self.after <= trials - 1
        return (self.log_gain + self.log_scale) * there, self.shift_pct_rmt * there

    def named(self, trials: int, stood_for: int = 0) -> EstimatedChange | None:
        """What changed by the last of so many trials of equally weighted particles (1, p), as far as it matters.

        Args:
            trials: how many trials there were.
            stood_for: how many more trials the first of them stands for.
        """
        gain, shift_pct = (step[0] for step in self.steps(trials))
        enhancement = (self.enhancement(trials) / self.enhancement(0))[0]
        levelled, shifted = np.abs(gain) > MATTERS, np.abs(shift_pct) > MATTERS * INTENSITY_PCT
        stepped, faded = levelled | shifted, np.abs(np.log(enhancement)) > MATTERS
        share = float(stepped.mean()), float(faded.mean())
        if max(share) < LIKELY_CHANGE:
            return None
        if share[1] > share[0]:
            return EstimatedChange("enhancement", share[1], *_interval(enhancement[faded]))
        trial = stood_for + int(np.quantile(np.ceil(self.after[0, stepped]), 0.5, method="lower"))
        if shifted.sum() > levelled.sum():
            return EstimatedChange("intensity", share[0], *_interval(shift_pct[shifted]), trial)
        return EstimatedChange("amplitudes", share[0], *_interval(np.exp(gain[levelled])), trial)


def _interval(sizes: Array) -> tuple[float, float, float]:
    """Median, and the ends of the 90 % interval."""
    low, median, high = np.quantile(sizes, (0.05, 0.5, 0.95)).tolist()
    return median, low, high
