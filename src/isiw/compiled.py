"""Compiled loops: the decorator of kernels, and the elementary functions that they are made of.

Kernels are plain functions over arrays, compiled by Numba when they are first called and kept on disk. Where Numba
cannot be imported, `AVAILABLE` is False and torch computes in their place. The elementary functions are polynomials in
single precision, because loops over them become vector instructions, and loops over those of a library do not.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numpy as np

from isiw.errors import warn

F = TypeVar("F", bound=Callable[..., Any])

KERNELS: Final = 3
"""Version of the kernels: it grows if the same draws come to other numbers."""

LANES: Final = 16
"""Trials or ISIs that a kernel computes side by side; arrays are padded to a multiple of it."""

SLOW_S: Final = 1.5
"""Kernels that are on disk are loaded faster than this."""

PATIENCE_S: Final = 120.0
"""So long a process waits for another that compiles."""

_SAFE: Final = {"contract", "arcp", "afn", "nsz"}
"""What the compiler may do to numbers. It may not reorder sums: p a + (1 - p) b would lose a small a."""

_UNWANTED: Final = os.environ.get("ISIW_ENGINE") == "torch" or os.environ.get("NUMBA_DISABLE_JIT", "0") not in {"", "0"}

AVAILABLE: Final = importlib.util.find_spec("numba") is not None and not _UNWANTED
"""True if there are compiled kernels here; the environment variable ISIW_ENGINE=torch does without them, and so does
NUMBA_DISABLE_JIT=1, with which they would take minutes a trial."""


def version() -> str:
    """The version of the compiled kernels, and of what compiles them; `"torch"` where there are none."""
    if not AVAILABLE:
        return "torch"
    import numba  # noqa: PLC0415 - it takes a second, and only those who compute need it

    return f"compiled {KERNELS}, numba {numba.__version__}"


def kernel(function: F) -> F:
    """Have a function compiled when it is first called; without Numba it is left as it is.

    It writes into the arrays that it is given and makes none, which would take seconds to compile.
    """
    return _compiled(function, _SAFE)


def loop(function: F) -> F:
    """As `kernel`, for functions that only others like it call: nothing is compiled that would let Python call them."""
    return _compiled(function, _SAFE, no_cpython_wrapper=True)


def inlined(function: F) -> F:
    """As `loop`, for small functions that become a part of those that call them."""
    return _compiled(function, _SAFE, forceinline=True, no_cpython_wrapper=True)


def part(function: F) -> F:
    """As `loop`, for long functions of many arrays, whose calls would be dear: compiled within those that call them."""
    return _compiled(function, _SAFE, inline="always")


_CONSTANTS: Final = *(f"particles/{name}" for name in ("changes", "moves", "noise", "prior", "shapes")), "shared/tables"
"""Modules of `isiw.models` whose constants kernels have compiled in."""


@cache
def _sources() -> str:
    """What the kernels depend on, in short: Numba itself notices changes of a function's own file only."""
    folder = Path(__file__).parent
    constants = ("window", *(f"models/{name}" for name in _CONSTANTS))
    files = [*folder.glob("models/particles/kernels/*.py"), *(folder / f"{name}.py" for name in constants)]
    files = sorted([Path(__file__), folder / "acquisition/information.py", *files])
    return hashlib.blake2b(b"".join(file.read_bytes() for file in files), digest_size=6).hexdigest()


def _compiled(function: F, fastmath: set[str], **more: bool | str) -> F:
    if not AVAILABLE:
        return function
    import numba  # noqa: PLC0415 - see above

    function.__qualname__ = f"{function.__name__}_{_sources()}"  # which the file on disk is named after

    # Errors are numpy's: a check of each divisor is no vector instruction.
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": fastmath, "no_cfunc_wrapper": True}
    options |= {"_nrt": False, **more}
    compiled: Any = numba.njit(**options)(function)
    with suppress(RuntimeError):  # there is no folder to keep it in
        compiled._cache = _Kept(function)  # noqa: SLF001 - as its option cache=True does, with a cache of Numba's own
    return cast("F", compiled)


