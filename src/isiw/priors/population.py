"""A hierarchical law of a lab's people, learnt from the posterior particles of their sessions.

A person's likelihood under a law is the mean over their particles of its density over that of their prior, so that no
session is run again. In each block of latents a person is of the lab's normal law, or an outsider of that prior, who
does not bend it. Gibbs sampling gives the next person's law, wider the fewer people there are.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from typing import Final, NamedTuple, TypeAlias, TypeVar

import numpy as np

from isiw.design import DesignSpace
from isiw.models.particles import ParticlePosterior
from isiw.models.particles.jumps import law_of
from isiw.models.particles.latents import latents_of, used_by
from isiw.models.particles.laws import Floor, Gain, Muscle, NoiseShares
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.places import Place
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ShapeShares
from isiw.models.shared.scales import Scale
from isiw.types import BoolArray, Conditioning, FloatArray, IntArray, Reference

LATENT_BLOCKS: Final = {"place": ("start", "width"), "floor": ("floor",), "gain": ("gain",), "muscle": ("recruitment",)}
"""What sessions teach laws of, and the blocks of latents in each."""

_OF_PULSES: Final = {"floor", "muscle"}
"""What pulses of TMS alone teach."""

Component = TypeVar("Component", Place, Floor, Gain, Muscle)
_Shares = TypeVar("_Shares", ShapeShares, NoiseShares)


def columns(name: str) -> list[int]:
    """The latents that one of `LATENT_BLOCKS` is about, as columns of a particle's values."""
    return np.flatnonzero(latents_of(*LATENT_BLOCKS[name])).tolist()


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


SWEEPS: Final = 1200
BURN_IN: Final = 200

P_OUTSIDER: Final = 0.15
"""How often, in one block, a person is not one of the lab's."""

SD_WEIGHT: Final = 3.0
"""As how many people the usual spread counts in the law's."""

KINDS_WEIGHT: Final = 1.0
"""As how many people the usual shares of kinds count: of one muscle and one rig, most people are of one kind."""


class LatentBlock(NamedTuple):
    """One block of latents of the people's particles."""

    values: FloatArray  # (n, i, d)
    log_density: FloatArray  # under the prior that the particles were drawn with, (n, i)
    used: BoolArray  # they mean anything to the particle, (n, i)


class HyperPrior(NamedTuple):
    """The prior of a block's law, fields of shape (d,)."""

    mean: FloatArray
    mean_sd: FloatArray  # from lab to lab
    sd: FloatArray  # the usual one over a lab's people


@dataclass(frozen=True, eq=False)
class People:
    """Equally weighted particles of n people, i of each: latents that have a law, and discrete ones, (n, i)."""

    blocks: Mapping[str, LatentBlock]
    kinds: Mapping[str, IntArray]


@dataclass(frozen=True, eq=False)
class Law:
    """The posterior predictive of one block, shape (d,), and the expected number of people that it was learnt from."""

    mean: FloatArray
    sd: FloatArray
    members: float


@dataclass(frozen=True, eq=False)
class Population:
    """The laws of a lab's people by block, and the shares of the kinds by discrete latent."""

    laws: Mapping[str, Law]
    shares: Mapping[str, FloatArray]


_Normal: TypeAlias = tuple[FloatArray, FloatArray]


def learnt(
    people: People, hyper: Mapping[str, HyperPrior], usual: Mapping[str, FloatArray], rng: np.random.Generator
) -> Population:
    """Learn a law from people."""
    laws = {name: (np.median(block.values, axis=(0, 1)), hyper[name].sd) for name, block in people.blocks.items()}
    shares = dict(usual)
    drawn: dict[str, list[tuple[FloatArray, FloatArray, int]]] = {name: [] for name in laws}
    kept_shares: dict[str, list[FloatArray]] = {name: [] for name in shares}
    for sweep in range(SWEEPS):
        picks = _picked(people, laws, shares, usual, rng)
        for name, block in people.blocks.items():
            members = _members(block, laws[name], picks, rng)
            laws[name] = _drawn_law(members, laws[name], hyper[name], rng)
            if sweep >= BURN_IN:
                drawn[name].append((*laws[name], len(members)))
        for name, kinds in people.kinds.items():
            chosen = np.take_along_axis(kinds, picks[:, None], axis=1)[:, 0]
            counts = np.bincount(chosen[chosen >= 0], minlength=len(usual[name]))
            shares[name] = rng.dirichlet(KINDS_WEIGHT * usual[name] + counts)
            if sweep >= BURN_IN:
                kept_shares[name].append(shares[name])
    predictive = {name: _predictive(draws) for name, draws in drawn.items()}
    return Population(predictive, {name: np.mean(kept, axis=0) for name, kept in kept_shares.items()})


def _log_ratio(block: LatentBlock, law: _Normal) -> FloatArray:
    """Log density under the law over that under the prior, times the share of the lab's people, by particle."""
    mean, sd = law
    z = (block.values - mean) / sd
    log_law = -0.5 * (z**2).sum(-1) - np.log(sd).sum() - 0.5 * np.log(2 * np.pi) * len(mean)
    ratio: FloatArray = log_law - block.log_density + np.log(1 - P_OUTSIDER)
    return ratio


