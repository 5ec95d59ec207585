"""The report of a session: one page that needs no network, no server, and for reading it no JavaScript.

What comes from a log is text in it. `isiw.plots` draws the pictures; plotly what is clicked, from `isiw.report.drawn`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from isiw.log.frames import measures_of
from isiw.log.record import SessionRecord, require_records
from isiw.plots.session import session_figure
from isiw.plots.style import inline_svg
from isiw.plots.timeline import all_sweeps_figure, course_figure, timeline_figure
from isiw.report.answers import answers, method_answers
from isiw.report.drawn import drawn
from isiw.report.html import asset, rendered, write_page
from isiw.report.intervention import contents_of, intervention_page
from isiw.report.tables import (
    counted_rows,
    event_rows,
    first_facts,
    further_facts,
    lost_rows,
    settings_facts,
    trial_row,
)
from isiw.report.words import fit_sentence, statement
from isiw.summary import JUDGED_SINCE
from isiw.text.named_code import library
from isiw.window import Window

_SAID_ABOVE: Final = {"end lost", "judged since"}
"""Sentences of the statement that the state of the log says already."""


def save_report(
    record: SessionRecord, path: str | Path, *, truth: Window | None = None, overwrite: bool = False
) -> Path:
    """Write the report of a session into a file.

    Args:
        record: the session.
        path: where to, such as `report.html`.
        truth: the true window, if the person is simulated.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        ConfigError: plotly or jinja2 is not installed.
        InvalidValueError: no record of a session, a path that is none of a page, or a file not to be replaced.
    """
    return write_page(path, lambda: report_page(record, truth=truth), overwrite=overwrite)


def report_page(record: SessionRecord, *, truth: Window | None = None) -> str:
    """The report of a session as a page of HTML; of an intervention, the change from before to after.

    Args:
        record: the session.
        truth: the true window, if the person is simulated.

    Raises:
        ConfigError: plotly or jinja2 is not installed.
        InvalidValueError: no record of a session.
    """
    require_records((record,))
    if record.header.intervention is not None:
        return intervention_page(contents_of(record, _states(record)))
    measured = measures_of(record)
    scripts = [library("plotly.offline", "report").get_plotlyjs(), asset("draw.js"), asset("page.js")]
    contents = {
        "pictures": _pictures(record, truth),
        "subject": record.header.subject or "an unnamed subject",
        "states": _states(record),
        "losses": (*record.unread_said, *record.losses),
        "statement": [said for said in statement(record) if said.name not in _SAID_ABOVE],
        "fit": fit_sentence(record),
        "answers": answers(record),
        "methods": method_answers(record) if record.rests_on_data else [],
        "facts": first_facts(record),
        "further": further_facts(record),
        "settings": settings_facts(record),
        "lost": lost_rows(record),
        "events": event_rows(record),
        "counted": counted_rows(record),
        "trials": [trial_row(t, record.header.stimulus, measured.get(t.index)) for t in record.table],
        "drawn": drawn(record),
        "log": record.path.name,
    }
    return rendered("page.html", scripts, **contents)


def _states(record: SessionRecord) -> list[str]:
    """The state of the log, which a reader must know before trusting the page."""
    said = []
    if record.end_lost:
        said.append("The log's end is missing: more stimuli may have been delivered than are shown.")
    elif not record.finished:
        last = f"trial {record.table[-1].index}" if len(record.table) else "its beginning"
        said.append(f"The log is not closed: the session is running, or was interrupted. It is shown up to {last}.")
    if record.estimates and record.is_judged_since:
        said.append(JUDGED_SINCE)
    return said


def _pictures(record: SessionRecord, truth: Window | None) -> Mapping[str, str]:
    """The pictures as SVG; the subject's code is the only text of the log in them."""
    figures = {
        "timeline": timeline_figure(record),
        "session": session_figure(record, truth=truth),
        "sweeps": all_sweeps_figure(record),
        "course": course_figure(record),
    }
    return {name: inline_svg(figure, name) for name, figure in figures.items() if figure is not None}