if AVAILABLE:
    from numba.core.caching import FunctionCache, IndexDataCacheFile

    class _Files(IndexDataCacheFile):  # type: ignore[misc] # Numba has no types
        """The files of a loop, each with a checksum behind it: machine code of other bytes may end the process."""

        def _save_data(self, name: str, data: object) -> None:
            content = self._dump(data)
            with self._open_for_write(self._data_path(name)) as file:
                file.write(content + _checksum(content))

        def _load_data(self, name: str) -> Any:
            content = Path(self._data_path(name)).read_bytes()
            if content[-CHECKSUM_BYTES:] != _checksum(content[:-CHECKSUM_BYTES]):
                raise ValueError(name)
            return super()._load_data(name)  # which reads up to the checksum

    class _Kept(FunctionCache):  # type: ignore[misc] # see above
        """The cache of a loop: where a file of it cannot be used, the loop is compiled, and kept again."""

        def __init__(self, function: Callable[..., Any]) -> None:
            super().__init__(function)
            stamp = self._impl.locator.get_source_stamp()
            self._cache_file: Any = _Files(self._cache_path, self._impl.filename_base, stamp)

        def load_overload(self, signature: Any, target: Any) -> Any:
            try:
                return super().load_overload(signature, target)
            except Exception:  # noqa: BLE001 - there is no end to what a damaged file can lead to
                _warn_of_damage(self._cache_path)
            with suppress(Exception):
                self.flush()  # the list of its files is begun again, or none could be kept
            return None

        def save_overload(self, signature: Any, compiled: Any) -> None:
            with suppress(Exception):  # the disk is full, or not ours: it is compiled again next time
                super().save_overload(signature, compiled)


CHECKSUM_BYTES: Final = 16


def _checksum(content: bytes) -> bytes:
    return hashlib.blake2b(content, digest_size=CHECKSUM_BYTES).digest()


def _warn_of_damage(folder: str) -> None:
    if _DAMAGED not in _CALLED:
        _CALLED.add(_DAMAGED)
        warn(
            f"Compiled loops that isiw keeps in {folder} are damaged. They are not used, and compiled again, "
            "which takes up to half a minute once. The results are the same.",
            RuntimeWarning,
        )


@contextmanager
def first_of(family: str) -> Generator[None, None, None]:
    """Let one process at a time compile kernels at first call, saying so if it is long; others load them."""
    if family in _CALLED or not AVAILABLE:
        yield
        return
    from numba.core import event  # noqa: PLC0415 - see above

    with _one_process(), event.install_recorder("numba:compile") as compiled:
        said = threading.Timer(SLOW_S, _say, (compiled,))
        said.daemon = True
        said.start()
        try:
            yield
        finally:
            said.cancel()
    _CALLED.add(family)


@contextmanager
def _one_process() -> Generator[None, None, None]:
    """Wait until no other process of this user compiles kernels; not for ever, and not where no file can be locked."""
    from filelock import FileLock, Timeout  # noqa: PLC0415 - few commands compute

    lock = FileLock(_lock_file())
    with suppress(OSError, Timeout, NotImplementedError):
        lock.acquire(timeout=PATIENCE_S)
    try:
        yield
    finally:
        lock.release()


def _lock_file() -> Path:
    user = os.getuid() if hasattr(os, "getuid") else 0  # elsewhere each user has an own folder
    return Path(tempfile.gettempdir()) / f"isiw-{_sources()}-{user}.lock"


def _say(compiled: Any) -> None:
    if compiled.buffer and _SAID not in _CALLED:
        _CALLED.add(_SAID)
        sys.stderr.write("isiw compiles its loops, once on this machine: about half a minute …\n")


_SAID: Final = "said"
_DAMAGED: Final = "damaged"
_CALLED: Final[set[str]] = set()

