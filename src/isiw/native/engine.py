"""Calls of the compiled engine on arrays, whose sizes are checked here: what it writes stays within them."""

from __future__ import annotations

import ctypes
from functools import cached_property
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from isiw.native.library import call
from isiw.types import Array, BoolArray, FloatArray, IntArray, Singles

FIELDS: Final = 27
"""Of a particle; their names and order are those of `isiw.models.particles.records`."""

COLUMNS: Final = 12
"""Of a trial, likewise."""

KINDS: Final = 5
"""Of a particle: its profile's shape, its noise, whether there is an enhancement, and a depression, and its change."""

MEANINGS: Final = 32
"""Latents that mean anything: those of the default in their order, then three of a depression."""

_LAST_KINDS: Final = np.array([3, 4, 1, 1, 4])
"""The last of each."""

LANES: Final = 16
"""Components of mixtures are padded to whole vectors of any processor."""

UNKNOWN: Final = np.float32(1e30)
"""In place of the log density of a block that was not worked out yet."""

_f, _d = np.dtype(np.float32), np.dtype(np.float64)
_i, _u, _b = np.dtype(np.int64), np.dtype(np.uint64), np.dtype(np.bool_)

Seeds: TypeAlias = NDArray[np.uint64]


class Crowd(NamedTuple):
    """Weighted particles of b people."""

    values: Singles  # of latents, (b, p, d)
    kinds: IntArray  # (b, p, k)
    log_weights: FloatArray  # (b, p)
    log_likelihood: Singles  # of the trials so far, (b, p)
    densities: Singles  # log densities of blocks, as far as known, (b, p, blocks)

    def copied(self) -> Crowd:
        """The same, to be changed."""
        log_weights, log_likelihood = self.log_weights.copy(), self.log_likelihood.copy()
        return Crowd(self.values.copy(), self.kinds.copy(), log_weights, log_likelihood, self.densities.copy())


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
    changed: int  # block of the latent that says when something changes; that of its size is the next


