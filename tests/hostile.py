"""What somebody else may have put where a file is to be: links, pipes, sockets and devices."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

_T = TypeVar("_T")


def _link_to_nowhere(path: Path) -> None:
    path.symlink_to(path.parent / "nowhere")


def _socket(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # a socket's path is short
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


IN_THE_WAY: Final[dict[str, Callable[[Path], None]]] = {
    "a link that leads nowhere": _link_to_nowhere,
    "a pipe": os.mkfifo,
    "a socket": _socket,
    "a device": lambda path: path.symlink_to("/dev/zero"),
    "a folder": Path.mkdir,
}
"""How each is made."""


def at_once(act: Callable[[], _T], within_s: float = 10.0) -> _T:
    """What something returns or raises, if it does so in time."""
    outcome: list[tuple[_T | None, BaseException | None]] = []

    def run() -> None:
        try:
            outcome.append((act(), None))
        except BaseException as error:  # noqa: BLE001 - raised again by whoever waits
            outcome.append((None, error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(within_s)
    assert outcome, "it waits for ever"
    result, error = outcome[0]
    if error is not None:
        raise error
    return result  # type: ignore[return-value]