def _picked(
    people: People,
    laws: Mapping[str, _Normal],
    shares: Mapping[str, FloatArray],
    usual: Mapping[str, FloatArray],
    rng: np.random.Generator,
) -> IntArray:
    """A particle of each person under the laws, memberships integrated out, shape (n,)."""
    # Blocks that mean nothing to a particle, and kinds of -1, weigh as in the prior.
    log_weight = sum(
        np.where(block.used, np.logaddexp(np.log(P_OUTSIDER), _log_ratio(block, laws[name])), 0.0)
        for name, block in people.blocks.items()
    )
    for name, kinds in people.kinds.items():
        log_share = np.append(np.log(shares[name] / usual[name]), 0.0)
        log_weight = log_weight + log_share[kinds]
    picks: IntArray = (log_weight + rng.gumbel(size=np.shape(log_weight))).argmax(-1)
    return picks


def _members(block: LatentBlock, law: _Normal, picks: IntArray, rng: np.random.Generator) -> FloatArray:
    """The picked particles of those who are of the lab's law in this block, shape (m, d)."""
    at = np.arange(len(picks)), picks
    picked = LatentBlock(block.values[at], block.log_density[at], block.used[at])
    log_odds = _log_ratio(picked, law) - np.log(P_OUTSIDER)
    members: FloatArray = picked.values[picked.used & (rng.logistic(size=len(picks)) < log_odds)]
    return members


def _drawn_law(members: FloatArray, law: _Normal, hyper: HyperPrior, rng: np.random.Generator) -> _Normal:
    """A law given its members: the mean given the SD, and the SD given the mean."""
    count, (_, sd) = len(members), law
    precision = hyper.mean_sd**-2 + count * sd**-2
    centre = (hyper.mean * hyper.mean_sd**-2 + members.sum(0) * sd**-2) / precision
    mean = centre + rng.standard_normal(len(centre)) / np.sqrt(precision)
    squares = SD_WEIGHT * hyper.sd**2 + ((members - mean) ** 2).sum(0)
    return mean, np.sqrt(squares / rng.chisquare(SD_WEIGHT + count, size=len(centre)))


def _predictive(draws: list[tuple[FloatArray, FloatArray, int]]) -> Law:
    """Mean and spread of the next person of the lab; the spread is of the middle, as few people have heavy tails."""
    means, sds, members = (np.array(column) for column in zip(*draws, strict=True))
    return Law(means.mean(0), np.sqrt(means.var(0) + np.median(sds, axis=0) ** 2), float(members.mean()))


PARTICLES: Final = 500
HYPER_DRAWS: Final = 20_000

WITHIN_A_LAB: Final = 0.5
"""The share of the variance between usual people that is between people of one lab."""


def people_of(posteriors: Sequence[ParticlePosterior]) -> People:
    """Equally weighted particles of some people."""
    blocks, kinds = zip(*map(_person, posteriors), strict=True)
    stacked = {
        name: LatentBlock(*map(np.stack, zip(*(own[name] for own in blocks), strict=True))) for name in LATENT_BLOCKS
    }
    return People(stacked, {name: np.stack([own[name] for own in kinds]) for name in kinds[0]})


def _person(posterior: ParticlePosterior) -> tuple[dict[str, LatentBlock], dict[str, IntArray]]:
    """The blocks of one person's particles by name, and the discrete latents: without a pair floor and curve alone."""
    latents, _ = posterior.swarm.picked(posterior.law, PARTICLES)
    densities = posterior.model.prior.log_densities(latents.values, posterior.space)
    values, used = latents.values[0].astype(float), used_by(latents.noise, latents.present)[0]
    blocks = {
        name: LatentBlock(
            values[:, columns(name)],
            densities["place" if name == "place" else LATENT_BLOCKS[name][0]][0],
            np.all(used[:, columns(name)], axis=-1) & (posterior.pairs > 0 or name in _OF_PULSES),
        )
        for name in LATENT_BLOCKS
    }
    shape = np.where(latents.present, latents.shape, -1)
    noise = np.where(latents.noise == NoiseKind.BY_LEVELS, -1, latents.noise)  # of which people have no share
    kinds = {"window": latents.present.astype(np.int64), "shape": shape, "noise": noise}
    return blocks, {name: kind[0] if posterior.pairs else np.full_like(kind[0], -1) for name, kind in kinds.items()}


def drawn_from(prior: Prior, space: DesignSpace, size: int) -> FloatArray:
    """Latents of so many people in general, shape (size, d)."""
    values, _ = law_of(prior, space).draws(size, np.zeros(1, dtype=np.uint64))
    drawn: FloatArray = values[0].astype(float)
    return drawn


def hyper_prior(prior: Prior, space: DesignSpace) -> dict[str, HyperPrior]:
    """Of the variance between usual people, one part is between labs, and the other between the people of a lab."""
    drawn = drawn_from(prior, space, HYPER_DRAWS)
    sd = np.sqrt(WITHIN_A_LAB) * prior.spreads
    mean_sd = np.sqrt(np.maximum(drawn.var(0) - sd**2, sd**2))  # all else by which people in general differ
    return {
        name: HyperPrior(drawn[:, own].mean(0), mean_sd[own], sd[own])
        for name, own in ((name, columns(name)) for name in LATENT_BLOCKS)
    }


def usual_shares(prior: Prior) -> dict[str, FloatArray]:
    """Shares of the kinds of people in general."""
    p_window = prior.profile.p_window
    kinds = {
        "window": (1.0 - p_window, p_window),
        "shape": astuple(prior.profile.shapes),
        "noise": astuple(prior.noise),
    }
    return {name: np.array(shares) for name, shares in kinds.items()}
