"""Disks that lack what local ones have: room, and calls of the operating system."""

from __future__ import annotations

import errno
import os
import shutil
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any, Never

import pytest


def no_room(_: object) -> Never:
    """In place of a call of the operating system that writes."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _replaced(file: Path) -> None:
    content = file.read_bytes()
    file.unlink()
    file.write_bytes(content)


HAPPENINGS: dict[str, Callable[[Path], object]] = {
    "deleted": lambda file: file.unlink(),
    "moved": lambda file: file.rename(file.with_name("elsewhere")),
    "its folder deleted": lambda file: shutil.rmtree(file.parent),
    "its folder moved": lambda file: file.parent.rename(file.parent.with_name("elsewhere")),
    "shortened": lambda file: os.truncate(file, file.stat().st_size // 2),
    "lengthened": lambda file: file.write_bytes(file.read_bytes() + b"more"),
    "replaced": _replaced,
}
"""What may happen to a file while it is written, but on Windows."""


def is_folder(handle: int) -> bool:
    """True if an open file is a folder."""
    return stat.S_ISDIR(os.fstat(handle).st_mode)


def over_a_file(_: Any, place: Any) -> bool:
    """True if a rename would replace something."""
    return Path(place).exists()


def refusing(patched: pytest.MonkeyPatch, call: str, code: int, only: Callable[..., bool] = lambda *_: True) -> None:
    """Let a call of the operating system fail as on a disk that does not know it."""
    real = getattr(os, call)

    def called(*args: Any, **more: Any) -> Any:
        if only(*args):
            raise OSError(code, os.strerror(code))
        return real(*args, **more)

    patched.setattr(os, call, called)
