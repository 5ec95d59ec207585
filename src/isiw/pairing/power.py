"""How many pulses a person needs, and how many people a study needs, to show a change of MEPs."""

from __future__ import annotations

import math
from bisect import bisect_left
from typing import Final

from isiw.checks import number, share
from isiw.errors import InvalidValueError
from isiw.lazy import scipy
from isiw.pairing.effect import AfterEffect

POWER: Final = 0.8
"""Usual probability of seeing what is there [Cohen1988]."""

BETWEEN_PEOPLE: Final = 0.35
"""SD of the change between people, natural log: an assumption, which a pilot study replaces."""

_LEAST_PEOPLE: Final = 2
_PEOPLE: Final = range(_LEAST_PEOPLE, 10_000)


def pulses_needed(effect: AfterEffect, factor: float, *, power: float = POWER, steady: bool = False) -> int | None:
    """How many pulses before and in all blocks after, of each, show a change in this person.

    The 90 % interval then holds no factor of 1 with this probability. From n pulses before and n after, the change has
    the SD sqrt(2 (s² / n + d²)), with the SD s of one pulse and that of the drift, d, which more pulses do not reduce.

    Args:
        effect: what was measured in the person.
        factor: the change that is to be seen, such as 1.5.
        power: the probability.
        steady: whether the level is taken not to drift.

    Returns:
        The number, or None where the level may drift so much that no number is enough.

    Raises:
        InvalidValueError: a factor of 1 or not above 0, or no probability.
    """
    wanted = _log_of(factor) / (_quantile(0.95) + _quantile(share("the power", power, above=0.0, below=1.0)))
    left = 0.5 * wanted**2 - (0.0 if steady else effect.drift_log_sd**2)
    return None if left <= 0 else math.ceil(effect.pulse_log_sd**2 / left)


def people_needed(factor: float, log_sd: float, *, power: float = POWER, level: float = 0.05) -> int:
    """How many people show a mean change, by a two-sided t-test of each person's log factor against none.

    The power is that of the noncentral t distribution [Cohen1988].

    Args:
        factor: the change that is to be seen, such as 1.5.
        log_sd: SD of measured changes between people, natural log: `math.hypot` of that of the true changes and that of
            measuring one, which `measuring_log_sd` gives.
        power: the probability of seeing it.
        level: the rate of false alarms.

    Raises:
        InvalidValueError: a factor of 1 or not above 0, an SD that is not, or no probability.
    """
    size = _log_of(factor) / number("log_sd", log_sd, above=0)
    power = share("the power", power, above=0.0, below=1.0)
    level = share("the level", level, above=0.0, below=1.0)
    return _LEAST_PEOPLE + bisect_left(_PEOPLE, power, key=lambda people: _power(people, size, level))


def measuring_log_sd(effect: AfterEffect) -> float:
    """SD with which one person's pooled change is known, natural log: its 90 % interval as that of a normal law."""
    low, high = effect.pooled.factor.low, effect.pooled.factor.high
    return math.log(high / low) / (2.0 * _quantile(0.95))


def _power(people: int, size: float, level: float) -> float:
    free = people - 1
    limit = scipy.stats.t.ppf(1.0 - level / 2.0, free)
    return float(scipy.stats.nct.sf(limit, free, size * math.sqrt(people)))


def _quantile(p: float) -> float:
    return float(scipy.special.ndtri(p))


def _log_of(factor: float) -> float:
    size = abs(math.log(number("the factor", factor, above=0)))
    if size == 0:
        raise InvalidValueError("no change at all cannot be shown", got=factor, expected="a factor such as 1.5 or 0.7")
    return size
