"""What follows from the comparison: three sentences and two tables, all of them made of its figures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from benchmarks.comparison.measures import CRITERIA, JUDGED, SHOWN
from benchmarks.comparison.rows import EVEN, GUESS
from benchmarks.comparison.running import RECORDED
from isiw.studies import differences

MAIN: Final = "recruitment"
DEFAULT: Final = "default"
CRITERION: Final = 0.7
EARLY, LATE = JUDGED
OFTEN: Final = 0.05
"""A larger share that is sure and wrong is named."""

NAMES: Final[Mapping[str, str]] = {
    GUESS: "one fixed window for everybody, no stimulus",
    EVEN: "evenly spaced ISIs",
    "random": "random ISIs",
    "nr": "the dissertation's nonlinear regression",
    "gpr": "the dissertation's Gaussian process",
    "svmr": "the dissertation's support vectors",
    "pf": "the dissertation's particle filter (no answer before 30)",
    DEFAULT: "**isiw's default**",
}
"""What the rows of README's table are called, in their order."""

PEOPLE: Final[Mapping[str, str]] = {
    "recruitment": "noise as near threshold (`recruitment`)",
    "gaussian": "constant-CV noise (`gaussian`)",
    "recorded": "responses that were recorded (`recorded`)",
}

WHO: Final[Mapping[str, str]] = {
    "recruitment": "simulated people with noise as near the motor threshold (`recruitment`)",
    "gaussian": "simulated people with constant-CV noise (`gaussian`)",
    RECORDED: "simulated windows of people whose MEPs were recorded",
}


def sentences(table: pd.DataFrame, rows: pd.DataFrame) -> list[str]:
    """What follows: what choosing saves, how the ways to choose differ, and whom not to trust.

    Args:
        table: as `measures.table_of` gives it.
        rows: the rows that it was made of.
    """
    main = table[table["cohort"] == MAIN].set_index("strategy")
    compared = differences(rows[(rows["cohort"] == MAIN) & (rows["strategy"] != GUESS)], DEFAULT)
    return [
        savings(table, [MAIN, *(cohort for cohort in table["cohort"].unique() if cohort != MAIN)]),
        choosing(compared[compared["trial"] == EARLY]),
        trusting(main),
    ]


def savings(table: pd.DataFrame, cohorts: Iterable[str]) -> str:
    """How many stimuli isiw's default needs against even ISIs, with each of some cohorts.

    Args:
        table: as `measures.table_of` gives it.
        cohorts: the cohorts.
    """
    defaults = table[table["strategy"] == DEFAULT].set_index("cohort", drop=False)
    found = [saving(defaults.loc[cohort].to_dict()) for cohort in cohorts if cohort in defaults.index]
    return " ".join(f"{each[0].upper()}{each[1:]}." for each in found)


def saving(line: Mapping[str, Any]) -> str:
    """How many stimuli isiw's default needs to a lasting F1, against even ISIs: to the largest F1 that both reach.

    Args:
        line: that of isiw's default with a cohort, with the columns of `measures.table_of`.
    """
    both = [each for each in CRITERIA if line[f"bound_{each}"] == ""]
    wanted = both[-1] if both else CRITERIA[0]
    names = ("stimuli", "even", "ratio", "low", "high")
    reached, even, ratio, low, high = (line[f"{name}_{wanted}"] for name in names)
    people = WHO.get(line["cohort"], f"simulated people of `{line['cohort']}`")
    who = f"on {line['people']} {people}"
    f1 = f"a mean F1 of {_criterion(wanted)}"
    if math.isinf(reached):
        return f"{who} isiw's default does not keep {f1} within {line['trials']} stimuli"
    has = f"{who} isiw's default keeps {f1} from {reached:.0f} stimuli on, evenly spaced ISIs"
    if math.isinf(even):
        return f"{has} not within {line['trials']}"
    found, ends = f"{has} from {even:.0f}", _interval(low, high)
    if math.isnan(ratio):
        return f"{found}, which is too early to compare"
    if math.isnan(low) or low <= 1.0 <= high:
        return f"{found}, which may be chance (ratio {short(ratio)}, {ends})"
    return f"{found}: {_percent(abs(1.0 - ratio))} {'fewer' if ratio < 1.0 else 'more'} (ratio {short(ratio)}, {ends})"