class _Struct(ctypes.Structure):
    """`Tables` of engine.h."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("latents", "blocks", "width", "knots", "place_count")),
        *((name, ctypes.c_int64) for name in ("states", "part_count", "jump_count", "kind_values")),
        *((name, ctypes.c_void_p) for name in Tables._fields[: Tables._fields.index("place_share")]),
        ("place_share", ctypes.c_float),
        ("apart", ctypes.c_int32),
        *((name, ctypes.c_void_p) for name in Tables._fields[Tables._fields.index("state_of") : -1]),
        ("changed", ctypes.c_int64),
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
        (states, parts, _), jumps, (_, values) = tables.shifted.shape, len(tables.jumps) + 1, tables.kinds.shape
        shapes: dict[str, tuple[np.dtype[np.generic], tuple[int, ...]]] = {
            "at": (_i, (MEANINGS,)),
            "spreads": (_f, (latents,)),
            **dict.fromkeys(("first", "size", "components"), (_i, (blocks,))),
            **dict.fromkeys(("log_shares", "below"), (_f, (blocks, width))),
            **dict.fromkeys(("means", "sds", "per_sds"), (_f, (latents, width))),
            **dict.fromkeys(("start_ms", "density", "quantiles"), (_f, (len(knots),))),
            "places": (_f, (len(tables.places), 5)),
            "place_below": (_f, (len(tables.places),)),
            "state_of": (_i, (KINDS,)),
            "shifted": (_b, (states, parts, latents)),
            "parts": (_f, (parts - 1,)),
            "jumps": (_f, (jumps - 1,)),
            "redrawn": (_b, (jumps, latents)),
            "renewed": (_b, (jumps, KINDS)),
            "of_profile": (_b, (jumps,)),
            "kinds": (_f, (KINDS, values)),
        }
        self._arrays = {
            name: np.array(getattr(tables, name), dtype=dtype, order="C") for name, (dtype, _) in shapes.items()
        }
        sizes = {"latents": latents, "blocks": blocks, "width": width, "knots": len(knots)}
        sizes |= {"place_count": len(tables.places), "states": states, "part_count": parts, "jump_count": jumps}
        self._struct = _Struct(
            **sizes,
            kind_values=values,
            place_share=tables.place_share,
            apart=tables.apart,
            changed=tables.changed,
            **{name: _address(self._arrays[name], dtype, *shape) for name, (dtype, shape) in shapes.items()},
        )
        self.latents, self.blocks, self._last = (
            latents,
            blocks,
            np.minimum(_LAST_KINDS, [3, 4, 1, 1, values]).astype(_u),
        )
        self._require_indices(width, knots=len(knots), changed=tables.changed)

    def _require_indices(self, width: int, *, knots: int, changed: int) -> None:
        """Check what the engine reads arrays at."""
        first, size, components, at = (self._arrays[name] for name in ("first", "size", "components", "at"))
        within = (first >= 0).all() and (size >= 1).all() and (first + size <= self.latents).all()
        within = within and (np.abs(components) <= width).all() and ((at >= 0) & (at <= self.latents)).all()
        # A start and width of a place are the first two latents; a change, where there is one, is two blocks.
        within = within and (first[components < 0] == 0).all() and (size[components < 0] == 2).all()
        if self._arrays["renewed"][:, -1].any():
            within = within and 0 <= changed < self.blocks - 1
        if not within or knots < 2 or width % LANES or (_LAST_KINDS @ self._arrays["state_of"]) >= self._struct.states:
            raise ValueError("the tables of a prior point beyond themselves")

    @cached_property
    def _at(self) -> int:
        return ctypes.addressof(self._struct)

    def meanings(self, values: Singles, kinds: IntArray, trials: int) -> Singles:
        """Fields of particles after so many trials, or with their changes if it is negative, (b, p, fields)."""
        people, particles = self._require_particles(values, kinds)
        found = np.empty((people, particles, FIELDS), dtype=_f)
        arrays = _address(values, _f, *values.shape), _address(kinds, _i, *kinds.shape)
        call("meanings", self._at, people, particles, *arrays, trials, _address(found, _f, *found.shape))
        return found

    def usual_weights(self, usual: Law, crowd: Crowd) -> FloatArray:
        """Log weights of particles under another prior, which ISIs are chosen with, (b, p)."""
        people, particles = self._require_crowd(crowd)
        found = np.empty((people, particles), dtype=_d)
        if usual.latents != self.latents:
            raise ValueError("the other prior is of other latents")
        arrays = self._values(crowd.values, crowd.kinds)
        known = _address(crowd.densities, _f, people, particles, self.blocks)
        weights = _address(crowd.log_weights, _d, people, particles), _address(found, _d, people, particles)
        call("usual_weights", self._at, usual._at, people, particles, *arrays, known, *weights)
        return found

    def learn(self, columns: Singles, min_ess: float, sweeps: tuple[int, int], dice: Seeds, crowd: Crowd) -> FloatArray:
        """Let particles learn the last of the trials, in place; what was found on the way, (b, 6).

        Args:
            columns: the trials, (b, n, columns).
            min_ess: they are resampled where their effective sample size, as a share, is below it.
            sweeps: how often they move where they were kept, and where they were resampled.
            dice: seeds, which move on, (b,).
            crowd: the particles, which change.

        Returns:
            Log likelihood of the trial, effective sample size before resampling as a share, shifts, those that were
            accepted, jumps, and those that were accepted, (b, 6).
        """
        people, particles = self._require_crowd(crowd)
        trials, found = columns.shape[1], np.empty((people, 6), dtype=_d)
        if particles < 2 or not trials:
            raise ValueError("particles move by differences of others, and learn from a trial")
        call(
            "learn",
            self._at,
            people,
            particles,
            trials,
            _address(columns, _f, people, trials, COLUMNS),
            min_ess,
            *sweeps,
            _address(dice, _u, people),
            *self._values(crowd.values, crowd.kinds),
            _address(crowd.log_weights, _d, people, particles),
            _address(crowd.log_likelihood, _f, people, particles),
            _address(crowd.densities, _f, people, particles, self.blocks),
            _address(found, _d, people, 6),
        )
        return found

    def represent(
        self, values: Singles, kinds: IntArray, log_weights: FloatArray, size: int, trials: int
    ) -> tuple[IntArray, Singles]:
        """Equally weighted particles that stand for weighted ones: numbers (b, s), and fields after so many trials."""
        people, particles = self._require_particles(values, kinds)
        picks, fields = np.empty((people, size), dtype=_i), np.empty((people, size, FIELDS), dtype=_f)
        weights = _address(log_weights, _d, people, particles)
        arrays = weights, _address(picks, _i, people, size), _address(fields, _f, *fields.shape)
        call("represent", self._at, people, particles, size, trials, *self._values(values, kinds), *arrays)
        return picks, fields

    def _values(self, values: Singles, kinds: IntArray) -> tuple[int, int]:
        return _address(values, _f, *values.shape), _address(kinds, _i, *kinds.shape)

    def _require_crowd(self, crowd: Crowd) -> tuple[int, int]:
        return self._require_particles(crowd.values, crowd.kinds)

    def nothing_known(self, people: int, particles: int) -> Singles:
        """Log densities of blocks of which none was worked out yet, (b, p, blocks)."""
        return np.full((people, particles, self.blocks), UNKNOWN)

    def draws(self, particles: int, seeds: Seeds) -> tuple[Singles, IntArray]:
        """So many particles of the prior of each person: latents (b, p, d), and kinds (b, p, k).

        Args:
            particles: how many a person.
            seeds: of each person, (b,) whole numbers of 64 bits without a sign.
        """
        people = len(seeds)
        values = np.empty((people, particles, self.latents), dtype=_f)
        kinds = np.empty((people, particles, KINDS), dtype=_i)
        arrays = _address(values, _f, *values.shape), _address(kinds, _i, *kinds.shape)
        call("draws", self._at, people, particles, _address(seeds, _u, people), *arrays)
        return values, kinds

    def sweeps(
        self,
        numbers: IntArray,
        columns: Singles,
        dice: Seeds,
        state: tuple[Singles, IntArray, Singles, Singles],
    ) -> Singles:
        """Move each person's particles so many times (b,), in place; the counts of their moves, (b, 4).

        Args:
            numbers: how often each person's particles move, (b,).
            columns: the trials, (b, n, columns).
            dice: seeds, which move on, (b,) whole numbers of 64 bits without a sign.
            state: latents, kinds, log likelihood and log densities of blocks of the particles, which change.

        Returns:
            Shifts, those that were accepted, jumps, and those that were accepted, (b, 4).
        """
        values, kinds, log_likelihood, densities = state
        people, particles = self._require_particles(values, kinds)
        trials, counts = columns.shape[1], np.zeros((people, 4), dtype=_f)
        if particles < 2:
            raise ValueError("particles move by differences of others")
        call(
            "sweeps",
            self._at,
            people,
            particles,
            trials,
            _address(numbers, _i, people),
            _address(columns, _f, people, trials, COLUMNS),
            _address(dice, _u, people),
            _address(values, _f, *values.shape),
            _address(kinds, _i, *kinds.shape),
            _address(log_likelihood, _f, people, particles),
            _address(densities, _f, people, particles, self.blocks),
            _address(counts, _f, people, 4),
        )
        return counts

    def _require_particles(self, values: Singles, kinds: IntArray) -> tuple[int, int]:
        people, particles, latents = values.shape
        within = latents == self.latents and kinds.shape == (people, particles, KINDS)
        if not within or (kinds.view(_u) > self._last).any():  # without a sign, what is below 0 is too large
            raise ValueError("these are no particles of this prior")
        return people, particles


def log_likelihoods(fields: Singles, columns: Singles) -> Singles:
    """Log likelihood of each person's trials (b, n, columns) under each particle (b, p, fields), (b, p)."""
    (people, particles, _), trials = fields.shape, columns.shape[1]
    found = np.empty((people, particles), dtype=_f)
    told = _address(columns, _f, people, trials, COLUMNS)
    call("likelihoods", people, particles, trials, _fields(fields), told, _address(found, _f, *found.shape))
    return found


