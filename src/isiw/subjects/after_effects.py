"""After-effects of paired stimulation in simulated people: who has one, how large it is, and how long it lasts.

What is known is of electrical pairs: at the right ISI they raise MEPs of TMS alone [Stefan2000], at another ISI they
lower them, for some 90 minutes [Wolters2003]; the rise lasts 30 to 60 minutes [MuellerDahlhaus2015]; many people show
none [Strube2015]; and more of a stimulation that raises MEPs may lower them [Gamboa2010]. The sizes, their scatter
between people, the share of responders, the number of pairs that it takes, and that taps do the same, are assumptions.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final, TypeAlias

import numpy as np

from isiw.checks import choice, whole
from isiw.excess import EDGE_LEVEL
from isiw.subjects.changes import Plasticity
from isiw.subjects.responses import log_normal
from isiw.subjects.subject import SimulatedSubject

RESPONDERS: Final = 0.5
"""Share of people of "mixed" in whom pairs change anything: an assumption."""

_Effect: TypeAlias = Callable[[np.random.Generator], Plasticity | None]


def _growth(rng: np.random.Generator) -> Plasticity:
    """MEPs grow to LN(1.6, .2) times what they were, 63 % of it after LN(60, .3) pairs at the best ISI."""
    limit, pairs = np.log(log_normal(rng, 1.6, 0.2)), log_normal(rng, 60.0, 0.3)
    return Plasticity(float(max(0.0, limit)), pairs, least=EDGE_LEVEL)


def _decaying(rng: np.random.Generator) -> Plasticity:
    return replace(_growth(rng), half_life_min=log_normal(rng, 40.0, 0.3))


def _timed(rng: np.random.Generator) -> Plasticity:
    """Pairs outside the window lower MEPs, to LN(.75, .15) of what they were."""
    effect = _decaying(rng)
    return replace(effect, outside=float(min(0.0, np.log(log_normal(rng, 0.75, 0.15)))))


def _mixed(rng: np.random.Generator) -> Plasticity | None:
    effect = _decaying(rng)
    return effect if rng.random() < RESPONDERS else None


def _metaplastic(rng: np.random.Generator) -> Plasticity:
    return replace(_decaying(rng), turns_after=log_normal(rng, 120.0, 0.2))


_EFFECTS: Final[Mapping[str, _Effect]] = MappingProxyType(
    {
        "none": lambda _rng: None,
        "growth": _growth,
        "decay": _decaying,
        "timed": _timed,
        "mixed": _mixed,
        "metaplastic": _metaplastic,
    }
)

AFTER_EFFECTS: Final = tuple(_EFFECTS)
"""The kinds of after-effects that `with_after_effects` knows."""


def with_after_effects(people: Iterable[SimulatedSubject], kind: str, seed: int) -> list[SimulatedSubject]:
    """The same people, in whom pairs inside their window leave an after-effect.

    Args:
        people: they keep their windows and responses.
        kind: one of `AFTER_EFFECTS`. Of "none" nobody changes; "growth" stays; "decay" is lost with a half-life of
            LN(40 min, .3); "timed" besides lowers MEPs by pairs outside the window; of "mixed" half have a "decay" and
            the others nothing; of "metaplastic" pairs beyond LN(120, .2) lower what the first have raised.
        seed: of the sizes, a whole number from 0 on.

    Raises:
        InvalidValueError: an unknown kind, or a negative seed.
    """
    choice("the kind of after-effect", kind, AFTER_EFFECTS)
    whole("the seed", seed, least=0)
    return [after_effect_of(person, kind, seed, number) for number, person in enumerate(people)]


def after_effect_of(person: SimulatedSubject, kind: str, seed: int, number: int) -> SimulatedSubject:
    """One of these people, by the number in the list."""
    rng = np.random.default_rng([zlib.crc32(f"after-effect-{kind}".encode()), seed, number])
    return replace(person, plasticity=_EFFECTS[kind](rng))
