"""Tables of sessions with recorded people: errors by person, the worst of them, and probable kinds of noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pandas as pd

from benchmarks.recorded_people import RecordedPerson
from benchmarks.zero_trials import best_fixed
from isiw.design import DesignSpace
from isiw.metrics import f1
from isiw.window import Window

DRAWS = 2000
SURE, TOO_SURE = 0.7, 0.35
"""Sure and wrong: the expected F1 is at least so much, and so much above the actual."""

BELIEVES = "believes "
NOTHING = "default"
"""What its rows are called where nothing was given before the pairs."""


def error_by_person(values: pd.Series, persons: pd.Series) -> float:
    """Standard error of a mean over sessions, by bootstrap over persons.

    Args:
        values: one a session; those that are not known count as not there.
        persons: whose session it is, same index.
    """
    known = values.notna()
    grouped = values[known].groupby(persons[known])
    sums, counts = grouped.sum().to_numpy(), grouped.size().to_numpy()
    if not len(sums):
        return float("nan")
    drawn = np.random.default_rng(0).integers(len(sums), size=(DRAWS, len(sums)))
    return float((sums[drawn].sum(1) / counts[drawn].sum(1)).std())


def sure_and_wrong(rows: pd.DataFrame) -> pd.Series:
    """Which sessions expect much more than is so."""
    return (rows["expected_f1"] >= SURE) & (rows["expected_f1"] - rows["f1"] >= TOO_SURE)


def tables_of(
    rows: pd.DataFrame, people: Sequence[RecordedPerson], space: DesignSpace, law: str
) -> dict[str, pd.DataFrame]:
    """All tables, by their titles.

    Args:
        rows: of all sessions, at all marks.
        people: the cohort.
        space: the design space.
        law: what the rows are called of who knows the law.
    """
    rows = rows.assign(sure_and_wrong=sure_and_wrong(rows).astype(float))
    rows["too_sure"] = rows["expected_f1"] - rows["f1"]
    rows["behind_the_law"] = -_more_than(rows, law, "f1")
    rows["gain"] = _more_than(rows, NOTHING, "f1")
    asked = rows[rows["pairs"] > 0]
    return {
        "By pairs": pd.DataFrame([_by_pairs(*key, part) for key, part in asked.groupby(["strategy", "pairs"])]),
        "At the stopping rule": _at_stopping(rows[rows["pairs"] == 0]),
        "Without any pair": _without_any(rows, people, space),
        "By person": pd.DataFrame([_by_person(*key, part) for key, part in _of_default(asked, "person")]),
        "What it believes": pd.DataFrame([_believed(*key, part) for key, part in _of_default(asked, "sure_and_wrong")]),
    }


def _more_than(rows: pd.DataFrame, other: str, figure: str) -> pd.Series:
    """By how much a figure is larger than that of another strategy in the same session after as many pairs."""
    of_other = rows[rows["strategy"] == other].set_index(["number", "pairs"])[figure]
    return rows[figure] - of_other.reindex(pd.MultiIndex.from_frame(rows[["number", "pairs"]])).to_numpy()


def _at_stopping(rows: pd.DataFrame) -> pd.DataFrame:
    """Pairs and F1 where the default's stopping rule fires, or at the last pair, and both less with nothing given.

    Args:
        rows: one a session.
    """
    own = rows[rows["strategy"].str.startswith(NOTHING)]
    own = own.assign(more_pairs=_more_than(own, NOTHING, "stop_pairs"), gain=_more_than(own, NOTHING, "stop_f1"))
    names = ("stop_pairs", "more_pairs", "stop_f1", "gain")
    return pd.DataFrame(
        [
            {
                "strategy": strategy,
                "sessions": len(part),
                "stopped": part["stopped"].mean(),
                **_with_errors(part, names),
            }
            for strategy, part in own.groupby("strategy")
        ]
    )


def _with_errors(rows: pd.DataFrame, names: Sequence[str]) -> dict[str, float]:
    error = partial(error_by_person, persons=rows["person"])
    return {f"{name}{end}": of(rows[name]) for name in names for end, of in (("", pd.Series.mean), ("_se", error))}


def _of_default(rows: pd.DataFrame, by: str) -> pd.core.groupby.DataFrameGroupBy:
    return rows[rows["strategy"].str.startswith(NOTHING)].groupby(["strategy", "pairs", by])


def _by_pairs(strategy: str, pairs: int, rows: pd.DataFrame) -> dict[str, object]:
    names = ("f1", "gain", "expected_f1", "behind_the_law", "start_covered", "end_covered", "sure_and_wrong")
    by_person = rows.groupby("person")[["f1", "too_sure"]].mean()
    worst = {
        "worst_person": int(by_person["f1"].idxmin()),
        "worst_f1": by_person["f1"].min(),
        "most_too_sure": by_person["too_sure"].max(),
    }
    return {"strategy": strategy, "pairs": pairs, "sessions": len(rows), **_with_errors(rows, names), **worst}


def _by_person(strategy: str, pairs: int, person: int, rows: pd.DataFrame) -> dict[str, object]:
    figures = rows[["f1", "expected_f1", "too_sure", "behind_the_law", "sure_and_wrong"]].mean().to_dict()
    errors = {f"{name}_se": rows[name].sem() for name in ("f1", "too_sure")}
    return {"strategy": strategy, "pairs": pairs, "person": person, **figures, **errors}


def _believed(strategy: str, pairs: int, wrong: float, rows: pd.DataFrame) -> dict[str, object]:
    """Mean probabilities of the kinds of responses, where it is sure and wrong and where it is not."""
    kinds = rows.filter(like=BELIEVES).mean().rename(lambda name: name.removeprefix(BELIEVES))
    who = {"strategy": strategy, "pairs": pairs, "sure and wrong": bool(wrong), "sessions": len(rows)}
    return {**who, "f1": rows["f1"].mean(), "expected_f1": rows["expected_f1"].mean(), **kinds}


def _without_any(rows: pd.DataFrame, people: Sequence[RecordedPerson], space: DesignSpace) -> pd.DataFrame:
    """F1 of the default before any pair, and of the best fixed window, which is chosen on all other persons."""
    start = rows[(rows["pairs"] == 0) & rows["strategy"].str.startswith(NOTHING)]
    found = [(strategy, part["f1"], part["person"]) for strategy, part in start.groupby("strategy")]
    persons = pd.Series([each.bank.person for each in people])
    truths = [each.subject().window(space) for each in people]
    fixed = {person: _fixed_without(person, persons, truths, space) for person in persons.unique()}
    reached = [f1(fixed[person], truth, space) for person, truth in zip(persons, truths, strict=True)]
    found.append(("the fixed window that is best on all other persons", pd.Series(reached), persons))
    figures: dict[str, Callable[[pd.Series, pd.Series], float]] = {
        "f1": lambda values, _: values.mean(),
        "f1_se": error_by_person,
    }
    return pd.DataFrame([{"guess": name, **{k: of(v, p) for k, of in figures.items()}} for name, v, p in found])


def _fixed_without(
    person: int, persons: pd.Series, truths: Sequence[Window | None], space: DesignSpace
) -> Window | None:
    others = [window for whose, window in zip(persons, truths, strict=True) if whose != person]
    nowhere = np.zeros(len(space.grid_ms), bool)
    return best_fixed(np.stack([nowhere if w is None else w.mask(space.grid_ms) for w in others]), space)
