"""A model's prior and its moves as the engine has them, with its calls on particles, whose sizes are checked here."""

from __future__ import annotations

import ctypes
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from isiw.models.windows import CUTS, Runs
from isiw.native.engine import (
    COLUMNS,
    DOUBLE,
    FIELDS,
    FLAG,
    KINDS,
    LANES,
    MEANINGS,
    NATURAL,
    PLACE,
    SINGLE,
    UNKNOWN,
    WHOLE,
    Seeds,
    address,
    call,
)
from isiw.types import Array, BoolArray, FloatArray, IntArray, Singles

_MOST_OF_BLOCK: Final = 32
_MOST_BLOCKS: Final = 64
"""How many latents a block may have, and how many blocks a prior: `prior.h` has the same."""

_OF_A_CHANGE: Final = slice(MEANINGS - 6, MEANINGS - 4)
_OF_A_DEPRESSION: Final = slice(MEANINGS - 4, MEANINGS - 2)
"""Meanings of latents that moves write or compare: when and by how much, and the start and the log width."""

_LAST_KINDS: Final = np.array([3, 5, 1, 1, 4])
"""The last of each."""


class Crowd(NamedTuple):
    """Weighted particles of b people."""

    values: Singles  # of latents, (b, p, d)
    kinds: IntArray  # (b, p, k)
    log_weights: FloatArray  # (b, p)
    log_likelihood: Singles  # of the trials so far, (b, p)
    densities: Singles  # log densities of blocks, as far as known, (b, p, blocks)

    def copied(self) -> Crowd:
        """The same, to be changed."""
        return Crowd._make(each.copy() for each in self)

    def of_person(self, person: int) -> Crowd:
        """The particles of one person, fields of shape (1, p)."""
        return Crowd._make(each[person : person + 1] for each in self)


class Asking(NamedTuple):
    """About what ISIs are scored, and how."""

    of_window: bool = False  # about the window alone
    usual: Law | None = None  # the prior that particles are weighed by, where it is not their own
    stronger_pct_rmt: float = 0.0  # by how much the next pulse is stronger than the pairs'


class Tables(NamedTuple):
    """What the engine knows of a model's prior and of its moves."""

    at: IntArray  # of the latent of each of `MEANINGS`; d where the model has none, (m,)
    spreads: Array  # usual SD of each latent, (d,)
    first: IntArray  # latent of each block, (k,)
    size: IntArray  # how many latents it has, (k,)
    components: (
        IntArray  # of its mixture, (k,); 0 for a start, negative for start and width that may be those of a place
    )
    log_shares: Array  # of the components, less the logs of their SDs, (k, c)
    below: Array  # sums of the shares of earlier components, from the second on, (k, c)
    means: Array  # of the latents in each component, (d, c)
    sds: Array  # likewise, (d, c)
    per_sds: Array  # 1 / SD, as dividers are slow, (d, c)
    start_ms: Array  # knots of the density of a start, evenly spaced, (s,)
    density: Array  # at the knots, (s,)
    quantiles: Array  # probability of an earlier start, at the knots, (s,)
    places: Array  # log share less the logs of the SDs, mean and SD of the start, then of the log width, (l, 5)
    place_below: Array  # given a place, sums of the shares of earlier ones, (l,)
    place_share: float  # probability of all places
    apart: bool  # enhancement and depression may not overlap
    state_of: IntArray  # weights of the kinds in the number of a particle's state, (kinds,)
    shifted: BoolArray  # which latents a difference moves, by state and part, (states, parts, d)
    parts: Array  # sums of the probabilities of earlier parts, (parts - 1,)
    jumps: Array  # likewise of earlier jumps, (jumps - 1,)
    redrawn: BoolArray  # which latents each jump draws again, (jumps, d)
    renewed: BoolArray  # which kinds each jump draws again, (jumps, kinds)
    of_profile: BoolArray  # the jump concerns nothing but a profile, which without facilitation means nothing, (jumps,)
    kinds: Array  # sums of the probabilities of earlier values of each kind, (kinds, v - 1)
    grid_ms: Array  # ISIs of the space [ms], ascending, (t,)
    cells: Array  # where outcomes end, as shares of the range of the log MEP, (y + 1,)
    changed: int  # block of the latent that says when something changes; that of its size is the next
    rows: int  # of tables by facilitation
    fine: bool  # the ISIs are so close to each other that a window's peak is in all of their range


