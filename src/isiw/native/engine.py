"""Calls of the compiled engine on arrays, whose sizes are checked here: what it writes stays within them."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from isiw.native.library import COLUMNS, DOUBLE, FIELDS, FLAG, SINGLE, WHOLE, address, call
from isiw.types import BoolArray, FloatArray, IntArray, Singles


def log_likelihoods(fields: Singles, columns: Singles) -> Singles:
    """Log likelihood of each person's trials (b, n, columns) under each particle (b, p, fields), (b, p)."""
    (people, particles, _), trials = fields.shape, columns.shape[1]
    found = np.empty((people, particles), dtype=SINGLE)
    told = address(columns, SINGLE, people, trials, COLUMNS)
    call("likelihoods", people, particles, trials, _fields(fields), told, address(found, SINGLE, *found.shape))
    return found


def evoked_means(fields: Singles, rows: int) -> tuple[Singles, Singles]:
    """Facilitations of the rows of tables, and expected MEPs above the floor there, in floors, (b, s, l) each.

    Rows are at squares of equal steps, or where there is a depression at equal steps from below 0.
    """
    levels, means = (np.empty((*fields.shape[:2], _rows(rows)), dtype=SINGLE) for _ in range(2))
    arrays = address(levels, SINGLE, *levels.shape), address(means, SINGLE, *means.shape)
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
    table = np.empty((people, samples, rows, outcomes), dtype=SINGLE)
    cells = address(log_mep, SINGLE, people, outcomes), address(widths, SINGLE, outcomes)
    at = address(levels, SINGLE, *fields.shape[:2], rows)
    found = address(table, SINGLE, *table.shape)
    call("outcome_tables", people, samples, rows, outcomes, order, _fields(fields), at, *cells, found)
    return table


def rows_between(fields: Singles, table: Singles, levels: Singles) -> Singles:
    """What lies between the rows of tables (b, s, l, y) at facilitations (b, s, t), (b, s, t, y)."""
    rows, outcomes, isis = table.shape[2], table.shape[3], levels.shape[2]
    found = np.empty((*levels.shape, outcomes), dtype=SINGLE)
    of = fields.shape[:2]
    arrays = address(table, SINGLE, *of, _rows(rows), outcomes), address(levels, SINGLE, *of, isis)
    call(
        "rows_between",
        _samples(fields),
        rows,
        isis,
        outcomes,
        _fields(fields),
        *arrays,
        address(found, SINGLE, *found.shape),
    )
    return found


def facilitations(fields: Singles, isi_ms: Singles) -> Singles:
    """Facilitation of each particle at some ISIs [ms] (t,), (b, s, t)."""
    found = np.empty((*fields.shape[:2], len(isi_ms)), dtype=SINGLE)
    at = address(isi_ms, SINGLE, len(isi_ms))
    call("facilitations", _samples(fields), len(isi_ms), _fields(fields), at, address(found, SINGLE, *found.shape))
    return found


def edge_levels(fields: Singles, evoked: Singles, isi_ms: Singles, *, fine: bool) -> Singles:
    """Facilitation at each window's edge, 2 where there is no window, (b, s).

    Args:
        fields: the particles, (b, s, fields).
        evoked: expected MEPs above the floor in the rows, in floors, (b, s, l).
        isi_ms: ascending ISIs [ms], (t,).
        fine: whether the largest facilitation is that of all of their range, not of these ISIs alone.
    """
    rows, found = evoked.shape[2], np.empty(fields.shape[:2], dtype=SINGLE)
    if not len(isi_ms):
        raise ValueError("windows are looked for at some ISIs")
    arrays = address(evoked, SINGLE, *fields.shape[:2], _rows(rows)), address(isi_ms, SINGLE, len(isi_ms))
    at = address(found, SINGLE, *found.shape)
    call("edge_levels", _samples(fields), rows, len(isi_ms), fine, _fields(fields), *arrays, at)
    return found


def window_runs(fields: Singles, levels: Singles, isi_ms: Singles) -> NDArray[np.int32]:
    """Which ISIs are in each particle's window, as two runs of indices (first, behind the last), (b, s, 4) int32."""
    runs = np.empty((*levels.shape, 4), dtype=np.int32)
    arrays = address(levels, SINGLE, *fields.shape[:2]), address(isi_ms, SINGLE, len(isi_ms))
    at = address(runs, runs.dtype, *runs.shape)
    call("window_runs", _samples(fields), len(isi_ms), _fields(fields), *arrays, at)
    return runs


