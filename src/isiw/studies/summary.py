"""What a study comes to: one row a strategy, cohort and mark."""

from __future__ import annotations

import pandas as pd

__all__ = ["summarise"]

_GROUP = ["cohort", "strategy", "trial"]


def summarise(rows: pd.DataFrame, errors: pd.DataFrame) -> pd.DataFrame:
    """Means over people.

    Args:
        rows: the rows of a study.
        errors: the people whose units failed, as `Store.errors` gives them.

    Returns:
        Sorted by cohort, strategy and trial: people; mean F1 and its standard error; shares of the people with
        a window whose start and end lie in the 90 % intervals; share to whom no window is reported, as where a
        method has no answer yet; mean of the pairs delivered; mean of the pairs after which the stopping rule
        fired and of the F1 then, over those for whom it did; the same over all, where those for whom it has not
        count as they stand at this mark (`end_delivered`, `end_f1`; NaN where the rule is ignored); share for
        whom it did so before the budget was used up; people without rows because they failed; median time of an
        ask and a tell [ms]. A strategy that failed for everybody has one row, at trial 0.
    """
    failed = errors.groupby(_GROUP[:2]).size() if len(errors) else pd.Series(dtype="int64")
    table = _means(rows) if len(rows) else pd.DataFrame(columns=[*_GROUP, "people"])
    present = set(zip(table["cohort"], table["strategy"], strict=True))
    missing = [{"cohort": c, "strategy": s, "trial": 0, "people": 0} for c, s in failed.index if (c, s) not in present]
    table = pd.concat([table, pd.DataFrame(missing)], ignore_index=True) if missing else table
    pairs = zip(table["cohort"], table["strategy"], strict=True)
    table["failed"] = [int(failed.get(pair, 0)) for pair in pairs]
    return table.sort_values(_GROUP, ignore_index=True)


def _means(rows: pd.DataFrame) -> pd.DataFrame:
    going_on, ignored = rows["stop_trial"].isna(), rows["converged"].isna()
    at_end = {
        "end_delivered": rows["stop_trial"].mask(going_on & ~ignored, rows["delivered"]),
        "end_f1": rows["stop_f1"].mask(going_on & ~ignored, rows["f1"]),
    }
    groups = rows.assign(**at_end, called_none=~rows["reported_window"].astype(bool)).groupby(_GROUP)
    return pd.DataFrame(
        {
            "people": groups.size(),
            "f1": groups["f1"].mean(),
            "f1_se": groups["f1"].sem(),
            "start_coverage": groups["start_covered"].mean(),
            "end_coverage": groups["end_covered"].mean(),
            "called_none": groups["called_none"].mean(),
            "delivered": groups["delivered"].mean(),
            "stop_trial": groups["stop_trial"].mean(),
            "stop_f1": groups["stop_f1"].mean(),
            "end_delivered": groups["end_delivered"].mean(),
            "end_f1": groups["end_f1"].mean(),
            "converged": groups["converged"].mean(),
            "ask_ms": groups["ask_ms"].median(),
            "tell_ms": groups["tell_ms"].median(),
        }
    ).reset_index()