class _Struct(ctypes.Structure):
    """`Tables` of engine.h."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("latents", "blocks", "width", "knots", "place_count", "states")),
        *((name, ctypes.c_int64) for name in ("part_count", "jump_count", "kind_values", "points", "outcomes")),
        *((name, ctypes.c_void_p) for name in Tables._fields[: Tables._fields.index("place_share")]),
        ("place_share", ctypes.c_float),
        ("apart", ctypes.c_int32),
        *((name, ctypes.c_void_p) for name in Tables._fields[Tables._fields.index("state_of") : -3]),
        *((name, ctypes.c_int64) for name in Tables._fields[-3:]),
    ]


class Law:
    """A model's prior and its moves, as the engine has them.

    Args:
        tables: what is known of both.

    Raises:
        ValueError: tables that do not fit each other.
    """

    def __init__(self, tables: Tables) -> None:
        blocks, (latents, width), knots = len(tables.first), tables.means.shape, tables.start_ms
        # Latents that do not move are whole vectors of any processor.
        shifted = np.pad(tables.shifted, ((0, 0), (0, 0), (0, -latents % LANES)))
        tables = tables._replace(shifted=shifted)
        (states, parts, padded), jumps, (_, values) = tables.shifted.shape, len(tables.jumps) + 1, tables.kinds.shape
        shapes: dict[str, tuple[np.dtype[np.generic], tuple[int, ...]]] = {
            "at": (WHOLE, (MEANINGS,)),
            "spreads": (SINGLE, (latents,)),
            **dict.fromkeys(("first", "size", "components"), (WHOLE, (blocks,))),
            **dict.fromkeys(("log_shares", "below"), (SINGLE, (blocks, width))),
            **dict.fromkeys(("means", "sds", "per_sds"), (SINGLE, (latents, width))),
            **dict.fromkeys(("start_ms", "density", "quantiles"), (SINGLE, (len(knots),))),
            "places": (SINGLE, (len(tables.places), 5)),
            "place_below": (SINGLE, (len(tables.places),)),
            "state_of": (WHOLE, (KINDS,)),
            "shifted": (FLAG, (states, parts, padded)),
            "parts": (SINGLE, (parts - 1,)),
            "jumps": (SINGLE, (jumps - 1,)),
            "redrawn": (FLAG, (jumps, latents)),
            "renewed": (FLAG, (jumps, KINDS)),
            "of_profile": (FLAG, (jumps,)),
            "kinds": (SINGLE, (KINDS, values)),
            "grid_ms": (SINGLE, (len(tables.grid_ms),)),
            "cells": (SINGLE, (len(tables.cells),)),
        }
        with np.errstate(over="ignore"):
            self._arrays = {
                name: np.array(getattr(tables, name), dtype=dtype, order="C") for name, (dtype, _) in shapes.items()
            }
        sizes = {"latents": latents, "blocks": blocks, "width": width, "knots": len(knots)}
        sizes |= {"place_count": len(tables.places), "states": states, "part_count": parts, "jump_count": jumps}
        sizes |= {"points": len(tables.grid_ms), "outcomes": len(tables.cells) - 1, "kind_values": values}
        numbers = {name: getattr(tables, name) for name in ("place_share", "apart", "changed", "rows", "fine")}
        self._struct = _Struct(
            **sizes,
            **numbers,
            **{name: address(self._arrays[name], dtype, *shape) for name, (dtype, shape) in shapes.items()},
        )
        self.latents, self.blocks = latents, blocks
        self._require_indices(width, knots=len(knots), changed=tables.changed)

    def _require_indices(self, width: int, *, knots: int, changed: int) -> None:
        """Check what the engine reads arrays at."""
        first, size, components, at = (self._arrays[name] for name in ("first", "size", "components", "at"))
        within = (first >= 0).all() and (size >= 1).all() and (first + size <= self.latents).all()
        within = within and (np.abs(components) <= width).all() and ((at >= 0) & (at <= self.latents)).all()
        # A start and width of a place are the first two latents; a change, where there is one, is two blocks.
        within = within and (first[components < 0] == 0).all() and (size[components < 0] == 2).all()
        within = within and size.max() <= _MOST_OF_BLOCK and self.blocks <= _MOST_BLOCKS
        if self._arrays["renewed"][:, -1].any():
            within = within and 0 <= changed < self.blocks - 1 and (at[_OF_A_CHANGE] < self.latents).all()
        if self._struct.apart:
            within = within and (at[_OF_A_DEPRESSION] < self.latents).all()
        within = within and self._struct.points > 0 and self._struct.outcomes > 0 and self._struct.rows > 1
        if not within or knots < 2 or (_LAST_KINDS @ self._arrays["state_of"]) >= self._struct.states:
            raise ValueError("the tables of a prior point beyond themselves")

    @cached_property
    def _at(self) -> int:
        return ctypes.addressof(self._struct)

    def meanings(self, values: Singles, kinds: IntArray, trials: int) -> Singles:
        """Fields of particles after so many trials, or with their changes if it is negative, (b, p, fields)."""
        people, particles = self._require_particles(values, kinds)
        found = np.zeros((people, particles, FIELDS), dtype=SINGLE)
        arrays = self._values(values, kinds)
        call("meanings", self._at, people, particles, *arrays, trials, address(found, SINGLE, *found.shape))
        return found

    def usual_weights(self, usual: Law, crowd: Crowd) -> FloatArray:
        """Log weights of particles under another prior, which ISIs are chosen with, (b, p)."""
        of, (values, kinds, weights, _, known) = self._crowd(crowd)
        found = np.empty(of, dtype=DOUBLE)
        arrays = values, kinds, known, weights, address(found, DOUBLE, *of)
        call("usual_weights", self._at, self._other(usual), *of, *arrays)
        return found

    def _other(self, usual: Law) -> int:
        """Where another prior of the same particles is."""
        if usual.latents != self.latents or usual._struct.kind_values != self._struct.kind_values:
            raise ValueError("the other prior is of other latents or kinds")
        return usual._at

    def ask(self, crowd: Crowd, isi_ms: Singles, size: int, trials: int, how: Asking) -> Singles:
        """How much the next trial, after so many, is expected to tell at some ISIs [ms] (t,), (b, t).

        Args:
            crowd: the particles.
            isi_ms: the ISIs.
            size: how many particles of equal weight stand for them.
            trials: how many came before.
            how: about what, by which prior, and at which intensity.
        """
        of, (values, kinds, weights, _, known) = self._crowd(crowd, least=1)
        if size < 1:
            raise ValueError("no particles stand for others")
        isis, found = len(isi_ms), np.empty((of[0], len(isi_ms)), dtype=SINGLE)
        arrays = values, kinds, known, weights, address(isi_ms, SINGLE, isis), address(found, SINGLE, of[0], isis)
        usual = None if how.usual is None else self._other(how.usual)
        sizes = *of, size, trials, how.of_window, how.stronger_pct_rmt, isis
        call("ask", self._at, usual, *sizes, *arrays)
        return found

    def estimate(self, crowd: Crowd, size: int, trials: int) -> tuple[IntArray, Runs]:
        """Particles of equal weight that stand for one person's after so many trials: numbers (1, s), and windows."""
        (people, particles), given = self._crowd(crowd, least=1)
        if people != 1:
            raise ValueError("one person is estimated at a time")
        points, picks, runs = self._struct.points, np.empty((1, size), dtype=WHOLE), np.empty((size, 2, 2), dtype=PLACE)
        best, f1 = np.empty(points, dtype=FLAG), np.empty(1, dtype=DOUBLE)
        found = address(picks, WHOLE, 1, size), address(runs, PLACE, size, 2, 2), address(best, FLAG, points)
        arrays = *given[:3], address(CUTS, DOUBLE, len(CUTS)), *found, address(f1, DOUBLE, 1)
        call("estimate", self._at, particles, size, trials, len(CUTS), *arrays)
        return picks, Runs(runs, points, (best, f1.item()))

    def learn(self, columns: Singles, min_ess: float, sweeps: tuple[int, int], dice: Seeds, crowd: Crowd) -> FloatArray:
        """Let particles learn the last of the trials, in place; what was found on the way, (b, 9).

        Args:
            columns: the trials, (b, n, columns).
            min_ess: they are resampled where their effective sample size, as a share, is below it.
            sweeps: how often they move where they were kept, and where they were resampled.
            dice: seeds, which move on, (b,).
            crowd: the particles, which change.

        Returns:
            Log likelihood of the trial, effective sample size before resampling as a share, shifts, those that were
            accepted, jumps, and those that were accepted; the probabilities, before the trial, of amplitudes below its
            lower and its upper end times the weights of particles that predict it, and these weights, summed, (b, 9).
        """
        (people, particles), arrays = self._crowd(crowd, least=2)
        trials, found = columns.shape[1], np.empty((people, 9), dtype=DOUBLE)
        if not trials:
            raise ValueError("particles learn from a trial")
        told = address(columns, SINGLE, people, trials, COLUMNS)
        arrays = address(dice, NATURAL, people), *arrays, address(found, DOUBLE, people, 9)
        call("learn", self._at, people, particles, trials, told, min_ess, *sweeps, *arrays)
        return found

    def represent(self, crowd: Crowd, size: int, trials: int) -> tuple[IntArray, Singles]:
        """Equally weighted particles that stand for weighted ones: numbers (b, s), and fields after so many trials."""
        (people, particles), given = self._crowd(crowd, least=1)
        picks, fields = np.empty((people, size), dtype=WHOLE), np.zeros((people, size, FIELDS), dtype=SINGLE)
        arrays = *given[:3], address(picks, WHOLE, people, size), address(fields, SINGLE, *fields.shape)
        call("represent", self._at, people, particles, size, trials, *arrays)
        return picks, fields

    def _crowd(self, crowd: Crowd, least: int = 0) -> tuple[tuple[int, int], tuple[int, ...]]:
        """How many people and particles there are, and where each array of a crowd is; raise with less than needed."""
        of = self._require_particles(crowd.values, crowd.kinds)
        if of[1] < least:
            raise ValueError(f"{least} particles are needed, since they stand for others, or move by their differences")
        values, kinds = self._values(crowd.values, crowd.kinds)
        weights, likelihood = address(crowd.log_weights, DOUBLE, *of), address(crowd.log_likelihood, SINGLE, *of)
        return of, (values, kinds, weights, likelihood, address(crowd.densities, SINGLE, *of, self.blocks + 1))

    def _values(self, values: Singles, kinds: IntArray) -> tuple[int, int]:
        return address(values, SINGLE, *values.shape), address(kinds, WHOLE, *kinds.shape)

    def nothing_known(self, people: int, particles: int) -> Singles:
        """Log densities of blocks of which none was worked out yet, (b, p, blocks)."""
        return np.full((people, particles, self.blocks + 1), UNKNOWN)

    def draws(self, particles: int, seeds: Seeds) -> tuple[Singles, IntArray]:
        """So many particles of the prior of each person: latents (b, p, d), and kinds (b, p, k).

        Args:
            particles: how many a person.
            seeds: of each person, (b,) whole numbers of 64 bits without a sign.
        """
        people = len(seeds)
        values = np.zeros((people, particles, self.latents), dtype=SINGLE)
        kinds = np.empty((people, particles, KINDS), dtype=WHOLE)
        arrays = self._values(values, kinds)
        call("draws", self._at, people, particles, address(seeds, NATURAL, people), *arrays)
        return values, kinds

    def _require_particles(self, values: Singles, kinds: IntArray) -> tuple[int, int]:
        people, particles, latents = values.shape
        if latents != self.latents or kinds.shape != (people, particles, KINDS):
            raise ValueError("these are no particles of this prior")
        return people, particles