if AVAILABLE:
    from llvmlite import ir
    from numba import types
    from numba.extending import intrinsic

    def _reinterpreted(given: Any, made: Any, llvm: Any) -> Callable[..., Any]:
        def typed(_context: Any, value: Any) -> Any:
            def built(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
                return builder.bitcast(arguments[0], llvm)

            return (made(given), built) if value == given else None

        return intrinsic(typed)

    _float_of = _reinterpreted(types.int32, types.float32, ir.FloatType())
    _bits_of = _reinterpreted(types.float32, types.int32, ir.IntType(32))
else:

    def _float_of(bits: np.int32) -> np.float32:
        return np.int32(bits).view(np.float32)

    def _bits_of(number: np.float32) -> np.int32:
        return np.float32(number).view(np.int32)


_ONE, _HALF, _MOST = np.float32(1.0), np.float32(0.5), np.float32(126.0)
_WHOLE = np.float32(1.5 * 2**23)
_BELL, _LEAST_BELL = np.float32(-0.5 * 1.4426950408889634), np.float32(-60.5 * 1.4426950408889634)
_TWO, _THREE_HALVES = np.float32(2.0), np.float32(1.5)
_LOG2E, _LN2 = np.float32(1.4426950408889634), np.float32(0.6931471805599453)
_E1, _E2, _E3 = np.float32(0.6931472067), np.float32(0.2402264923), np.float32(0.0555032721)
_E4, _E5, _E6 = np.float32(0.0096184373), np.float32(0.0013400429), np.float32(0.0001546976)
_SQRT_HALF = np.int32(0x3F3504F3)
_L0, _L1, _L2 = np.float32(7.0376836292e-2), np.float32(-1.1514610310e-1), np.float32(1.1676998740e-1)
_L3, _L4, _L5 = np.float32(-1.2420140846e-1), np.float32(1.4249322787e-1), np.float32(-1.6668057665e-1)
_L6, _L7, _L8 = np.float32(2.0000714765e-1), np.float32(-2.4999993993e-1), np.float32(3.3333331174e-1)
_TINY = np.float32(1.1754944e-38)
_N0, _N1, _N2 = np.float32(-1.26551223), np.float32(1.00002368), np.float32(0.37409196)
_N3, _N4, _N5 = np.float32(0.09678418), np.float32(-0.18628806), np.float32(0.27886807)
_N6, _N7, _N8, _N9 = np.float32(-1.13520398), np.float32(1.48851587), np.float32(-0.82215223), np.float32(0.17087277)
_ROOT_HALF, _FAR = np.float32(0.70710678), np.float32(9.0)


@inlined
def _exp2(x: Any) -> Any:
    """Power of 2, in single precision, within ±126."""
    shifted = x + _WHOLE  # whose last bits are the whole number next to it
    f = x - (shifted - _WHOLE)
    power = _ONE + f * (_E1 + f * (_E2 + f * (_E3 + f * (_E4 + f * (_E5 + f * _E6)))))
    return _float_of(np.int32(_bits_of(power) + np.int32(_bits_of(shifted) << 23)))


@inlined
def exp2(x: Any) -> Any:
    """Power of 2, in single precision; beyond ±126 as at ±126."""
    return _exp2(min(max(x, -_MOST), _MOST))


@inlined
def exp(x: Any) -> Any:
    """Power of e, in single precision."""
    return exp2(x * _LOG2E)


@inlined
def bell(z: Any) -> Any:
    """exp(-z² / 2), in single precision; what is as good as 0 stays a normal number, which is much faster."""
    return _exp2(max(_BELL * z * z, _LEAST_BELL))


@inlined
def log(x: Any) -> Any:
    """Natural logarithm of a positive number, in single precision."""
    bits = _bits_of(max(x, _TINY))
    exponent = np.int32(np.int32(bits - _SQRT_HALF) >> 23)  # or Numba takes twice as many bits
    m = _float_of(np.int32(bits - (exponent << 23))) - _ONE  # from √½ to √2, less 1
    tail = _L5 + m * (_L4 + m * (_L3 + m * (_L2 + m * (_L1 + m * _L0))))
    square = m * m
    return m - _HALF * square + square * m * (_L8 + m * (_L7 + m * (_L6 + m * tail))) + np.float32(exponent) * _LN2


@inlined
def per(x: Any) -> Any:
    """1 / x of a positive number, in single precision: by Newton's method, as dividers are slow."""
    y = _float_of(np.int32(0x7EF311C7 - _bits_of(x)))
    y = y * (_TWO - x * y)
    y = y * (_TWO - x * y)
    return y * (_TWO - x * y)


@inlined
def per_root(x: Any) -> Any:
    """1 / √x of a positive number, likewise."""
    half = _HALF * x
    y = _float_of(np.int32(0x5F3759DF - (_bits_of(x) >> 1)))
    y = y * (_THREE_HALVES - half * y * y)
    y = y * (_THREE_HALVES - half * y * y)
    return y * (_THREE_HALVES - half * y * y)


@inlined
def ndtr(x: Any) -> Any:
    """Probability that a standard normal variable is below x, in single precision (relative error 2e-7)."""
    z = min(abs(x), _FAR) * _ROOT_HALF
    t = _ONE / (_ONE + _HALF * z)
    tail = _N4 + t * (_N5 + t * (_N6 + t * (_N7 + t * (_N8 + t * _N9))))
    beyond = _HALF * t * exp(_N0 - z * z + t * (_N1 + t * (_N2 + t * (_N3 + t * tail))))
    return beyond if x < 0 else _ONE - beyond


def _total(values: Any, count: int) -> Any:
    """Sum of the first values, in any order."""
    total = np.float32(0.0)
    for i in range(count):
        total += values[i]
    return total


total = _compiled(_total, _SAFE | {"reassoc"}, no_cpython_wrapper=True)
