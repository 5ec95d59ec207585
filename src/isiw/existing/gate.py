"""The files that a reader opens: those of the header's own folder and those that are named, and no others."""

from __future__ import annotations

import hashlib
import os
import stat
import sysconfig
import zoneinfo
from collections.abc import Iterable
from io import BufferedReader
from pathlib import Path
from typing import Any, Final, cast

from isiw.errors import ConfigError, InvalidValueError
from isiw.opening import opened
from isiw.text.named_code import library

_HDF5: Final = b"\x89HDF\r\n\x1a\n"
_HDF5_AT: Final = 512  # where a file of HDF5 may begin, too: MATLAB's have a text of their own before it
_NOTHING: Final = Path(os.devnull)  # which libraries open as they ask the system what it is, and which holds nothing


class Gate:
    """An audit hook that sees each file as it is opened for reading, whatever name in a header a library follows."""

    def __init__(self, source: Path, also: Iterable[Path] = (), own: Iterable[Path] = ()) -> None:
        self.source, self._is_folder = source, source.is_dir()
        self._folder = _real(source if self._is_folder else source.parent)
        self._named = {_real(source), *map(_real, also)}
        places = sysconfig.get_paths()  # Python, its libraries, isiw and time zones are loaded while a file is read
        code = [*(places[key] for key in ("stdlib", "platstdlib", "purelib", "platlib")), *zoneinfo.TZPATH]
        self._code = [*map(_real, [*map(Path, code), Path(__file__).parents[1], *own])]
        self.read: dict[Path, None] = {}
        self.refused: InvalidValueError | None = None

    def __call__(self, event: str, args: tuple[Any, ...]) -> None:
        """See an event of Python; raise if it opens a file elsewhere."""
        if event != "open" or not isinstance(args[0], str | bytes | os.PathLike):
            return
        if args[2] & (os.O_WRONLY | os.O_RDWR) == os.O_WRONLY:
            return
        path = Path(os.fsdecode(args[0]))
        try:
            mode = path.stat().st_mode
        except (OSError, ValueError):  # whoever opens it sees that it is not there
            return
        real = _real(path)
        if stat.S_ISDIR(mode) or real == _NOTHING or any(real.is_relative_to(folder) for folder in self._code):
            return
        inside = real.is_relative_to(self._folder) if self._is_folder else real.parent == self._folder
        if not (inside or real in self._named):
            self.refused = InvalidValueError(
                f"{self.source.name} refers to a file elsewhere, and only files of its own folder are read",
                got=str(path),
                remedy="If it belongs to it, put it into that folder, or name it: --also FILE (in Python also=[FILE]).",
            )
        elif not stat.S_ISREG(mode):
            self.refused = InvalidValueError(f"a file of {self.source.name} is no regular file", got=str(path))
        else:
            self.read[real] = None
            return
        raise self.refused

    def require_nothing_refused(self) -> None:
        """Raise if a file was refused, also if the library that wanted it went on without."""
        if self.refused is not None:
            raise self.refused

    def hashes(self) -> dict[str, str]:
        """The SHA-256 of each file that was read, by its name, and below a folder that is the source by its path."""
        found, source = dict[str, str](), _real(self.source)
        for path in sorted({*self.read, *(() if self._is_folder else (source,))}):
            inside = self._is_folder and path.is_relative_to(self._folder)
            name = path.relative_to(self._folder).as_posix() if inside else path.name
            name = self.source.name if path == source else name
            while name in found:  # files of one name in several folders
                name += "'"
            found[name] = hash_of(path)
        return found


def hash_of(path: Path) -> str:
    """The SHA-256 of a file."""
    with opened(path) as file:
        return hashlib.file_digest(cast("BufferedReader", file), "sha256").hexdigest()


def require_no_links(path: Path) -> None:
    """Raise if a file of HDF5 says that parts of it are in other files, which its library opens past any hook."""
    if not path.is_file():
        return
    with opened(path) as file:
        head = file.read(_HDF5_AT + len(_HDF5))
    if not (head.startswith(_HDF5) or head.endswith(_HDF5)):
        return
    try:
        h5py = library("h5py", "import")
    except ConfigError:  # then nothing else can read it either
        return
    with h5py.File(path, "r") as file:
        found: list[str] = []

        def look(name: str, link: Any) -> None:
            thing = file.get(name) if isinstance(link, h5py.HardLink) else None
            if isinstance(link, h5py.ExternalLink):
                found.append(f"{name} in {link.filename}")
            elif isinstance(thing, h5py.Dataset) and (thing.external or thing.is_virtual):
                found.append(name)

        file.visititems_links(look)
    if found:
        what = f"{path.name} refers to other files, and only what is in it is read"
        raise InvalidValueError(what, got=", ".join(found[:3]), remedy="Save it as one file.")


def _real(path: Path) -> Path:
    return Path(os.path.realpath(path))
