"""What the text claims of particles, initial observations, two Gaussians, the sweep, and the online test."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Hashable, Mapping
from typing import Final

import numpy as np
import pandas as pd

from benchmarks.dissertation.claims import Claim
from benchmarks.reduction import dissertation as text
from benchmarks.reduction.claims import ERRORS, Found, Statement, about, between, number, share, told
from benchmarks.reduction.comparison import PEOPLE_OF_KIM
from benchmarks.reduction.look import NAMES
from benchmarks.reduction.method_claims import their_error
from benchmarks.reduction.particles import RANGES
from benchmarks.reduction.readings import PEOPLE
from benchmarks.reduction.significance import no_power, paired_tests
from benchmarks.reduction.timing import BREAKS_OF_A_FULL_SWEEP, minutes

Table = pd.DataFrame

EARLY: Final = tuple(f"k={k}" for k in (1, 2, 3))
LATE: Final = tuple(f"k={k}" for k in (6, 7, 8))
CLOSE: Final = 0.2
"""Variances that differ by less than this share are called equal."""


def particle_claims(table: Table, spread: Table, rows: pd.DataFrame) -> list[Claim]:
    """Fig. 4.28 and 4.30.

    Args:
        table: as from `particles.summary`.
        spread: as from `particles.variances`.
        rows: the sessions, as from `particles.labelled`.
    """
    bare = {name: group.set_index("particles") for name, group in table.groupby("range", sort=False)}
    statements: list[Statement[Table]] = [
        Statement("Fig. 4.28", "30 to 40 particles need 3 to 4 iterations.", "3–4", _iterations),
        Statement("Fig. 4.28", "30 to 40 particles need 100 to 150 trials.", "100–150", _trials),
        Statement("Fig. 4.28", "Fewer particles need fewer trials.", "rising", _rising),
        Statement("Fig. 4.28", "F1 is lower with 10 and 20 particles than with more.", "lower", _lower),
    ]
    values = rows[rows["range"] == "without"]
    f1 = values.pivot_table(index=values["person"] % PEOPLE_OF_KIM, columns="particles", values="f1, measured")
    least = float(paired_tests(f1)["p"].min())
    weak = filter(None, (no_power(f1[first] - f1[second]) for first, second in itertools.combinations(f1, 2)))
    same = about(least >= 0.05, f"least corrected p {least:.2g}", next(weak, ""))
    ratios = {name: _ratio(spread, name) for name in RANGES if name != "without"}
    return [
        *(told(one, bare) for one in statements),
        told(Statement("Fig. 4.28", "No difference in F1 is significant.", "n.s.", lambda _: same), {"base": None}),
        told(
            Statement("Fig. 4.30", "With accelerometer the variance falls faster at first.", "lower", _faster), ratios
        ),
        told(Statement("Fig. 4.30", "After iteration 5 or 6 the variances hardly differ.", "equal", _equal), ratios),
    ]


def _iterations(table: Table) -> Found:
    found = [table.loc[m, "iterations"] for m in (30, 40)]
    return about(all(2.5 <= value < 4.5 for value in found), f"{found[0]:.1f} and {found[1]:.1f}")


def _trials(table: Table) -> Found:
    found = [table.loc[m, "trials"] for m in (30, 40)]
    return about(all(100 <= value <= 150 for value in found), f"{found[0]:.0f} and {found[1]:.0f}")


def _rising(table: Table) -> Found:
    trials, errors = table["trials"], table["trials SE"]
    apart = (trials.iloc[-1] - trials.iloc[0]) / math.hypot(errors.iloc[-1], errors.iloc[0])
    return about(trials.is_monotonic_increasing and apart >= ERRORS, ", ".join(f"{value:.0f}" for value in trials))


def _lower(table: Table) -> Found:
    f1, few, many = table["F1: measured"], [10, 20], [30, 40, 50]
    low, high = f1.loc[few].idxmax(), f1.loc[many].idxmin()
    holds = _larger(table, "F1: measured", "F1 SE", high, low)
    return about(holds, ", ".join(f"{value:.2f}" for value in f1))


def _larger(table: Table, value: str, error: str, first: Hashable, second: Hashable) -> bool:
    """Whether one row's value is larger than another's by two standard errors."""
    apart = table.loc[first, value] - table.loc[second, value]
    return bool(apart >= ERRORS * math.hypot(table.loc[first, error], table.loc[second, error]))


def _ratio(spread: Table, name: str) -> pd.Series:
    """Mean variance with accelerometer by that without, by iteration."""
    means = {label: group.filter(like="k=").mean() for label, group in spread.groupby("range", sort=False)}
    return means[name] / means["without"]


def _faster(ratio: pd.Series) -> Found:
    early = ratio[list(EARLY)]
    return about((early < 1.0).all(), "ratio " + ", ".join(f"{value:.2f}" for value in early))


def _equal(ratio: pd.Series) -> Found:
    late = ratio[list(LATE)]
    return about(((late - 1.0).abs() <= CLOSE).all(), "ratio " + ", ".join(f"{value:.2f}" for value in late))


Curve = pd.DataFrame
"""F1 and trials of one method, with or without accelerometer, by number of initial observations."""


def initial_claims(table: Table) -> list[Claim]:
    """4.4.7, Fig. 4.31–4.33.

    Args:
        table: as from `initial.summary`.
    """
    return [
        told(
            Statement(where, f"{NAMES[method]} {word} accelerometer: {what}", theirs, look),
            {_people(cohort): _curve(table, cohort, method, word) for cohort in table["cohort"].unique()},
        )
        for where, method, word, what, theirs, look in _INITIAL
    ]


def _people(cohort: str) -> str:
    return "constant-CV noise" if cohort == "gaussian" else cohort


def _curve(table: Table, cohort: str, method: str, word: str) -> Curve:
    keys = (table["cohort"] == cohort) & (table["method"] == method) & (table["accelerometer"] == word)
    return table[keys].set_index("initial")


def _rises(low: int, high: int) -> Callable[[Curve], Found]:
    def look(curve: Curve) -> Found:
        f1 = curve["F1"]
        return about(_larger(curve, "F1", "F1 SE", high, low), f"{f1[low]:.2f} → {f1[high]:.2f}")

    return look


def _best(least: int, most: int) -> Callable[[Curve], Found]:
    def look(curve: Curve) -> Found:
        inside = (curve.index >= least) & (curve.index <= most)
        at, other = curve["F1"].idxmax(), curve.loc[~inside, "F1"].idxmax()
        holds = inside[curve.index.get_loc(at)] and _larger(curve, "F1", "F1 SE", at, other)
        shown = f"best at {at} ({curve['F1'].max():.2f}); {curve.loc[inside, 'F1'].max():.2f} where the text has it"
        return about(holds, shown)

    return look


def _low(least: int, most: int) -> Callable[[Curve], Found]:
    def look(curve: Curve) -> Found:
        inside = (curve.index >= least) & (curve.index <= most)
        (few, few_error), (many, many_error) = (_mean_trials(curve[rows]) for rows in (inside, ~inside))
        return about(many - few >= ERRORS * math.hypot(few_error, many_error), f"{few:.1f} against {many:.1f}")

    return look


def _mean_trials(rows: Curve) -> tuple[float, float]:
    """Mean trials of some numbers of initial observations, and its standard error."""
    return float(rows["trials"].mean()), float(np.sqrt((rows["trials SE"] ** 2).sum()) / len(rows))


_INITIAL: Final = (
    ("Fig. 4.31", "nr", "without", "F1 rises from 7 to 8 initial observations.", "higher", _rises(7, 8)),
    ("Fig. 4.31", "nr", "with", "F1 rises from 6 to 9 initial observations.", "higher", _rises(6, 9)),
    ("Fig. 4.31", "nr", "without", "trials are low below 7.", "low", _low(4, 6)),
    ("Fig. 4.31", "nr", "with", "trials are low below 5.", "low", _low(4, 4)),
    ("Fig. 4.32", "svmr", "without", "F1 is best at 4.", "4", _best(4, 4)),
    ("Fig. 4.32", "svmr", "with", "F1 is best at 3.", "3", _best(3, 3)),
    ("Fig. 4.32", "svmr", "without", "trials are low from 4 to 8.", "low", _low(4, 8)),
    ("Fig. 4.32", "svmr", "with", "trials are low above 3.", "low", _low(4, 9)),
    ("Fig. 4.33", "gpr", "without", "F1 is best at 6.", "6", _best(6, 6)),
    ("Fig. 4.33", "gpr", "with", "F1 is best below 8.", "below 8", _best(2, 7)),
    ("Fig. 4.33", "gpr", "without", "trials are low below 8.", "low", _low(2, 7)),
    ("Fig. 4.33", "gpr", "with", "trials are low above 2.", "low", _low(3, 9)),
)


def step_claims(table: Table) -> list[Claim]:
    """Which steps of Fig. 4.31–4.33 are significant here; NR's from 7 to 8 is in the text's words."""
    own = table[table["cohort"] == PEOPLE]
    step = own[(own["method"] == "nr") & (own["accelerometer"] == "without") & (own["initial"] == 8)].iloc[0]
    look = about(bool(step["F1 *"]), step["F1 *"] or "n.s.")
    claims = [
        told(
            Statement("Fig. 4.31", "NR's rise from 7 to 8 without accelerometer is significant.", "*", lambda _: look),
            {"base": None},
        )
    ]
    for where, method in (("Fig. 4.31", "nr"), ("Fig. 4.32", "svmr"), ("Fig. 4.33", "gpr")):
        marks = own[(own["method"] == method) & ((own["F1 *"] != "") | (own["trials *"] != ""))]
        ours = "; ".join(
            f"{r['accelerometer']}, to {r['initial']}: F1 {r['F1 *'] or 'n.s.'}, trials {r['trials *'] or 'n.s.'}"
            for _, r in marks.iterrows()
        )
        reason = "the marks' places cannot be read in the copy that was used; ours stand for themselves"
        found = Found(holds=False, ours=ours or "none significant")
        what = f"{NAMES[method]}: marks of significance between neighbouring numbers."
        claims.append(told(Statement(where, what, "* to ***", lambda _, f=found: f, reason), {"base": None}))
    return claims


def seven_claims(table: Table) -> list[Claim]:
    """Trials with seven initial observations (Fig. 4.15–4.17); PF has none, and its Fig. 4.14 the number of Fig. 4.24.

    Args:
        table: as from `initial.summary`.
    """
    figures = {"nr": "Fig. 4.15", "svmr": "Fig. 4.16", "gpr": "Fig. 4.17"}
    claims = []
    for method, where in figures.items():
        mean, sd = text.TRIALS_SEVEN[method]
        curves = {cohort: _curve(table, cohort, method, "without") for cohort in table["cohort"].unique()}
        contexts = {_people(str(cohort)): curve.loc[7] for cohort, curve in curves.items()}
        what = f"{NAMES[method]} needs {mean} trials with seven initial observations."
        claims.append(told(Statement(where, what, f"{mean}, SD {sd}", _seven(mean, their_error(method))), contexts))
    return claims


def _seven(theirs: float, error: float) -> Callable[[pd.Series], Found]:
    return lambda row: between(row["trials"], theirs, math.hypot(row["trials SE"], error), own=float(row["trials SE"]))


def gaussian_claims(components: Table) -> list[Claim]:
    """Fig. 4.34 and 4.4.8.

    Args:
        components: as from `gaussians.components`, the text's own row first.
    """
    high, low, zero = text.TWO_GAUSSIANS
    contexts = {str(r["reading"]): r for _, r in components.iloc[1:].iterrows()}
    statements: list[Statement[pd.Series]] = [
        Statement("Fig. 4.34", "The higher Gaussian's share is 0.57.", str(high), lambda r: number(r["high"], high)),
        Statement("Fig. 4.34", "The lower Gaussian's share is 0.09.", str(low), lambda r: number(r["low"], low, 0.05)),
        Statement(
            "4.4.8",
            "The larger Gaussian is 6.3 times as high as the smaller.",
            "6.3",
            lambda r: share(r["ratio"], high / low),
        ),
        Statement("4.4.8", "The lower vanishes in 70 % of runs.", "0.70", lambda r: number(r["lower is zero"], zero)),
    ]
    return [told(one, contexts) for one in statements]


def sweep_facts(rows: pd.DataFrame) -> list[Claim]:
    """Table 4.1 and 4.2.1, from the conventional sweeps of the comparison."""
    sweeps = rows[(rows["method"] == "incremental") & ~rows["accelerometer"]]
    passed = {str(name): float(group["normal"].mean()) for name, group in sweeps.groupby("cohort", sort=False)}
    share_normal = text.NORMAL_OF_ELEVEN / PEOPLE_OF_KIM
    full = minutes(600, BREAKS_OF_A_FULL_SWEEP)
    return [
        told(
            Statement(
                "Table 4.1",
                "Normality of the mean MEPs inside the window is not rejected for 8 of 11.",
                f"{share_normal:.2f}",
                lambda value: number(value, share_normal),
            ),
            passed,
        ),
        told(
            Statement(
                "4.2.1",
                "A full sweep takes 130 minutes: 1 s a trial, 2 min after twelve, two breaks of 10 min.",
                "130",
                lambda value: share(value, 130.0),
            ),
            {"as stated": full},
        ),
    ]


def online_claims(table: Table) -> list[Claim]:
    """Table 5.3, NR.

    Args:
        table: as from `online.summary`.
    """
    claims = []
    for person, r in enumerate(text.ONLINE["correlation"]):
        rows = table[(table["person"] == person + 1) & (table["method"] == NAMES["nr"])]
        context: Mapping[str, pd.Series] = {"base": rows.iloc[0]}
        n, swept = text.ONLINE["stimuli"][person], text.ONLINE["conventional"][person]
        who, figure = f"subject {person + 1}", ("Fig. 5.12", "Fig. 5.13")[person]
        statements: list[Statement[pd.Series]] = [
            Statement(
                f"Table 5.3, {figure}",
                f"Online, NR's profile of {who} correlates with the measured one by {r}.",
                str(r),
                lambda s, r=r: number(s["r: measured"], r),
            ),
            Statement(
                "Table 5.3", f"Online, NR needs {n} trials with {who}.", str(n), lambda s, n=n: share(s["trials"], n)
            ),
            Statement(
                "Table 5.3",
                f"The conventional sweep needs {swept} trials with {who}.",
                str(swept),
                lambda s, n=swept: share(s["conventional"], n),
            ),
        ]
        claims += [told(one, context) for one in statements]
    return claims


__all__ = [
    "gaussian_claims",
    "initial_claims",
    "online_claims",
    "particle_claims",
    "seven_claims",
    "step_claims",
    "sweep_facts",
]
