"""The cells of a column, as other programs write numbers, words, dates, and what is missing."""

from __future__ import annotations

import datetime as dt
import math
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import chain
from numbers import Real
from typing import Any, Final

from isiw.errors import InvalidValueError
from isiw.existing.layout import ISI_UNITS_MS, WORDS, Layout, plain, unit_named
from isiw.existing.names import ALL
from isiw.lazy import pd
from isiw.types import FloatArray

_NUMBER: Final = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|[-+]?inf(inity)?", re.IGNORECASE)
_GROUPED: Final = {".": re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d+)?"),  # by the other sign than the decimal one
                   ",": re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+(,\d+)?")}  # fmt: skip
_NUMBER_BEFORE: Final = re.compile(r"^[-+\d.,\s]*(e[-+]?\d+)?\s*")
_BLANKS: Final = re.compile(r"(?<=\d)[ '’\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}\N{THIN SPACE}](?=\d{3})")
_DATE: Final = re.compile(r"(\d{1,2})([./-])(\d{1,2})\2\d{2,4}(?!\d)")
_ZONE: Final = re.compile(r":.*(z|utc|gmt|[+-]\d\d:?\d\d)\s*$", re.IGNORECASE)
_FURTHEST_BEHIND: Final = dt.timedelta(hours=12)  # nowhere on Earth is the time of the day further behind UTC
_APART: Final = dt.timedelta(hours=6)  # no session has such a break, and the nights between two have
_ERROR: Final = re.compile(r"#(N/?[AV]|[^\W_/]+(/0)?[!?])")  # in whatever language
_REMEDY: Final = "Write dates as 2026-01-31."
_PSYCHOPY: Final = re.compile(r"_(\d\d)h(\d\d)\.(\d\d)")  # a time of the day as PsychoPy writes it behind a date
_MANY: Final = 2**16  # so many texts are remembered: in a long table most cells are like others


@lru_cache(_MANY)
def _says_nothing(text: str) -> bool:
    return text.strip().casefold() in WORDS["missing"]


def is_missing(cell: Any) -> bool:
    """True if a cell holds nothing."""
    if isinstance(cell, str):
        return _says_nothing(cell)
    return cell is None or type(cell).__name__ in {"NAType", "NaTType"} or cell != cell  # noqa: PLR0124 - NaN


@lru_cache(_MANY)
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
    if mark is not None and not mark.strip() and is_missing(cell):
        return True
    if mark is not None and mark.strip():
        words = [str(one).strip().casefold() for one in (cell, mark)]
        numbers = [{_value(word, sign) for sign in ".,"} - {math.nan} for word in words]
        if words[0] == words[1] or any(map(math.isfinite, numbers[0] & numbers[1])):
            return True
    return isinstance(cell, str) and plain(cell) in WORDS["alone"]


