"""Posterior particles of logged people, as the hierarchical law takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import Final, NamedTuple

import numpy as np

from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.particles import ParticlePosterior
from isiw.models.particles.latents import used_by
from isiw.models.particles.prior import Prior
from isiw.priors.components import LATENT_BLOCKS, columns
from isiw.priors.population import Block, HyperPrior, People
from isiw.types import FloatArray, IntArray

PARTICLES: Final = 500
HYPER_DRAWS: Final = 20_000

WITHIN_A_LAB: Final = 0.5
"""The share of the variance between usual people that is between people of one lab."""


class _Person(NamedTuple):
    blocks: dict[str, Block]
    kinds: dict[str, IntArray]


def people_of(posteriors: Sequence[ParticlePosterior]) -> People:
    """Equally weighted particles of some people."""
    each = [_person(posterior) for posterior in posteriors]
    blocks = {name: Block(*map(np.stack, zip(*(p.blocks[name] for p in each), strict=True))) for name in each[0].blocks}
    return People(blocks, {name: np.stack([person.kinds[name] for person in each]) for name in each[0].kinds})


def _person(posterior: ParticlePosterior) -> _Person:
    latents = posterior.swarm.picked(PARTICLES)
    densities = posterior.model.prior.log_densities(latents.values, posterior.space)
    values, used = latents.values[0].double().numpy(), used_by(latents.noise, latents.present)[0].numpy()
    blocks = {
        name: Block(
            values[:, columns(name)],
            densities["place" if name == "place" else LATENT_BLOCKS[name][0]][0].double().numpy(),
            np.all(used[:, columns(name)], axis=-1),
        )
        for name in LATENT_BLOCKS
    }
    shape = torch.where(latents.present, latents.shape, -1)
    kinds = {"window": latents.present.long(), "shape": shape, "noise": latents.noise}
    return _Person(blocks, {name: kind[0].numpy() for name, kind in kinds.items()})


def hyper_prior(prior: Prior, space: DesignSpace) -> dict[str, HyperPrior]:
    """Of the variance between usual people, one part is between labs, and the other between the people of a lab."""
    drawn = prior.sample(1, HYPER_DRAWS, torch.Generator().manual_seed(0), space).values[0].double().numpy()
    sd = np.sqrt(WITHIN_A_LAB) * prior.spreads.double().numpy()
    mean_sd = np.sqrt(np.maximum(drawn.var(0) - sd**2, sd**2))  # all else by which people in general differ
    return {
        name: HyperPrior(drawn[:, own].mean(0), mean_sd[own], sd[own])
        for name, own in ((name, columns(name)) for name in LATENT_BLOCKS)
    }


def usual_shares(prior: Prior) -> dict[str, FloatArray]:
    """How often the kinds of people come in general."""
    p_window = prior.profile.p_window
    kinds = {
        "window": (1.0 - p_window, p_window),
        "shape": astuple(prior.profile.shapes),
        "noise": astuple(prior.noise),
    }
    return {name: np.array(shares) for name, shares in kinds.items()}
