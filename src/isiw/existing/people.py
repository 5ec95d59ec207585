"""The people of a table: each row a trial, each person and day a log of their own."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence
from typing import Any, Final

from isiw.checks import MOST_MEP_MV
from isiw.design import DesignSpace, missing_reference
from isiw.errors import InvalidValueError
from isiw.existing.delivered import Delivered, renumbered
from isiw.existing.layout import Layout
from isiw.existing.tables import Columns, says_alone
from isiw.findings import Kind
from isiw.lazy import pd
from isiw.signals.judgement import judge_measurement
from isiw.text.sanitize import counted
from isiw.trials import Measurement, Status, Stimulus, Trial
from isiw.types import Reference
from isiw.visit import Visit

_ANYWHERE_MS: Final = 10_000.0


def people_of(frame: pd.DataFrame, layout: Layout, source: str, name: str = "") -> list[Delivered]:
    """The people of a table, in the order in which they come first; who has no code is called as the file is."""
    reference = required_reference(layout, source)
    columns = Columns.found(frame, layout, source)
    isi, mep = columns.of["isi"], columns.of["mep"]
    rows = [n for n in range(columns.rows) if mep.number(n) is not None or isi.text(n) or columns.text("asked", n)]
    if not rows:
        raise InvalidValueError(f"{source} has no trials", remedy="Are the right columns named?")
    subjects = [columns.text("subject", row) for row in rows]
    if any(subjects) and not all(subjects):
        empty = rows[subjects.index("")]
        raise columns.of["subject"].refused(empty, "is empty", "Write the person's code into each row.")
    people: dict[str, list[int]] = {}
    for subject, row in zip(subjects, rows, strict=True):
        people.setdefault(subject, []).append(row)
    visits = [(own, subject, day) for subject, theirs in people.items() for day, own in _days(columns, theirs).items()]
    visits.sort(key=lambda visit: visit[0][0])
    return [_person(columns, own, layout, reference, source, (subject, day), name) for own, subject, day in visits]


def _days(columns: Columns, rows: Sequence[int]) -> dict[int | None, list[int]]:
    """The rows of each day; days without a number of their own are counted as they come."""
    days: dict[str, list[int]] = {}
    for row in rows:
        days.setdefault(columns.text("day", row), []).append(row)
    if list(days) == [""]:
        return {None: list(rows)}
    numbers = [int(found[-1]) if len(found := re.findall(r"\d+", day)) == 1 else 0 for day in days]
    if len(set(numbers)) < len(numbers) or min(numbers) < 1:
        numbers = list(range(1, len(days) + 1))
    return dict(zip(numbers, days.values(), strict=True))


def anywhere(reference: Reference) -> DesignSpace:
    """A space that any ISI can have come from."""
    return DesignSpace(-_ANYWHERE_MS, _ANYWHERE_MS, 10.0, reference=reference)


def required_reference(layout: Layout, source: str) -> Reference:
    """The event that the ISIs of a file count from, which nobody but the lab knows."""
    if layout.reference is None:
        raise InvalidValueError(
            f"the event from which the ISIs of {source} count is not stated",
            expected=missing_reference().expected,
            remedy="Say --reference impact or --reference valve.",
        )
    return layout.reference


def _person(
    columns: Columns,
    rows: Sequence[int],
    layout: Layout,
    reference: Reference,
    source: str,
    key: tuple[str, int | None],
    name: str,
) -> Delivered:
    subject, day = key
    _require_ascending(columns, rows, source)
    _require_said(columns, rows, layout, source)
    trials = [_trial(columns, row, number, layout, anywhere(reference)) for number, row in enumerate(rows)]
    blocks = [columns.text("block", row) for row in rows]
    return Delivered(
        renumbered(trials),
        reference,
        subject=subject or name,
        visit=Visit(day=day),
        source=source,
        created=_created(columns, rows[0]),
        units=columns.units,
        unused=columns.unused,
        blocks={n: block for n, block in enumerate(blocks) if n and block != blocks[n - 1]},
    )


def _trial(columns: Columns, row: int, number: int, layout: Layout, space: DesignSpace) -> Trial:
    """One row as a trial: as the file judges it, or else as a session would."""
    alone = says_alone(columns.of["isi"].cells[row], layout.alone)
    isi_ms = None if alone else columns.number("isi", row)
    asked_ms = columns.number("asked", row) if "asked" in columns.of else isi_ms
    mep_mv, lost = columns.number("mep", row), _lost(columns, row)
    if mep_mv is not None and not 0 <= mep_mv <= MOST_MEP_MV:
        remedy = "It must be from peak to peak, in the unit that is stated; is --unit right?"
        raise columns.of["mep"].refused(row, "is no amplitude", remedy)
    facts: dict[str, Any] = {
        "commanded_isi_ms": asked_ms,
        "isi_ms": isi_ms,
        "isi_sd_ms": columns.number("isi_sd", row) or 0.0,
        "mep_mv": mep_mv,
        "background_rms_uv": columns.number("background", row),
        "excluded": "status" in columns.of and columns.flag("exclude", row) is True,
    }
    if columns.flag("tap_alone", row):
        return Trial(number, Status.ACCEPTED, tap_alone=True, **{**facts, "commanded_isi_ms": None})
    if lost is None and (mep_mv is None or (isi_ms is None and asked_ms is not None)):
        lost = Kind.OUTCOME_UNKNOWN
    if lost is None and not {"status", "exclude"} & columns.of.keys() and mep_mv is not None:
        measured = Measurement(mep_mv, isi_ms, facts["isi_sd_ms"] or 0.0, None)
        meant_ms = asked_ms if "asked" in columns.of or isi_ms is None else max(isi_ms, 0.0)
        judged = judge_measurement(measured, Stimulus(number, meant_ms), space)
        lost = judged.reason
    return Trial(number, Status.ACCEPTED if lost is None else Status.MISTRIAL, reason=lost, **facts)


def _lost(columns: Columns, row: int) -> Kind | None:
    """Why the file counts a row as lost; None if it does not."""
    judged = columns.flag("status", row)
    bad = columns.flag("exclude", row) and "status" not in columns.of
    if judged is not False and not bad:
        return None
    return Kind.of_mistrial(columns.text("reason", row))


def _require_said(columns: Columns, rows: Sequence[int], layout: Layout, source: str) -> None:
    """Raise if nobody says what rows without an ISI are."""
    if "asked" in columns.of or layout.alone is not None:
        return
    isi = columns.of["isi"]
    empty = [
        row
        for row in rows
        if not says_alone(isi.cells[row], None) and not says_alone(columns.text("condition", row), None)
        and not isi.text(row) and columns.number("mep", row) is not None
        and _lost(columns, row) is None and not columns.flag("tap_alone", row)
    ]  # fmt: skip
    if empty:
        raise InvalidValueError(
            f"{counted(len(empty), 'row has', 'rows have')} an amplitude and no ISI in {source}",
            got=f"row {empty[0] + 1}",
            remedy="If these are TMS alone, say --alone with what stands in their place, or --alone '' for an empty "
            "cell; if not, mark them in a column called exclude.",
        )


def _require_ascending(columns: Columns, rows: Sequence[int], source: str) -> None:
    """Raise if the rows are not in the order of delivery, on which drift and the start depend."""
    if (order := columns.of.get("order")) is None or "block" in columns.of:
        return
    known = [row for row in rows if order.text(row)]
    texts = [order.text(row) for row in known]
    are_numbers = [re.sub("[.,]", "", text).lstrip("-").isdigit() for text in texts]
    if any(are_numbers):
        if not all(are_numbers):
            odd = known[are_numbers.index(False)]
            raise order.refused(odd, "is none of a trial", "Delete the row if it is a sum or a mean.")
        places = [order.number(row) or 0.0 for row in known]
    else:  # times of the day, perhaps
        moments = pd.to_datetime(pd.Series(texts), errors="coerce", format="mixed")
        places = [] if moments.isna().any() else [moment.timestamp() for moment in moments]
    repeated = next((text for text, other in zip(texts[1:], places[1:], strict=False) if places.count(other) > 1), None)
    if places != sorted(places):
        raise InvalidValueError(
            f"the rows of {source} are not in the order of its column {order.name!r}",
            remedy="Sort them as the trials were delivered, or name the column that says so: --column order=NAME.",
        )
    if all(are_numbers) and repeated is not None:
        raise InvalidValueError(
            f"a trial has two rows and more in {source}, by its column {order.name!r}",
            got=repeated,
            remedy="Leave one row for each trial, such as that of one muscle; or name a column of people or blocks: "
            "--column subject=NAME, --column block=NAME.",
        )


def _created(columns: Columns, row: int) -> str:
    column = columns.of.get("date")
    if column is None or not column.text(row):
        return ""
    moment = pd.to_datetime(column.text(row), errors="coerce", utc=True)
    if pd.isna(moment):
        raise column.refused(row, "is no date", "Write dates as 2026-01-31.")
    return dt.datetime.fromtimestamp(moment.timestamp(), tz=dt.UTC).isoformat(timespec="microseconds")
