"""The columns of a table: what they hold, in which units, and their cells as other programs write numbers and words."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, Final

from isiw.errors import InvalidValueError, did_you_mean
from isiw.existing.layout import COLUMNS, ISI_UNITS_MS, UNIT_WORDS, Layout, letters
from isiw.lazy import pd
from isiw.signals.limits import EMG_UNITS_MV

_MISSING: Final = frozenset({"", "nan", "(null)", "na", "n/a", "none", "null", "<na>", "nat", "-", "--", ".", "?"})
_YES: Final = frozenset({"1", "1.0", "true", "yes", "y", "x", "accepted", "accept", "ok", "good", "valid", "keep"})
_NO: Final = frozenset({"0", "0.0", "false", "no", "n", "mistrial", "rejected", "reject", "bad", "invalid", "excluded"})
_ALONE: Final = frozenset({"tms alone", "tms only", "tms", "single", "single pulse", "single tms", "sp", "alone", "ts",
                           "baseline", "control", "unconditioned", "unpaired", "ts alone", "ts only", "test",
                           "test alone", "test only", "test pulse", "test stimulus", "no tap"})  # fmt: skip
"""What a cell of ISIs says of TMS alone, hyphens and underscores as blanks."""

_NUMBER: Final = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?inf(inity)?", re.IGNORECASE)
_GROUPED: Final = {
    ".": re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d+)?"),
    ",": re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+(,\d+)?"),
}
"""By the decimal sign, numbers whose thousands are grouped by the other sign."""
_NUMBER_BEFORE: Final = re.compile(r"^[-+\d.,\s]*(e[-+]?\d+)?\s*")
_BLANKS: Final = re.compile(r"(?<=\d)[ '\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}](?=\d{3})")


def is_missing(cell: Any) -> bool:
    """True if a cell holds nothing."""
    if isinstance(cell, str):
        return cell.strip().casefold() in _MISSING
    return cell is None or cell != cell or type(cell).__name__ in {"NAType", "NaTType"}  # noqa: PLR0124 - NaN


def _value(text: str, decimal: str) -> float:
    """The number that a text is; NaN if it is none."""
    text = _BLANKS.sub("", text.strip().replace("\N{MINUS SIGN}", "-"))
    group = "," if decimal == "." else "."
    if group in text:
        if not _GROUPED[decimal].fullmatch(text):
            return math.nan
        text = text.replace(group, "")
    text = text.replace(decimal, ".")
    return float(text) if _NUMBER.fullmatch(text) else math.nan


def says_alone(cell: Any, mark: str | None) -> bool:
    """True if a cell of ISIs stands for TMS alone; an empty one does only if that is the mark."""
    if mark is not None and (is_missing(cell) if not mark.strip() else _same(cell, mark)):
        return True
    return isinstance(cell, str) and " ".join(re.split(r"[\s_-]+", cell.strip().casefold())) in _ALONE


def _same(cell: Any, mark: str) -> bool:
    if str(cell).strip().casefold() == mark.strip().casefold():
        return True
    return isinstance(cell, Real) and bool(_NUMBER.fullmatch(mark.strip())) and float(cell) == float(mark)


@dataclass(frozen=True)
class Column:
    """A column that holds something known: its name and cells as they were read, and how its numbers are read."""

    name: str
    cells: Sequence[Any]
    decimal: str = "."
    of: str = "the data"
    factor: float = 1.0  # that turns a number into ms, mV or µV

    def number(self, row: int) -> float | None:
        """The number in a row [ms, mV or µV]; None if the cell is empty."""
        cell = self.cells[row]
        if is_missing(cell):
            return None
        if isinstance(cell, str):
            value = _value(cell, self.decimal)
        else:
            value = float(cell) if isinstance(cell, Real) and not isinstance(cell, bool) else math.nan
        if not math.isfinite(value):
            usual = "Correct it, leave the cell empty, or name another column: --column KEY=NAME."
            is_comma = isinstance(cell, str) and "," in cell and self.decimal != ","
            remedy = "If the comma is a decimal sign, say --decimal ," if is_comma else usual
            raise self.refused(row, "is no number", remedy)
        return value if self.factor == 1.0 else value * self.factor

    def flag(self, row: int) -> bool | None:
        """True if the cell of a row says yes; None if it is empty."""
        cell = self.cells[row]
        if is_missing(cell):
            return None
        word = str(cell).strip().casefold()
        if word not in _YES | _NO:
            raise self.refused(row, "says neither yes nor no", "Use accepted and rejected, or 1 and 0.")
        return word in _YES

    def text(self, row: int) -> str:
        """The cell of a row as text; a whole number has no decimal sign."""
        cell = self.cells[row]
        if is_missing(cell):
            return ""
        whole = isinstance(cell, Real) and not isinstance(cell, bool) and float(cell).is_integer()
        return str(int(cell)) if whole else str(cell).strip()

    def refused(self, row: int, why: str, remedy: str) -> InvalidValueError:
        """The error that a cell of a row cannot be read."""
        return InvalidValueError(
            f"row {row + 1} of the column {self.name!r} of {self.of} {why}", got=self.cells[row], remedy=remedy
        )


def with_decimals(columns: Mapping[str, Column], stated: str | None) -> dict[str, Column]:
    """Columns with the decimal sign of each one's texts; one that may also group thousands is asked about."""
    signs = {key: _signs(column) for key, column in columns.items()}
    all_signs = set[str]().union(*signs.values())
    usual = stated or (all_signs.pop() if len(all_signs) == 1 else None)
    found = {}
    for key, column in columns.items():
        if usual is None and not signs[key] and (doubtful := _doubtful(column)):
            raise InvalidValueError(
                f"the {'comma' if ',' in doubtful else 'point'} in the column {column.name!r} of {column.of} may be a "
                "decimal sign, or group thousands",
                got=doubtful,
                remedy="Say --decimal , or --decimal . to name the decimal sign.",
            )
        found[key] = replace(column, decimal=max(signs[key], key=",.".find, default=usual or "."))
    return found