def evoked_means(fields: Singles, rows: int) -> tuple[Singles, Singles]:
    """Facilitations of the rows of tables, and expected MEPs above the floor there, in floors, (b, s, l) each.

    Rows are at squares of equal steps, or where there is a depression at equal steps from below 0.
    """
    levels, means = (np.empty((*fields.shape[:2], _rows(rows)), dtype=_f) for _ in range(2))
    arrays = _address(levels, _f, *levels.shape), _address(means, _f, *means.shape)
    call("evoked_means", _samples(fields), rows, _fields(fields), *arrays)
    return levels, means


def outcome_tables(fields: Singles, levels: Singles, order: int, log_mep: Singles, widths: Singles) -> Singles:
    """Probability of each outcome of the next trial, (b, s, l, y).

    Args:
        fields: the particles, (b, s, fields).
        levels: facilitations of the rows, (b, s, l).
        order: how many trials came before.
        log_mep: middles of the outcomes, log mV, (b, y).
        widths: of the outcomes, in any unit, (y,).
    """
    (people, samples, rows), outcomes = levels.shape, len(widths)
    table = np.empty((people, samples, rows, outcomes), dtype=_f)
    cells = _address(log_mep, _f, people, outcomes), _address(widths, _f, outcomes)
    at = _address(levels, _f, *fields.shape[:2], rows)
    found = _address(table, _f, *table.shape)
    call("outcome_tables", people, samples, rows, outcomes, order, _fields(fields), at, *cells, found)
    return table


def rows_between(fields: Singles, table: Singles, levels: Singles) -> Singles:
    """What lies between the rows of tables (b, s, l, y) at facilitations (b, s, t), (b, s, t, y)."""
    rows, outcomes, isis = table.shape[2], table.shape[3], levels.shape[2]
    found = np.empty((*levels.shape, outcomes), dtype=_f)
    of = fields.shape[:2]
    arrays = _address(table, _f, *of, _rows(rows), outcomes), _address(levels, _f, *of, isis)
    call(
        "rows_between",
        _samples(fields),
        rows,
        isis,
        outcomes,
        _fields(fields),
        *arrays,
        _address(found, _f, *found.shape),
    )
    return found


