"""How many trials a conventional sweep has, by where it begins and ends; and minutes and stimuli of every strategy."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.comparison import METHODS, WORDS
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import NAMES
from benchmarks.reduction.recorded import STEP_MS, TRIALS_PER_ISI
from benchmarks.reduction.timing import BREAKS_OF_A_FULL_SWEEP, minutes

TWELVE: Final = (
    "272 (the sweep's average) equals twelve trials at each 5 ms inside the windows, with no way there and no silence "
    "behind: a per cent of it is no reduction against a sweep that has to find the window."
)
"""What stands beside every per cent of reduction."""


def trials_inside(widths_ms: tuple[float, ...]) -> tuple[float, float]:
    """Mean and population SD of a sweep's trials inside windows of these widths [ms], both ends included."""
    trials = TRIALS_PER_ISI * (np.array(widths_ms) / STEP_MS + 1)
    return float(trials.mean()), float(trials.std())


def sweeps(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a reading of "a conventional sweep": its trials on each cohort."""
    sweep = rows[rows["method"] == "incremental"]
    bare, hit = sweep[~sweep["accelerometer"]], sweep[sweep["accelerometer"]]
    readings = {
        "whole range, 500 ms after the valve command": (bare, "whole"),
        "from the valve command until the window was passed (`incremental`)": (bare, "trials"),
        "from the impact until the window was passed": (hit, "trials"),
        "from 25 ms before the window until it was passed": (bare, "near"),
        "inside the measured window only": (bare, "inside measured"),
        "inside the measured window over TMS alone at 90 % only": (bare, "inside measured, 90 %"),
        "inside the measured window by .135 only": (bare, "inside measured, .135"),
        "inside the true window only": (bare, "inside true"),
    }
    table = []
    for name, (group, column) in readings.items():
        means = group.groupby("cohort", sort=False)[column].agg(["mean", "std"])
        ours = {
            f"{cohort}{label}": value
            for cohort, pair in means.iterrows()
            for label, value in zip(("", " SD"), pair, strict=True)
        }
        table.append(
            {
                "reading": name,
                "text": text.TRIALS["without"]["incremental"],
                "text SD": text.TRIALS_SEVEN["incremental"][1],
            }
            | ours
        )
    return pd.DataFrame(table)


def burden(rows: pd.DataFrame) -> pd.DataFrame:
    """Trials, stimuli and minutes of each strategy on each cohort."""
    table = []
    for (cohort, accelerometer), group in rows.groupby(["cohort", "accelerometer"], sort=False):
        for method in (*METHODS, "incremental"):
            trials = group.loc[group["method"] == method, "trials"]
            if trials.empty:
                continue
            breaks = BREAKS_OF_A_FULL_SWEEP if method == "incremental" else 0
            table.append(
                {
                    "cohort": cohort,
                    "accelerometer": WORDS[bool(accelerometer)],
                    "strategy": NAMES[method],
                    "trials": trials.mean(),
                    "taps and pulses": 2 * trials.mean(),
                    "minutes": trials.map(lambda n, breaks=breaks: minutes(n, breaks)).mean(),
                }
            )
    return pd.DataFrame(table)


def shows_a_window(rows: pd.DataFrame) -> str:
    """In how many people the text's own ground truth shows a window, in a sentence."""
    bare = rows[(rows["method"] == "incremental") & ~rows["accelerometer"]]
    shares = bare.groupby("cohort", sort=False)["shows a window"].mean()
    listed = ", ".join(f"{100 * share:.0f} % of `{cohort}`" for cohort, share in shares.items())
    return (
        f"The text's own ground truth, the means of ten MEPs above TMS alone at 100 % RMT, shows a window in {listed}; "
        "in the text every person had one. So only the first are like the text's people; the noise of the others is "
        "that of single MEPs near threshold as it was measured elsewhere."
    )


def section_sweeps(rows: pd.DataFrame) -> Section:
    """Readings of the conventional sweep."""
    mean, sd = trials_inside(text.WIDTHS_MS)
    prose = f"""\
The text's 272 trials (271, SD 108 in Fig. 4.18) follow from its own Table 4.1: twelve trials at each 5 ms *inside*
the measured windows, both ends included, are {mean:.1f}, SD {sd:.1f}. What was recorded, or counted, is thus the
window alone, with no approach to it and no silence behind it (264 and 408 of Table 5.3 are 22 and 34 such stops),
and nothing was recorded where the text's figures show zero. A sweep that starts at the valve command, or at the
impact, and ends when responses have vanished needs more. Where a sweep begins is the low end of the design space;
`incremental` needs no setting for it."""
    bare = rows[(rows["method"] == "incremental") & ~rows["accelerometer"]]
    conclusions = [
        f"`{name}`: {100 * group['shows a window'].mean():.0f} % of sweeps show a window three standard errors above "
        f"TMS alone at 100 % RMT, and {100 * group['shows a window, 90 %'].mean():.0f} % above that at 90 %. By the "
        f"true window the F1 of the first is {group['f1, true'].mean():.2f}, and {group['f1, of .135'].mean():.2f} "
        f"that of the rule of 0.135; measured and true profile correlate by {group['correlation, true'].mean():.2f}."
        for name, group in bare.groupby("cohort", sort=False)
    ]
    return Section(
        "The conventional sweep", prose, [Table("Trials by reading.", sweeps(rows))], conclusions=conclusions
    )


def section_burden(rows: pd.DataFrame) -> Section:
    """Minutes on the table."""
    full = minutes(600, BREAKS_OF_A_FULL_SWEEP)
    prose = f"""\
One-second trials and two minutes of rest after every twelve; a conventional sweep has two long breaks besides, of
five minutes in the text's words and ten in its sum, which is followed: {full:.0f} minutes for its 600 trials
(4.2.1). That the other strategies rest as often, and need no long breaks, is assumed: the text does not say. A
trial is one pair of stimuli, a tap and a pulse, which Table 5.3 counts as one."""
    return Section("Trials, stimuli and minutes for each person", prose, [Table("Means.", burden(rows))])
