"""From a model's prior to the tables that the engine knows it by."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from isiw.design import DesignSpace
from isiw.models.particles.compiled import Tables
from isiw.models.particles.mixture import Mixture
from isiw.models.particles.predictions import CELLS, FINE_MS
from isiw.models.shared.draws import LEVELS
from isiw.models.shared.start import StartPrior
from isiw.models.windows import grid_of
from isiw.native.engine import MEANINGS
from isiw.types import FloatArray, Singles

PART_PROBABILITY: Final = (0.25, 0.30, 0.25, 0.20)
"""How often a difference moves all latents, those of the profile alone, those of the response alone, and place, floor
and size alone: particles whose floor is far off have another window and gain as well, and leave that with all three."""

_NOT_REACHED: Final = 2.0
"""No uniform draw is above it."""

_NO_SHARE: Final = -1e30
"""Log share of a component that is missing."""


def prior_tables(
    space: DesignSpace,
    start: StartPrior,
    mixtures: Sequence[Mixture],
    *,
    starts: int,
    places: tuple[float, Mixture] | None,
    at: Sequence[int],
    spreads: FloatArray,
    moves: dict[str, Any],
) -> Tables:
    """The tables of a prior."""
    latents, width = len(spreads), max(len(mixture.shares) for mixture in mixtures)
    sizes = [mixture.means.shape[-1] for mixture in mixtures]
    first = [*range(starts), *(starts + np.cumsum([0, *sizes[:-1]]))]
    size, components = [1] * starts + sizes, [0] * starts + [len(mixture.shares) for mixture in mixtures]
    log_shares, below = (np.full((len(first), width), filled, dtype=np.float32) for filled in (_NO_SHARE, _NOT_REACHED))
    means, sds = np.zeros((latents, width), dtype=np.float32), np.ones((latents, width), dtype=np.float32)
    for block, mixture in enumerate(mixtures, start=starts):
        count, span = components[block], slice(first[block], first[block] + size[block])
        log_shares[block, :count] = _log(mixture.shares) - np.log(mixture.sds).sum(-1)
        below[block, : count - 1] = mixture.shares.cumsum()[:-1]
        with np.errstate(over="ignore"):  # laws of absurd size become infinite in single precision
            means[span, :count], sds[span, :count] = mixture.means.T, mixture.sds.T
    if places is not None:
        # Start and width are one block: anywhere, or in one of the places; only here do the constants matter.
        log_shares[1] += math.log1p(-places[0]) - 0.5 * math.log(2.0 * math.pi)
        first, size, components = [0, *first[2:]], [2, *size[2:]], [-components[1], *components[2:]]
        log_shares, below = log_shares[1:], below[1:]
    where = np.full(MEANINGS, latents)
    where[: len(at)] = [latents if index < 0 else index for index in at]
    most_kinds = max(map(len, moves["kinds"]))
    law: dict[str, Any] = {"at": where, "spreads": spreads, "log_shares": log_shares, "below": below}
    law |= {"means": means, "sds": sds, "per_sds": 1.0 / sds}
    law |= {"first": np.array(first), "size": np.array(size), "components": np.array(components)}
    law |= dict(zip(("start_ms", "density", "quantiles"), start.knots(space)[:3], strict=True)) | _of_places(places)
    law |= {"grid_ms": grid_of(space), "cells": CELLS, "rows": LEVELS, "fine": space.step_ms <= FINE_MS}
    made = moves | {"changed": int(np.searchsorted(law["first"], where[27]))}
    made |= {"parts": _edges(PART_PROBABILITY, len(PART_PROBABILITY))}
    made |= {"jumps": _edges(moves["jumps"], len(moves["jumps"]))}
    made |= {"kinds": np.stack([_edges(shares, most_kinds) for shares in moves["kinds"]])}
    return Tables(**law, **made)


def _of_places(places: tuple[float, Mixture] | None) -> dict[str, Any]:
    if places is None:
        nothing = np.zeros((0, 5), dtype=np.float32)
        return {"places": nothing, "place_share": 0.0, "place_below": np.zeros(0, dtype=np.float32)}
    share, law = places
    scale = math.log(share) + _log(law.shares) - np.log(law.sds).sum(-1) - math.log(2.0 * math.pi)
    table = np.stack([scale, law.means[:, 0], law.sds[:, 0], law.means[:, 1], law.sds[:, 1]], axis=-1)
    return {"places": table, "place_share": share, "place_below": law.shares.cumsum()}


def _log(shares: FloatArray) -> FloatArray:
    """Logs of shares; of none `_NO_SHARE`."""
    return np.where(shares > 0, np.log(np.maximum(shares, 1e-300)), _NO_SHARE)


def _edges(shares: Sequence[float], values: int) -> Singles:
    """Sums of the probabilities of earlier alternatives, from the second on, for so many of them."""
    edges = np.full(values - 1, _NOT_REACHED, dtype=np.float32)
    edges[: len(shares) - 1] = np.cumsum(shares)[:-1]
    return edges