def facilitations(fields: Singles, isi_ms: Singles) -> Singles:
    """Facilitation of each particle at some ISIs [ms] (t,), (b, s, t)."""
    found = np.empty((*fields.shape[:2], len(isi_ms)), dtype=_f)
    at = _address(isi_ms, _f, len(isi_ms))
    call("facilitations", _samples(fields), len(isi_ms), _fields(fields), at, _address(found, _f, *found.shape))
    return found


def edge_levels(fields: Singles, evoked: Singles, isi_ms: Singles, *, fine: bool) -> Singles:
    """Facilitation at each window's edge, 2 where there is no window, (b, s).

    Args:
        fields: the particles, (b, s, fields).
        evoked: expected MEPs above the floor in the rows, in floors, (b, s, l).
        isi_ms: ascending ISIs [ms], (t,).
        fine: whether the largest facilitation is that of all of their range, not of these ISIs alone.
    """
    rows, found = evoked.shape[2], np.empty(fields.shape[:2], dtype=_f)
    if not len(isi_ms):
        raise ValueError("windows are looked for at some ISIs")
    arrays = _address(evoked, _f, *fields.shape[:2], _rows(rows)), _address(isi_ms, _f, len(isi_ms))
    at = _address(found, _f, *found.shape)
    call("edge_levels", _samples(fields), rows, len(isi_ms), fine, _fields(fields), *arrays, at)
    return found


def window_runs(fields: Singles, levels: Singles, isi_ms: Singles) -> NDArray[np.int32]:
    """Which ISIs are in each particle's window, as two runs of indices (first, behind the last), (b, s, 4) int32."""
    runs = np.empty((*levels.shape, 4), dtype=np.int32)
    arrays = _address(levels, _f, *fields.shape[:2]), _address(isi_ms, _f, len(isi_ms))
    at = _address(runs, runs.dtype, *runs.shape)
    call("window_runs", _samples(fields), len(isi_ms), _fields(fields), *arrays, at)
    return runs


def entropy_reductions(mass: Singles) -> Singles:
    """Entropy of the mean of distributions (b, s, t, y) less their mean entropy [nat], (b, t)."""
    people, samples, isis, outcomes = mass.shape
    found = np.empty((people, isis), dtype=_f)
    for given, to in zip(mass, found, strict=True):
        arrays = _address(given, _f, samples, isis, outcomes), _address(to, _f, isis)
        call("entropy_reductions", samples, isis, outcomes, *arrays)
    return found


def variance_reductions(mass: Singles, masks: Singles) -> Singles:
    """Variance of each ISI's membership in windows (b, s, g) less that after an outcome (b, s, t, y), summed, (b, t).

    Sampled windows are runs of ISIs, so that what changes from one ISI to the next is summed instead of all of them.
    """
    (people, samples, isis, outcomes), points = mass.shape, masks.shape[2]
    found = np.empty((people, isis), dtype=_f)
    for given, inside, to in zip(mass, masks, found, strict=True):
        arrays = _address(given, _f, samples, isis, outcomes), _address(inside, _f, samples, points)
        call("variance_reductions", samples, isis, outcomes, points, *arrays, _address(to, _f, isis))
    return found


ELEMENTARY: Final = ("exp", "exp2", "log", "per", "per_root", "between")


def elementary(name: str, x: Singles, y: Singles | None = None) -> Singles:
    """One of the elementary functions that the engine is made of, of some numbers (n,); for tests.

    `between` is the probability that a standard normal variable is between x and y.
    """
    found = np.empty(len(x), dtype=_f)
    arrays = (_address(array, _f, len(x)) for array in (x, x if y is None else y, found))
    call("elementary", ELEMENTARY.index(name), len(x), *arrays)
    return found


def _fields(fields: Singles) -> int:
    return _address(fields, _f, *fields.shape[:2], FIELDS)


def _samples(fields: Singles) -> int:
    return int(fields.shape[0] * fields.shape[1])


def _rows(rows: int) -> int:
    if rows < 2:
        raise ValueError("a table has two rows or more")
    return rows


def _address(array: NDArray[np.generic], dtype: np.dtype[np.generic], *shape: int) -> int:
    """Where an array begins, if it is what the engine takes it for: C reads and writes all of the shape."""
    if array.dtype != dtype or array.shape != shape or not array.flags.c_contiguous:
        raise ValueError(f"the engine needs {dtype} {shape} side by side, not {array.dtype} {array.shape}")
    return int(array.__array_interface__["data"][0])
