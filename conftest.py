"""What holds for all tests before any library is imported, and in the processes that they start."""

from __future__ import annotations

import gc
import os
import sys
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

# Workers share the cores, and matrices are small: more threads only wait for each other.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# Workers and the commands that tests start would otherwise compile the modules of isiw again, each of them.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


SLOW = 20
"""As many usual tests take about as long as one that is marked slow."""


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Modules and tests stay until the end: nothing looks for garbage among them."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Workers take the files of most work first, so that none has one left when the others have done all theirs."""
    if not hasattr(config, "workerinput"):
        return
    work = Counter[Path]()
    for item in items:
        work[item.path] += SLOW if item.get_closest_marker("slow") else 1
    items.sort(key=lambda item: -work[item.path])


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Each file is run by one worker, so that what a file's tests share is made once."""
    from xdist.scheduler import LoadFileScheduling  # noqa: PLC0415 - whoever runs no workers need not have it

    config.option.loadscopereorder = False  # they are in order
    return LoadFileScheduling(config, log) if config.getoption("dist") == "load" else None