@dataclass(frozen=True)
class Column:
    """A column that holds something known: its name and cells as they were read, and how its numbers are read."""

    name: str
    cells: Sequence[Any]
    decimal: str = "."
    of: str = "the data"
    factor: float = 1.0  # that turns a number into ms, mV or µV
    of_codes: bool = False  # of people, who may be called NA
    remedy: str = "Correct it, leave the cell empty, or name another column: --column KEY=NAME."
    is_stated: bool = False  # whether `where` has it, so that it is what it says, however odd

    def number(self, row: int) -> float | None:
        """The number in a row [ms, mV or µV]; None if the cell is empty."""
        cell = self.cells[row]
        if is_missing(cell):
            return None
        value = _value(cell, self.decimal) if isinstance(cell, str) else _float(cell)
        if not math.isfinite(value):
            is_comma = isinstance(cell, str) and "," in cell and self.decimal != ","
            remedy = "If the comma is a decimal sign, say --decimal ," if is_comma else self.remedy
            raise self.refused(row, "is no number", remedy)
        # 10.4 µV are 0.0104 mV, not 0.010400000000000001.
        return value if self.factor == 1.0 else float(f"{value * self.factor:.15g}")

    def flag(self, row: int, yes: str = "counted", no: str = "left out") -> bool | None:
        """True if the cell of a row says yes, or a word of that kind; None if it is empty."""
        cell = self.cells[row]
        if is_missing(cell):
            return None
        word = str(cell).strip().casefold()
        says = [word in WORDS[usual] or word in WORDS[kind] for usual, kind in (("yes", yes), ("no", no))]
        if not any(says):
            raise self.refused(row, "says neither yes nor no", "Use accepted and rejected, or 1 and 0.")
        return says[0]

    def text(self, row: int) -> str:
        """The cell of a row as text; a whole number has no decimal sign."""
        cell = self.cells[row]
        if is_missing(cell) and not (self.of_codes and isinstance(cell, str) and cell.strip() in {"NA", "na", "Na"}):
            return ""
        whole = not isinstance(cell, str) and _float(cell).is_integer()
        return str(int(cell)) if whole else str(cell).strip()

    @cached_property
    def texts(self) -> list[str]:
        """The cells of all rows as texts."""
        return [self.text(row) for row in range(len(self.cells))]

    @cached_property
    def numbers(self) -> FloatArray:
        """The cells of all rows as numbers as they stand there, also with commas, shape (n,); NaN for what is none."""
        texts = pd.Series([text.replace(",", ".") for text in self.texts], dtype=object)
        return pd.to_numeric(texts, errors="coerce").to_numpy(dtype="float64")

    def require_no_errors(self) -> None:
        """Raise if a cell has an error of Excel."""
        for row, cell in enumerate(self.cells):
            if isinstance(cell, str) and cell.startswith("#") and _ERROR.fullmatch(cell.strip()):
                raise self.refused(row, "is an error of Excel", "Correct its formula, or empty the cell.")

    def refused(self, row: int, why: str, remedy: str) -> InvalidValueError:
        """The error that a cell of a row cannot be read."""
        what = f"row {row + 1} of the column {self.name!r} of {self.of} {why}"
        return InvalidValueError(what, got=self.cells[row], remedy=remedy)

    def doubted(self, why: str, got: object, remedy: str, expected: str | None = None) -> InvalidValueError:
        """The error that a column cannot be read."""
        what = f"the column {self.name!r} of {self.of} {why}"
        return InvalidValueError(what, got=got, expected=expected, remedy=remedy)

    def doubt(self, why: str, got: object, remedy: str, expected: str | None = None, row: int | None = None) -> None:
        """Raise that a column, or its cell of a row, may be something else, if `where` does not have it."""
        if not self.is_stated:
            remedy = f'{remedy}, say --where "{self.name}={ALL}".'
            raise self.doubted(why, got, remedy, expected) if row is None else self.refused(row, why, remedy)


def with_decimals(columns: Mapping[str, Column], stated: str | None) -> dict[str, Column]:
    """Columns with the decimal sign of each one's texts; one that may also group thousands is asked about."""
    signs = {key: _signs(column) for key, column in columns.items()}
    all_signs = {*chain.from_iterable(signs.values())}
    usual = stated or (all_signs.pop() if len(all_signs) == 1 else None)
    found = {}
    for key, column in columns.items():
        if len(signs[key]) > 1:
            raise column.doubted("has decimal commas and decimal points", None, "Write one of them in all cells.")
        if stated is not None and signs[key] and stated not in signs[key]:
            expected = f"{''.join(signs[key])!r}, as its numbers have"
            why, remedy = "has another decimal sign than the one that is stated", "Leave --decimal out, or correct it."
            raise column.doubted(why, stated, remedy, expected)
        if usual is None and not signs[key] and (doubtful := _doubtful(column)):
            sign = "comma" if "," in doubtful else "point"
            why = f"has a {sign} that may be a decimal sign, or group thousands"
            raise column.doubted(why, doubtful, "Say --decimal , or --decimal .")
        found[key] = replace(column, decimal=max(signs[key], default=usual or "."))
    return found


def _signs(column: Column) -> set[str]:
    """The decimal signs that texts of a column have for certain."""
    found = set[str]()
    for text in {cell for cell in column.cells if isinstance(cell, str) and not {*cell}.isdisjoint(".,")}:
        fitting = {sign for sign in ".," if not math.isnan(_value(text, sign))}
        found |= fitting & {*text} if len(fitting) == 1 else set()
    return found


def _doubtful(column: Column) -> str | None:
    """A text whose sign may be a decimal one, or group thousands; whole numbers beside points say that they group."""
    texts = [cell.strip() for cell in column.cells if isinstance(cell, str)]
    doubtful = [text for text in texts if any(grouped.fullmatch(text) for grouped in _GROUPED.values())]
    are_asked = bool(doubtful) and ("," in doubtful[0] or any(text.isdigit() for text in texts))
    return doubtful[0] if are_asked else None


