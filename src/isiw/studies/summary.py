"""The results of a study: means over people by strategy, cohort and mark, and paired differences between strategies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from isiw.errors import InvalidValueError, did_you_mean
from isiw.lazy import pd, scipy
from isiw.studies.sessions import TIMES
from isiw.types import FloatArray

_GROUP: Final = ["cohort", "strategy", "trial"]

LEVEL: Final = 0.95
"""Confidence level of all intervals."""

SURE_F1, WRONG_F1 = 0.7, 0.35
"""An answer is sure and wrong if its expected F1 is at least the first, and at least the second above its actual F1."""

RESAMPLES: Final = 4999
"""Bootstrap samples of an interval; enough for the tail of ten comparisons at once."""

FEW: Final = 20
"""Fewer people than these have an interval by Student's t: a bootstrap over so few is too narrow."""

COLUMNS: Final = 100
"""Width of a printed table."""


def summarise(rows: pd.DataFrame, errors: pd.DataFrame | None = None) -> pd.DataFrame:
    """Means over people.

    Args:
        rows: the rows of a study.
        errors: the people whose units failed, as `Store.errors` gives them; None if nobody failed.

    Returns:
        Sorted by cohort, strategy and trial: people; mean F1, its standard error, and its 95 % interval by Student's t,
        cut off at 0 and 1 and NaN for a single person; shares of the people with a window whose start and end lie in
        the 90 % intervals; share that is sure and wrong, which expects an F1 of at least .7 and at least .35 more than
        it has (NaN if a method expects none); share to whom no window is reported, as if a method has no answer yet;
        mean of the pairs delivered; mean of the pairs after which the stopping rule fired and of the F1 then, over
        those for whom it did; the same over all, in which those for whom it has not count as they stand at this mark
        (`end_delivered`, `end_f1`; NaN if the rule is ignored); share for whom it did so before the budget was used
        up; people without rows because they failed; median time of an ask and a tell [ms]. A strategy that failed for
        everybody has one row, at trial 0.

    Raises:
        InvalidValueError: two rows of one person, strategy, cohort and trial.
    """
    _require_each_once(rows)
    failed = pd.Series(dtype="int64") if errors is None or not len(errors) else errors.groupby(_GROUP[:2]).size()
    table = _means(rows) if len(rows) else pd.DataFrame(columns=[*_GROUP, "people"])
    present = set(zip(table["cohort"], table["strategy"], strict=True))
    missing = [{"cohort": c, "strategy": s, "trial": 0, "people": 0} for c, s in failed.index if (c, s) not in present]
    table = pd.concat([table, pd.DataFrame(missing)], ignore_index=True) if missing else table
    pairs = zip(table["cohort"], table["strategy"], strict=True)
    table["failed"] = [int(failed.get(pair, 0)) for pair in pairs]
    return table.sort_values(_GROUP, ignore_index=True)


def _require_each_once(rows: pd.DataFrame) -> None:
    """Raise if somebody would count twice, as when studies with the same people are put together."""
    twice = rows.duplicated([*_GROUP, "person"]) if len(rows) else pd.Series(dtype=bool)
    if twice.any():
        first = rows[twice].iloc[0]
        raise InvalidValueError(
            "somebody has two rows of one strategy and trial, and would count twice",
            got=", ".join(f"{key} {first[key]}" for key in (*_GROUP, "person")),
            remedy="Leave out one of the studies, or give people with other seeds numbers of their own.",
        )


def sure_and_wrong(expected_f1: pd.Series, f1: pd.Series) -> pd.Series:
    """1 for answers that are sure and wrong (see `SURE_F1`), else 0; NaN if no F1 is expected."""
    wrong = (expected_f1 >= SURE_F1) & (expected_f1 - f1 >= WRONG_F1)
    return wrong.astype(float).mask(expected_f1.isna())


def _means(rows: pd.DataFrame) -> pd.DataFrame:
    going_on, ignored = rows["stop_trial"].isna(), rows["converged"].isna()
    at_end = {
        "end_delivered": rows["stop_trial"].mask(going_on & ~ignored, rows["delivered"]),
        "end_f1": rows["stop_f1"].mask(going_on & ~ignored, rows["f1"]),
    }
    at_end |= {"sure_and_wrong": sure_and_wrong(rows["expected_f1"], rows["f1"])}
    groups = rows.assign(**at_end, called_none=~rows["reported_window"].astype(bool)).groupby(_GROUP)
    people, f1, se = groups.size(), groups["f1"].mean(), groups["f1"].sem()
    reach = se * scipy.stats.t.ppf(0.5 + LEVEL / 2, people - 1)
    band = {"f1_low": (f1 - reach).clip(lower=0.0), "f1_high": (f1 + reach).clip(upper=1.0)}
    columns = {"start_coverage": ("start_covered", "mean"), "end_coverage": ("end_covered", "mean")}
    stops = ("stop_trial", "stop_f1", "end_delivered", "end_f1")
    means = ("sure_and_wrong", "called_none", "delivered", *stops, "converged")
    columns |= {name: (name, "mean") for name in means} | {name: (name, "median") for name in TIMES}
    table = pd.DataFrame({"people": people, "f1": f1, "f1_se": se, **band})
    return table.join(groups.agg(**columns)).reset_index()


