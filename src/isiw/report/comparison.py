"""Several sessions beside each other, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from isiw.log.reader import SessionRecord
from isiw.log.schema import Estimate
from isiw.priors.days import DayToDay
from isiw.priors.differing import Difference
from isiw.report.words import JUDGED_SINCE
from isiw.text import one_line

HEADINGS = ("session", "subject", "begun", "told", "P(window)", "window", "start", "end")
"""What the rows of the table hold."""


def comparison_table(records: Sequence[SessionRecord]) -> str:
    """The windows of sessions as their logs report them, a line each; start and end are 90 % intervals.

    Args:
        records: the sessions.
    """
    rows = [HEADINGS, *comparison_rows(records)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
    since = [f"{_whose(r)}: {JUDGED_SINCE}" for r in records if r.estimates and r.is_judged_since]
    return "\n".join([*lines, *since])


def comparison_rows(records: Sequence[SessionRecord]) -> list[tuple[str, ...]]:
    """The cells of that table, a row a session; empty where nothing is known."""
    return [_row(number, record) for number, record in enumerate(records, start=1)]


def _row(number: int, record: SessionRecord) -> tuple[str, ...]:
    header = record.header
    who = (
        str(number),
        one_line(header.subject) or "unnamed",
        header.created[:16].replace("T", " "),
        str(len(record.table.told)),
    )
    if not (record.estimates and record.rests_on_data):
        return (*who, "–", "too little was measured", "", "")
    return (*who, *_found(record.estimates[-1]))


def _found(last: Estimate) -> tuple[str, ...]:
    chance = "–" if last.probability is None else f"{last.probability:.2f}"
    if last.window is None:
        return chance, last.nothing, "", ""
    edges = (_edge(last.start_low_ms, last.start_high_ms), _edge(last.end_low_ms, last.end_high_ms))
    return chance, str(last.window), *edges


def _edge(low_ms: float | None, high_ms: float | None) -> str:
    if low_ms is None or high_ms is None:
        return "–"
    if math.isinf(low_ms) and math.isinf(high_ms):
        return "beyond the range"
    return f"{'<' if math.isinf(low_ms) else f'{low_ms:.0f}'}–{'>' if math.isinf(high_ms) else f'{high_ms:.0f}'} ms"


def comparison_sentence(difference: Difference) -> str:
    """What is known of how two windows differ.

    Args:
        difference: between the sessions.
    """
    kind = "the same person" if difference.same_person else "two people, or not known to be one"
    sentences = [
        f"{_whose(difference.second)} against {_whose(difference.first)}, {kind}:",
        _moved(difference),
        _later(difference),
        f"{difference.obstacle.removesuffix('.')}." if difference.obstacle else "",
    ]
    return " ".join(sentence for sentence in sentences if sentence)


def _whose(record: SessionRecord) -> str:
    return f"{one_line(record.header.subject) or 'unnamed'} ({record.path.name})"


def _moved(difference: Difference) -> str:
    if difference.moved is None:
        return ""
    before = 1.0 - DayToDay().p_stays
    return (
        f"with probability {difference.moved:.2f} ({before:g} where nothing is known) the window moved beyond the "
        "usual shift from day to day;"
    )


def _later(difference: Difference) -> str:
    if difference.starts_later is None or difference.ends_later is None:
        return ""
    return (
        f"it starts later with probability {difference.starts_later:.2f} and ends later with probability "
        f"{difference.ends_later:.2f} (0.5 where nothing is known)."
    )