def required_unit(layout: Layout, known: Mapping[str, float], said: str | None, what: str, got: str | None) -> str:
    """The unit of something: the one that is stated, or else the one that the file says."""
    unit = layout.unit_of(known) or said
    if unit is None or unit not in known:
        units = "ms or s" if known is ISI_UNITS_MS else "mV, uV or V"
        what = f"the unit of {what} is not stated or unknown"
        raise InvalidValueError(what, got=got, remedy=f"Say --unit with {units}.")
    return unit


def without_unit_in_cells(name: str, cells: Sequence[Any]) -> tuple[str, Sequence[Any]]:
    """A column whose cells all say the same unit, such as "12.5 ms", as one whose name says it."""
    texts = [cell for cell in cells if not is_missing(cell) and not says_alone(cell, None)]
    unit, *others = {_NUMBER_BEFORE.sub("", cell.casefold()) if isinstance(cell, str) else "" for cell in texts} or {""}
    if others or (known := unit_named(unit)) is None:
        return name, cells
    bare = {cell: cell.strip()[: -len(unit)].strip() for cell in texts}
    return f"{name} ({known})", [bare.get(cell, cell) for cell in cells]


def dates_of(column: Column, rows: Iterable[int]) -> dict[int, dt.datetime]:
    """The dates of rows, in UTC; those of empty cells are left out."""
    texts = {row: _PSYCHOPY.sub(r" \1:\2:\3", text) for row in rows if (text := column.text(row))}
    day_first = _day_first(texts.values())
    if day_first is None:
        raise column.refused(next(iter(texts)), "may have the day first, or the month", _REMEDY)
    dates = dict(zip(texts, _moments([*texts.values()], day_first=day_first), strict=True))
    for row, date in dates.items():
        if pd.isna(date):
            raise column.refused(row, "is no date", _REMEDY)
    return {row: date.to_pydatetime() for row, date in dates.items()}


def days_of(dates: Mapping[int, dt.datetime]) -> dict[int, str]:
    """The day of each row: the date of the first of those that follow each other, be it beyond midnight."""
    days, rows = dict[int, str](), sorted(dates, key=lambda row: dates[row])
    for before, row in zip([*rows[:1], *rows], rows, strict=False):
        goes_on = before in days and dates[row] - dates[before] < _APART
        days[row] = days[before] if goes_on else f"{dates[row].date()}"
    return days


def latest_of(texts: Sequence[str], dates: Sequence[dt.datetime | None]) -> str:
    """When the last of some trials was given at the latest, as ISO 8601 in UTC; empty if one of them has no date."""
    known = [date for date in dates if date is not None]
    if not known or len(known) < len(dates):
        return ""
    latest = max(known)
    if len({*known}) < len(known) or any(date.time() == dt.time() for date in known):  # a date may be any of its day
        latest += dt.timedelta(days=1)
    if not all(_ZONE.search(text) for text in texts):
        latest += _FURTHEST_BEHIND
    return latest.isoformat(timespec="seconds")


def times_of(texts: Sequence[str]) -> list[float]:
    """Dates and times as seconds, ascending if they can be read so; nothing if one of them is neither."""
    day_first = _day_first(texts)
    read = [_moments(texts, day_first=order) for order in ((True, False) if day_first is None else (day_first,))]
    whole = [[moment.timestamp() for moment in moments] for moments in read if not moments.isna().any()]
    return next((times for times in whole if times == sorted(times)), whole[0] if whole else [])


def _moments(texts: Sequence[str], *, day_first: bool) -> pd.Series:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that other dates of the column do not begin with the day
        cells = pd.Series(texts, dtype=object)
        read = pd.to_datetime(cells, errors="coerce", utc=True, dayfirst=day_first)  # as the first one, which is fast
        others = pd.to_datetime(cells[read.isna()], errors="coerce", utc=True, format="mixed", dayfirst=day_first)
        return read.where(read.notna(), others)


def _day_first(texts: Iterable[str]) -> bool | None:
    """Whether dates of numbers begin with the day; None if that cannot be seen."""
    dates = [found for text in texts if (found := _DATE.match(text))]
    if any(date[2] == "." or int(date[1]) > 12 for date in dates):
        return True
    if all(date[1] == date[3] for date in dates) or any(int(date[3]) > 12 for date in dates):
        return False
    return None
