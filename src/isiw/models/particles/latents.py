"""The latents of a particle: a vector of numbers of one meaning each, in blocks by what they are about."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from isiw.models.particles.changes import ChangeKind
from isiw.models.particles.noise import NoiseKind
from isiw.types import BoolArray, IntArray, Singles

_CURVE: Final = ("log_ceiling", "log_slope", "log_input_sd", "log_sigma_y", "log_boost", "rest")

RECTIFIED: Final = {name: f"rectified_{name}" for name in _CURVE}
"""What the latents of a recruitment curve are called where it starts at a threshold."""

BLOCKS: Final = {
    "start": ("start_ms",),
    "width": ("log_width_ms",),
    "form": ("form",),
    "floor": ("log_floor_mv", "log_floor_sd"),
    "session": ("drift", "startup"),
    "gain": ("log_gain", "log_cv"),
    "reliability": ("reliability",),
    "switch": ("switched_on", "switched_off", "log_size", "log_size_cv"),
    "recruitment": _CURVE,
    "rectified": (*RECTIFIED.values(), "log_onset"),
    "changed": ("log_changed_after",),
    "change": ("change_size",),
}
"""The latents by what they are about."""

LATENTS: Final = tuple(name for names in BLOCKS.values() for name in names)
"""Names of the latents, in order."""

PROFILE_BLOCKS: Final = ("start", "width", "form")
RESPONSE_BLOCKS: Final = ("gain", "reliability", "switch", "recruitment", "rectified")

_SIZES: Final = ("log_gain", "log_size", "log_ceiling", RECTIFIED["log_ceiling"])
PLACE_AND_SIZES: Final = ("start_ms", "log_width_ms", "log_floor_mv", *_SIZES)

_COMMON: Final = ("floor", "session")
_USED: Final = {
    NoiseKind.CONSTANT_CV: ("gain",),
    NoiseKind.MISSING: ("gain", "reliability"),
    NoiseKind.RECRUITMENT: ("recruitment",),
    NoiseKind.ALL_OR_NONE: ("switch",),
    NoiseKind.RECTIFIED: ("rectified",),
}


def latents_of(*blocks: str) -> BoolArray:
    """Which latents belong to some of `BLOCKS`, shape (d,)."""
    chosen = {latent for block in blocks for latent in BLOCKS[block]}
    return np.array([latent in chosen for latent in LATENTS])


def used_by(noise: IntArray, present: BoolArray, change: IntArray | None = None) -> BoolArray:
    """Which latents mean anything to particles of some kinds (...); all others are drawn from the prior, (..., d)."""
    used: BoolArray = _USED_BY_KIND[noise] | (present[..., np.newaxis] & _OF_PROFILE)
    return used if change is None else used | _USED_BY_CHANGE[change]


_OF_PROFILE: Final = latents_of(*PROFILE_BLOCKS)
_USED_BY_KIND: Final = np.stack(
    [
        *(latents_of(*_COMMON, *names) for names in _USED.values()),
        latents_of("session") | np.array([name == "log_boost" for name in LATENTS]),  # by levels
    ]
)
_BY_CHANGE: Final = {ChangeKind.NONE: (), ChangeKind.ENHANCEMENT: ("change",)}
_USED_BY_CHANGE: Final = np.stack([latents_of(*_BY_CHANGE.get(kind, ("changed", "change"))) for kind in ChangeKind])


KINDS: Final = ("shape", "noise", "present", "depressed", "change")
"""Of a particle: family of its profile, `NoiseKind`, whether it has an enhancement, and a depression, `ChangeKind`."""


class Latents(NamedTuple):
    """Particles of b people, of any model."""

    values: Singles  # of the model's latents, in their order, (b, p, d)
    kinds: IntArray  # whole numbers in the order of `KINDS`, (b, p, k)

    def of(self, name: str) -> Singles:
        """The values of one of `LATENTS`, (b, p)."""
        return self.values[..., LATENTS.index(name)]

    def with_kind(self, name: str, kind: IntArray) -> Latents:
        """The same with one of `KINDS` changed, shape (b, p)."""
        kinds = self.kinds.copy()
        kinds[..., KINDS.index(name)] = kind
        return self._replace(kinds=kinds)

    @property
    def shape(self) -> IntArray:
        """Kinds of the profiles, (b, p)."""
        return self.kinds[..., 0]

    @property
    def noise(self) -> IntArray:
        """Kinds of the noise, (b, p)."""
        return self.kinds[..., 1]

    @property
    def present(self) -> BoolArray:
        """Which particles have any facilitation, (b, p)."""
        return self.kinds[..., 2] > 0

    @property
    def depressed(self) -> BoolArray:
        """Which particles have a depression, (b, p)."""
        return self.kinds[..., 3] > 0

    @property
    def change(self) -> IntArray:
        """What changes in the session, (b, p)."""
        return self.kinds[..., 4]

    def taken(self, picks: IntArray) -> Latents:
        """Some of the particles of each person, by their numbers (b, s), fields of shape (b, s, ...)."""
        people, particles, _ = self.values.shape
        numbers = picks + particles * np.arange(people)[:, np.newaxis]  # of all people: one `take` is the fastest
        values, kinds = (each.reshape(people * particles, -1).take(numbers, axis=0) for each in self)
        return Latents(values, kinds)
