"""The answer of an intervention: by which factor pulses of TMS alone changed from before to after.

The factor is that of what a pulse evokes above the EMG floor. It comes with a 90 % interval, that allows for a drift of
the level; beside it stands the ratio of mean MEPs, and what that ratio would be without an effect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final, NamedTuple

import numpy as np

from isiw.checks import number, whole
from isiw.errors import InvalidValueError
from isiw.lazy import scipy
from isiw.pairing.law import Pulses
from isiw.pairing.level import STRETCH, LevelPrior, Posterior, Stretches, posterior
from isiw.pairing.pulses import TestPulse, meps_mv

ALL_BLOCKS: Final = "all blocks"
"""The name of the mean over the blocks after an intervention."""

MASS: Final = 0.9
"""Probability of every interval."""

LEAST_BEFORE: Final = 5
"""Fewer pulses before the intervention say too little of how much MEPs vary."""

USUAL_PAIRS: Final = 100
"""Stimuli between the last pulse before and the first one after, if nobody says how many."""

USUAL_LIMIT_MV: Final = 0.02
"""An MEP of 0 lies below this, if no other detection limit is stated [mV]."""


class Interval(NamedTuple):
    """A factor, with the ends of its 90 % interval."""

    median: float
    low: float
    high: float

    @property
    def holds_none(self) -> bool:
        """True if no change at all is within it."""
        return self.low <= 1.0 <= self.high


@dataclass(frozen=True)
class BlockChange:
    """The change from before to one block after the intervention, or to all of them.

    Args:
        block: the block's name; "all blocks" for their mean.
        at_min: the middle of the block, from the last pair [min].
        pulses: how many pulses it has.
        factor: by which what TMS alone evokes has changed, a drift of the level allowed for.
        steady: the same if the level did not drift.
        more: probability that it has become more.
        ratio: ratio of mean MEPs after to before, at the same intensities; None where there are none.
        unchanged: between these the ratio would lie in nine of ten visits without an effect; None likewise.
    """

    block: str
    at_min: float
    pulses: int
    factor: Interval
    steady: Interval
    more: float
    ratio: float | None
    unchanged: tuple[float, float] | None


@dataclass(frozen=True)
class AfterEffect:
    """What an intervention changed.

    Args:
        blocks: the change to each block after it, in order.
        pooled: the mean change over these blocks.
        before: how many pulses were given before it.
        drift_log_sd: SD of the drift of the level, as far as the pulses show it, natural log.
        pulse_log_sd: SD with which one pulse shows the level, natural log.
    """

    blocks: tuple[BlockChange, ...]
    pooled: BlockChange
    before: int
    drift_log_sd: float
    pulse_log_sd: float

    @property
    def is_shown(self) -> bool:
        """True if the interval of the pooled change holds no factor of 1."""
        return not self.pooled.factor.holds_none


def change_of(
    pulses: Sequence[TestPulse],
    *,
    pairs: int = USUAL_PAIRS,
    detection_limit_mv: float = USUAL_LIMIT_MV,
    prior: LevelPrior | None = None,
) -> AfterEffect:
    """The change of MEPs of TMS alone from before an intervention to after it.

    Args:
        pulses: of TMS alone, in the order of delivery, at any intensities.
        pairs: how many stimuli the intervention had.
        detection_limit_mv: an MEP of 0 lies below this [mV].
        prior: what is known of people beforehand.

    Raises:
        InvalidValueError: fewer than five pulses before, none after, or a number that cannot be.
    """
    before = [pulse for pulse in pulses if pulse.after_last_pair_s < 0]
    after = [pulse for pulse in pulses if pulse.after_last_pair_s >= 0]
    _require_enough(len(before), len(after))
    pairs = whole("pairs", pairs, least=0)
    limit_mv = number("detection_limit_mv", detection_limit_mv, above=0)
    blocks = [list(those) for _, those in groupby(after, key=lambda pulse: pulse.block)]
    prior = prior or LevelPrior()
    stretches = _stretches([before, *blocks], pairs)
    found = posterior(_as_read([*before, *after], limit_mv), stretches, prior)
    drift = math.sqrt(float(found.weights @ np.array([size for size, _ in prior.drifts]) ** 2))
    changes = [_change(found, which, before, block, drift) for which, block in enumerate(blocks)]
    pooled = _change(found, len(blocks), before, after, drift)
    return AfterEffect(tuple(changes), pooled, len(before), drift, found.pulse_log_sd)


def _require_enough(before: int, after: int) -> None:
    if before < LEAST_BEFORE or not after:
        raise InvalidValueError(
            "too few pulses of TMS alone to say what has changed",
            got=f"{before} before the intervention, {after} after it",
            expected=f"at least {LEAST_BEFORE} before and 1 after; 20 to 30 in each block are usual",
            remedy="Give more pulses of TMS alone before the first pair; afterwards nothing can replace them.",
        )


def _as_read(pulses: Sequence[TestPulse], limit_mv: float) -> Pulses:
    mep_mv = np.array([pulse.mep_mv for pulse in pulses])
    intensity = np.array([pulse.intensity_pct_rmt for pulse in pulses])
    return Pulses(np.log(np.where(mep_mv > 0, mep_mv, limit_mv)), mep_mv == 0, intensity)


def _stretches(blocks: Sequence[Sequence[TestPulse]], pairs: int) -> Stretches:
    """Stretches of at most ten pulses, and where each is among all stimuli."""
    of_pulse: list[int] = []
    block_of: list[int] = []
    at: list[tuple[float, float]] = []
    given = 0
    for number_of, block in enumerate(blocks):
        for part in np.array_split(np.arange(len(block)), -(-len(block) // STRETCH)):
            of_pulse += [len(block_of)] * len(part)
            block_of.append(number_of)
            at.append((given + part[0], given + part[-1]))
        given += len(block) + (0 if number_of else pairs)
    return Stretches(np.array(of_pulse), np.array(block_of), np.array(at, dtype=float))


def _change(
    found: Posterior, which: int, before: Sequence[TestPulse], block: Sequence[TestPulse], drift: float
) -> BlockChange:
    names = list(dict.fromkeys(pulse.block for pulse in block))
    ratio, spread = _ratio(before, block)
    unchanged = None
    if spread is not None:
        reach = float(scipy.stats.norm.ppf(0.5 + MASS / 2.0)) * math.hypot(spread, math.sqrt(2.0) * drift)
        unchanged = math.exp(-reach), math.exp(reach)
    return BlockChange(
        names[0] if len(names) == 1 else ALL_BLOCKS,
        float(np.median([pulse.after_last_pair_s for pulse in block])) / 60.0,
        len(block),
        Interval(*map(math.exp, found.interval(which, MASS))),
        Interval(*map(math.exp, found.given(0).interval(which, MASS))),
        1.0 - found.below(which, 0.0),
        ratio,
        unchanged,
    )


def _ratio(before: Sequence[TestPulse], after: Sequence[TestPulse]) -> tuple[float | None, float | None]:
    """Ratio of mean MEPs at the same intensities, and the SD of its log if nothing changed, by the pulses before."""
    logs, variances, weights = [], [], []
    for pct in sorted({pulse.intensity_pct_rmt for pulse in after}):
        first, then = (meps_mv(those, pct) for those in (before, after))
        if len(first) < 2 or not first.mean() > 0 or not then.mean() > 0:
            continue
        logs.append(math.log(then.mean() / first.mean()))
        variances.append(float((first.std(ddof=1) / first.mean()) ** 2) * (1.0 / len(first) + 1.0 / len(then)))
        weights.append(len(then))
    if not logs:
        return None, None
    shares = np.array(weights) / sum(weights)
    return math.exp(float(shares @ np.array(logs))), math.sqrt(float(shares**2 @ np.array(variances)))
