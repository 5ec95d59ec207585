"""The default against each method at equal trials and at equal F1, on three kinds of people."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy.stats import sem

from benchmarks.reduction import dissertation as text
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import COLOURS, NAMES, panels
from benchmarks.reduction.readings import BASE, LIVE, PEOPLE, Reading
from benchmarks.reduction.sessions import Session
from isiw.metrics import trials_to_criterion
from isiw.plots.style import explain
from isiw.types import FloatArray

NOISE = {PEOPLE: "little", "recruitment": "near-threshold", "gaussian": "constant-CV"}

JUDGED: Final[dict[str, tuple[str, str]]] = {PEOPLE: ("f1, measured", "f1_measured_by_trial")}
"""By which F1 a cohort is judged: where the measured windows are the text's, as there; else by the true window."""
BY_TRUTH: Final = ("f1, true", "f1_by_trial")
ALONE: Final = (0, 10)
"""Trials of TMS alone that every method is told before its first pair."""
LOW_NOISE: Final = (PEOPLE, "gaussian")
EARLY, LATE = 10, 40
"""Between these trials no regression may get worse by more than two standard errors where there is little noise."""
MARGIN = 0.15
MARKS = (5, 10, 15, 20, 30, 40)
LEVELS = (0.5, 0.6, 0.7, 0.8, 0.9)
PF_HORIZON = 300
"""Trials of the particle filter's curve: a generation alone is thirty."""
HALF = 0.5


def sessions(people: int, horizon: int, seed: int) -> list[Session]:
    """Trials counted from the valve command: of `kim11-measured` as recorded, since they are judged so; else live.

    Args:
        people: of each cohort.
        horizon: trials that are played at least, whatever the stopping rule says; of the default, at most.
        seed: of the cohorts.
    """
    return [
        Session(
            method,
            cohort,
            person,
            seed,
            reading_of(cohort),
            horizon=PF_HORIZON if method == "pf" else horizon,
            alone=alone,
            settings=(("max_trials", horizon),) if method == "default" else (),
        )
        for alone in ALONE
        for cohort in NOISE
        for method in (*text.METHODS, "default")
        for person in range(people)
    ]


def reading_of(cohort: str) -> Reading:
    """How the trials of a cohort are observed."""
    return BASE if cohort in JUDGED else LIVE


def judged(rows: pd.DataFrame) -> pd.DataFrame:
    """The sessions with the F1 by which their cohort is judged as `f1` and `f1_by_trial`, and `f1 before` any trial.

    Sessions whose sweep shows no window are left out: nothing can be judged by it.
    """
    parts = []
    for cohort, group in rows.groupby("cohort", sort=False):
        at_stop, by_trial = JUDGED.get(str(cohort), BY_TRUTH)
        before = group[at_stop.replace("f1,", "f1 before,")]
        parts.append(group.assign(f1=group[at_stop], f1_by_trial=group[by_trial], **{"f1 before": before}))
    return pd.concat(parts).dropna(subset=["f1"])


def curve(rows: pd.DataFrame, method: str) -> FloatArray:
    """F1 by trial, a row a person, shape (people, trials)."""
    return np.array(rows.loc[rows["method"] == method, "f1_by_trial"].tolist())


def equal_trials(rows: pd.DataFrame) -> pd.DataFrame:
    """Mean F1 of each method after as many trials, on each cohort, without and with TMS alone; the last with its SE."""
    table = []
    for (cohort, alone, method), group in rows.groupby(["cohort", "alone", "method"], sort=False):
        curves = curve(group, str(method))
        marks = [mark for mark in MARKS if mark <= curves.shape[1]]
        f1 = {str(mark): float(curves[:, mark - 1].mean()) for mark in marks}
        errors = {f"SE {mark}": float(sem(curves[:, mark - 1])) for mark in marks}
        row = {"cohort": cohort, "TMS alone": alone, "method": NAMES[str(method)], "n": len(curves)}
        table.append(row | f1 | errors)
    return pd.DataFrame(table)


