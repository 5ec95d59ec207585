"""What holds for all tests before any library is imported, and in the processes that they start."""

from __future__ import annotations

import gc
import os
import sys
from collections import Counter
from collections.abc import Generator
from typing import Any

import pytest

# Workers share the cores, and matrices are small: more threads only wait for each other.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# Workers and the commands that tests start would otherwise compile the modules of isiw again, each of them.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


COMPILES = "tests/strategy/test_catalogue.py"
"""In a fresh clone, whoever begins with this file compiles the loops: half a minute."""

COMPILED_LITTLE = tuple(f"tests/{room}/" for room in ("signals", "devices", "subjects"))
"""Files that hardly call compiled loops: other workers begin with them, instead of waiting for the loops."""


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
    """Order of the files that workers take: see above, and files of many tests before those of few."""
    if not hasattr(config, "workerinput"):
        return
    tests = Counter(item.path for item in items)

    def turn(item: pytest.Item) -> tuple[int, int]:
        first = 0 if item.nodeid.startswith(COMPILES) else 1 if item.nodeid.startswith(COMPILED_LITTLE) else 2
        return first, -tests[item.path]

    items.sort(key=turn)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Each file is run by one worker, so that what a file's tests share is made once."""
    from xdist.scheduler import LoadFileScheduling  # noqa: PLC0415 - whoever runs no workers need not have it

    config.option.loadscopereorder = False  # they are in order
    return LoadFileScheduling(config, log) if config.getoption("dist") == "load" else None
