"""All claims of the text with their verdicts, and the first paragraph of the report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

import pandas as pd

from benchmarks.dissertation.claims import KINDS, REPRODUCED, Claim, by_kind, claims_as_json, put_to_test
from benchmarks.reduction import comparison, gaussians, initial, online, particles, pf_readings, reading_table, wrong
from benchmarks.reduction import dissertation as text
from benchmarks.reduction.claims import ERRORS, SHARE, UNIT
from benchmarks.reduction.conventional import TWELVE, shows_a_window
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.method_claims import in_words, method_claims, row, star_claims, sweep_claims
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
from benchmarks.reduction.significance import POWER, WORTH

PROSE = f"""\
Each claim of chapters 4 and 5 about the methods, ours on `{PEOPLE}` beside it. One rule: a number counts within
{ERRORS:g} standard errors of the difference, whose interval stands beside it, where the text's is known (trials: the
SDs of Fig. 4.14–4.18; convergence: its runs), else within {UNIT:g} (F1, correlation) or {100 * SHARE:.0f} % (one
person's trials); an order where it is the same throughout; a direction where it is {ERRORS:g} standard errors large. A
number whose own interval could hold a fifth of the text's holds and says nothing; so does "not significant" by a test
that finds a difference of {WORTH:g} with a power below {POWER:g}. Whatever comes out so is "reproduced" only if it
fails for a wrong model that was run on the same people (`fails_for`); else it "cannot fail here". Where the base fails,
the verdict names readings, or other people, for whom the claim holds: with so many, some do by chance. Which method a
bar of Fig. 4.24 and 4.25 belongs to was inferred from a copy in which the figures' text is out of order: likely, not
certain. Base and readings are below."""

PUT_IN = {"A full sweep takes 130 minutes": "by construction: the text's own sum of its own times"}

WRONG = {
    wrong.UNRELATED: "each MEP is that of an ISI drawn at random",
    wrong.RANDOM: "behind the initial ones, in the place of those that NR, SVMR and GPR ask for",
    wrong.MISREAD: "50 ms² of the edges as an SD of 50 ms; the particles' SD of 25 ms as a variance of 25 ms²",
    wrong.FIXED: "NR, SVMR and GPR report the window that is best for everybody, whatever they are told",
    wrong.OTHER_NOISE: "the noise of people at large near threshold, instead of little noise",
}


def contexts(rows: Mapping[ModuleType, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """The comparison under the base, on every cohort and reading, and under the readings of PF, by name."""
    main, read, pf = rows[comparison], rows[reading_table], rows[pf_readings]
    base = main[main["cohort"] == PEOPLE]
    found = {PEOPLE: base}
    found |= {f"people of {name}": group for name, group in main.groupby("cohort", sort=False) if name != PEOPLE}
    found |= {name: reading_table.rows_of(name, read) for name in list(reading_table.READINGS)[1:]}
    others = base[base["method"] != "pf"]
    found |= {name: pd.concat((others, pf_readings.rows_of(name, pf))) for name in list(pf_readings.SETTINGS)[1:]}
    return {name: comparison.summary(group) for name, group in found.items()}


def all_claims(rows: Mapping[ModuleType, pd.DataFrame], waveforms: list[Any]) -> list[Claim]:
    """Every claim, in the order of its figure, table or section; those that hold are put to the test.

    Args:
        rows: sessions by part of the report.
        waveforms: what the sessions on waveforms came to.
    """
    main = rows[comparison]
    claims = [
        *sweep_facts(main),
        *method_claims(contexts(rows)),
        *_side_by_side(main[main["cohort"] == PEOPLE]),
        *_of_particles(rows[particles]),
        *_of_initial(rows[initial]),
        *gaussian_claims(gaussians.components(rows[gaussians])),
        *online_claims(online.summary(waveforms)),
    ]
    return sorted(put_to_test(claims, wrong_claims(rows), PUT_IN), key=lambda claim: claim.where)


def _side_by_side(base: pd.DataFrame) -> list[Claim]:
    return [*sweep_claims(base), *star_claims(base)]


def _of_particles(rows: pd.DataFrame) -> list[Claim]:
    clouds = particles.labelled(rows)
    return particle_claims(particles.summary(clouds), particles.variances(clouds), clouds)


def _of_initial(rows: pd.DataFrame) -> list[Claim]:
    steps = initial.summary(rows)
    return [*seven_claims(steps), *initial_claims(steps), *step_claims(steps)]


def wrong_claims(rows: Mapping[ModuleType, pd.DataFrame]) -> dict[str, list[Claim]]:
    """What becomes of the claims under each model that is wrong on purpose, by its name.

    Args:
        rows: sessions by part of the report.
    """
    main = rows[comparison]
    base, others = main[main["cohort"] == PEOPLE], main[main["cohort"] == "recruitment"]
    found = {}
    for name in (wrong.UNRELATED, wrong.RANDOM, wrong.MISREAD, wrong.FIXED):
        table = wrong.of_part(rows[wrong], name, "comparison")
        same = base[~base["method"].isin((*table["method"].unique(), "default"))]  # what the model leaves as it is
        table = pd.concat((table, same))
        found[name] = [*method_claims({name: comparison.summary(table)}), *_side_by_side(table)]
    for part, claims_of in (("initial", _of_initial), ("particles", _of_particles)):
        if len(chosen := wrong.of_part(rows[wrong], wrong.UNRELATED, part)):
            found[wrong.UNRELATED] += claims_of(chosen)
    of_others = [*method_claims({"": comparison.summary(others)}), *_side_by_side(others), *sweep_facts(others)]
    return found | {wrong.OTHER_NOISE: of_others}


def section(claims: Sequence[Claim]) -> Section:
    """This part of the report."""
    said = ", ".join(f"{count} {name}" for name, count in by_kind(claims).items())
    table = Table(f"{len(claims)} claims: {said}.", pd.DataFrame(claims_as_json(claims)))
    return Section("Every claim, with a verdict", PROSE, [table, Table("Wrong models.", caught_by(claims))])


def caught_by(claims: Sequence[Claim]) -> pd.DataFrame:
    """How many of the reproduced claims fail for each wrong model."""
    failing = Counter(name for claim in claims if claim.verdict == REPRODUCED for name in claim.fails_for.split("; "))
    return pd.DataFrame(
        [
            {"wrong model": name, "what it is": what, "reproduced claims that fail for it": failing[name]}
            for name, what in WRONG.items()
        ]
    )


def opening(claims: Sequence[Claim], main: pd.DataFrame) -> str:
    """What comes out as printed, and what does not.

    Args:
        claims: all of them.
        main: sessions of the comparison.
    """
    table = comparison.summary(main[main["cohort"] == PEOPLE])
    counts = by_kind(claims)
    f1, trials, converged = (row(table, column) for column in ("F1: measured", "trials", "converged %"))
    ranked = sorted(f1, key=lambda method: -f1[method])
    sweep = main[(main["cohort"] == PEOPLE) & (main["method"] == "incremental") & ~main["accelerometer"]]
    swept = float(sweep["trials"].mean())
    place = ("first", "second", "third", "last")[ranked.index("pf")]
    theirs = {name: {m: values["without"][m] for m in text.METHODS} for name, values in _THEIRS.items()}
    shares = {method: 100 * value for method, value in theirs["converged"].items()}
    sentences = (
        f"On simulated people whose measured windows are the text's (`{PEOPLE}`), {counts[REPRODUCED]} of the text's",
        f"{len(claims)} claims come out as printed, within the standard errors of both sides or 0.1, and fail for a",
        f"wrong model that was run; {counts[KINDS[1]]} come out under another reading or on other people,",
        f"{counts[KINDS[2]]} do not, and {counts[KINDS[3]]} hold but could not fail.",
        shows_a_window(main),
        f"Without accelerometer, F1: {in_words(f1)} (text: {in_words(theirs['F1'])});",
        f"the text has PF last, and here it is {place}.",
        f"Trials: {in_words(trials, 0)} (text: {in_words(theirs['trials'], 0)});",
        f"that is {_shares(trials, 272.0)} of the text's 272,",
        f"and {_shares(trials, swept)} of our own sweep's {swept:.0f}.",
        TWELVE,
        f"Runs that converge: {in_words(converged, 0)} % (text: {in_words(shares, 0)} %).",
        "Which method a bar of Fig. 4.24 (trials) and 4.25 (F1) belongs to was inferred: likely, not certain.",
    )
    return " ".join(sentences)


def _shares(trials: Mapping[str, float], sweep: float) -> str:
    fewest_first = sorted(trials.items(), key=lambda pair: pair[1])
    return ", ".join(f"{100 * n / sweep:.0f} % ({m.upper()})" for m, n in fewest_first)


_THEIRS = {"F1": text.F1, "trials": text.TRIALS, "converged": text.CONVERGED}
