"""The process that reads one file: it takes a request, limits itself, reads, and writes an answer.

Of files it opens those of the header's own folder and those that are named, and no others.
"""

from __future__ import annotations

import csv
import json
import os
import stat
import sys
import sysconfig
import zoneinfo
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from isiw.errors import ConfigError, InvalidValueError
from isiw.existing import formats
from isiw.existing.apart import Answer, write_answer, write_error
from isiw.existing.layout import Layout
from isiw.existing.limits import ReadingLimits, limit, seconds_for
from isiw.existing.looking import seen_in
from isiw.existing.reading import contents_in, people_of_contents
from isiw.files import hash_of
from isiw.lazy import pd
from isiw.opening import opened
from isiw.text.named_code import library
from isiw.text.toml_files import checked

_HDF5: Final = b"\x89HDF\r\n\x1a\n"
_HDF5_AT: Final = 512  # where a file of HDF5 may begin, too: MATLAB's have a text of their own before it
_NOTHING: Final = Path(os.devnull)  # which libraries open as they ask the system what it is, and which holds nothing


def main() -> None:
    """Answer the request that stands at the standard input."""
    request = json.loads(sys.stdin.buffer.read())
    folder = Path(request["answer"])
    try:
        _answer(request, folder)
    except BaseException as error:  # noqa: BLE001 - whatever a library fails with is the answer
        write_error(folder, error)


def _answer(request: Mapping[str, Any], folder: Path) -> None:
    path, limits = Path(request["path"]), ReadingLimits(**request["limits"])
    layout = checked(Layout, request["layout"], "the layout")
    own = _load_libraries(path)
    csv.field_size_limit(2**31 - 1)  # a cell that is too long is refused in words later
    limit("DATA", 1e6 * limits.memory_mb)
    limit("CPU", seconds_for(limits, path, table=formats.format_of(path).is_table))
    gate = Gate(path, [Path(other) for other in request["also"]], own)
    sys.addaudithook(gate)
    try:
        require_no_links(path)
        contents = contents_in(path, layout, limits)
        if contents.trials is not None:  # for so many rows, of which trials are made, there is more time
            limit("CPU", seconds_for(limits, path, table=True, rows=len(contents.trials)))
        if request["look"]:
            found = seen_in(contents, path, layout, limits)
        else:
            found = Answer(people_of_contents(contents, path, layout, request["subject"], limits), {})
    finally:
        gate.require_nothing_refused()
    write_answer(folder, found, gate.hashes())


def _load_libraries(path: Path) -> list[Path]:
    """Load what takes long to load before the time of reading begins; the files of settings that it reads later on."""
    pd.DataFrame  # noqa: B018 - which loads pandas
    needed = formats.format_of(path).library
    if needed == "mne":
        mne = library("mne", "import")
        mne.io.read_raw  # noqa: B018 - which loads its readers
        return [Path(mne.get_config_path())]
    if needed:
        with suppress(ConfigError):  # whoever reads the file says it
            library(needed, "import")
    return []


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
            what = f"{self.source.name} refers to a file elsewhere, and only files of its own folder are read"
            remedy = "If it belongs to it, put it into that folder, or name it: --also FILE (in Python also=[FILE])."
            self.refused = InvalidValueError(what, got=str(path), remedy=remedy)
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
