"""The report of a session: one page that needs no network, no server, and for reading it no JavaScript.

The pictures that are read and printed are drawn by `isiw.plots`; what is moved and clicked is drawn by plotly in the
browser, from the numbers of `isiw.report.drawn`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from isiw.log.reader import SessionRecord, require_records
from isiw.plots.course import course_figure
from isiw.plots.inline import inline_svg
from isiw.plots.session import session_figure
from isiw.plots.sweeps import sweeps_figure
from isiw.plots.timeline import timeline_figure
from isiw.report.answers import answers
from isiw.report.drawn import drawn
from isiw.report.facts import first_facts, further_facts, settings_facts
from isiw.report.html import asset, library, rendered, write_page
from isiw.report.tables import counted_rows, event_rows, lost_rows, trial_row
from isiw.report.words import finding_sentences, fit_sentence
from isiw.window import Window


def save_report(
    record: SessionRecord, path: str | Path, *, truth: Window | None = None, overwrite: bool = False
) -> Path:
    """Write the report of a session into a file.

    Args:
        record: the session.
        path: where to, such as `report.html`.
        truth: the true window, where the person is simulated.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        ConfigError: plotly or jinja2 is not installed.
        InvalidValueError: no record of a session, a path that is none of a page, or there is a file that is not to be
            replaced.
    """
    return write_page(path, lambda: report_page(record, truth=truth), overwrite=overwrite)


def report_page(record: SessionRecord, *, truth: Window | None = None) -> str:
    """The report of a session as a page of HTML.

    Args:
        record: the session.
        truth: the true window, where the person is simulated.

    Raises:
        ConfigError: plotly or jinja2 is not installed.
        InvalidValueError: no record of a session.
    """
    require_records((record,))
    scripts = [library("plotly.offline").get_plotlyjs(), asset("draw.js"), asset("page.js")]
    return rendered("page.html", scripts, pictures=_pictures(record, truth), **_contents(record))


def _contents(record: SessionRecord) -> dict[str, Any]:
    """What the page says, before it is laid out."""
    return {
        "subject": record.header.subject or "an unnamed subject",
        "states": _states(record),
        "losses": (*record.told_unread, *record.losses),
        "findings": finding_sentences(record),
        "fit": fit_sentence(record),
        "answers": answers(record),
        "facts": first_facts(record),
        "further": further_facts(record),
        "settings": settings_facts(record),
        "lost": lost_rows(record),
        "events": event_rows(record),
        "counted": counted_rows(record),
        "trials": [trial_row(trial, record.header.stimulus) for trial in record.table],
        "drawn": drawn(record),
        "log": record.path.name,
    }


def _states(record: SessionRecord) -> list[str]:
    """What a reader must know of the log before trusting the page."""
    said = []
    if record.end_lost:
        said.append("The log's end is missing: more stimuli may have been delivered than are shown.")
    elif not record.finished:
        last = f"trial {record.table[-1].index}" if len(record.table) else "its beginning"
        said.append(f"The log is not closed: the session is running, or was interrupted. It is shown up to {last}.")
    if record.estimates and record.is_judged_since:
        said.append("Trials were judged anew after the last estimate, which does not know of it; resume the session.")
    return said


def _pictures(record: SessionRecord, truth: Window | None) -> Mapping[str, str]:
    """The pictures as SVG, none of which holds a text of the log."""
    figures = {
        "timeline": timeline_figure(record),
        "session": session_figure(record, truth=truth),
        "sweeps": sweeps_figure(record),
        "course": course_figure(record),
    }
    return {name: inline_svg(figure, name) for name, figure in figures.items() if figure is not None}
