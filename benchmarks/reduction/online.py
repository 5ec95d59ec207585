"""The online experiment: two people on the simulated tapping robot, with waveforms (5.2.4, 5.3.2, Table 5.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import pandas as pd
import torch
from matplotlib.figure import Figure

import isiw
from benchmarks.reduction import dissertation as text
from benchmarks.reduction.document import Section, Table
from benchmarks.reduction.look import COLOURS, NAMES, panels
from benchmarks.reduction.sessions import correlation
from benchmarks.waveform_loop import Pair, by_waveform
from isiw.design import IMPACT_SPACE
from isiw.subjects import cohort
from isiw.types import FloatArray

PEOPLE: Final = (4, 7)
"""Two of `kim11`, with windows (110 and 145 ms) such as Table 5.3's 264 and 408 trials span (105 and 165 ms)."""

SETTINGS: Final[dict[str, dict[str, Any]]] = {"nr": {"initial": 7}, "default": {}, "incremental": {}}
"""The text's regression had seven initial observations."""

PROSE = """\
The simulated tapping robot in open loop, with waveforms, ISIs from 0 to 320 ms from the impact; two people of
`kim11`. NR begins with seven ISIs, as online in the text. Conventional: the sweep from the impact, on waveforms as
well, until the window was passed."""


@dataclass(frozen=True)
class Online:
    """One strategy with one person on the robot."""

    person: int
    method: str
    seed: int


def plan(seed: int) -> list[Online]:
    """Both people with every strategy."""
    return [Online(person, method, seed) for person in PEOPLE for method in SETTINGS]


def examine(online: Online) -> dict[str, Any]:
    """One session on waveforms until the strategy stops: its stimuli, window and profile, and the true ones."""
    torch.set_num_threads(1)
    subject = cohort("kim11", online.person + 1, online.seed)[online.person]
    seed = online.seed + online.person
    strategy = isiw.make_strategy(online.method, IMPACT_SPACE, seed, **SETTINGS[online.method])
    # The robot of the waveform loop takes what it needs from a pair of sessions.
    deliver = by_waveform(subject, IMPACT_SPACE, Pair("impact", "open-loop", online.seed, online.person, seed, 0))
    told: list[tuple[float, float]] = []
    mistrials = 0
    while not strategy.decision().stop:
        stimulus = isiw.Stimulus(len(told) + mistrials, strategy.ask())
        judged = isiw.signals.judge(deliver(stimulus), stimulus, IMPACT_SPACE)
        if judged.reason is not None:
            mistrials += 1
            strategy.count_mistrial()
            continue
        told.append((judged.isi_ms, judged.mep_mv))
        strategy.tell(judged.isi_ms, judged.mep_mv, isi_sd_ms=judged.isi_sd_ms)
    estimate, truth = strategy.estimate(), subject.window(IMPACT_SPACE)
    return {
        "person": online.person,
        "method": online.method,
        "trials": len(told) + mistrials,
        "mistrials": mistrials,
        "f1": isiw.metrics.f1(estimate, truth, IMPACT_SPACE),
        "told": told,
        "grid_ms": estimate.grid_ms,
        "profile_mv": _median(estimate),
        "true_mv": subject.expected_mep_mv(IMPACT_SPACE),
    }


def _median(estimate: isiw.WindowEstimate) -> FloatArray:
    assert estimate.grid_ms is not None  # noqa: S101 - these strategies have profiles
    band = estimate.profile(estimate.grid_ms)
    assert band is not None  # noqa: S101 - as above
    return band.median_mv


def _at(result: dict[str, Any], isi_ms: FloatArray) -> FloatArray:
    """A result's profile at some ISIs."""
    return (
        isiw.WindowEstimate(None, None, grid_ms=result["grid_ms"], profile_quantiles_mv=[result["profile_mv"]] * 3)
        .profile(isi_ms)
        .median_mv
    )


def summary(results: list[dict[str, Any]]) -> pd.DataFrame:
    """Table 5.3: stimuli and correlation with the measured and the true profile; the dissertation's beside them."""
    table = []
    for number, person in enumerate(PEOPLE):
        of_person = {result["method"]: result for result in results if result["person"] == person}
        swept = of_person["incremental"]
        for method in ("nr", "default"):
            result = of_person[method]
            theirs = method == "nr"
            table.append(
                {
                    "person": number + 1,
                    "strategy": NAMES[method],
                    "trials": result["trials"],
                    "mistrials": result["mistrials"],
                    "conventional": swept["trials"],
                    "share %": 100 * result["trials"] / swept["trials"],
                    "correlation measured": correlation(_at(result, swept["grid_ms"]), swept["profile_mv"]),
                    "true profile": correlation(_at(result, IMPACT_SPACE.grid_ms), result["true_mv"]),
                    "F1 true": result["f1"],
                    "text trials": text.ONLINE["stimuli"][number] if theirs else None,
                    "text conventional": text.ONLINE["conventional"][number] if theirs else None,
                    "text correlation": text.ONLINE["correlation"][number] if theirs else None,
                }
            )
    return pd.DataFrame(table)


def figure(results: list[dict[str, Any]]) -> Figure:
    """Fig. 5.12 and 5.13: profiles."""
    picture, axes = panels(1, 2, width=4.4, height=3.0)
    for one, person, number in zip(axes[0], PEOPLE, ("5.12", "5.13"), strict=True):
        for result in results:
            if result["person"] != person:
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
                label=f"{NAMES[result['method']]}, {result['trials']} trials",
            )
            one.plot(*zip(*result["told"], strict=True), "o", ms=2.5, color=colour, alpha=0.6)
        one.set(title=f"Fig. {number}: online", xlabel="ISI from the impact [ms]", ylabel="MEP [mV]")
        one.legend(fontsize=7, frameon=False)
    return picture


def section(results: list[dict[str, Any]]) -> Section:
    """This part of the report."""
    return Section(
        "Online, on waveforms (Table 5.3)",
        PROSE,
        [Table("Table 5.3.", summary(results))],
        ("online", figure(results)),
    )
