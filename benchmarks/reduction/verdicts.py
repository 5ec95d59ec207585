"""All claims of the text with their verdicts, and the first paragraph of the report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

import pandas as pd

from benchmarks.dissertation.claims import Claim, claims_as_json
from benchmarks.reduction import before, comparison, gaussians, initial, online, particles, pf_readings, reading_table
from benchmarks.reduction import dissertation as text
from benchmarks.reduction.claims import SHARE, UNIT
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.method_claims import cell, in_words, method_claims, row, star_claims, sweep_claims
from benchmarks.reduction.part_claims import (
    gaussian_claims,
    initial_claims,
    online_claims,
    particle_claims,
    seven_claims,
    step_claims,
    sweep_facts,
)
from benchmarks.reduction.readings import PEOPLE

PROSE = f"""\
Each claim of chapters 4 and 5 about the methods, ours on `{PEOPLE}` beside it. Numbers of trials count as reproduced
within {100 * SHARE:.0f} %, F1, correlation and convergence within {UNIT:g}; an order where it is the same throughout.
Where the base fails, the verdict names readings, or other people, for whom the claim holds: with so many, some do by
chance. A direction counts however small the difference: from so few sessions, many are chance. That two things do not
differ can hardly be refuted with so few people. Which method a bar of Fig. 4.24 and 4.25 belongs to was inferred from a
copy in which the figures' text is out of order: likely, not certain. Base and readings are below."""


def contexts(rows: Mapping[ModuleType, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """The comparison under the base, on every cohort and reading, and under the readings of PF, by name."""
    main, read, pf = rows[comparison], rows[reading_table], rows[pf_readings]
    base = main[main["cohort"] == PEOPLE]
    found = {PEOPLE: base}
    found |= {f"people of {name}": group for name, group in main.groupby("cohort", sort=False) if name != PEOPLE}
    skipped = {"base", "kim11 (input noise of people at large)"}
    found |= {name: reading_table.rows_of(name, read) for name in reading_table.READINGS if name not in skipped}
    others = base[base["method"] != "pf"]
    found |= {name: pd.concat((others, pf_readings.rows_of(name, pf))) for name in list(pf_readings.SETTINGS)[1:]}
    return {name: comparison.summary(group) for name, group in found.items()}


def all_claims(rows: Mapping[ModuleType, pd.DataFrame], waveforms: list[Any]) -> list[Claim]:
    """Every claim, in the order of its figure, table or section.

    Args:
        rows: sessions by part of the report.
        waveforms: what the sessions on waveforms came to.
    """
    main = rows[comparison]
    base = main[main["cohort"] == PEOPLE]
    steps, clouds = initial.summary(rows[initial]), particles.labelled(rows[particles])
    pf_trials = cell(comparison.summary(base), "trials", "pf")
    claims = [
        *sweep_facts(main),
        *seven_claims(steps, pf_trials),
        *method_claims(contexts(rows)),
        *sweep_claims(base),
        *star_claims(base),
        *particle_claims(particles.summary(clouds), particles.variances(clouds), clouds),
        *initial_claims(steps),
        *step_claims(steps),
        *gaussian_claims(gaussians.components(rows[gaussians])),
        *online_claims(online.summary(waveforms)),
    ]
    return sorted(claims, key=lambda claim: claim.where)


def section(claims: Sequence[Claim]) -> Section:
    """This part of the report."""
    counts = Counter(kind(claim) for claim in claims)
    said = ", ".join(f"{count} {name}" for name, count in counts.items())
    table = pd.DataFrame(claims_as_json(claims))
    return Section("Every claim, with a verdict", PROSE, [Table(f"{len(claims)} claims: {said}.", table)])


def kind(claim: Claim) -> str:
    """Which of the three verdicts it is."""
    return "reproduced" if claim.verdict == "reproduced" else claim.verdict.split()[0].rstrip(",") + " …"


def opening(claims: Sequence[Claim], main: pd.DataFrame, zero: pd.DataFrame) -> str:
    """What comes out as printed, what does not, and what F1 there is before any trial.

    Args:
        claims: all of them.
        main: sessions of the comparison.
        zero: as from `before.table`.
    """
    table = comparison.summary(main[main["cohort"] == PEOPLE])
    counts = Counter(kind(claim) for claim in claims)
    f1, trials, converged = (row(table, column) for column in ("F1: measured", "trials", "converged %"))
    ranked = sorted(f1, key=lambda method: -f1[method])
    place = ("first", "second", "third", "last")[ranked.index("pf")]
    theirs = {name: {m: values["without"][m] for m in text.METHODS} for name, values in _THEIRS.items()}
    shares = {method: 100 * value for method, value in theirs["converged"].items()}
    sentences = (
        f"On simulated people whose measured windows are the text's (`{PEOPLE}`), {counts['reproduced']} of the text's",
        f"{len(claims)} claims come out as printed (trials within 30 %, other numbers within 0.1),",
        f"{counts['under …']} under another reading or on other people, and {counts['not …']} do not.",
        f"Without accelerometer, F1: {in_words(f1)} (text: {in_words(theirs['F1'])});",
        f"the text has PF last, and here it is {place}.",
        f"Trials: {in_words(trials, 0)} (text: {in_words(theirs['trials'], 0)}).",
        f"Runs that converge: {in_words(converged, 0)} % (text: {in_words(shares, 0)} %).",
        "Which method a bar of Fig. 4.24 (trials) and 4.25 (F1) belongs to was inferred: likely, not certain.",
        before.in_words(zero[zero["cohort"] == PEOPLE]),
    )
    return " ".join(sentences)


_THEIRS = {"F1": text.F1, "trials": text.TRIALS, "converged": text.CONVERGED}
