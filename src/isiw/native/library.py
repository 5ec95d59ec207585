"""The library of compiled code: its level for this processor, its functions, and arrays as they take them."""

from __future__ import annotations

import ctypes
import os
import platform
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from isiw.errors import InvalidValueError, IsiwError
from isiw.native.sources import digest

LEVELS: Final = ("x86-64-v4", "x86-64-v3", "x86-64-v2", "base")
"""What the library is compiled for, the fastest first: AVX-512, AVX2, SSE4.2, and processors that are no x86."""

VERSION: Final = 7
"""Of the engine: it grows if the same draws come to other numbers."""

_LONGEST: Final = 200
"""Of a library's statement of how it was made [bytes]."""


FIELDS: Final = 27
"""Of a particle; their names and order are those of `isiw.models.particles.records`."""

COLUMNS: Final = 11
"""Of a trial, likewise."""

KINDS: Final = 5
"""Of a particle: its profile's shape, its noise, whether there is an enhancement, and a depression, and its change."""

MEANINGS: Final = 32
"""Latents that mean anything: those of the default in their order, then three of a depression."""

LANES: Final = 16
"""Latents that do not move are padded to whole vectors of any processor."""

UNKNOWN: Final = np.float32(1e30)
"""In place of the log density of a block that was not worked out yet."""

SINGLE, DOUBLE = np.dtype(np.float32), np.dtype(np.float64)
WHOLE, NATURAL, FLAG = np.dtype(np.int64), np.dtype(np.uint64), np.dtype(np.bool_)

Seeds: TypeAlias = NDArray[np.uint64]


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
    "outcome_tables": "nnnnnaaaaa",
    "rows_between": "nnnnaaaa",
    "facilitations": "nnaaa",
    "edge_levels": "nnnsaaaa",
    "window_runs": "nnaaaa",
    "expected_f1": "nnnaaaaa",
    "entropy_reductions": "nnnnaaaa",
    "variance_reductions": "nnnnnaaaaa",
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
