"""Files that are made of logs, such as pictures: they replace no log, and nothing else unasked."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Final

from isiw.errors import InvalidValueError
from isiw.files import in_the_way, is_reserved, opened, put

_LOG: Final = b"\x89MCAP"
"""What every log begins with."""


def write_output(path: str | Path, content: bytes, *, overwrite: bool = False) -> Path:
    """Write a file that is no log, as a whole or not at all; its folder is made where it is missing."""
    target = Path(path)
    check_output(target, overwrite=overwrite)
    made_folder(target.parent)
    try:
        put(target, content, replacing=overwrite)
    except FileExistsError as error:
        raise _taken(target) from error
    except OSError as error:  # which names what is written first, and not the file that was asked for
        raise OSError(error.errno, error.strerror, str(target)) from error
    return target


def check_output(path: str | Path, *, overwrite: bool = False) -> None:
    """Check that `write_output` may write a file; for whoever has long work to do before."""
    target = Path(path)
    if target.parent.is_dir() and not os.access(target.parent, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(target))
    if is_reserved(target.name):
        raise InvalidValueError("Windows keeps this name for itself", got=str(target), remedy="Choose another name.")
    if (other := in_the_way(target)) is not None:
        raise InvalidValueError(f"there is {other} of this name", got=str(target), remedy="Name a file.")
    if overwrite and is_mcap(target):
        raise InvalidValueError("a log is never overwritten", got=str(target), remedy="Choose another path.")
    if not overwrite and target.exists():
        raise _taken(target)


def made_folder(path: str | Path) -> Path:
    """A folder, made where it is missing."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = "it is a file" if folder.is_file() else error.strerror
        raise InvalidValueError(
            f"the folder cannot be made: {why}", got=str(folder), remedy="Choose another folder."
        ) from error
    return folder


def _taken(target: Path) -> InvalidValueError:
    return InvalidValueError(
        "there is a file already, and it is not overwritten unasked",
        got=str(target),
        remedy="Choose another path, or ask for it: --overwrite, or overwrite=True.",
    )


def is_mcap(path: Path) -> bool:
    """Whether a file begins as every log does, whatever its name."""
    if not path.is_file():
        return False
    with opened(path) as file:
        return file.read(len(_LOG)) == _LOG
