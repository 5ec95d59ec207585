"""The online experiment: two people on the simulated tapping robot, with waveforms (5.2.4, 5.3.2, Table 5.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
import torch
from matplotlib.figure import Figure

import isiw
from benchmarks.reduction import dissertation as text
from benchmarks.reduction.conventional import TWELVE
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import COLOURS, NAMES, panels
from benchmarks.reduction.sessions import correlation
from benchmarks.waveform_loop import Pair, robot, session_of
from isiw.design import IMPACT_SPACE
from isiw.plots.style import explain
from isiw.subjects.cohorts import cohort
from isiw.types import FloatArray

COHORT: Final = "kim11-measured"
PEOPLE: Final = (4, 7)
"""Two of them, with windows (110 and 145 ms) such as Table 5.3's 264 and 408 trials span (105 and 165 ms)."""

SETTINGS: Final[dict[str, dict[str, Any]]] = {"nr": {"initial": 7}, "default": {}, "incremental": {}}
"""The text's regression had seven initial observations."""

PROSE = f"""\
The simulated tapping robot in open loop, with waveforms, ISIs from 0 to 320 ms from the impact; two people of
`kim11-measured`, each strategy in a session, which learns what the tap itself does to the EMG. NR begins with seven
ISIs, as online in the text. Conventional: the sweep from the impact, on waveforms as well, until the window was passed.
Means over sessions; the figure has the first. {TWELVE}"""


@dataclass(frozen=True)
class Online:
    """One strategy with one person on the robot; `session` differs in trial noise, `settings` in all else."""

    person: int
    session: int
    method: str
    seed: int
    settings: tuple[tuple[str, Any], ...] = ()


def plan(sessions: int, seed: int, default: tuple[tuple[str, Any], ...] = ()) -> list[Online]:
    """Both people with every strategy, so many sessions each; the default with these settings."""
    return [
        Online(person, session, method, seed, default if method == "default" else tuple(settings.items()))
        for person in PEOPLE
        for session in range(sessions)
        for method, settings in SETTINGS.items()
    ]


def examine(online: Online) -> dict[str, Any]:
    """One session on waveforms until the strategy stops: its stimuli, window and profile, and the true ones."""
    torch.set_num_threads(1)
    subject = cohort(COHORT, online.person + 1, online.seed)[online.person]
    seed = online.seed + 11 * online.session + online.person
    strategy = isiw.make_strategy(online.method, IMPACT_SPACE, seed, **dict(online.settings))
    pair = Pair("impact", "open-loop", online.seed, online.person, seed, 0)
    result = session_of(robot(subject, pair), strategy)
    pairs = [trial for trial in result.trials if not trial.tap_alone]
    told = [(trial.isi_ms, trial.mep_mv) for trial in pairs if trial.reason is None]
    estimate, truth = result.estimate, subject.window(IMPACT_SPACE)
    return {
        "person": online.person,
        "session": online.session,
        "method": online.method,
        "trials": len(pairs),
        "mistrials": len(pairs) - len(told),
        "f1": isiw.metrics.f1(estimate, truth, IMPACT_SPACE),
        "told": told,
        "grid_ms": estimate.grid_ms,
        "profile_mv": estimate.profile(estimate.grid_ms).median_mv,
        "true_mv": subject.expected_mep_mv(IMPACT_SPACE),
    }


def _at(isi_ms: FloatArray, result: dict[str, Any]) -> FloatArray:
    """A result's profile [mV] at some ISIs."""
    return np.interp(isi_ms, result["grid_ms"], result["profile_mv"])


def row_of(result: dict[str, Any], swept: dict[str, Any]) -> dict[str, Any]:
    """One session beside the conventional sweep of the same person and noise seed."""
    return {
        "person": result["person"],
        "method": result["method"],
        "trials": result["trials"],
        "mistrials": result["mistrials"],
        "conventional": swept["trials"],
        "share %": 100 * result["trials"] / swept["trials"],
        "r: measured": correlation(_at(swept["grid_ms"], result), swept["profile_mv"]),
        "r: true": correlation(_at(IMPACT_SPACE.grid_ms, result), result["true_mv"]),
        "F1: true": result["f1"],
    }


def summary(results: list[dict[str, Any]]) -> pd.DataFrame:
    """Table 5.3: means over sessions of stimuli and correlations; the dissertation's numbers beside them."""
    swept = {(r["person"], r["session"]): r for r in results if r["method"] == "incremental"}
    rows = [row_of(r, swept[r["person"], r["session"]]) for r in results if r["method"] != "incremental"]
    table = pd.DataFrame(rows).groupby(["person", "method"], sort=False).mean().reset_index()
    for column, name in (("stimuli", "trials"), ("conventional", "conventional"), ("correlation", "r: measured")):
        theirs = dict(zip(PEOPLE, text.ONLINE[column], strict=True))
        table[f"text: {name}"] = table["person"].map(theirs).where(table["method"] == "nr").astype(float)
    return table.assign(
        person=table["person"].map({p: n + 1 for n, p in enumerate(PEOPLE)}), method=table["method"].map(NAMES)
    )


def figure(results: list[dict[str, Any]]) -> Figure:
    """Fig. 5.12 and 5.13: profiles."""
    picture, axes = panels(1, 2, width=4.4, height=3.0)
    for one, person, number in zip(axes[0], PEOPLE, ("5.12", "5.13"), strict=True):
        for result in results:
            if (result["person"], result["session"]) != (person, 0):
                continue
            if result["method"] == "incremental":
                one.plot(result["grid_ms"], result["profile_mv"], color="black", lw=0.8, label="measured")
                one.plot(IMPACT_SPACE.grid_ms, result["true_mv"], color="black", ls=":", label="true")
                continue
            colour = COLOURS[result["method"]]
            one.plot(
                result["grid_ms"],
                result["profile_mv"],
                color=colour,
                label=f"Fig. {number}: {NAMES[result['method']]}, {result['trials']} trials",
            )
            one.plot(*zip(*result["told"], strict=True), "o", ms=2.5, color=colour, alpha=0.6)
        one.set(title=f"Fig. {number}: online", xlabel="ISI from the impact [ms]", ylabel="MEP [mV]")
    explain(picture, ncols=3)
    return picture


def section(results: list[dict[str, Any]]) -> Section:
    """This part of the report."""
    return Section(
        "Online, on waveforms (Table 5.3)", PROSE, [Table("Table 5.3.", summary(results))], ("online", figure(results))
    )
