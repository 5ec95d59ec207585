"""The compiled engine: its library at the level of this processor, and its calls, which check arrays and sizes.

What it writes stays within the arrays: C reads and writes all of a shape, and here each is what it is taken for.
"""

from __future__ import annotations

import ctypes
import os
import platform
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from isiw.errors import InvalidValueError, IsiwError
from isiw.native.sources import digest
from isiw.types import BoolArray, FloatArray, Singles

LEVELS: Final = ("x86-64-v4", "x86-64-v3", "x86-64-v2", "base")
"""What the library is compiled for, the fastest first: AVX-512, AVX2, SSE4.2, and processors that are no x86."""

VERSION: Final = 9
"""Of the engine: it grows if the same draws come to other numbers."""

_LONGEST: Final = 200
"""Of a library's statement of how it was made [bytes]."""


FIELDS: Final = 51
"""Of a particle; their names and order are those of `isiw.models.particles.records`."""

COLUMNS: Final = 11
"""Of a trial, likewise."""

KINDS: Final = 5
"""Of a particle: its profile's shape, its noise, whether there is an enhancement, and a depression, and its change."""

RESPONSE_LEVELS: Final = 8
"""Of a law by levels: at most so many intensities at which pulses were given alone."""

MEANINGS: Final = 33
"""Latents that mean anything: those of the default in their order, three of a depression, and the first of levels."""

LANES: Final = 16
"""Latents that do not move are padded to whole vectors of any processor."""

UNKNOWN: Final = np.float32(1e30)
"""In place of the log density of a block that was not worked out yet."""

SINGLE, DOUBLE = np.dtype(np.float32), np.dtype(np.float64)
WHOLE, NATURAL, FLAG, PLACE = np.dtype(np.int64), np.dtype(np.uint64), np.dtype(np.bool_), np.dtype(np.int32)

Seeds: TypeAlias = NDArray[np.uint64]
_Shape: TypeAlias = tuple[int, ...]


_FILES: Final = {"Darwin": "_engine.dylib", "Windows": "_engine.dll"}
_PATH: Final = Path(__file__).with_name(_FILES.get(platform.system(), "_engine.so.1"))
_WANTED: Final = "ISIW_LEVEL"

_KINDS: Final[dict[str, type[ctypes._SimpleCData[Any]]]] = {
    "n": ctypes.c_int64,
    "s": ctypes.c_int32,
    "d": ctypes.c_double,
    "a": ctypes.c_void_p,
}
_SIGNATURES: Final = {
    "likelihoods": "nnnaaa",
    "meanings": "annaana",
    "usual_weights": "aannaaaaa",
    "learn": "annnadnnaaaaaaa",
    "represent": "annnnaaaaa",
    "draws": "annaaa",
    "sweeps": "annnaaaaaaaa",
    "evoked_means": "nnaaa",
    "outcome_tables": "nnnnnaaaaaa",
    "rows_between": "nnnnaaaa",
    "facilitations": "nnaaa",
    "edge_levels": "nnnsaaaa",
    "window_runs": "nnaaaa",
    "best_window": "nnnnaaaa",
    "reductions": "nnnnaaa",
    "ask": "aannnnsdnaaaaaa",
    "estimate": "annnnaaaaaaaa",
    "elementary": "snaaa",
}
"""The functions in the order of `Engine` in engine.h, and what they take: numbers, and arrays."""


class _Functions(ctypes.Structure):
    """The functions of one level."""

    _fields_ = [
        (name, ctypes.CFUNCTYPE(ctypes.c_int, *(_KINDS[sort] for sort in sorts))) for name, sorts in _SIGNATURES.items()
    ]


@cache
def level() -> str:
    """The level of the processor that the engine computes at: the best that it has.

    The environment variable ISIW_LEVEL asks for a lower one, so that a session of another computer can be repeated bit
    for bit.

    Raises:
        InvalidValueError: the processor does not have the level that is asked for.
        IsiwError: there is no compiled engine for this computer.
    """
    wanted = os.environ.get(_WANTED)
    there = [name for name in LEVELS if _found(name)]
    if wanted is not None and wanted not in there:
        raise InvalidValueError(
            "this processor does not have the level of the environment variable ISIW_LEVEL",
            got=wanted,
            expected=f"one of {', '.join(there)}",
            remedy="Leave it out to use the best level.",
        )
    if not there:
        raise IsiwError(
            "isiw was not compiled for this processor",
            got=platform.machine(),
            expected="an x86-64 of the years since 2009, or an aarch64",
            remedy="Install isiw from its sources on this computer, or use another one.",
        )
    return there[0] if wanted is None else wanted