def changes(rows: pd.DataFrame) -> pd.DataFrame:
    """By how much a regression's F1 changes from an early to a late trial where there is little noise, with its SE."""
    table = []
    chosen = rows[rows["cohort"].isin(LOW_NOISE) & rows["method"].isin(("nr", "svmr", "gpr"))]
    for (cohort, alone, method), group in chosen.groupby(["cohort", "alone", "method"], sort=False):
        curves = curve(group, str(method))
        if curves.shape[1] < LATE:
            continue
        change = curves[:, LATE - 1] - curves[:, EARLY - 1]
        found = {"change": float(change.mean()), "SE": float(sem(change))}
        worse = {"worse by more than 2 SE": "yes" if found["change"] < -2 * found["SE"] else "no"}
        table.append({"cohort": cohort, "TMS alone": alone, "method": NAMES[str(method)]} | found | worse)
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
        rows: sessions of the cohort, in the same order of people; those whom the default has not seen are left out.
        method: the other method.
    """
    rows = rows[rows["person"].isin(rows.loc[rows["method"] == "default", "person"])]
    own = rows[rows["method"] == method]
    trials, f1 = own["trials"].to_numpy(), own["f1"].to_numpy()
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


def duels(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """The default against every method, by cohort, as from `judged`."""
    groups = {str(cohort): group for cohort, group in rows.groupby("cohort", sort=False)}
    return {cohort: pd.DataFrame([duel(group, method) for method in text.METHODS]) for cohort, group in groups.items()}


def before(rows: pd.DataFrame, method: str = "default") -> dict[str, float]:
    """Mean F1 of a method before any trial, by cohort, as from `judged`."""
    means = rows[rows["method"] == method].groupby("cohort", sort=False)["f1 before"].mean()
    return {str(cohort): float(mean) for cohort, mean in means.items()}


def verdicts(table: pd.DataFrame, noise: str) -> list[str]:
    """What is to hold against GPR."""
    row = table.set_index("against").loc["GPR"]
    if math.isnan(row["share of its trials"]):
        behind = f"at GPR's {row['its trials']:.1f} trials the difference is {row['gain']:+.2f} ± {row['± 95 %']:.2f}"
        return [f"FAILS: on {noise} noise the default does not keep GPR's F1 ({row['its F1']:.2f}); {behind}."]
    share, gain, needed = row["share of its trials"], row["gain"], row["default's trials to its F1"]
    half = (
        f"on {noise} noise the default has GPR's F1 ({row['its F1']:.2f}) from trial "
        f"{needed:.0f} on, {100 * share:.0f} % of GPR's {row['its trials']:.1f} (at most half)."
    )
    better = f"on {noise} noise its F1 at GPR's trials is better by {gain:+.2f} ± {row['± 95 %']:.2f}"
    if noise == "near-threshold":
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
    picture, axes = panels(1, len(NOISE), width=4.6, height=3.3, sharey=True)
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
    axes[0, 0].set_ylabel("mean F1")
    explain(picture, ncols=5)
    return picture


def section(rows: pd.DataFrame) -> Section:
    """This part of the report."""
    every = judged(rows)
    rows, told = (every[every["alone"] == alone] for alone in ALONE)
    tables = duels(rows)
    gpr = tables[PEOPLE].set_index("against").loc["GPR", "its F1"]
    shown = [
        Table(f"`{cohort}`, {noise} noise: at each method's stop.", tables[cohort]) for cohort, noise in NOISE.items()
    ]
    shown += [
        Table(f"`{cohort}`, {NOISE[cohort]} noise, ten TMS alone told to every method: at each method's stop.", table)
        for cohort, table in duels(told).items()
    ]
    equal = equal_trials(every)
    shown += [
        Table("Equal trials: mean F1 after so many, whatever the stopping rule says, and its standard error.", equal),
        Table(f"From {EARLY} to {LATE} trials, where there is little noise.", changes(every)),
        Table("Equal F1: trials from which on a mean F1 is kept, of so many that were played.", equal_f1(rows)),
    ]
    prose = f"""\
{rows["person"].nunique()} people of each cohort, 500 ms from the valve command, without TMS alone and with ten
trials of it told to every method before the first pair; NR, SVMR and GPR take the floor from the pairs in either case.
`{PEOPLE}`: recorded trials, F1 by the measured window, as in the text, of sweeps that show one; GPR's F1 is {gpr:.2f}
there (text .81). The others: live trials, F1 by the true window. The default looks for the true window, by 0.135, as
NR, SVMR and GPR do. At equal trials: the default's F1 after as many trials as each session of the other method took (at
most {curve(rows, "default").shape[1]}), paired by person. At equal F1: from which trial on the default's mean F1 stays
at or above the other method's mean at its stop. A trial is one pair of stimuli."""
    said = [sentence for cohort, noise in NOISE.items() for sentence in verdicts(tables[cohort], noise)]
    picture = ("by_trial", figure(equal[equal["TMS alone"] == 0], tables))
    return Section("Equal trials, equal F1", prose, shown, picture, said)
