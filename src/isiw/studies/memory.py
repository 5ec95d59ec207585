"""Keeping the memory of large tensors from one trial to the next.

glibc gives large blocks back to the system as soon as they are freed; a batch of people, which needs them again on the
next trial, spent a quarter of its time on getting them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Generator
from contextlib import contextmanager, suppress

# Parameters of mallopt(3), from malloc.h, and the value that both begin with.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
_USUAL_BYTES = 128 * 1024


@contextmanager
def memory_kept() -> Generator[None, None, None]:
    """Have this process keep what it frees, and give it back at the end; does nothing without glibc."""
    _set_thresholds(1 << 30)
    try:
        yield
    finally:
        _set_thresholds(_USUAL_BYTES)
        with suppress(AttributeError, OSError, TypeError):
            ctypes.CDLL(None).malloc_trim(0)


def _set_thresholds(size_bytes: int) -> None:
    with suppress(AttributeError, OSError, TypeError):  # another C library has no such settings
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_MMAP_THRESHOLD, size_bytes)
        mallopt(_TRIM_THRESHOLD, size_bytes)