def version() -> str:
    """The version of the engine, and its level; two computers with both alike ask the same ISIs."""
    return f"{VERSION}, {level()}"


def sources() -> str:
    """The digest of the sources that the engine was compiled from, wherever that was."""
    return _stated(_library())[1]


def call(name: str, *arguments: object) -> None:
    """Call a function of the engine with numbers and addresses of arrays.

    Raises:
        MemoryError: there is not enough for what it needs in between.
        ValueError: kinds of particles are none that there are.
    """
    failed = _functions(name)(*arguments)
    if failed > 0:
        raise ValueError("these are no particles of this prior")
    if failed:
        raise MemoryError(f"there is no memory for {name}")


@cache
def _functions(name: str) -> Any:
    return getattr(_found(level())[0], name)


@cache
def _found(name: str) -> Any:
    """The functions of a level, behind a pointer that is false where the processor does not have it."""
    engine = _library().isiw_engine
    engine.argtypes, engine.restype = [ctypes.c_char_p], ctypes.POINTER(_Functions)
    return engine(name.encode())


@cache
def _library() -> ctypes.CDLL:
    try:
        loaded = ctypes.CDLL(str(_PATH))
    except OSError as error:
        raise IsiwError(
            "the compiled engine cannot be loaded",
            got=str(error),
            expected=str(_PATH),
            remedy="Install isiw again; in a checkout: pip install -e .",
        ) from error
    require_built_of(loaded, Path(__file__).with_name("source"))
    return loaded


def address(array: NDArray[np.generic], dtype: np.dtype[np.generic], *shape: int) -> int:
    """Where an array begins, if it is what the engine takes it for: C reads and writes all of the shape."""
    if array.dtype != dtype or array.shape != shape or not array.flags.c_contiguous:
        raise ValueError(f"the engine needs {dtype} {shape} side by side, not {array.dtype} {array.shape}")
    return int(array.__array_interface__["data"][0])


def _stated(library: ctypes.CDLL) -> list[str]:
    """How a library says that it was made: a word, the digest of its sources, and that of everything else."""
    return (ctypes.c_char * _LONGEST).in_dll(library, "isiw_sources").value.decode().split(":")


def require_built_of(library: ctypes.CDLL, folder: Path) -> None:
    """Have a library be of the sources in a folder; an installed package has no such folder, and nothing to compare.

    Raises:
        IsiwError: it was compiled from other sources.
    """
    if not folder.is_dir():
        return
    stated, expected = _stated(library), digest(folder)
    if expected not in stated:
        raise IsiwError(
            "the compiled engine was made of other sources than those beside it",
            got=":".join(stated),
            expected=f"isiw-sources:{expected}",
            remedy="Run pip install -e . again, in the folder of isiw.",
        )


def _made(name: str, sizes: Sequence[int], given: Sequence[tuple[Singles, _Shape]], *shapes: _Shape) -> list[Singles]:
    """What a function makes of sizes and of arrays, which must have some shapes: arrays of some shapes."""
    found = [np.empty(shape, dtype=SINGLE) for shape in shapes]
    arrays = (*given, *zip(found, shapes, strict=True))
    call(name, *sizes, *(address(array, SINGLE, *shape) for array, shape in arrays))
    return found


def log_likelihoods(fields: Singles, columns: Singles) -> Singles:
    """Log likelihood of each person's trials (b, n, columns) under each particle (b, p, fields), (b, p)."""
    (people, particles, _), trials = fields.shape, columns.shape[1]
    given = _fields(fields), (columns, (people, trials, COLUMNS))
    return _made("likelihoods", (people, particles, trials), given, (people, particles))[0]


def evoked_means(fields: Singles, rows: int) -> tuple[Singles, Singles]:
    """Facilitations of the rows of tables, and expected MEPs above the floor there, in floors, (b, s, l) each.

    Rows are at squares of equal steps, or where there is a depression at equal steps from below 0.
    """
    shape = *fields.shape[:2], _rows(rows)
    levels, means = _made("evoked_means", (_samples(fields), rows), [_fields(fields)], shape, shape)
    return levels, means


def outcome_tables(
    fields: Singles, levels: Singles, means: Singles, order: int, cells: Singles
) -> tuple[Singles, Singles]:
    """Between which log MEPs outcomes of the next trial lie, (b, 2), and the probability of each, (b, s, l, y).

    Args:
        fields: the particles, (b, s, fields).
        levels: facilitations of the rows, (b, s, l).
        means: expected MEPs above the floor there, in floors, likewise.
        order: how many trials came before.
        cells: ends of the outcomes, as shares of what lies between the log MEPs, (y + 1,).
    """
    of, outcomes = fields.shape[:2], len(cells) - 1
    rows = *of, levels.shape[2]
    given = _fields(fields), (levels, rows), (means, rows), (cells, (outcomes + 1,))
    sizes = *rows, outcomes, order
    ends, table = _made("outcome_tables", sizes, given, (of[0], 2), (*rows, outcomes))
    return ends, table


