"""What holds for all tests before any library is imported, and in the processes that they start."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Generator
from pathlib import Path

import pytest

# Workers share the cores, and matrices are small: more threads only wait for each other.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# Workers and the commands that tests start would otherwise compile the modules of isiw again, each of them.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Modules and tests stay until the end: nothing looks for garbage among them."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


APART = ("slow", "long")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Of slow tests, or of long ones, only files that mark one so are read: most do not, and each loads libraries."""
    mark = config.option.markexpr
    return True if mark in APART and collection_path.suffix == ".py" and not _marks(collection_path, mark) else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Raise if a mark is made elsewhere than in the file of its test, where it would not be looked for."""
    marked = {(item.path, mark) for item in items for mark in APART if item.get_closest_marker(mark)}
    if unseen := sorted(str(path) for path, mark in marked if not _marks(path, mark)):
        raise pytest.UsageError(f"slow or long tests whose file does not have pytest.mark.slow or .long: {unseen}")


def _marks(path: Path, mark: str) -> bool:
    return f"pytest.mark.{mark}" in path.read_text(encoding="utf-8")
