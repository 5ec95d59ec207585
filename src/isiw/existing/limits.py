"""The limits of what is read from a file of another program, each with what it says when it is passed."""

from __future__ import annotations

import glob
import os
import re
import time
import zipfile
from dataclasses import dataclass, fields, replace
from itertools import islice
from pathlib import Path
from typing import IO, Final, Literal

from isiw.checks import Checked, Count, Positive, number
from isiw.errors import InvalidValueError
from isiw.lazy import pd
from isiw.opening import opened

try:
    import resource
except ImportError:  # on Windows
    resource = None  # type: ignore[assignment]

_BYTES_PER_S: Final = {True: 1e6, False: 4e6}  # a table has a second more for each so many bytes, and a recording
_ROWS_PER_S: Final = 2e3  # a second more for each so many rows, once they are read: a trial is made of each
_SIGNS: Final = (b"\t", b";", b",", b"|")  # what separates the cells of a text
_BLANKS: Final = re.compile(rb"\s\S")  # or else blanks do
_BYTES_PER_SIGN: Final = 4  # a character takes no more
_FIRST_LINES, _CHUNK = 100, 2**20
LARGEST_FACTOR: Final = 1e6  # by which limits are multiplied at most, so that each remains a number


@dataclass(frozen=True)
class ReadingLimits(Checked):
    """The most that is read from one file; `larger` gives a file more of everything.

    Args:
        file_mb: the size of the file [MB].
        unpacked_mb: what the parts of a packed file, such as a workbook, are unpacked to [MB].
        memory_mb: the memory of the process that reads [MB].
        seconds: its processor time [s], besides a second for each MB of a table, for each 2,000 of its rows, and for
            each 4 MB of a recording.
        lines: the lines of a text, empty ones, too.
        rows: the rows of a table.
        columns: its columns.
        cells: its cells.
        visits: the people of a table, each visit of a person counted.
        trials: the trials of one person at one visit.
        name_length: the length of a column's name [characters].
        cell_length: the length of the text in a cell [characters].

    Raises:
        InvalidValueError: a limit that is not positive.
    """

    file_mb: Positive = 4000.0
    unpacked_mb: Positive = 500.0
    memory_mb: Positive = 700.0
    seconds: Positive = 3.0
    lines: Count = 1_000_000
    rows: Count = 250_000
    columns: Count = 2_000
    cells: Count = 2_000_000
    visits: Count = 5_000
    trials: Count = 20_000
    name_length: Count = 1_000
    cell_length: Count = 32_767

    def larger(self, factor: float) -> ReadingLimits:
        """The same, each multiplied.

        Args:
            factor: by how much, at least 1.

        Raises:
            InvalidValueError: a factor below 1 or above `LARGEST_FACTOR`.
        """
        factor = number("by how much limits of reading are larger", factor, least=1, most=LARGEST_FACTOR)
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        return replace(self, **{name: type(value)(value * factor) for name, value in values.items()})


def seconds_for(limits: ReadingLimits, path: Path, *, table: bool, rows: int = 0) -> float:
    """The processor time for one file, of which so many rows are known [s]."""
    parts = path.rglob("*") if path.is_dir() else path.parent.glob(f"{glob.escape(path.stem)}*")
    size = sum(part.stat().st_size for part in ([path] if table else parts) if part.is_file())  # or samples beside it
    return limits.seconds + size / _BYTES_PER_S[table] + rows / _ROWS_PER_S


def passed(source: str, what: str, got: object, most: float, unit: str = "") -> InvalidValueError:
    """The error that a file has more than a limit allows."""
    remedy = "Is it the right file? If it is, say --larger 2, or more (limits=isiw.existing.ReadingLimits().larger(2))."
    return InvalidValueError(f"{source} {what}", got=got, expected=f"at most {most:g}{unit}", remedy=remedy)


def require_file(limits: ReadingLimits, path: Path, *, text: bool) -> None:
    """Raise if a file is too large, or what it unpacks to, or if a text has too many lines."""
    if not path.is_file():
        return
    with opened(path) as file:
        require_most(path.name, ("is too large", os.fstat(file.fileno()).st_size / 1e6, limits.file_mb, " MB"))
        if file.read(2) == b"PK":
            try:
                unpacked_mb = sum(part.file_size for part in zipfile.ZipFile(file).infolist()) / 1e6
            except (zipfile.BadZipFile, ValueError, NotImplementedError):  # its reader says what is wrong
                return
            require_most(path.name, ("unpacks to too much", unpacked_mb, limits.unpacked_mb, " MB"))
        elif text:
            _require_lines(limits, path.name, file)


def _require_lines(limits: ReadingLimits, source: str, file: IO[bytes]) -> None:
    lines = dict.fromkeys((b"\n", b"\r"), 0)
    file.seek(0)
    while chunk := file.read(_CHUNK):
        for end in lines:
            lines[end] += chunk.count(end)
    require_most(source, ("has too many lines", max(lines.values()), limits.lines, ""))
    file.seek(0)
    for line in islice(file, _FIRST_LINES):
        cells = 1 + (max(map(line.count, _SIGNS)) or sum(1 for _ in islice(_BLANKS.finditer(line), limits.columns)))
        most = _BYTES_PER_SIGN * limits.cell_length * cells
        require_most(source, ("has too many columns", cells, limits.columns, ""),
                     ("has too long a line for its cells", len(line), most, " bytes"))  # fmt: skip


def require_table(limits: ReadingLimits, frame: pd.DataFrame, source: str) -> None:
    """Raise if a table has too many rows, columns or cells, or too long a name or text."""
    rows, columns = frame.shape
    require_most(source, ("has too many columns", columns, limits.columns, ""),
                 ("has too many rows", rows, limits.rows, ""),
                 ("has too many cells", frame.size, limits.cells, ""))  # fmt: skip
    texts = [("has too long a name of a column", [*map(str, frame.columns)], limits.name_length)]
    for name, cells in frame.items():
        if not pd.api.types.is_numeric_dtype(cells):
            texts.append((f"has too long a text in the column {name!r}", cells.tolist(), limits.cell_length))
    for what, each, most in texts:
        longest = max((len(cell) for cell in each if isinstance(cell, str | bytes)), default=0)
        require_most(source, (what, longest, most, " characters"))


def require_most(source: str, *counts: tuple[str, float, float, str]) -> None:
    """Raise if there is more of something than a limit allows: what it has, how much, at most, and in which unit."""
    for what, got, most, unit in counts:
        if got > most:
            raise passed(source, what, f"{got:.0f}{unit}" if unit else got, most, unit)


def limit(kind: Literal["DATA", "CPU"], most: float) -> None:
    """Limit the memory of this process [bytes] on Linux, or its processor time from now on [s], but on Windows."""
    if resource is not None:
        limited, begun = getattr(resource, f"RLIMIT_{kind}"), 1 + time.process_time() if kind == "CPU" else 0
        _, hard = resource.getrlimit(limited)
        resource.setrlimit(limited, (int(most + begun if hard < 0 else min(most + begun, hard)), hard))
