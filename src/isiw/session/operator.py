"""The operator at the terminal, where there is one."""

from __future__ import annotations

import sys

from isiw.session.terminal import is_terminal
from isiw.text import plain


def goes_on(reason: str) -> bool:
    """Ask in the terminal whether to go on; no, where there is no terminal."""
    if not (is_terminal(sys.stdin) and is_terminal(sys.stderr)):
        return False
    alarm(f"\n{reason} The device is disarmed. Go on? [y/N] ", end="")
    return sys.stdin.readline().strip().lower() in {"y", "yes"}


def alarm(text: str, *, end: str = "\n") -> None:
    """Say something on the screen at once."""
    if sys.stderr is not None:  # as under pythonw
        sys.stderr.write(f"{plain(text)}{end}")
        sys.stderr.flush()
