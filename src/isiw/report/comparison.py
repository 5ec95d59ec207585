"""Several sessions beside each other: as a table, in words, and as a page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from isiw import sentences, summary
from isiw.dissertation.response_counts import TrialsByIsi, by_isi, count_trials, measured_profile
from isiw.errors import InvalidValueError
from isiw.figures import Edge, Estimate
from isiw.log.continuing import imported_sentence
from isiw.log.record import SessionRecord
from isiw.metrics import profile_correlation
from isiw.plots.comparison import comparison_figure
from isiw.plots.style import inline_svg, session_name
from isiw.priors.days import DayToDay
from isiw.priors.differing import Difference
from isiw.report.html import rendered, write_page
from isiw.report.tables import first_facts
from isiw.report.words import counts_sentence, findings
from isiw.text.sanitize import one_line

HEADINGS = ("session", "subject", "begun (UTC)", "trials", "P(window)", "window", "start", "end")
"""The columns of the table."""


def comparison_table(records: Sequence[SessionRecord]) -> str:
    """The windows of sessions as their logs report them, a line each; start and end are 90 % intervals."""
    rows = [HEADINGS, *comparison_rows(records)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
    since = [f"{_whose(r)}: {summary.JUDGED_SINCE}" for r in records if r.estimates and r.is_judged_since]
    imported = imported_sentence([_whose(record) for record in records if record.header.imported])
    return "\n".join([*lines, *since, *filter(None, [imported])])


def comparison_rows(records: Sequence[SessionRecord]) -> list[tuple[str, ...]]:
    """The cells of that table, a row a session; empty if nothing is known."""
    rows: list[tuple[str, ...]] = []
    for number, record in enumerate(records, start=1):
        record.require_open()
        begun, last = record.begun[:16].replace("T", " ") or "not known", record.found
        who = (str(number), one_line(record.header.subject) or "unnamed", begun, str(len(record.table.told)))
        chance = "–" if last is None or last.probability is None else f"{last.probability:.2f}"
        if last is None:
            rows.append((*who, chance, sentences.TOO_LITTLE, "", ""))
        else:
            rows.append((*who, chance, summary.in_short(last), _cell(last, last.start), _cell(last, last.end)))
    return rows


def _cell(estimate: Estimate, edge: Edge) -> str:
    if estimate.window is None:
        return ""
    if edge.low_ms is None or edge.high_ms is None:
        return "–"
    if edge.low_ms == edge.high_ms:
        return summary.edge_text(edge.low_ms)
    if math.isinf(edge.low_ms) or math.isinf(edge.high_ms):
        return f"before {edge.high_ms:.0f} ms" if math.isinf(edge.low_ms) else f"after {edge.low_ms:.0f} ms"
    return f"{sentences.interval_cell(edge)} ms"


def comparison_sentence(difference: Difference) -> str:
    """A sentence on the difference of two windows."""
    named = difference.first.header.subject and difference.second.header.subject
    other = "different subject codes" if named else "perhaps the same person, as not both have a subject code"
    kind = "the same person" if difference.same_person else other
    said = [
        f"{_whose(difference.second)} against {_whose(difference.first)}, {kind}:",
        sentences.moved(difference.moved, 1.0 - DayToDay().p_stays),
        sentences.later(difference.starts_later, difference.ends_later),
        f"{difference.obstacle.removesuffix('.')}." if difference.obstacle else "",
    ]
    return " ".join(sentence for sentence in said if sentence)


def correlation_sentence(record: SessionRecord, measured: SessionRecord) -> str:
    """How the estimated profile of a session correlates with the mean MEPs by ISI of another.

    Raises:
        InvalidValueError: an estimate without a profile, no pairs that count, ISIs from different events, or too few
            in common.
        LogError: measured MEPs that would show the concealed arm of an intervention.
    """
    measured.require_open()
    found, trials = record.found, _pairs_of(measured)
    if found is None or not found.profile_mv:
        remedy = "Name the log of a session with trials, of a strategy that estimates one, first."
        raise InvalidValueError("the log has no estimated profile", got=str(record.path), remedy=remedy)
    events = record.header.space.reference, measured.header.space.reference
    if events[0] != events[1]:
        raise InvalidValueError("the logs count ISIs from different events", got=" and ".join(events))
    at_ms, mean_mv, counts = measured_profile(trials)
    r, isis = profile_correlation(found.grid_ms, found.profile_mv, at_ms, mean_mv)
    fewest = f"means of {counts.min()} to {counts.max()} trials"
    return (
        f"The profile of {_whose(record)} correlates with the mean MEPs of {_whose(measured)} by {r:.2f}, "
        f"at {isis} ISIs ({fewest} each)."
    )


def counts_table(record: SessionRecord, threshold_mv: float | None, share: float) -> str:
    """The response counts of a session, a line an ISI, and the effective window.

    Raises:
        InvalidValueError: as for `count_trials`.
        LogError: the arm of an intervention is concealed.
    """
    record.require_open()
    study = count_trials(_pairs_of(record), threshold_mv, share)
    rows = study.counts.itertuples()
    lines = [f"{row.Index:5g} ms  {row.trials:6d}  {row.responses:9d}  {row.share:5.2f}" for row in rows]
    effective = "No ISI is effective" if study.window is None else f"Effective: {study.window}"
    alone = "" if math.isnan(study.alone_share) else f" {study.alone_share:.0%} of the trials of TMS alone exceed it."
    said = f"{effective}: more than {share:.0%} of the trials above {1e3 * study.threshold_mv:.3g} µV.{alone}"
    return "\n".join([f"{'ISI':>8}  trials  responses  share", *lines, said])


def _pairs_of(record: SessionRecord) -> TrialsByIsi:
    trials = by_isi(record.table)
    if not len(trials.isi_ms):
        raise InvalidValueError(
            "no pair of stimuli in the log counts", got=str(record.path), remedy="Name another log."
        )
    return trials


def _whose(record: SessionRecord) -> str:
    return f"{one_line(record.header.subject) or 'unnamed'} ({record.path.name})"


def save_comparison(
    records: Sequence[SessionRecord], differences: Sequence[Difference], path: str | Path, *, overwrite: bool = False
) -> Path:
    """Write a page that compares sessions into a file.

    Args:
        records: the sessions.
        differences: as `isiw.priors.differences` finds them.
        path: where to, such as `comparison.html`.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        ConfigError: jinja2 is not installed.
        InvalidValueError: ISIs from different events, a path that is none of a page, or a file not to be replaced.
    """
    return write_page(path, lambda: comparison_page(records, differences), overwrite=overwrite)


def comparison_page(records: Sequence[SessionRecord], differences: Sequence[Difference]) -> str:
    """A page of HTML that compares sessions; it needs no network and no JavaScript."""
    names = [f"{number}: {session_name(record)}" for number, record in enumerate(records, start=1)]
    return rendered(
        "comparison.html",
        sentences=[comparison_sentence(difference) for difference in differences],
        picture=inline_svg(comparison_figure(records, names), "comparison"),
        headings=HEADINGS,
        rows=comparison_rows(records),
        sessions=[
            {
                "subject": record.header.subject or "an unnamed subject",
                "log": record.path.name,
                "findings": [
                    *(one.text for one in findings(record)),
                    *([summary.JUDGED_SINCE] if record.is_judged_since else []),
                ],
                "counts": counts_sentence(record),
                "facts": first_facts(record),
            }
            for record in records
        ],
        losses=[f"{record.path.name}: {loss}" for record in records for loss in (*record.unread_said, *record.losses)],
    )
