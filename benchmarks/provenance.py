"""Where results come from: the command that made them, and the versions it was run with."""

from __future__ import annotations

import platform
import shlex
import sys
from importlib import metadata

__all__ = ["command_of", "facts_of", "made_with", "versions_of"]


def command_of(benchmark: str) -> str:
    """The command that runs a benchmark as it is being run.

    Args:
        benchmark: its module in this folder.
    """
    return shlex.join(["python", "-m", f"benchmarks.{benchmark}", *sys.argv[1:]])


def versions_of(*packages: str) -> dict[str, str]:
    """The versions of Python, isiw and some packages, by name."""
    return {"python": platform.python_version()} | {name: metadata.version(name) for name in ("isiw", *packages)}


def made_with(*packages: str) -> str:
    """The versions of Python, isiw and some packages in a line."""
    return ", ".join(f"{name} {version}" for name, version in versions_of(*packages).items())


def facts_of(benchmark: str, *packages: str, **more: object) -> dict[str, object]:
    """What a run was: its command, its versions, and what else there is to say, such as the seed."""
    return {"command": command_of(benchmark), "versions": versions_of(*packages), **more}