def choosing(compared: pd.DataFrame) -> str:
    """How many other rows are above and below the default, and the best of those that have the most people.

    Args:
        compared: as `isiw.studies.differences` gives it against the default, of one cohort and mark.
    """
    known = compared[compared["low"].notna()]
    if not len(known):
        return f"Of the ways to choose and to estimate nothing can be said after {EARLY} stimuli: too few people."
    below, above = known[known["high"] < 0], known[known["low"] > 0]
    best = known.loc[known["difference"].where(known["people"] == known["people"].max()).idxmax()]
    named = f" ({_listed(above['strategy'])})" if len(above) else ""
    rest = len(known) - len(below) - len(above)
    return (
        f"After {EARLY} stimuli, of {len(known)} other ways to choose and to estimate, {len(below)} have a lower mean "
        f"F1 than the default on the same people of `{MAIN}`, {len(above)} a higher one{named}, and {rest} cannot be "
        f"told from it (intervals that hold together with 95 %); the best of those on the most people is "
        f"`{best['strategy']}` ({signed(best['difference'])}, {signed(best['low'])} to {signed(best['high'])}, "
        f"{best['people']} people)."
    )


def trusting(main: pd.DataFrame) -> str:
    """Whose answers are often sure and wrong, and who is no better than the fixed window.

    Args:
        main: the table of one cohort by strategy.
    """
    wrong = main[f"wrong_{EARLY}"].dropna()
    people = main["people"].reindex(wrong.index)
    chance = [binomtest(round(w * n), n, OFTEN, "greater").pvalue for w, n in zip(wrong, people, strict=True)]
    often = wrong[np.array(chance) < OFTEN].sort_values(ascending=False)
    own = f"{_percent(wrong[DEFAULT])} of the default's answers are sure and wrong" if DEFAULT in wrong else ""
    many = ", ".join(f"`{name}` ({_percent(share)})" for name, share in often.items() if name != DEFAULT)
    beyond = f"more than {_percent(OFTEN)}, beyond chance,"
    said = f"{beyond} of those of {many}" if many else f"{beyond} of no other row's"
    guess, late = main[f"f1_{EARLY}"][GUESS], main[f"f1_{LATE}"].drop(GUESS).dropna()
    beaten = late[late <= guess]
    no_better = f"not above it are {_listed(beaten.index)}" if len(beaten) else f"each of {len(late)} rows is above it"
    return (
        f"After {EARLY} stimuli {own}, {said}; one fixed window for everybody has an F1 of {short(guess)} without any "
        f"stimulus, and after {LATE} stimuli {no_better}."
    )


