"""What moves may do to particles with both kinds of segment: what a shift moves, and what a jump draws again."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.models.particles.building import prior_tables
from isiw.models.particles.compiled import Law
from isiw.models.particles.latents import LATENTS as DEFAULT_LATENTS
from isiw.models.particles.supra.prior import BLOCKS, LATENTS, SupraPrior
from isiw.types import BoolArray

JUMPS: Final = {
    "enhanced": 0.2,
    "depressed": 0.25,
    "place": 0.15,
    "depressed place": 0.15,
    "both places": 0.15,
    "curve": 0.1,
}
"""Shares of the jumps. They draw again: whether there is a segment, and all of it; where and how wide one is, or both
are; the curve."""

REDRAWN: Final = {
    "enhanced": BLOCKS["enhanced"],
    "depressed": BLOCKS["depressed"],
    "place": BLOCKS["enhanced"][:2],
    "depressed place": BLOCKS["depressed"][:2],
    "both places": (*BLOCKS["enhanced"][:2], *BLOCKS["depressed"][:2]),
    "curve": BLOCKS["curve"],
}
"""The latents that each jump draws again."""

_PLACES_AND_SIZES: Final = (*REDRAWN["both places"], "log_floor_mv", "log_ceiling")

_OF_A_DEPRESSION: Final = ("depressed_start_ms", "depressed_log_width_ms", "depressed_log_shift")
_AS_THE_DEFAULT: Final = tuple("log_shift" if n == "log_boost" else n for n in (*DEFAULT_LATENTS, *_OF_A_DEPRESSION))
"""What the engine knows latents by, in their order."""


@lru_cache(maxsize=16)
def law_of(prior: SupraPrior, space: DesignSpace) -> Law:
    """The prior, and what moves may do, as the engine has them."""
    of_enhanced, of_depressed = (_latents(*BLOCKS[name]) for name in ("enhanced", "depressed"))
    there = ((False, False), (True, False), (False, True), (True, True))
    used = np.stack([(~of_enhanced | up) & (~of_depressed | down) for up, down in there])
    segments = of_enhanced | of_depressed
    parts = np.stack([np.ones_like(segments), segments, ~segments, _latents(*_PLACES_AND_SIZES)])
    moves = {
        "apart": True,
        "state_of": np.array([0, 0, 1, 2, 0]),
        "shifted": parts & used[:, np.newaxis],
        "jumps": tuple(JUMPS.values()),
        "redrawn": np.stack([_latents(*names) for names in REDRAWN.values()]),
        "renewed": np.array([[False, False, jump == "enhanced", jump == "depressed", False] for jump in JUMPS]),
        "of_profile": np.zeros(len(JUMPS), dtype=bool),
        "kinds": (
            (1.0,),
            (0.0, 0.0, 1.0),  # all noise is that of a recruitment curve
            *((1.0 - p, p) for p in (prior.enhanced.probability, prior.depressed.probability)),
            (1.0,),
        ),
    }
    at = [LATENTS.index(name) if name in LATENTS else -1 for name in _AS_THE_DEFAULT]
    tables = prior_tables(
        space, prior.start, prior.mixtures, starts=2, places=None, at=at, spreads=prior.spreads, moves=moves
    )
    return Law(tables)


def _latents(*names: str) -> BoolArray:
    """Which latents have some names, shape (d,)."""
    return np.array([name in names for name in LATENTS])
