"""What holds for all tests before any library is imported, and in the processes that they start."""

from __future__ import annotations

import os
import sys
from typing import Any

import pytest

# Workers share the cores, and matrices are small: more threads only wait for each other.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# Workers and the commands that tests start would otherwise compile the modules of isiw again, each of them.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Each file is run by one worker, so that what a file's tests share is made once."""
    from xdist.scheduler import LoadFileScheduling  # noqa: PLC0415 - whoever runs no workers need not have it

    return LoadFileScheduling(config, log) if config.getoption("dist") == "load" else None