def _listed(names: Iterable[Any]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _interval(low: float, high: float) -> str:
    return "too few people for an interval" if math.isnan(low) else f"95 % interval {short(low)} to {short(high)}"


def short(value: float) -> str:
    """A number with two digits behind the point, as .72; — if there is none."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.2f}"
    return text.removeprefix("0") if text.startswith("0.") else text


def signed(value: float) -> str:
    """The same with its sign."""
    return ("−" if value < 0 else "+") + short(abs(value))


def compared_rows(rows: pd.DataFrame, cohort: str) -> pd.DataFrame:
    """The rows of README's table of one cohort: those of the default's people; a method that met fewer is left out.

    Args:
        rows: all rows, those of the fixed window, too.
        cohort: the cohort.
    """
    shown = rows[(rows["cohort"] == cohort) & rows["strategy"].isin(list(NAMES))]
    people = set(shown.loc[shown["strategy"] == DEFAULT, "person"])
    met = shown.groupby("strategy")["person"].agg(lambda persons: people <= set(persons))
    return shown[shown["strategy"].isin(met.index[met]) & shown["person"].isin(people)]


def readme_table(tables: Mapping[str, pd.DataFrame]) -> str:
    """README's table.

    Args:
        tables: by cohort the table of `compared_rows`, as `measures.table_of` gives it.
    """
    kept = f"stimuli until F1 stays at {' / '.join(map(_criterion, CRITERIA))}"
    lines = [["people", "method", *(f"F1 after {mark}" for mark in SHOWN), kept], ["---"] * (3 + len(SHOWN))]
    for cohort, table in tables.items():
        by_name = table.set_index("strategy")
        for place, name in enumerate(name for name in NAMES if name in by_name.index):
            line = by_name.loc[name]
            who = f"{line['people']}: {PEOPLE[cohort]}" if place == 0 else ""
            means = [short(line[f"f1_{mark}"]) for mark in SHOWN]
            needed = " / ".join(_stimuli(line[f"stimuli_{each}"]) for each in CRITERIA)
            lines.append([who, NAMES[name], *means, "" if name == GUESS else needed])
    return "\n".join(f"| {' | '.join(line)} |".replace("|  |", "| |") for line in lines)


def _stimuli(found: float) -> str:
    return f"{found:.0f}" if math.isfinite(found) else "–"


def _criterion(f1: float) -> str:
    return f"{f1:g}".removeprefix("0")


def ratio_of(line: Mapping[str, Any], criterion: float) -> str:
    """The ratio to even ISIs as a cell of a table."""
    bound, ratio = line[f"bound_{criterion}"], line[f"ratio_{criterion}"]
    if bound == "unknown" or line["strategy"] in {EVEN, GUESS}:
        return "–"
    if bound:
        return f"{'<' if bound == 'below' else '>'} {short(ratio)}"
    low, high = line[f"low_{criterion}"], line[f"high_{criterion}"]
    reach = f"{short(low)} to {short(high)}" if math.isfinite(high) else f"≥ {short(low)}"
    return f"{short(ratio)} ({'no interval' if math.isnan(low) else reach})"


def readable(table: pd.DataFrame) -> pd.DataFrame:
    """The table of one cohort as it is read, the best after `EARLY` stimuli first.

    Args:
        table: as `measures.table_of` gives it.
    """
    lines = table.sort_values(f"f1_{EARLY}", ascending=False).to_dict("records")
    return pd.DataFrame([_read(line) for line in lines])


def _read(line: Mapping[str, Any]) -> dict[str, str]:
    f1 = {f"F1 at {mark}": f"{short(line[f'f1_{mark}'])} ± {short(line[f'f1_{mark}_se'])}" for mark in SHOWN}
    ratios = {f"stimuli to {_criterion(each)} / even": ratio_of(line, each) for each in CRITERIA}
    both: Sequence[tuple[str, str]] = (("expected − actual F1", "excess"), ("edges covered", "coverage"))
    judged = {name: " / ".join(_cell(line, key, mark) for mark in JUDGED) for name, key in both}
    wrong = " / ".join("–" if math.isnan(w := line[f"wrong_{mark}"]) else _percent(w) for mark in JUDGED)
    spent = line["processor_ms"]
    cost = {"ms a trial": "–" if math.isnan(spent) else f"{spent:.1f}" if spent < 10 else f"{spent:.0f}"}
    names = {"strategy": line["strategy"], "people": str(line["people"])}
    return names | f1 | ratios | judged | {"sure and wrong": wrong} | cost


def _cell(line: Mapping[str, Any], key: str, mark: int) -> str:
    value = float(line[f"{key}_{mark}"])
    return "–" if math.isnan(value) else signed(value) if key == "excess" else short(value)
