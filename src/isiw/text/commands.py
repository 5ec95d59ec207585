"""Commands as one types them, for messages that say what to do next."""

from __future__ import annotations

import os
import shlex
import subprocess

__all__ = ["command"]


def command(*words: object) -> str:
    """A command of isiw, its words quoted as this system's shell needs it.

    Args:
        words: what comes after `isiw`: names of commands, options, paths.
    """
    line = ["isiw", *map(str, words)]
    return subprocess.list2cmdline(line) if os.name == "nt" else shlex.join(line)
