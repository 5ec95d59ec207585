"""Several sessions beside each other, as a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from isiw.log.reader import SessionRecord
from isiw.plots.comparison import comparison_figure
from isiw.plots.inline import inline_svg
from isiw.priors.differing import Difference
from isiw.report.comparison import HEADINGS, comparison_rows, comparison_sentence
from isiw.report.facts import first_facts
from isiw.report.html import rendered, write_page
from isiw.report.words import JUDGED_SINCE, counts_sentence, finding_sentences


def save_comparison(
    records: Sequence[SessionRecord],
    differences: Sequence[Difference],
    path: str | Path,
    *,
    overwrite: bool = False,
) -> Path:
    """Write a page that compares sessions into a file.

    Args:
        records: the sessions.
        differences: as `isiw.priors.differences` finds them.
        path: where to, such as `comparison.html`.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        ConfigError: jinja2 is not installed.
        InvalidValueError: ISIs that count from different events, a path that is none of a page, or a file that is not
            to be replaced.
    """
    return write_page(path, lambda: comparison_page(records, differences), overwrite=overwrite)


def comparison_page(records: Sequence[SessionRecord], differences: Sequence[Difference]) -> str:
    """A page of HTML that compares sessions; it needs no network and no JavaScript.

    Args:
        records: the sessions.
        differences: as `isiw.priors.differences` finds them.

    Raises:
        ConfigError: jinja2 is not installed.
        InvalidValueError: no sessions, or ISIs that count from different events.
    """
    numbers = [str(number) for number in range(1, len(records) + 1)]
    return rendered(
        "comparison.html",
        sentences=[comparison_sentence(difference) for difference in differences],
        picture=inline_svg(comparison_figure(records, numbers), "comparison"),
        headings=HEADINGS,
        rows=comparison_rows(records),
        sessions=[_session(record) for record in records],
        losses=[f"{record.path.name}: {loss}" for record in records for loss in (*record.told_unread, *record.losses)],
    )


def _session(record: SessionRecord) -> dict[str, Any]:
    return {
        "subject": record.header.subject or "an unnamed subject",
        "log": record.path.name,
        "findings": [*finding_sentences(record), *([JUDGED_SINCE] if record.is_judged_since else [])],
        "counts": counts_sentence(record),
        "facts": first_facts(record),
    }
