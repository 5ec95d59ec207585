"""The latents of a particle: a vector of numbers of one meaning each, in blocks by what they are about."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Final, NamedTuple

from isiw.lazy import torch
from isiw.models.particles.changes import ChangeKind
from isiw.models.particles.noise import NoiseKind
from isiw.models.protocol import Tensor

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


@cache
def latents_of(*blocks: str, device: torch.device) -> Tensor:
    """Which latents belong to some of `BLOCKS`, shape (d,); one tensor for all callers, who leave it as it is."""
    chosen = {latent for block in blocks for latent in BLOCKS[block]}
    return torch.tensor([latent in chosen for latent in LATENTS], device=device)


def used_by(noise: Tensor, present: Tensor, change: Tensor | None = None) -> Tensor:
    """Which latents mean anything to particles of some kinds; all others are as the prior draws them."""
    of_profile = latents_of(*PROFILE_BLOCKS, device=noise.device)
    used = _used_by_kind(noise.device)[noise] | (present.unsqueeze(-1) & of_profile)
    return used if change is None else used | _used_by_change(noise.device)[change]


@cache
def _used_by_kind(device: torch.device) -> Tensor:
    return torch.stack([latents_of(*_COMMON, *_USED[kind], device=device) for kind in NoiseKind])


@cache
def _used_by_change(device: torch.device) -> Tensor:
    used = {ChangeKind.NONE: (), ChangeKind.ENHANCEMENT: ("change",)}
    return torch.stack([latents_of(*used.get(kind, ("changed", "change")), device=device) for kind in ChangeKind])


KINDS: Final = ("shape", "noise", "present", "depressed", "change")
"""What a particle is of: `ShapeKind`, `NoiseKind`, whether there is an enhancement, a depression, and `ChangeKind`."""


HYPOTHESES: Final = 4 * len(ChangeKind)
"""How many there are: a window or none, a depression or none, and what changes."""


class Latents(NamedTuple):
    """Particles of b people, of any model."""

    values: Tensor  # of the model's latents, in their order, (b, p, d)
    kinds: Tensor  # whole numbers in the order of `KINDS`, (b, p, k)
    log_blocks: Tensor | None = None  # known log densities of blocks, under the prior they moved under, (b, p, n)

    @classmethod
    def of(cls, values: Tensor, **kinds: Tensor | int) -> Latents:
        """Particles from some of their kinds by name, each (b, p) or the same for all; the others are 0."""
        like = values[..., 0].long()
        columns = [torch.as_tensor(kinds.get(name, 0)).to(like).expand_as(like) for name in KINDS]
        return cls(values, torch.stack(columns, dim=-1))

    def each(self, made: Callable[..., Tensor], *others: Latents) -> Latents:
        """Values and kinds made in one way of those of these particles, and of others; without densities of blocks."""
        particles = self, *others
        return Latents(made(*(p.values for p in particles)), made(*(p.kinds for p in particles)))

    def with_kind(self, name: str, kind: Tensor) -> Latents:
        """The same with one of `KINDS` changed, shape (b, p)."""
        kinds = self.kinds.clone()
        kinds[..., KINDS.index(name)] = kind
        return Latents(self.values, kinds)

    @property
    def shape(self) -> Tensor:
        """Kinds of the profiles, (b, p)."""
        return self.kinds[..., 0]

    @property
    def noise(self) -> Tensor:
        """Kinds of the noise, (b, p)."""
        return self.kinds[..., 1]

    @property
    def present(self) -> Tensor:
        """Which particles have any facilitation, (b, p)."""
        return self.kinds[..., 2] > 0

    @property
    def depressed(self) -> Tensor:
        """Which particles have a depression, (b, p)."""
        return self.kinds[..., 3] > 0

    @property
    def change(self) -> Tensor:
        """What changes in the session, (b, p)."""
        return self.kinds[..., 4]

    @property
    def hypothesis(self) -> Tensor:
        """Which of `HYPOTHESES` each particle is of, (b, p)."""
        return len(ChangeKind) * (2 * self.kinds[..., 2] + self.kinds[..., 3]) + self.change