def _signs(column: Column) -> set[str]:
    """The decimal signs that texts of a column have for certain."""
    texts = [cell for cell in column.cells if isinstance(cell, str)]
    return {
        sign
        for sign, other in (".,", ",.")
        if any(
            sign in text and not math.isnan(_value(text, sign)) and math.isnan(_value(text, other)) for text in texts
        )
    }


def _doubtful(column: Column) -> str | None:
    """A text whose sign may be a decimal one, or group thousands; whole numbers beside points say that they group."""
    texts = [cell.strip() for cell in column.cells if isinstance(cell, str)]
    doubtful = [text for text in texts if any(grouped.fullmatch(text) for grouped in _GROUPED.values())]
    if doubtful and ("," in doubtful[0] or any(text.isdigit() for text in texts)):
        return doubtful[0]
    return None


@dataclass(frozen=True)
class Columns:
    """The columns of a table by what they hold."""

    of: Mapping[str, Column]
    rows: int
    units: tuple[str, str]
    unused: tuple[str, ...]
    empty: Column  # in the place of those that there are not

    def __getitem__(self, key: str) -> Column:
        return self.of.get(key, self.empty)

    @classmethod
    def found(cls, frame: pd.DataFrame, layout: Layout, source: str) -> Columns:
        """The columns of a table, as they are named or else as they are called."""
        names = [str(name) for name in frame.columns]
        held = {key: _named(key, names, layout, source) for key in COLUMNS}
        for key in ("isi", "mep"):
            if held[key] is None:
                raise _missing(key, names, source)
        columns = {}
        for key, name in held.items():
            if name is not None:
                said, cells = without_unit_in_cells(name, frame.iloc[:, names.index(name)].tolist())
                columns[key] = Column(said, cells, of=source)
        numeric = ("isi", "mep", "asked", "isi_sd", "background")
        columns |= with_decimals({key: columns[key] for key in numeric if key in columns}, layout.decimal)
        isi_unit = required_unit("ISIs", columns["isi"], layout, ISI_UNITS_MS)
        mep_unit = required_unit("amplitudes", columns["mep"], layout, EMG_UNITS_MV)
        factors = {"isi": ISI_UNITS_MS[isi_unit], "mep": EMG_UNITS_MV[mep_unit]}
        for key in ("asked", "isi_sd"):
            if key in columns:
                factors[key] = ISI_UNITS_MS[_told(columns[key].name, ISI_UNITS_MS) or isi_unit]
        if "background" in columns:
            factors["background"] = 1e3 * EMG_UNITS_MV[_told(columns["background"].name, EMG_UNITS_MV) or "uV"]
        columns |= {key: replace(columns[key], factor=factor) for key, factor in factors.items()}
        unused = tuple(name for name in names if name not in held.values() and name.strip())
        return cls(columns, len(frame), (isi_unit, mep_unit), unused, Column("", [None] * len(frame), of=source))


