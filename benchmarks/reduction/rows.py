"""The main comparison alone, with many sessions a row: its table, and the claims about it judged again.

What else the report holds, and which wrong models a claim fails for, is as the last whole run has it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any, Final

import pandas as pd

from benchmarks.dissertation.claims import (
    KINDS,
    NONE,
    NOT,
    REPRODUCED,
    UNDER,
    Claim,
    by_kind,
    claims_as_json,
    read_claims,
)
from benchmarks.reduction import comparison, verdicts
from benchmarks.reduction import dissertation as text
from benchmarks.reduction.claims import ERRORS
from benchmarks.reduction.conventional import TWELVE
from benchmarks.reduction.document import Section, Table, markdown
from benchmarks.reduction.look import NAMES
from benchmarks.reduction.method_claims import method_claims, star_claims, sweep_claims, their_error
from benchmarks.reduction.parallel import Workers, frame, run_sessions
from benchmarks.reduction.readings import PEOPLE
from benchmarks.reduction.size import Size

__all__ = ["judged_again", "measured", "rewritten"]

REST: Final = "The text's own ground truth"
"""How the rest of the opening begins, behind the counts."""

UNTRIED: Final = "no reading was tried"
"""Here; the verdict before names those that were."""

TITLE: Final = "The reduction of trials, with many sessions a row"


def measured(size: Size, seed: int, workers: Workers) -> pd.DataFrame:
    """The sessions of `kim11-measured` in the main comparison."""
    sessions = [session for session in comparison.sessions(size, seed) if session.cohort == PEOPLE]
    return frame(sessions, run_sessions(sessions, workers))


def beside_text(rows: pd.DataFrame) -> pd.DataFrame:
    """Trials of each method, the text's, and the interval of their difference."""
    table = comparison.summary(rows)
    table = table[table["text: trials"].notna()].rename(columns={"text: trials": "text"})
    lines = []
    for line in table.to_dict("records"):
        method = next(name for name, shown in NAMES.items() if shown == line["method"])
        error = math.hypot(line["SE"], their_error(method, line["accelerometer"]))
        apart = line["trials"] - line["text"]
        lines.append(
            {
                "method": line["method"],
                "accelerometer": line["accelerometer"],
                "sessions": line["sessions"],
                "trials": f"{line['trials']:.1f} ± {line['SE']:.1f}",
                "text": f"{line['text']:g}",
                "difference": f"{apart:+.1f} ({apart - ERRORS * error:+.1f} to {apart + ERRORS * error:+.1f})",
                "% of the text's 272": f"{100 * line['trials'] / text.TRIALS['without']['incremental']:.1f}",
                "F1: measured": "–"
                if math.isnan(line["F1 SE"])
                else f"{line['F1: measured']:.2f} ± {line['F1 SE']:.2f}",
                "text: F1": f"{line['text: F1']:.2f}",
            }
        )
    return pd.DataFrame(lines)


def judged_again(before: Iterable[Claim], rows: pd.DataFrame) -> list[Claim]:
    """All claims, those about the comparison as they come out with these sessions.

    Args:
        before: as the last whole run judged them.
        rows: as from `measured`.
    """
    now = [*method_claims({PEOPLE: comparison.summary(rows)}), *sweep_claims(rows), *star_claims(rows)]
    known = {(claim.where, claim.what): claim for claim in now}
    return [again(claim, known.get((claim.where, claim.what), claim)) for claim in before]


def again(before: Claim, now: Claim) -> Claim:
    """A claim with its new numbers; wrong models and readings were run only for the verdict before."""
    if now is before:
        return before
    if now.verdict == REPRODUCED:
        if before.verdict == REPRODUCED:
            return replace(now, fails_for=before.fails_for)
        untested = "cannot fail here: no wrong model was run for it with so many sessions"
        return replace(now, verdict=before.verdict if before.verdict.startswith("cannot fail") else untested)
    if now.verdict.startswith(NOT) and before.verdict.startswith(UNDER):
        return replace(now, verdict=before.verdict)
    if UNTRIED in now.verdict:
        was = before.verdict if before.verdict.startswith(NOT) else "not, because it comes out otherwise"
        return replace(now, verdict=was)
    return replace(now, fails_for=NONE)


def rewritten(rows: pd.DataFrame, facts: Mapping[str, Any], results: Path) -> str:
    """Put the claims judged again into a report's JSON and Markdown, and write the table beside it; the opening.

    Args:
        rows: as from `measured`.
        facts: what the run was.
        results: the report's path, without suffix.
    """
    path = results.with_suffix(".json")
    record, before = json.loads(path.read_text(encoding="utf-8")), read_claims(path)
    claims = judged_again(before, rows)
    said, was = verdicts.section(claims), fill(record["opening"], 120)
    people = rows["person"].nunique()
    counts, whole = by_kind(claims), record.get("whole", record["opening"])
    opening = (
        f"With {people} sessions a row of `{PEOPLE}` ({people / 11:g} for each of 11 people), {counts[REPRODUCED]} of "
        f"the text's {len(claims)} claims come out as printed and fail for a wrong model that was run; {counts[UNDER]} "
        f"come out under another reading or on other people, {counts[NOT]} do not, and {counts[KINDS[-1]]} "
        f"hold but could not fail. {TWELVE} `trial_reduction_rows.md` has intervals of each difference. All "
        f"else is of the last whole run, with 11 sessions a row. {whole[whole.index(REST) :]}"
    )
    record |= {"whole": whole, "opening": opening, "claims": claims_as_json(claims)}
    record["sections"][0]["tables"] = [
        {"caption": t.caption, "rows": json.loads(t.rows.to_json(orient="records"))} for t in said.tables
    ]
    path.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    page = results.with_suffix(".md").read_text(encoding="utf-8").replace(was, fill(opening, 120))
    begin, end = page.index(f"## {said.title}"), page.index("## The methods side by side")
    lines = "\n".join(markdown(said, results))
    results.with_suffix(".md").write_text(page[:begin] + lines + page[end:], encoding="utf-8")
    table = Section(TITLE, f"`{PEOPLE}`. {TWELVE}", [Table("Mean ± SE; intervals of 2 SE.", beside_text(rows))])
    told = [f"# {TITLE}", "", *(f"- {key}: {value}" for key, value in facts.items()), "", *markdown(table, results)[2:]]
    results.with_name(f"{results.name}_rows.md").write_text("\n".join(told).rstrip() + "\n", encoding="utf-8")
    return opening
