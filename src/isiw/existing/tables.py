"""Tables of trials, as spreadsheets and statistics write them: pandas reads, and what is ambiguous is asked about."""

from __future__ import annotations

import importlib
import io
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from isiw.errors import ConfigError, InvalidValueError, did_you_mean
from isiw.existing.cells import Column, decimal_of
from isiw.existing.layout import COLUMNS, ISI_UNITS_MS, Layout
from isiw.files import opened
from isiw.lazy import pd, scipy
from isiw.signals.limits import EMG_UNITS_MV

TEXTS: Final = {".csv", ".tsv", ".txt", ".dat", ".tab"}
WORKBOOKS: Final = {".xlsx", ".xlsm"}
SUFFIXES: Final = TEXTS | WORKBOOKS | {".parquet"}

_ENCODINGS: Final = ("utf-8-sig", "cp1252")
_UNIT_KEYS: Final = {"ms": "ms", "msec": "ms", "s": "s", "sec": "s", "us": "us", "µs": "us", "μs": "us",
                     "v": "V", "mv": "mV", "uv": "uV", "µv": "uV", "μv": "uV"}  # fmt: skip


def read_frame(path: Path, layout: Layout) -> pd.DataFrame:
    """The table in a file, its cells as they are."""
    suffix = path.suffix.lower()
    readers = {".mat": _matlab, ".parquet": _parquet} | dict.fromkeys(WORKBOOKS, _workbook)
    read = readers.get(suffix, _texts)
    with opened(path) as file:
        content = file.read()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a workbook's styles; what is in its cells is checked
            frame = read(content, layout)
    except (ConfigError, InvalidValueError):
        raise
    except Exception as error:  # each reader has errors of its own
        why, *_ = str(error).splitlines() or [type(error).__name__]
        raise InvalidValueError(
            f"the file is no table that can be read: {why}",
            got=str(path),
            remedy="Save it as CSV, with the columns' names in the first line.",
        ) from error
    if not len(frame):
        raise InvalidValueError("the table has no rows", got=str(path), remedy="Are the lines before it skipped?")
    return frame


def _texts(content: bytes, layout: Layout) -> pd.DataFrame:
    text = _decoded(content)
    lines = text.splitlines()[layout.skip_lines :]
    separator = layout.separator or _separator(lines[0] if lines else "")
    header: dict[str, Any] = {"header": None, "names": list(layout.names)} if layout.names else {}
    options: dict[str, Any] = {"dtype": str, "keep_default_na": False, "skipinitialspace": True, **header}
    frame: pd.DataFrame = pd.read_csv(io.StringIO("\n".join(lines)), sep=separator, **options)
    return frame


