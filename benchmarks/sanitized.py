"""Runs a script with an engine that checks itself: its addresses, and that nothing it does is undefined.

The library is compiled with the sanitizers of the compiler (`ISIW_SANITIZE=1`, see hatch_build.py) and loaded in a
process of its own, which has to begin with their memory allocator.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import hatch_build

from isiw.native import engine

ROOT: Final = Path(hatch_build.__file__).parent
TAKEN: Final = "ISIW_SANITIZED_LIBRARY"
"""The environment variable that a process of `run` has, with the library that `take` takes."""


def compiler() -> str | None:
    """The compiler of this computer, if it has sanitizers that can be loaded first."""
    for command in ("cc", "gcc"):
        if hatch_build.works([command]) and _allocator(command) is not None:
            return command
    return None


def _allocator(command: str) -> Path | None:
    """The library of the address sanitizer; None if the compiler has none."""
    said = hatch_build.run([command, "-print-file-name=libasan.so"]).stdout.strip()
    return Path(said) if Path(said).is_file() else None


def run(arguments: Sequence[str | Path], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run Python with some arguments, its scripts taking the library that checks itself; it fails where that does.

    Args:
        arguments: of Python.
        folder: where the library is compiled, or kept from before.
    """
    command = compiler()
    if command is None:
        raise SystemExit("There is no compiler with sanitizers here: install gcc.")
    made = folder / hatch_build.here().file
    folders = os.pathsep.join(map(str, (ROOT / "src", ROOT, ROOT / "tests")))
    environment = os.environ | {"ISIW_SANITIZE": "1", "CC": command, "PYTHONPATH": folders}
    build = "import sys, pathlib, hatch_build; hatch_build.build(pathlib.Path(sys.argv[1]))"
    subprocess.run([sys.executable, "-c", build, made], env=environment, check=True)  # noqa: S603 - this repository's
    environment |= {TAKEN: str(made), "LD_PRELOAD": str(_allocator(command)), "ASAN_OPTIONS": "detect_leaks=0"}
    environment |= {"PYTHONMALLOC": "malloc"}  # or small arrays come from memory that the sanitizers do not see
    return subprocess.run(  # noqa: S603 - scripts of this repository
        [sys.executable, *arguments], env=environment, capture_output=True, text=True, check=False
    )


def take() -> None:
    """Have this process use the library that checks itself."""
    engine._PATH = Path(os.environ[TAKEN])  # type: ignore[misc] # noqa: SLF001 - isiw itself loads no other one