def require_one(what: str, stated: str, names: Iterable[object], remedy: str | None = None) -> None:
    """Raise if a file has nothing of the name that is stated."""
    known = [str(name) for name in names]
    if stated not in known:
        remedy = did_you_mean(stated, known) or remedy
        raise InvalidValueError(what, got=stated, expected=f"one of {', '.join(known)}", remedy=remedy)


def _named(key: str, names: list[str], layout: Layout, source: str) -> str | None:
    """The column that holds something; None if there is none."""
    if (stated := layout.columns.get(key)) is not None:
        if names.count(stated) > 1:
            raise InvalidValueError(f"several columns of {source} have this name", got=stated, remedy="Rename them.")
        require_one(f"{source} has no such column", stated, names)
        return stated
    taken = set(layout.columns.values())
    for known in COLUMNS[key]:
        fitting = [name for name in names if letters(name) == known and name not in taken]
        if len(fitting) > 1:
            raise InvalidValueError(
                f"several columns of {source} may hold the {key}",
                got=" or ".join(fitting),
                remedy=f'Say --column "{key}={fitting[0]}".' if len(set(fitting)) > 1 else "Rename one of them.",
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


def isis_of(vectors: Mapping[str, Sequence[Any]], layout: Layout, source: str) -> list[float | None]:
    """The ISIs among the vectors that come with sweeps [ms]; None is TMS alone."""
    name = _named("isi", list(vectors), layout, source)
    if name is None:
        raise _missing("isi", list(vectors), source)
    cells = list(vectors[name])
    column = with_decimals({"isi": Column(name, cells, of=source)}, layout.decimal)["isi"]
    column = replace(column, factor=ISI_UNITS_MS[required_unit("ISIs", column, layout, ISI_UNITS_MS)])
    alone = [says_alone(cell, layout.alone) for cell in cells]
    isis_ms = [None if alone[row] else column.number(row) for row in range(len(cells))]
    if lost := [row for row, isi_ms in enumerate(isis_ms) if isi_ms is None and not alone[row]]:
        raise column.refused(lost[0], "is empty", "If it is TMS alone, say --alone ''.")
    return isis_ms


def _told(name: str, known: Mapping[str, float]) -> str | None:
    """The unit that a column's name says, of those of one quantity."""
    words = [*re.findall(r"[\[(](.*?)[\])]", name), *re.findall(r"[^\W_]+", name)[1:]]
    told = [unit for word in words if (unit := UNIT_WORDS.get(word.strip().casefold(), "")) in known]
    return told[-1] if told else None


def required_unit(what: str, column: Column, layout: Layout, known: Mapping[str, float]) -> str:
    """The column's unit, as it is stated or as its name says."""
    unit = layout.unit_of(known) or _told(column.name, known)
    if unit is None:
        units = "ms or s" if "ms" in known else "mV, uV or V"
        numbers = [value for row in range(len(column.cells)) if isinstance(value := _tried(column, row), float)]
        span = f"{min(numbers):g} to {max(numbers):g}" if numbers else None
        raise InvalidValueError(
            f"the unit of the {what} of {column.of} is not stated, in the column {column.name!r}",
            got=span,
            remedy=f"Say --unit with {units}.",
        )
    return unit


def _tried(column: Column, row: int) -> float | None:
    try:
        return column.number(row)
    except InvalidValueError:
        return None


def without_unit_in_cells(name: str, cells: list[Any]) -> tuple[str, list[Any]]:
    """A column whose cells all say the same unit, such as "12.5 ms", as one whose name says it."""
    texts = [cell for cell in cells if not is_missing(cell)]
    ends = {_NUMBER_BEFORE.sub("", cell.casefold()) if isinstance(cell, str) else "" for cell in texts}
    (unit,) = ends if len(ends) == 1 else ("",)
    if unit not in UNIT_WORDS:
        return name, cells
    bare = [cell if is_missing(cell) else cell.strip()[: -len(unit)].strip() for cell in cells]
    return f"{name} ({UNIT_WORDS[unit]})", bare
