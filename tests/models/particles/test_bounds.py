"""Compiled loops stay within their arrays, which Numba checks where `NUMBA_BOUNDSCHECK=1`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "bounded.py"
CHECKED = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_OPT": "1", "NUMBA_LOOP_VECTORIZE": "0", "NUMBA_SLP_VECTORIZE": "0"}


def test_no_loop_leaves_its_arrays_at_sizes_around_each_constant(pytestconfig: pytest.Config) -> None:
    # Compiling takes half a minute, and what is compiled is kept from run to run, apart from what sessions use.
    cache = pytestconfig.cache
    assert cache is not None
    environment = os.environ | CHECKED | {"NUMBA_CACHE_DIR": str(cache.mkdir("bounds-checked"))}
    ended = subprocess.run(  # noqa: S603 - a script of the tests
        [sys.executable, "-W", "ignore", SCRIPT], env=environment, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
