"""The report of a session: one page that needs no network, no server, and for reading it no JavaScript.

What comes from a log is text in it. `isiw.plots` draws the pictures; plotly what is clicked, from `isiw.report.drawn`.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, Final

from isiw.errors import InvalidValueError
from isiw.files import check_output, write_output
from isiw.log.reader import SessionRecord, require_records
from isiw.plots.session import session_figure
from isiw.plots.style import inline_svg
from isiw.plots.timeline import course_figure, sweeps_figure, timeline_figure
from isiw.report.answers import answers, method_answers
from isiw.report.drawn import drawn
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
from isiw.sentences import JUDGED_SINCE
from isiw.text import plain
from isiw.text.named_code import library
from isiw.window import Window

_ASSETS: Final = resources.files("isiw.report") / "assets"
_SUFFIXES: Final = {".html", ".htm"}

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
    """The report of a session as a page of HTML.

    Args:
        record: the session.
        truth: the true window, if the person is simulated.

    Raises:
        ConfigError: plotly or jinja2 is not installed.
        InvalidValueError: no record of a session.
    """
    require_records((record,))
    record.require_open()
    scripts = [library("plotly.offline", "report").get_plotlyjs(), asset("draw.js"), asset("page.js")]
    contents = {
        "pictures": _pictures(record, truth),
        "subject": record.header.subject or "an unnamed subject",
        "states": _states(record),
        "losses": (*record.told_unread, *record.losses),
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
        "trials": [trial_row(t, record.header.stimulus, record.measures.get(t.index)) for t in record.table],
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
        "sweeps": sweeps_figure(record),
        "course": course_figure(record),
    }
    return {name: inline_svg(figure, name) for name, figure in figures.items() if figure is not None}


def write_page(path: str | Path, page: Callable[[], str], *, overwrite: bool = False) -> Path:
    """Write a page into a file, which is checked before the page is made."""
    if Path(path).suffix.lower() not in _SUFFIXES:
        raise InvalidValueError("a page is for a browser", got=str(path), expected="a path that ends in .html")
    check_output(path, overwrite=overwrite)
    return write_output(path, page().encode(), overwrite=overwrite)


def rendered(template: str, scripts: Sequence[str] = (), **contents: Any) -> str:
    """A page; its policy lets no script run but these, and nothing be fetched."""
    jinja2 = library("jinja2", "report")
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(asset),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=lambda value: plain(value) if type(value) is str else value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    digests = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    hashes = [f"'sha256-{digest}'" for digest in digests]  # what the page's policy knows a script by
    page: str = environment.get_template(template).render(
        contents,
        style=asset("page.css"),
        scripts=scripts,
        hashes=" ".join(hashes) or "'none'",
    )
    return page


def asset(name: str) -> str:
    """A file of `assets`."""
    return (_ASSETS / name).read_text(encoding="utf-8")
