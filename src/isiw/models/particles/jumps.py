"""What moves may do to particles of the default model: which latents a shift moves, and which kinds a jump draws again.

A jump leads to another kind of profile, of noise, or to and from "no window".
"""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.models.particles.building import prior_tables
from isiw.models.particles.changes import ChangeKind
from isiw.models.particles.compiled import Law
from isiw.models.particles.latents import (
    KINDS,
    LATENTS,
    PLACE_AND_SIZES,
    PROFILE_BLOCKS,
    RESPONSE_BLOCKS,
    latents_of,
    used_by,
)
from isiw.models.particles.levels import CARRIED
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Prior

JUMPS: Final = {
    "form": 0.09,
    "noise": 0.17,
    "window": 0.22,
    "place": 0.07,
    "response": 0.05,
    "change": 0.30,
    "time or window": 0.10,
}
"""Shares of the jumps. They draw again: the profile's kind and form; the noise's kind and all that belongs to it;
whether there is a window, and all of it; where and how wide it is; what belongs to the noise's kind; what changes in
the session, and when; that and the window at once."""

REDRAWN: Final = {
    "form": ("form",),
    "noise": RESPONSE_BLOCKS,
    "window": PROFILE_BLOCKS,
    "place": ("start", "width"),
    "response": RESPONSE_BLOCKS,
    "change": (),
    "time or window": PROFILE_BLOCKS,
}
"""The blocks of latents that each jump draws again from the prior; a change is drawn by rules of its own."""

_RENEWED: Final = {
    "form": {"shape"},
    "noise": {"noise"},
    "window": {"shape", "present"},
    "place": (),
    "response": (),
    "change": {"change"},
    "time or window": {"shape", "present", "change"},
}
"""Which kinds each jump draws again."""


_NO_DEPRESSION: Final = (-1,) * 3


@lru_cache(maxsize=64)
def law_of(prior: Prior, space: DesignSpace, *, by_levels: bool = False) -> Law:
    """The prior, and what moves may do, as the engine has them; particles may have a law by levels, too."""
    profile = prior.profile
    joint = profile.joint(space)
    change, present, noise = np.indices((len(ChangeKind), 2, len(NoiseKind))).reshape(3, -1)
    used = used_by(noise, present > 0, change)
    carried = CARRIED if by_levels else 0  # behind the latents, and neither drawn nor moved
    behind = [(0, 0), (0, carried)]
    moves = {
        "apart": False,
        "state_of": np.array([0, 1, len(NoiseKind), 0, 2 * len(NoiseKind)]),
        "shifted": np.pad(_SHIFTED & used[:, np.newaxis], [(0, 0), *behind]),
        "jumps": tuple(JUMPS.values()),
        "redrawn": np.pad(np.stack([latents_of(*REDRAWN[jump]) for jump in JUMPS]), behind),
        "renewed": np.array([[kind in kinds for kind in KINDS] for kinds in _RENEWED.values()]),
        "of_profile": np.array([jump in {"form", "place"} for jump in JUMPS]),
        "kinds": (
            astuple(profile.shapes),
            astuple(prior.noise),
            (1.0 - profile.p_window, profile.p_window),
            (1.0,),
            prior.changes.shares,
        ),
    }
    tables = prior_tables(
        space,
        profile.start,
        list(prior.mixtures.values()),
        starts=1,
        places=None if joint is None else (joint.share, joint.mixture),
        at=[*range(len(LATENTS)), *_NO_DEPRESSION, len(LATENTS) if by_levels else -1],
        spreads=np.append(prior.spreads, np.ones(carried)),
        moves=moves,
    )
    return Law(tables)


_OF_PROFILE, _CHANGED = latents_of(*PROFILE_BLOCKS), latents_of("changed")
_SHIFTED: Final = np.stack(
    [~_CHANGED, _OF_PROFILE, ~_OF_PROFILE & ~_CHANGED, np.array([name in PLACE_AND_SIZES for name in LATENTS])]
)
"""Which latents a difference moves by its part, shape (parts, d)."""