def rows_between(fields: Singles, table: Singles, levels: Singles) -> Singles:
    """What lies between the rows of tables (b, s, l, y) at facilitations (b, s, t), (b, s, t, y)."""
    of, (rows, outcomes), isis = fields.shape[:2], table.shape[2:], levels.shape[2]
    given = _fields(fields), (table, (*of, _rows(rows), outcomes)), (levels, (*of, isis))
    return _made("rows_between", (_samples(fields), rows, isis, outcomes), given, (*of, isis, outcomes))[0]


def facilitations(fields: Singles, isi_ms: Singles) -> Singles:
    """Facilitation of each particle at some ISIs [ms] (t,), (b, s, t)."""
    given, isis = (_fields(fields), (isi_ms, (len(isi_ms),))), len(isi_ms)
    return _made("facilitations", (_samples(fields), isis), given, (*fields.shape[:2], isis))[0]


def edge_levels(fields: Singles, evoked: Singles, isi_ms: Singles, *, fine: bool) -> Singles:
    """Facilitation at each window's edge, 2 where there is no window, (b, s).

    Args:
        fields: the particles, (b, s, fields).
        evoked: expected MEPs above the floor in the rows, in floors, (b, s, l).
        isi_ms: ascending ISIs [ms], (t,).
        fine: whether the largest facilitation is that of all of their range, not of these ISIs alone.
    """
    of, rows, isis = fields.shape[:2], evoked.shape[2], len(isi_ms)
    if not isis:
        raise ValueError("windows are looked for at some ISIs")
    given = _fields(fields), (evoked, (*of, _rows(rows))), (isi_ms, (isis,))
    return _made("edge_levels", (_samples(fields), rows, isis, fine), given, of)[0]


def window_runs(fields: Singles, levels: Singles, isi_ms: Singles) -> NDArray[np.int32]:
    """Which ISIs are in each particle's window, as two runs of indices (first, behind the last), (b, s, 4) int32."""
    runs = np.empty((*levels.shape, 4), dtype=PLACE)
    arrays = address(levels, SINGLE, *fields.shape[:2]), address(isi_ms, SINGLE, len(isi_ms))
    of, at = address(fields, SINGLE, *fields.shape[:2], FIELDS), address(runs, PLACE, *runs.shape)
    call("window_runs", _samples(fields), len(isi_ms), of, *arrays, at)
    return runs


def best_window(pairs: NDArray[np.int32], points: int, shares: FloatArray) -> tuple[BoolArray, float]:
    """The set of ISIs (t,) of largest expected F1 with sampled windows, and this F1.

    Args:
        pairs: index of the first ISI of each run of a window, and behind its last, (s, k, 2).
        points: how many ISIs.
        shares: the sets are those in at least such a share of as many windows as any ISI is in, (cuts,).
    """
    samples, runs, _ = pairs.shape
    if not runs or pairs.min(initial=0) < 0 or (pairs[..., 0] > pairs[..., 1]).any() or pairs.max(initial=0) > points:
        raise ValueError("windows are runs of the ISIs")
    inside, f1 = np.empty(points, dtype=FLAG), np.empty(1, dtype=DOUBLE)
    arrays = address(pairs, PLACE, samples, runs, 2), address(shares, DOUBLE, len(shares))
    found = address(inside, FLAG, points), address(f1, DOUBLE, 1)
    call("best_window", samples, runs, points, len(shares), *arrays, *found)
    return inside, f1.item()


def reductions(mass: Singles, masks: Singles) -> Singles:
    """Entropy of the mean of one person's distributions (s, t, y), less their mean entropy [nat], (t,).

    With windows (s, points) instead the variance of each point's membership, less that after an outcome, summed.
    Sampled windows are runs of ISIs, so that what changes from one ISI to the next is summed instead of all of them.
    """
    (samples, isis, outcomes), points = mass.shape, masks.shape[1]
    given = (mass, mass.shape), (masks, (samples, points))
    return _made("reductions", (samples, isis, outcomes, points), given, (isis,))[0]


def _fields(fields: Singles) -> tuple[Singles, _Shape]:
    return fields, (*fields.shape[:2], FIELDS)


def _samples(fields: Singles) -> int:
    return int(fields.shape[0] * fields.shape[1])


def _rows(rows: int) -> int:
    if rows < 2:
        raise ValueError("a table has two rows or more")
    return rows
