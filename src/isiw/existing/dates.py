"""Dates and times of tables, whose day or month may come first."""

from __future__ import annotations

import datetime as dt
import re
import warnings
from collections.abc import Iterable, Sequence
from typing import Final

from isiw.existing.cells import Column
from isiw.lazy import pd

_DATE: Final = re.compile(r"(\d{1,2})([./-])(\d{1,2})\2\d{2,4}(?!\d)")
_ZONE: Final = re.compile(r":.*(z|utc|gmt|[+-]\d\d:?\d\d)\s*$", re.IGNORECASE)
_FURTHEST_BEHIND: Final = dt.timedelta(hours=12)  # nowhere on Earth is the time of the day further behind UTC
_REMEDY: Final = "Write dates as 2026-01-31."


def dates_of(column: Column, rows: Iterable[int]) -> dict[int, dt.datetime]:
    """The dates of rows, in UTC; those of empty cells are left out."""
    texts = {row: text for row in rows if (text := column.text(row))}
    day_first = _day_first(texts.values())
    if day_first is None:
        raise column.refused(next(iter(texts)), "may have the day first, or the month", _REMEDY)
    dates = dict(zip(texts, _moments([*texts.values()], day_first=day_first), strict=True))
    for row, date in dates.items():
        if pd.isna(date):
            raise column.refused(row, "is no date", _REMEDY)
    return {row: date.to_pydatetime() for row, date in dates.items()}


def latest_of(texts: Sequence[str], dates: Sequence[dt.datetime | None]) -> str:
    """When the last of some trials was given at the latest, as ISO 8601 in UTC; empty if one of them has no date.

    A date without a time may be any of its day, and so may one of several trials; without a zone it may be of any.
    """
    known = [date for date in dates if date is not None]
    if not known or len(known) < len(dates):
        return ""
    latest = max(known)
    if len({*known}) < len(known) or any(date.time() == dt.time() for date in known):
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