def _decoded(content: bytes) -> str:
    if content[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        return content.decode("utf-16")
    for encoding in _ENCODINGS:
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    return content.decode("latin-1")


def _separator(line: str) -> str:
    """What separates the columns' names; blanks, if nothing else does."""
    counts = {sign: line.count(sign) for sign in ("\t", ";", ",")}
    best = max(counts, key=lambda sign: counts[sign])
    return best if counts[best] else r"\s+"


def _workbook(content: bytes, layout: Layout) -> pd.DataFrame:
    extra("openpyxl")
    return pd.read_excel(io.BytesIO(content), sheet_name=layout.sheet or 0, skiprows=layout.skip_lines, dtype=object)


def _parquet(content: bytes, _: Layout) -> pd.DataFrame:
    return pd.read_parquet(io.BytesIO(content))


def _matlab(content: bytes, _: Layout) -> pd.DataFrame:
    """The vectors of equal length in a file of MATLAB, as the columns of a table."""
    values = scipy.io.loadmat(cast("Any", io.BytesIO(content)), squeeze_me=True)
    vectors = {name: value for name, value in values.items() if not name.startswith("__") and np.ndim(value) == 1}
    longest = max((len(vector) for vector in vectors.values()), default=0)
    return pd.DataFrame({name: vector for name, vector in vectors.items() if len(vector) == longest})


def extra(name: str) -> Any:
    """A library of the extra `import`."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise ConfigError(f"{name} is not installed", remedy='Install it with: pip install "isiw[import]"') from error


@dataclass(frozen=True)
class Columns:
    """The columns of a table by what they hold, and the units of ISIs and amplitudes.

    Args:
        of: the columns that are there.
        isi_ms: one of the unit of the ISIs in ms.
        mep_mv: one of the unit of the amplitudes in mV.
        rows: how many rows there are.
    """

    of: Mapping[str, Column]
    isi_ms: float
    mep_mv: float
    rows: int

    @classmethod
    def found(cls, frame: pd.DataFrame, layout: Layout, source: str) -> Columns:
        """The columns of a table, as they are named or else as they are called."""
        names = [str(name) for name in frame.columns]
        held = {key: _named(key, names, layout, source) for key in COLUMNS}
        for key in ("isi", "mep"):
            if held[key] is None:
                raise _missing(key, names, source)
        cells = {key: frame.iloc[:, names.index(name)].tolist() for key, name in held.items() if name is not None}
        columns = {key: Column(held[key] or "", values, of=source) for key, values in cells.items()}
        numeric = [columns[key] for key in ("isi", "mep", "asked", "isi_sd", "background") if key in columns]
        decimal = decimal_of(numeric, layout.decimal)
        columns = {key: Column(each.name, each.cells, decimal, source) for key, each in columns.items()}
        isi_ms = _unit("ISIs", columns["isi"], layout, ISI_UNITS_MS)
        return cls(columns, isi_ms, _unit("amplitudes", columns["mep"], layout, EMG_UNITS_MV), len(frame))

    def number(self, key: str, row: int, factor: float = 1.0) -> float | None:
        """A number of a row; None if there is none."""
        column = self.of.get(key)
        return None if column is None else column.number(row, factor)

    def flag(self, key: str, row: int) -> bool | None:
        """A yes or no of a row; None if there is none."""
        column = self.of.get(key)
        return None if column is None else column.flag(row)

    def text(self, key: str, row: int) -> str:
        """A text of a row; empty if there is none."""
        column = self.of.get(key)
        return "" if column is None else column.text(row)


def _letters(name: str) -> str:
    """A column's name in letters alone, without its unit."""
    words = re.findall(r"[^\W_]+", re.sub(r"[\[(].*?[\])]", " ", name.casefold()))
    while len(words) > 1 and words[-1] in _UNIT_KEYS:
        words.pop()
    return "".join(words)


def _named(key: str, names: list[str], layout: Layout, source: str) -> str | None:
    """The column that holds something; None if there is none."""
    if (stated := layout.columns.get(key)) is not None:
        if stated not in names:
            raise InvalidValueError(
                f"{source} has no such column",
                got=stated,
                expected=f"one of {', '.join(names)}",
                remedy=did_you_mean(stated, names) or None,
            )
        return stated
    taken = set(layout.columns.values())
    for known in COLUMNS[key]:
        fitting = [name for name in names if _letters(name) == known and name not in taken]
        if len(fitting) > 1:
            raise InvalidValueError(
                f"several columns of {source} may hold the {key}",
                got=" or ".join(fitting),
                remedy=f'Say --column "{key}={fitting[0]}".',
            )
        if fitting:
            return fitting[0]
    return None


def _missing(key: str, names: list[str], source: str) -> InvalidValueError:
    what = {"isi": "ISIs", "mep": "amplitudes of the MEPs"}[key]
    return InvalidValueError(
        f"no column of {source} is known to hold the {what}",
        got=", ".join(names),
        remedy=f'Say --column "{key}=NAME"; if the names are not in the first line, describe the file: --layout FILE.',
    )


def _unit(what: str, column: Column, layout: Layout, known: Mapping[str, float]) -> float:
    """One of the column's unit in ms or mV, by its name or as it is stated."""
    bracketed = re.findall(r"[\[(](.*?)[\])]", column.name)
    words = [*bracketed, *re.findall(r"[^\W_]+", column.name)[1:]]
    told = [unit for word in words if (unit := _UNIT_KEYS.get(word.strip().casefold(), "")) in known]
    stated = layout.unit_of(known)
    if stated is None and not told:
        units = "ms or s" if "ms" in known else "mV, uV or V"
        numbers = [value for row in range(len(column.cells)) if isinstance(value := _tried(column, row), float)]
        span = f"{min(numbers):g} to {max(numbers):g}" if numbers else None
        raise InvalidValueError(
            f"nobody says in which unit the {what} of {column.of} are, in the column {column.name!r}",
            got=span,
            remedy=f"Say --unit with {units}.",
        )
    return known[stated or told[-1]]


def _tried(column: Column, row: int) -> float | None:
    try:
        return column.number(row)
    except InvalidValueError:
        return None
