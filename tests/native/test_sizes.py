"""The engine stays within its arrays and does nothing undefined, which the sanitizers of a compiler see."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import sanitized

BEYOND = """
import numpy as np
from benchmarks import sanitized
from isiw.native import engine
sanitized.take()
sizes = engine.FIELDS, 23, 24
given = [np.zeros(size, dtype=np.float32) for size in sizes]
engine.call("evoked_means", 1, 24, *(array.__array_interface__["data"][0] for array in given))
"""

pytestmark = [
    pytest.mark.skipif(sanitized.compiler() is None, reason="no compiler with sanitizers here"),
    pytest.mark.slow,
]


@pytest.fixture
def folder(pytestconfig: pytest.Config) -> Path:
    """Where the library is kept from run to run: compiling it takes some seconds."""
    cache = pytestconfig.cache
    assert cache is not None
    return cache.mkdir("sanitized")


def test_nothing_leaves_its_arrays_at_sizes_around_each_constant(folder: Path) -> None:
    ended = sanitized.run([Path(__file__).with_name("sizes.py")], folder)
    assert ended.returncode == 0, ended.stderr


def test_whoever_leaves_an_array_is_noticed(folder: Path) -> None:
    ended = sanitized.run(["-c", BEYOND], folder)
    assert ended.returncode != 0
    assert "AddressSanitizer: heap-buffer-overflow" in ended.stderr
