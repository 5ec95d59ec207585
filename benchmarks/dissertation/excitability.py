"""Excitability that paired pulses change, and how much it biases each strategy (4.5, 5.4.1).

The text says that every pair delivered in the window changed what was measured afterwards; it gives no number. Here the
log gain of simulated people moves towards ± 0.5 with their pairs (`isiw.subjects.Plasticity`), and the estimated window
is compared with that of the same session without the change.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
import pandas as pd
import torch
from matplotlib.figure import Figure

import isiw
from benchmarks.dissertation.claims import Claim
from benchmarks.dissertation.parts import Told
from benchmarks.dissertation.size import Size
from benchmarks.reduction.look import COLOURS, NAMES, panels
from isiw.design import IMPACT_SPACE
from isiw.signals import wrong_isi
from isiw.subjects import Plasticity, SimulatedSubject, cohort

__all__ = ["tell"]

COHORT: Final = "recruitment"
SECTION: Final = "Section 5.4.1"
STRATEGIES: Final = ("incremental", "nr", "gpr", "pf", "default")
PAIRS: Final = 50.0
CHANGES: Final = {"grows": Plasticity(0.5, PAIRS), "none": None, "shrinks": Plasticity(-0.5, PAIRS)}

NOTE: Final = (
    f"Simulated people of the cohort `{COHORT}`, ISIs from the impact. Their gain grows to 1.65 or shrinks to 0.61 of "
    f"what it was; {PAIRS:g} pairs at the best ISI bring 63 % of that. The text gives no size: this one is ours. The "
    "truth is the window before the first pair."
)


def tell(size: Size, seed: int) -> Told:
    """This part of the gallery."""
    rows = [
        _examined(method, change, person, number, seed)
        for number, person in enumerate(cohort(COHORT, size.people, seed))
        for method in STRATEGIES
        for change in CHANGES
    ]
    table = pd.DataFrame(rows)
    claims = [_claim(method, table[table["method"] == method]) for method in STRATEGIES]
    return Told(NOTE, claims, {SECTION: _figure(table)})


def _examined(method: str, change: str, subject: SimulatedSubject, number: int, seed: int) -> dict[str, Any]:
    """One session until the strategy stops: its trials, F1 and edges; the same noise whatever the change."""
    torch.set_num_threads(1)
    responder = replace(subject, plasticity=CHANGES[change]).begin(seed + number)
    strategy = isiw.make_strategy(method, IMPACT_SPACE, seed + number)
    trials = 0
    while not strategy.decision().stop:
        asked_ms = strategy.ask()
        response = responder.respond(asked_ms, "impact")
        trials += 1
        if wrong_isi(response.isi_ms, asked_ms, IMPACT_SPACE) is None:
            strategy.tell(response.isi_ms, response.mep_mv)
        else:
            strategy.count_mistrial()
    window, truth = strategy.estimate().window, subject.window(IMPACT_SPACE)
    edges = {"start_ms": np.nan, "end_ms": np.nan}
    if window is not None:
        edges = {"start_ms": window.start_ms, "end_ms": window.end_ms}
    f1 = isiw.metrics.f1(window, truth, IMPACT_SPACE)
    return {"method": method, "change": change, "person": number, "trials": trials, "f1": f1} | edges


def _claim(method: str, rows: pd.DataFrame) -> Claim:
    by = rows.pivot_table(index="person", columns="change", values=["f1", "start_ms", "end_ms", "trials"], dropna=False)
    f1, people = by["f1"], rows["person"].nunique()
    worse = {change: f1[change] - f1["none"] for change in ("grows", "shrinks")}
    misses = [change for change, off in worse.items() if off.mean() < -2 * off.sem()]
    return Claim(
        "5.4.1, 4.5",
        f"{NAMES[method]}: pairs in the window change the excitability, so the estimate does not match the window.",
        "seen, no number",
        f"F1 {f1['none'].mean():.2f} without a change, {f1['grows'].mean():.2f} as the gain grows, "
        f"{f1['shrinks'].mean():.2f} as it shrinks; edges against those without a change: {_moved(by, 'grows')}; "
        f"{_moved(by, 'shrinks')} ({by['trials']['none'].mean():.0f} trials, {people} people)",
        ", ".join(f"{change}: F1 {off.mean():+.2f} ± {off.sem():.2f}" for change, off in worse.items()),
        f"under reading the gain {' or '.join(misses)}: F1 is worse by more than two standard errors"
        if misses
        else f"not, because F1 is not worse by more than two standard errors with {people} people, either way",
    )


def _moved(by: pd.DataFrame, change: str) -> str:
    """How the edges lie against those of the session without a change: mean over people, with its standard error."""
    edges = []
    for edge in ("start_ms", "end_ms"):
        off = (by[edge][change] - by[edge]["none"]).dropna()
        edges.append(f"{off.mean():+.0f} ± {off.sem():.0f} ms")
    return f"{change}: start {edges[0]}, end {edges[1]}"


def _figure(table: pd.DataFrame) -> Figure:
    picture, axes = panels(1, 1, width=6.0)
    for k, method in enumerate(STRATEGIES):
        means = table[table["method"] == method].groupby("change")["f1"].mean()[list(CHANGES)]
        axes[0, 0].bar(
            np.arange(3) + 0.16 * (k - 2), means, 0.15, label=NAMES[method], color=COLOURS.get(method, "black")
        )
    axes[0, 0].set_xticks(range(3), ["gain grows", "unchanged", "gain shrinks"])
    axes[0, 0].set(ylabel="mean F1", ylim=(0, 1))
    axes[0, 0].legend(fontsize=7, frameon=False, ncols=3)
    return picture
