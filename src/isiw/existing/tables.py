"""The columns of a table: what they hold, in which units, and their cells as other programs write numbers and words."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, Final

from isiw.errors import InvalidValueError, did_you_mean
from isiw.existing.layout import COLUMNS, ISI_UNITS_MS, UNIT_WORDS, Layout, letters
from isiw.findings import Kind
from isiw.lazy import pd
from isiw.signals.limits import EMG_UNITS_MV
from isiw.text.sanitize import counted

_MISSING: Final = frozenset({"", "nan", "(null)", "na", "n/a", "none", "null", "<na>", "nat", "-", "--", ".", "?"})
_YES: Final = frozenset({"1", "1.0", "true", "yes", "y", "x", "accepted", "accept", "ok", "good", "valid", "keep"})
_NO: Final = frozenset({"0", "0.0", "false", "no", "n", "mistrial", "rejected", "reject", "bad", "invalid", "excluded"})
_ALONE: Final = frozenset({"tms alone", "tms only", "tms", "single", "single pulse", "single tms", "sp", "alone", "ts",
                           "baseline", "control", "unconditioned", "unpaired", "ts alone", "ts only", "test",
                           "test alone", "test only", "test pulse", "test stimulus", "no tap"})  # fmt: skip
"""What a cell of ISIs says of TMS alone, hyphens and underscores as blanks."""
_TAP_ALONE: Final = frozenset({"tap alone", "tap only", "hit only", "hammer only", "no tms", "no pulse", "cs alone",
                               "cs only", "conditioning alone", "conditioning only"})  # fmt: skip

_VAGUE: Final = frozenset({"interval", "delay", "soa", "amplitude", "amp", "peaktopeak", "peaktopeakamplitude",
                           "emgpeaktopeak", "p2pamplitude", "ptpamplitude", "p2p", "ptp"})  # fmt: skip
"""Names of columns that may also be of the interval between trials, or of the stimulus: two of them are asked about."""

_NUMBER: Final = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|[-+]?inf(inity)?", re.IGNORECASE)
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
    return cell is None or type(cell).__name__ in {"NAType", "NaTType"} or cell != cell  # noqa: PLR0124 - NaN


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


def _float(cell: object) -> float:
    """A number as a float; NaN if it is none, or a whole one that no float can hold."""
    with suppress(OverflowError):
        return float(cell) if isinstance(cell, Real) and not isinstance(cell, bool) else math.nan
    return math.nan


def says_alone(cell: Any, mark: str | None) -> bool:
    """True if a cell of ISIs stands for TMS alone; an empty one does only if that is the mark."""
    if mark is not None and (is_missing(cell) if not mark.strip() else _same(cell, mark)):
        return True
    return isinstance(cell, str) and _plain(cell) in _ALONE


def _plain(text: str) -> str:
    return " ".join(re.split(r"[\s_-]+", text.strip().casefold()))


def _same(cell: Any, mark: str) -> bool:
    """True if a cell is the mark, as a text or as a number."""
    if str(cell).strip().casefold() == mark.strip().casefold():
        return True
    numbers = [{_value(str(one), sign) for sign in ".,"} for one in (cell, mark)]
    return any(number in numbers[1] for number in numbers[0] if math.isfinite(number))


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
        value = _value(cell, self.decimal) if isinstance(cell, str) else _float(cell)
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
        whole = _float(cell).is_integer()
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

    def tms_alone(self, row: int, mark: str | None) -> bool:
        """True if a row is TMS alone: its ISI says so, or its condition does, and it has no ISI, or 0 and less."""
        isi = self.of["isi"]
        if says_alone(isi.cells[row], mark):
            return True
        return says_alone(self["condition"].text(row), None) and (isi.number(row) or 0.0) <= 0

    def tap_alone(self, row: int) -> bool:
        """True if a row is a tap alone, by a column for it or by its condition."""
        return bool(self["tap_alone"].flag(row)) or _plain(self["condition"].text(row)) in _TAP_ALONE

    def lost(self, row: int) -> Kind | None:
        """Why a row is marked as lost; None if it is not."""
        judged = self["status"].flag(row)
        bad = self["exclude"].flag(row) and "status" not in self.of
        if judged is not False and not bad:
            return None
        return Kind.of_mistrial(self["reason"].text(row))

    def require_said(self, rows: Sequence[int], mark: str | None) -> None:
        """Raise if it is not stated what rows without an ISI are, or if a row is both a pair and TMS alone."""
        isi, condition = self.of["isi"], self["condition"]
        alone = [row for row in rows if says_alone(condition.text(row), None)]
        both = [row for row in alone if mark is None and not self.tms_alone(row, mark)]
        if both and len(alone) < len(rows):  # who writes one word into all rows does not mean this
            raise condition.refused(
                both[0],
                f"says TMS alone, and the ISI there is {isi.text(both[0])}",
                "If it is TMS alone, leave its ISI empty, or say --alone with the number that stands there; if it is a "
                "pair, rename the column.",
            )
        empty = [
            row
            for row in rows
            if not isi.text(row) and not self.tms_alone(row, mark) and not self.tap_alone(row)
            and "asked" not in self.of and self.lost(row) is None
            and ("mep" not in self.of or self["mep"].number(row) is not None)
        ]  # fmt: skip
        if empty:
            raise InvalidValueError(
                f"{counted(len(empty), 'row has', 'rows have')} an amplitude and no ISI in {isi.of}",
                got=f"row {empty[0] + 1}",
                remedy="If these are TMS alone, say --alone with what stands in their place, or --alone '' for an "
                "empty cell; if not, mark them in a column called exclude.",
            )

    @classmethod
    def found(cls, frame: pd.DataFrame, layout: Layout, source: str, needed: Sequence[str] = ("isi", "mep")) -> Columns:
        """The columns of a table, as they are named or else as they are called."""
        names = [str(name) for name in frame.columns]
        wanted = [key for key in COLUMNS if key != "mep" or key in needed]
        held = {key: _named(key, names, layout, source) for key in wanted}
        for key in needed:
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
        factors, mep_unit = {"isi": ISI_UNITS_MS[isi_unit]}, "mV"
        if "mep" in columns:
            mep_unit = required_unit("amplitudes", columns["mep"], layout, EMG_UNITS_MV)
            factors["mep"] = EMG_UNITS_MV[mep_unit]
        for key in ("asked", "isi_sd"):
            if key in columns:
                factors[key] = ISI_UNITS_MS[unit_said(columns[key].name, ISI_UNITS_MS) or isi_unit]
        if "background" in columns:
            factors["background"] = 1e3 * EMG_UNITS_MV[unit_said(columns["background"].name, EMG_UNITS_MV) or "uV"]
        columns |= {key: replace(columns[key], factor=factor) for key, factor in factors.items()}
        if "subject" not in layout.columns and _numbers_rows(columns.get("subject")):
            held["subject"] = None
            del columns["subject"]
        unread = [name for name in names if name not in held.values()]
        found = cls(columns, len(frame), (isi_unit, mep_unit), (), Column("", [None] * len(frame), of=source))
        unread += [columns["condition"].name] if found._has_conditions() else []
        return replace(found, unused=tuple(name for name in unread if name.strip()))

    def _has_conditions(self) -> bool:
        """True if the condition also tells pairs from each other, of which nothing is read."""
        words = {_plain(self["condition"].text(row)) for row in range(self.rows)}
        return len(words - _ALONE - _TAP_ALONE - {""}) > 1


def require_one(kind: str, source: str, stated: str, names: Iterable[object], remedy: str | None = None) -> None:
    """Raise if a file has nothing of a kind of the name that is stated, or more than one."""
    known = [str(name) for name in names]
    if stated not in known:
        remedy = did_you_mean(stated, known) or remedy
        raise InvalidValueError(
            f"{source} has no such {kind}", got=stated, expected=f"one of {', '.join(known)}", remedy=remedy
        )
    if known.count(stated) > 1:
        raise InvalidValueError(f"several {kind}s of {source} have this name", got=stated, remedy="Rename them.")


def _named(key: str, names: list[str], layout: Layout, source: str) -> str | None:
    """The column that holds something; None if there is none."""
    if (stated := layout.columns.get(key)) is not None:
        require_one("column", source, stated, names)
        return stated
    free = [(name, letters(name)) for name in names if name not in layout.columns.values()]
    fitting = {known: [name for name, plain in free if plain == known] for known in COLUMNS[key]}
    found = [known for known in COLUMNS[key] if fitting[known]]
    rivals = [known for known in found if known == found[0] or {known, found[0]} <= _VAGUE]
    several = [name for known in rivals for name in fitting[known]]
    if len(several) > 1:
        raise InvalidValueError(
            f"several columns of {source} may hold the {key}",
            got=" or ".join(several),
            remedy=f'Say --column "{key}={several[0]}".' if len(set(several)) > 1 else "Rename one of them.",
        )
    return several[0] if several else None


def _missing(key: str, names: list[str], source: str) -> InvalidValueError:
    what = {"isi": "ISIs", "mep": "amplitudes of the MEPs"}[key]
    return InvalidValueError(
        f"no column of {source} is known to hold the {what}",
        got=", ".join(names),
        remedy=f'Say --column "{key}=NAME"; if the names are not in the first line, describe the file: --layout FILE.',
    )


def of_vectors(vectors: Mapping[str, Sequence[Any]], layout: Layout, source: str) -> Columns:
    """The columns that come with sweeps: the vectors that are as long as that of the ISIs."""
    name = _named("isi", list(vectors), layout, source)
    if name is None:
        raise _missing("isi", list(vectors), source)
    beside = {other: cells for other, cells in vectors.items() if len(cells) == len(vectors[name])}
    return Columns.found(pd.DataFrame(beside), layout, source, needed=("isi",))


def _numbers_rows(column: Column | None) -> bool:
    """True if a column called id has another value in each row, so that it is of trials and not of people."""
    if column is None or letters(column.name) != "id":
        return False
    values = [column.text(row) for row in range(len(column.cells))]
    return len(values) > 1 and len({*values}) == len(values)


def unit_said(name: str, known: Mapping[str, float]) -> str | None:
    """The unit that a column's name says, of those of one quantity."""
    words = [*re.findall(r"[\[(]([^][()]*)[\])]", name), *re.findall(r"[^\W_]+", name)[1:]]
    told = [unit for word in words if (unit := UNIT_WORDS.get(word.strip().casefold(), "")) in known]
    return told[-1] if told else None


def required_unit(what: str, column: Column, layout: Layout, known: Mapping[str, float]) -> str:
    """The column's unit, as it is stated or as its name says."""
    unit = layout.unit_of(known) or unit_said(column.name, known)
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
