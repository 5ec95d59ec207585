"""Creates and replaces files in folders that others can write to: whole, synced, and through no link.

A file is written under a new random name, and takes its place in one step. A folder that its disk cannot sync is said
once, and used.

On Windows the names of devices are refused. On macOS a disk is asked to empty its cache, which `fsync` alone does not.
These branches have been type-checked, and have not been run.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import stat
import sys
import unicodedata
import uuid
from contextlib import suppress
from io import BufferedReader
from pathlib import Path
from typing import IO, Final, cast

from isiw.errors import DiskWarning, InvalidValueError, warn
from isiw.opening import opened

if sys.platform == "darwin":
    import fcntl

TEMPORARY: Final = ".isiw-"
"""What the name of a file begins with until it takes its place; a process that is killed may leave it behind."""

_RESERVED: Final = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9¹²³])\s*([.:].*)?", re.IGNORECASE)
_KINDS: Final = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFDIR: "a folder",
}


def is_reserved(name: str) -> bool:
    """True if Windows takes a file's name for a device, or for another name: `CON`, `aux.mcap`, `log.`."""
    return bool(_RESERVED.fullmatch(name)) or name.endswith((".", " "))


def folded(name: str) -> str:
    """A file's name as systems compare it for which capitals and the spelling of accents make no difference."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFD", name).casefold()).rstrip(". ")


def twin(path: Path) -> Path | None:
    """The file beside a path that has another name here and the same one on other systems; None if there is none."""
    try:
        names = sorted(other.name for other in path.parent.iterdir())
    except FileNotFoundError:
        return None
    own = folded(path.name)
    return next((path.with_name(name) for name in names if name != path.name and folded(name) == own), None)


def in_the_way(path: Path) -> str | None:
    """The thing of a file's name that is no file, in words; None if there is a file, or nothing."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        if path.is_symlink():
            return "a link that leads nowhere"
        if isinstance(error, FileNotFoundError | NotADirectoryError):
            return None
        raise
    return None if stat.S_ISREG(mode) else _KINDS.get(stat.S_IFMT(mode), "something else")


def new_file(path: Path) -> IO[bytes]:
    """A file that was not there, open for reading and appending."""
    return open(path, "a+b", opener=lambda name, flags: os.open(name, flags | os.O_EXCL, 0o666))


def shared_file(path: Path) -> IO[bytes]:
    """A file that all accounts of this computer may open, made if it is missing; through no link, and never emptied.

    What is there is opened without the wish to make it, which some systems refuse in a folder for all if it is another
    account's.
    """
    flags = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        handle = os.open(path, flags)
    except FileNotFoundError:
        try:
            handle = os.open(path, flags | os.O_CREAT | os.O_EXCL, 0o666)
        except FileExistsError:  # another process was faster
            handle = os.open(path, flags)
        else:
            if hasattr(os, "fchmod"):
                os.fchmod(handle, 0o666)  # whatever is taken from new files of this account
    return os.fdopen(handle, "r+b")


def beside(path: Path) -> Path:
    """A new random name beside a path, for a file that takes its place later."""
    return path.with_name(f"{TEMPORARY}{uuid.uuid4().hex}")


def written_beside(path: Path, content: bytes) -> Path:
    """A new file beside a path, under a random name; synced."""
    written = beside(path)
    with new_file(written) as file:
        try:
            file.write(content)
            file.flush()
            force(file.fileno())
        except BaseException:
            _removed(written)
            raise
    return written


def put(path: Path, content: bytes, *, replacing: bool) -> None:
    """Put a whole file in its place in one step, for good."""
    written = written_beside(path, content)
    try:
        if replacing:
            written.replace(path)
        else:
            take_free_place(written, path)
        sync_folder(path.parent)
    except BaseException:
        _removed(written)
        raise


def _removed(file: Path) -> None:
    with suppress(OSError):
        file.unlink(missing_ok=True)


def take_free_place(file: Path, place: Path) -> None:
    """Rename a file to a name that nothing has, in one step that replaces nothing."""
    if sys.platform == "win32":
        file.rename(place)  # which Windows itself refuses if the name is taken
        return
    try:
        place.hardlink_to(file)
    except FileExistsError:
        raise
    except OSError:  # a disk without hard links
        if os.path.lexists(place):
            raise FileExistsError(place) from None
        file.rename(place)
    else:
        file.unlink()


_CANNOT_SYNC: Final = frozenset(
    {errno.EINVAL, errno.EBADF, errno.EIO, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.EACCES, errno.EPERM}
)
_said: set[str] = set()


def sync_folder(folder: Path) -> None:
    """Make a rename in this folder durable, if its disk can; a warning says once that it cannot.

    The files themselves are synced, so that only a power cut just after a rename may bring back a name from before.
    Windows makes a rename durable by itself.
    """
    if sys.platform == "win32":
        return
    try:
        handle = os.open(folder, os.O_RDONLY)
        try:
            force(handle)
        finally:
            os.close(handle)
    except OSError as error:
        if error.errno not in _CANNOT_SYNC:
            raise
        if (place := os.path.realpath(folder)) not in _said:
            _said.add(place)
            why = f"The disk of {place} cannot sync a folder ({error.strerror}), as some network disks. It is used."
            warn(f"{why} After a power cut the newest log there may have its name from before.", DiskWarning)


def force(handle: int) -> None:
    """Return when what was written is on the disk."""
    if sys.platform == "darwin":
        with suppress(OSError):  # not every file system can
            fcntl.fcntl(handle, fcntl.F_FULLFSYNC)
            return
    os.fsync(handle)


def write_output(path: str | Path, content: bytes, *, overwrite: bool = False) -> Path:
    """Write a file that is no log, as a whole or not at all; its folder is made if it is missing."""
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


def check_output(path: str | Path, *, overwrite: bool) -> None:
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
    """A folder, made if it is missing."""
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
        remedy="Choose another path, or replace it: --overwrite, or overwrite=True.",
    )


_LOG: Final = b"\x89MCAP"
"""What every log begins with."""


def is_mcap(path: Path) -> bool:
    """True if a file begins as every log does, whatever its name."""
    if not path.is_file():
        return False
    with opened(path) as file:
        return file.read(len(_LOG)) == _LOG


def hash_of(path: Path) -> str:
    """The SHA-256 of a file."""
    with opened(path) as file:
        return hashlib.file_digest(cast("BufferedReader", file), "sha256").hexdigest()
