"""Commands as one types them, for messages that say what to do next."""

from __future__ import annotations

import os
import shlex
import subprocess


def command(*words: object) -> str:
    """A command of isiw, its words quoted as this system's shell needs it."""
    line = ["isiw", *map(str, words)]
    return subprocess.list2cmdline(line) if os.name == "nt" else shlex.join(line)
