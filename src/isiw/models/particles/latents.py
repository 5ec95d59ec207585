"""The latents of a particle: a vector of numbers of one meaning each, in blocks by what they are about."""

from __future__ import annotations

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


class Latents(NamedTuple):
    """Particles of b people."""

    values: Tensor  # in the order of `LATENTS`, (b, p, d)
    shape: Tensor  # one of `ShapeKind`, (b, p)
    noise: Tensor  # one of `NoiseKind`, (b, p)
    present: Tensor  # there is any facilitation, (b, p)
    change: Tensor  # one of `ChangeKind`, (b, p)
