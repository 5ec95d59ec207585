"""Normal laws of latents as components of the particle model's prior, and how they stand beside those that it has."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import astuple, replace
from typing import Final, TypeVar

from isiw.lazy import torch
from isiw.models.particles.latents import latents_of
from isiw.models.particles.laws import Floor, Gain, Muscle, NoiseShares
from isiw.models.particles.places import Place
from isiw.models.particles.profile import ShapeShares
from isiw.models.shared.scales import Scale
from isiw.types import Conditioning, FloatArray, Reference

LATENT_BLOCKS: Final = {"place": ("start", "width"), "floor": ("floor",), "gain": ("gain",), "muscle": ("recruitment",)}
"""What sessions teach laws of, and the blocks of latents in each."""

Component = TypeVar("Component", Place, Floor, Gain, Muscle)
_Shares = TypeVar("_Shares", ShapeShares, NoiseShares)


def columns(name: str) -> list[int]:
    """The latents that one of `LATENT_BLOCKS` is about, as columns of a particle's values."""
    mask = latents_of(*LATENT_BLOCKS[name], device=torch.device("cpu"))
    return [int(column) for column in torch.nonzero(mask)[:, 0]]


def place(
    share: float,
    mean: FloatArray,
    sd: FloatArray,
    reference: Reference,
    hit_delay_ms: tuple[float, float] | None = None,
    conditioning: Conditioning = "tap",
) -> Place:
    """A law of start and log width."""
    (width,) = _log_scales(mean[1:], sd[1:])
    return Place(share, Scale(float(mean[0]), float(sd[0])), width, reference, hit_delay_ms, conditioning)


def floor(share: float, mean: FloatArray, sd: FloatArray) -> Floor:
    """A law of the floor."""
    return Floor(share, *_log_scales(mean, sd))


def gain(share: float, mean: FloatArray, sd: FloatArray) -> Gain:
    """A law of the gain."""
    return Gain(share, *_log_scales(mean, sd))


def muscle(share: float, mean: FloatArray, sd: FloatArray, name: str) -> Muscle:
    """A law of recruitment curves."""
    ratio, slope, input_sd, sigma_y, boost = _log_scales(mean[:-1], sd[:-1])
    return Muscle(name, share, ratio, slope, input_sd, sigma_y, boost, Scale(float(mean[-1]), float(sd[-1])))


def _log_scales(mean: FloatArray, sd: FloatArray) -> list[Scale]:
    return [Scale(math.exp(m), s) for m, s in zip(mean.tolist(), sd.tolist(), strict=True)]


def beside(usual: tuple[Component, ...], learnt: Sequence[Component]) -> tuple[Component, ...]:
    """Components that make room for further ones."""
    left = max(0.0, 1.0 - math.fsum(component.share for component in learnt))  # shares of 1 may round to more
    kept: list[Component] = [replace(component, share=left * component.share) for component in usual]
    return tuple(itertools.chain(kept, learnt))


def mixed(learnt: float, usual: float, share: float) -> float:
    """A probability as learnt, with a share of the usual one."""
    return (1.0 - share) * learnt + share * usual


def mixed_shares(learnt: Sequence[float], usual: _Shares, share: float) -> _Shares:
    """Shares of kinds as learnt, with a share of the usual ones."""
    pairs = zip(learnt, astuple(usual), strict=True)
    return type(usual)(*(mixed(float(new), old, share) for new, old in pairs))