def expected_f1(sets: BoolArray, sample: IntArray, first: IntArray, behind: IntArray) -> FloatArray:
    """Expected F1 of sets of ISIs (c, t) with sampled windows, (c,).

    Args:
        sets: which ISIs each set has.
        sample: the sample that each run of ISIs next to each other is of, ascending, (r,).
        first: index of its first ISI, (r,).
        behind: index behind its last, (r,).
    """
    runs, found = len(sample), np.empty(len(sets), dtype=DOUBLE)
    if not runs or first.min() < 0 or (first > behind).any() or behind.max() > sets.shape[1]:
        raise ValueError("windows are runs of the ISIs")
    side_by_side = [np.ascontiguousarray(array) for array in (sample, first, behind)]
    arrays = address(sets, FLAG, *sets.shape), *(address(array, WHOLE, runs) for array in side_by_side)
    call("expected_f1", *sets.shape, runs, *arrays, address(found, DOUBLE, len(sets)))
    return found


class Foreseen(NamedTuple):
    """Distributions of one person's next outcome at some ISIs: they lie between the rows of tables."""

    fields: Singles  # the samples, (1, s, fields)
    table: Singles  # distributions in the rows, (1, s, l, y)
    levels: Singles  # facilitations at the ISIs, (1, s, t)


def entropy_reductions(foreseen: Singles | Foreseen) -> Singles:
    """Entropy of the mean of one person's distributions, (s, t, y) or foreseen, less their mean entropy [nat], (t,)."""
    sizes, arrays = _foreseen(foreseen)
    found = np.empty(sizes[2], dtype=SINGLE)
    call("entropy_reductions", *sizes, *arrays, address(found, SINGLE, *found.shape))
    return found


def variance_reductions(foreseen: Singles | Foreseen, masks: Singles) -> Singles:
    """Variance of each ISI's membership in one person's windows (s, g) less that after an outcome, summed, (t,).

    Distributions of the outcome are (s, t, y), or foreseen. Sampled windows are runs of ISIs, so that what changes from
    one ISI to the next is summed instead of all of them.
    """
    sizes, arrays = _foreseen(foreseen)
    points, found = masks.shape[1], np.empty(sizes[2], dtype=SINGLE)
    inside = address(masks, SINGLE, sizes[0], points)
    call("variance_reductions", *sizes, points, *arrays, inside, address(found, SINGLE, *found.shape))
    return found


def _foreseen(foreseen: Singles | Foreseen) -> tuple[tuple[int, int, int, int], tuple[int, int, int]]:
    """Samples, rows, ISIs and outcomes, and where fields, table and facilitations begin."""
    if not isinstance(foreseen, Foreseen):
        samples, isis, outcomes = foreseen.shape
        mass = address(foreseen, SINGLE, *foreseen.shape)
        return (samples, 0, isis, outcomes), (mass, mass, mass)
    fields, table, levels = foreseen
    (_, samples, rows, outcomes), isis = table.shape, levels.shape[2]
    arrays = address(fields, SINGLE, 1, samples, FIELDS), address(table, SINGLE, 1, samples, _rows(rows), outcomes)
    return (samples, rows, isis, outcomes), (*arrays, address(levels, SINGLE, 1, samples, isis))


ELEMENTARY: Final = ("exp", "exp2", "log", "per", "per_root", "between")


def elementary(name: str, x: Singles, y: Singles | None = None) -> Singles:
    """One of the elementary functions that the engine is made of, of some numbers (n,); for tests.

    `between` is the probability that a standard normal variable is between x and y.
    """
    found = np.empty(len(x), dtype=SINGLE)
    arrays = (address(array, SINGLE, len(x)) for array in (x, x if y is None else y, found))
    call("elementary", ELEMENTARY.index(name), len(x), *arrays)
    return found


def _fields(fields: Singles) -> int:
    return address(fields, SINGLE, *fields.shape[:2], FIELDS)


def _samples(fields: Singles) -> int:
    return int(fields.shape[0] * fields.shape[1])


def _rows(rows: int) -> int:
    if rows < 2:
        raise ValueError("a table has two rows or more")
    return rows
