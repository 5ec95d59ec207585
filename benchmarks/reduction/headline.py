"""The headline: the default against each method at equal trials and at equal F1, with either kind of noise."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import COLOURS, NAMES, panels
from benchmarks.reduction.readings import LIVE
from benchmarks.reduction.sessions import Session
from benchmarks.reduction.size import Size
from isiw.metrics import trials_to_criterion
from isiw.plots.style import explain
from isiw.types import FloatArray

NOISE = {"recruitment": "realistic", "gaussian": "constant-CV"}
MARGIN = 0.15
MARKS = (5, 10, 15, 20, 30, 40)
LEVELS = (0.5, 0.6, 0.7, 0.8, 0.9)
PF_HORIZON = 300
"""Trials of the particle filter's curve: a generation alone is thirty."""
HALF = 0.5


def sessions(size: Size, seed: int) -> list[Session]:
    """Live trials, counted from the valve command, on both cohorts."""
    return [
        Session(method, cohort, person, seed, reading=LIVE, horizon=PF_HORIZON if method == "pf" else size.horizon)
        for cohort in NOISE
        for method in (*text.METHODS, "default")
        for person in range(size.headline)
    ]


def curve(rows: pd.DataFrame, method: str) -> FloatArray:
    """F1 by trial, a row a person, shape (people, trials)."""
    return np.array(rows.loc[rows["method"] == method, "f1_by_trial"].tolist())


def equal_trials(rows: pd.DataFrame) -> pd.DataFrame:
    """Mean F1 of each method after as many trials, on each cohort."""
    table = []
    for (cohort, method), group in rows.groupby(["cohort", "method"], sort=False):
        mean = curve(group, str(method)).mean(axis=0)
        f1 = {str(mark): float(mean[mark - 1]) for mark in MARKS if mark <= len(mean)}
        table.append({"cohort": cohort, "method": NAMES[str(method)]} | f1)
    return pd.DataFrame(table)


def equal_f1(rows: pd.DataFrame) -> pd.DataFrame:
    """Trials from which on each method keeps a mean F1, on each cohort; None where its curve does not reach it."""
    table = []
    for (cohort, method), group in rows.groupby(["cohort", "method"], sort=False):
        mean = curve(group, str(method)).mean(axis=0)
        trials = {f"{level:.1f}": _cell(trials_to_criterion(mean, level)) for level in LEVELS}
        table.append({"cohort": cohort, "method": NAMES[str(method)], "of": len(mean)} | trials)
    return pd.DataFrame(table)


def _cell(trials: int | None) -> str:
    return "–" if trials is None else str(trials)


def duel(rows: pd.DataFrame, method: str) -> dict[str, float | str | None]:
    """The default against one method on one cohort.

    Args:
        rows: sessions of the cohort, in the same order of people.
        method: the other method.
    """
    own = rows[rows["method"] == method]
    trials, f1 = own["trials"].to_numpy(), own["f1, true"].to_numpy()
    curves = curve(rows, "default")
    stopped = np.minimum(trials, curves.shape[1])
    at_stop = curves[np.arange(len(curves)), stopped - 1]
    reached = trials_to_criterion(curves.mean(axis=0), float(f1.mean()))
    gain = at_stop - f1
    return {
        "against": NAMES[method],
        "its trials": float(trials.mean()),
        "its F1": float(f1.mean()),
        "default's F1 at as many": float(at_stop.mean()),
        "gain": float(gain.mean()),
        "± 95 %": float(1.96 * gain.std(ddof=1) / math.sqrt(len(gain))),
        "default's trials to its F1": math.nan if reached is None else float(reached),
        "share of its trials": math.nan if reached is None else reached / float(trials.mean()),
    }


def verdicts(table: pd.DataFrame, noise: str) -> list[str]:
    """What is to hold against GPR."""
    row = table.set_index("against").loc["GPR"]
    share, gain, needed = row["share of its trials"], row["gain"], row["default's trials to its F1"]
    half = (
        f"on {noise} noise the default has GPR's F1 ({row['its F1']:.2f}) from trial "
        f"{needed:.0f} on, {100 * share:.0f} % of GPR's {row['its trials']:.1f} (at most half)."
    )
    better = f"on {noise} noise its F1 at GPR's trials is better by {gain:+.2f} ± {row['± 95 %']:.2f}"
    if noise == "realistic":
        return [f"{_word(share <= HALF)}: {half}", f"{_word(gain >= MARGIN)}: {better} (at least {MARGIN})."]
    return [f"{_word(share <= HALF)}: {half}", f"{better}."]


def _word(holds: bool) -> str:  # noqa: FBT001 - a verdict
    return "holds" if holds else "FAILS"


def figure(equal: pd.DataFrame, duels: Mapping[str, pd.DataFrame]) -> Figure:
    """Mean F1 after so many trials, and where the dissertation's methods stop.

    Args:
        equal: as `equal_trials` gives it.
        duels: of each cohort, as `duel` gives a row of it.
    """
    picture, axes = panels(1, 2, width=4.6, height=3.3, sharey=True)
    for one, (cohort, noise) in zip(axes[0], NOISE.items(), strict=True):
        means = equal[equal["cohort"] == cohort].set_index("method")
        marks = [mark for mark in MARKS if str(mark) in means]
        stops = duels[cohort].set_index("against")
        for method in ("nr", "svmr", "gpr", "default"):
            name = NAMES[method]
            f1s = means.loc[name, [str(mark) for mark in marks]].to_numpy(dtype=float)
            one.plot(marks, f1s, "o-", ms=3, color=COLOURS[method], label=name)
            if name in stops.index:
                one.plot(*stops.loc[name, ["its trials", "its F1"]], "D", color=COLOURS[method], mec="black", ms=6)
        one.plot([], [], "D", color="none", mec="black", ms=6, label="at its stopping rule, on average")
        one.set(title=f"{cohort}: {noise} noise", xlabel="trials", ylim=(0, 1), xlim=(0, None))
    axes[0, 0].set_ylabel("mean F1 (true window)")
    explain(picture, ncols=5)
    return picture


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    tables = {
        str(cohort): pd.DataFrame([duel(group, method) for method in text.METHODS])
        for cohort, group in rows.groupby("cohort")
    }
    shown = [
        Table(f"`{cohort}`, {noise} noise: at each method's stop.", tables[cohort]) for cohort, noise in NOISE.items()
    ]
    equal = equal_trials(rows)
    shown += [
        Table("Equal trials: mean F1 after so many, whatever the stopping rule says.", equal),
        Table("Equal F1: trials from which on a mean F1 is kept, of so many that were played.", equal_f1(rows)),
    ]
    prose = f"""\
{rows["person"].nunique()} people of each cohort, live trials over 500 ms from the valve command, F1 by the true
window. At equal trials: the default's F1 after as many trials as each session of the other method took (at most
{curve(rows, "default").shape[1]}), paired by person. At equal F1: from which trial on the default's mean F1 stays
at or above the other method's mean at its stop. A trial is one pair of stimuli."""
    said = [sentence for cohort, noise in NOISE.items() for sentence in verdicts(tables[cohort], noise)]
    return Section("The headline: equal trials, equal F1", prose, shown, ("headline", figure(equal, tables)), said)