def differences(rows: pd.DataFrame, reference: str | None = None) -> pd.DataFrame:
    """Paired differences of F1 between strategies on the same people.

    Args:
        rows: the rows of a study.
        reference: the strategy that the others are compared with; by default "default", or else the first label.

    Returns:
        Sorted by cohort, strategy and trial: people (who have rows of both), mean difference of F1 (the strategy minus
        the reference), its standard error, and its interval, by a bootstrap over 20 people or more, else by Student's
        t. The intervals of a cohort and mark hold together with 95 % probability: each has a level of
        1 − .05 / (number of strategies − 1) (Bonferroni). With fewer than two people there is no interval (NaN).

    Raises:
        InvalidValueError: an unknown reference, fewer than two strategies, or two rows of one person, strategy, cohort
            and trial.
    """
    _require_each_once(rows)
    labels = sorted(rows["strategy"].unique()) if len(rows) else []
    if len(labels) < 2:
        raise InvalidValueError("a comparison needs two strategies", got=", ".join(labels) or "none")
    reference = reference or ("default" if "default" in labels else labels[0])
    if reference not in labels:
        raise InvalidValueError(
            "no such strategy in the study",
            got=reference,
            expected=", ".join(labels),
            remedy=did_you_mean(reference, labels) or None,
        )
    f1 = rows.pivot_table(index=["cohort", "trial", "person"], columns="strategy", values="f1")
    others = [label for label in labels if label != reference]
    compared = [
        {"cohort": cohort, "strategy": label, "trial": trial, "reference": reference}
        | _difference((people[label] - people[reference]).dropna().to_numpy(), len(others))
        for (cohort, trial), people in f1.groupby(level=["cohort", "trial"])
        for label in others
    ]
    table = pd.DataFrame(compared)
    return table[table["people"] > 0].sort_values(_GROUP, ignore_index=True)


def _difference(paired: FloatArray, comparisons: int) -> dict[str, float]:
    """Mean, standard error and interval of the differences of some people."""
    people = len(paired)
    mean = float(paired.mean()) if people else math.nan
    found = {"people": people, "difference": mean, "se": math.nan, "low": math.nan, "high": math.nan}
    if people < 2:
        return found
    level, se = 1.0 - (1.0 - LEVEL) / comparisons, float(scipy.stats.sem(paired))
    if people < FEW or np.ptp(paired) == 0:
        reach = se * float(scipy.stats.t.ppf(0.5 + level / 2, people - 1))
        return found | {"se": se, "low": mean - reach, "high": mean + reach}
    low, high = _bootstrapped(paired, level)
    return found | {"se": se, "low": low, "high": high}


def _bootstrapped(paired: FloatArray, level: float) -> tuple[float, float]:
    """The interval of a mean: bias-corrected and accelerated, or by percentiles if very few people leave that open."""
    for method in ("BCa", "percentile"):
        rng = np.random.default_rng(0)
        drawn = scipy.stats.bootstrap(
            (paired,), np.mean, confidence_level=level, n_resamples=RESAMPLES, batch=500, method=method, rng=rng
        )
        low, high = map(float, drawn.confidence_interval)
        if math.isfinite(low) and math.isfinite(high):
            break
    return low, high


def means_table(summary: pd.DataFrame, compared: pd.DataFrame | None = None) -> str:
    """A study as text of at most 100 columns: a block a cohort, a line a strategy, a column a mark.

    Args:
        summary: as `summarise` returns it.
        compared: as `differences` returns it, printed below each cohort; None if there is nothing to compare.
    """
    lines = list[str]()
    for cohort, means in summary[summary["people"] > 0].groupby("cohort"):
        fewest, most = means["people"].min(), means["people"].max()
        lines.append(f"{cohort}: mean F1 [95 % interval]; {fewest if fewest == most else f'{fewest}–{most}'} people")
        lines += _block(means, "f1", "f1_low", "f1_high", ".2f")
        of_cohort = None if compared is None else compared[compared["cohort"] == cohort]
        if of_cohort is not None and len(of_cohort):
            reference = of_cohort["reference"].iloc[0]
            lines.append(f"minus {reference}, the same people; intervals that hold together with 95 % probability")
            lines += _block(of_cohort, "difference", "low", "high", "+.2f")
        lines.append("")
    return "\n".join(lines).rstrip()


def _block(table: pd.DataFrame, mean: str, low: str, high: str, form: str) -> Iterator[str]:
    """A heading and a line a strategy; of too many marks some are left out, evenly, and the last is kept."""
    width = max(8, int(table["strategy"].str.len().max()))
    cell = 16 if form.startswith("+") else 13
    marks = sorted(table["trial"].unique())
    most = max(1, (COLUMNS - width - 2) // (cell + 2))
    kept = [marks[i] for i in sorted({round(each) for each in np.linspace(0, len(marks) - 1, most)})][-most:]
    yield "  ".join(["trials".ljust(width), *(f"{mark:>{cell}}" for mark in kept)])
    for strategy, of_strategy in table.groupby("strategy"):
        at = of_strategy.set_index("trial")
        cells = (_cell(at.loc[mark], mean, low, high, form) if mark in at.index else "–" for mark in kept)
        yield "  ".join([str(strategy).ljust(width), *(f"{each:>{cell}}" for each in cells)])


def _cell(row: pd.Series, mean: str, low: str, high: str, form: str) -> str:
    value, lowest, highest = (_figure(row[name], form) for name in (mean, low, high))
    return value if math.isnan(row[low]) else f"{value} [{lowest} {highest}]"


def _figure(value: float, form: str) -> str:
    text = f"{value:{form}}"
    return text.replace("0.", ".", 1) if text.lstrip("+-").startswith("0.") else text
