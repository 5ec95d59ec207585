"""People whose muscle answers the tap itself, told as amplitudes: with a few taps alone, and without any.

    python -m benchmarks.taps_alone --people 50 > benchmarks/results/taps_alone.md

The people are those of `tap-response`. Their sessions are run three times with the default: without the tap's own
response, with it and a few taps alone before the first trial, and with it and no tap alone. The taps alone lie at even
distances among the ISIs whose MEP window a tap's response may meet. Reported people come from seed 200,000 on; seeds
below 1,000 are for work.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Final

import numpy as np
import pandas as pd
import torch
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.metrics import covers, f1
from isiw.signals.taps_alone import meets_response
from isiw.studies import summary
from isiw.subjects.subject import SimulatedSubject

MARKS: Final = 20, 40, 60
SPACE: Final = isiw.VALVE_SPACE


def session(subject: SimulatedSubject, seed: int, taps: int) -> list[dict[str, object]]:
    """What is estimated after each of `MARKS` trials, and where the stopping rule ends.

    Args:
        subject: the person.
        seed: of the noise and the strategy.
        taps: how many taps alone come first.
    """
    responder, strategy = subject.begin(seed), isiw.make_strategy(seed=seed, hit_delay_ms=subject.stated_hit_delay_ms)
    meet_ms = [isi_ms for isi_ms in SPACE.grid_ms if meets_response(isi_ms, SPACE.reference)]
    for isi_ms in np.linspace(meet_ms[0], meet_ms[-1], taps):
        alone = responder.respond(isi_ms, SPACE.reference, pulse=False)
        strategy.tell(alone.isi_ms, alone.mep_mv, pulse=False)
    rows, stopped, truth = [], False, subject.window(SPACE)
    for trial in range(1, MARKS[-1] + 1):
        response = responder.respond(strategy.ask(), SPACE.reference)
        strategy.tell(response.isi_ms, response.mep_mv)
        stops = not stopped and strategy.decision().stop
        for at in ([trial] if trial in MARKS else []) + (["stop"] if stops else []):
            estimate = strategy.estimate()
            covered = covers(estimate, truth, SPACE)
            row: dict[str, object] = {
                "trial": str(at),
                "f1": f1(estimate, truth, SPACE),
                "expected": estimate.expected_f1,
            }
            row |= dict(zip(("start", "end"), (np.nan, np.nan) if covered is None else covered, strict=True))
            said = estimate.window is not None
            row |= {"window": said, "told": estimate.tap_may_explain if said else np.nan}
            rows.append(row)
        stopped |= stops
    return rows


def main(
    people: Annotated[int, typer.Option(help="People.")] = 50,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 200_000,
    taps: Annotated[int, typer.Option(help="Taps alone before the first trial.")] = 6,
) -> None:
    """Print how the sessions compare."""
    torch.set_num_threads(1)
    rows = []
    for number, person in enumerate(isiw.subjects.cohort("tap-response", people, seed)):
        silent = replace(person, tap_response=None)
        for name, subject, alone in (("no response", silent, 0), ("taps alone", person, taps), ("none", person, 0)):
            rows += [row | {"sessions": name, "person": number} for row in session(subject, seed + number, alone)]
    table = pd.DataFrame(rows)
    table["sure_and_wrong"] = summary.sure_and_wrong(table["expected"], table["f1"])
    table["without_the_sentence"] = table["sure_and_wrong"].where(table["told"] != 1, 0.0)
    usual = table[table["sessions"] == "no response"].set_index(["person", "trial"])["f1"]
    table["f1_more"] = table["f1"] - table.join(usual.rename("usual"), on=["person", "trial"])["usual"]
    groups = table.drop(columns="person").groupby(["sessions", "trial"])
    means = groups.mean(numeric_only=False).assign(people=groups.size(), f1_more_se=groups["f1_more"].sem())
    means.index = [", ".join(key) for key in means.index]
    print(f"- command: `{command_of('taps_alone')}`; seed of the people {seed:,}")
    print(f"- {made_with('torch')}")
    print(
        "- `f1_more`: beside the same people without a response to the tap; `told`: of the windows that are reported,"
    )
    print("  those with the sentence that the tap's own response may explain them; `without_the_sentence`: who is sure")
    print("  and wrong without it\n")
    print(means.astype(float).to_markdown(floatfmt=".3f"))


if __name__ == "__main__":
    understood("taps_alone", prints=True)
    typer.run(main)
