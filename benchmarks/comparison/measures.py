"""What the rows of the comparison come to: one line a cohort and strategy.

Stimuli to a lasting F1 are read from the mean F1 by trial, linear between the marks. Their ratio to that of even ISIs
is of the same people; its interval is by a bootstrap over people.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd

from benchmarks.comparison.rows import EVEN
from isiw.studies import summarise
from isiw.types import ArrayLike, FloatArray

SHOWN: Final = (10, 20, 40)
JUDGED: Final = (20, 40)
CRITERIA: Final = (0.7, 0.8, 0.9)
RESAMPLES: Final = 2000
ENDS: Final = (0.025, 0.975)
_KEYS: Final = ["cohort", "strategy"]


def lasting(mean_f1: ArrayLike, marks: Sequence[int], criterion: float) -> FloatArray:
    """The number of stimuli from which on a mean F1 stays at or above a criterion; infinite where it does not.

    Args:
        mean_f1: after each mark, shape (..., m).
        marks: numbers of stimuli, ascending, shape (m,).
        criterion: the F1 to be kept.
    """
    means, at = np.asarray(mean_f1, dtype=float), np.asarray(marks, dtype=float)
    missed = ~(means >= criterion)
    last = means.shape[-1] - 1 - missed[..., ::-1].argmax(axis=-1)  # the last mark that misses it, if any does
    before = np.minimum(last, len(at) - 2)
    low, high = (np.take_along_axis(means, place[..., None], -1)[..., 0] for place in (before, before + 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        part = (criterion - low) / (high - low)
    crossed = at[before] + part * (at[before + 1] - at[before])
    kept = np.where(missed[..., -1], math.inf, crossed)
    return np.where(missed.any(axis=-1), kept, at[0])


def ratio(own_f1: FloatArray, even_f1: FloatArray, marks: Sequence[int], criterion: float) -> dict[str, Any]:
    """Stimuli to a lasting F1, those at even ISIs, and their ratio on the same people.

    Args:
        own_f1: F1 of each person after each mark, shape (n, m).
        even_f1: the same at even ISIs.
        marks: numbers of stimuli, shape (m,).
        criterion: the F1 to be kept.

    Returns:
        `stimuli` and `even`, infinite if it is not reached; `ratio`, its interval `low` and `high`, and `bound`:
        empty, or "below" or "above" if the ratio is one since only one of both was reached, or "unknown".
    """
    own, even = (float(lasting(f1.mean(axis=0), marks, criterion)) for f1 in (own_f1, even_f1))
    people, last = len(own_f1), float(marks[-1])
    drawn = np.random.default_rng(0).multinomial(people, np.full(people, 1.0 / people), RESAMPLES) / people
    again = _ratios(*(lasting(drawn @ f1, marks, criterion) for f1 in (own_f1, even_f1)), last)
    low, high = (math.nan, math.nan)
    if np.isnan(again).mean() <= 2 * ENDS[0]:
        low, high = np.nanquantile(again, ENDS, method="nearest")
    bound = {(True, True): "", (True, False): "below", (False, True): "above", (False, False): "unknown"}
    reached = (math.isfinite(own), math.isfinite(even))
    at_once = even < min(mark for mark in marks if mark > 0)  # before the first mark, little is known of when
    found = math.nan if at_once or not any(reached) else min(own, last) / min(even, last)
    said = "unknown" if math.isnan(found) else bound[reached]
    return {"stimuli": own, "even": even, "ratio": found, "low": float(low), "high": float(high), "bound": said}


def _ratios(own: FloatArray, even: FloatArray, last: float) -> FloatArray:
    """Ratios of resamples: NaN where neither is reached, and at most what it is where even ISIs do not reach it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found = own / np.minimum(even, last)
    return np.where(np.isinf(own) & np.isinf(even), math.nan, found)


def table_of(rows: pd.DataFrame, processor_ms: Mapping[str, float]) -> pd.DataFrame:
    """One line a cohort and strategy.

    Args:
        rows: with the columns of a study; those of even ISIs are what ratios are of.
        processor_ms: processor time of a trial by strategy [ms].

    Returns:
        People, trials of a session; mean F1 (`f1_20`) and its standard error (`f1_20_se`) after each of `SHOWN`; what
        `ratio` gives for each of `CRITERIA` (`ratio_0.7` and so on); after each of `JUDGED` the mean expected minus
        actual F1 (`excess_20`), the share of true edges in 90 % intervals (`coverage_20`), and the share that is sure
        and wrong (`wrong_20`), NaN where a method has no such thing; `processor_ms`.
    """
    means = summarise(rows).set_index([*_KEYS, "trial"])
    lines = []
    for keys, own in rows.groupby(_KEYS):
        even = rows[(rows["cohort"] == keys[0]) & (rows["strategy"] == EVEN)]
        line = dict(zip(_KEYS, keys, strict=True))
        line |= {"people": own["person"].nunique(), "trials": int(own["trial"].max())}
        line |= dict(_of_marks(own, means.loc[keys])) | dict(_against(own, even))
        lines.append(line | {"processor_ms": processor_ms.get(str(keys[1]), math.nan)})
    return pd.DataFrame(lines)


def _of_marks(own: pd.DataFrame, means: pd.DataFrame) -> Iterator[tuple[str, float]]:
    for mark in SHOWN:
        for name, column in (("", "f1"), ("_se", "f1_se")):
            yield f"f1_{mark}{name}", float(means[column].get(mark, math.nan))
    for mark in JUDGED:
        at = own[own["trial"] == mark]
        yield f"excess_{mark}", float((at["expected_f1"] - at["f1"]).mean())
        yield f"coverage_{mark}", float(pd.concat([at["start_covered"], at["end_covered"]]).mean())
        yield f"wrong_{mark}", float(means["sure_and_wrong"].get(mark, math.nan))


def _against(own: pd.DataFrame, even: pd.DataFrame) -> Iterator[tuple[str, Any]]:
    both = [table.pivot_table(index="person", columns="trial", values="f1") for table in (own, even)]
    people = both[0].index.intersection(both[1].index)
    marks = list(both[0].columns)
    nobody = len(people) == 0
    if nobody:
        both, people = [both[0], both[0] * math.nan], both[0].index
    curves = [f1.loc[people, marks].to_numpy() for f1 in both]
    for criterion in CRITERIA:
        for name, value in ratio(*curves, marks, criterion).items():
            yield f"{name}_{criterion}", "unknown" if nobody and name == "bound" else value
