"""What pulses of TMS alone over the recruitment curve, given before the pairs, are worth to the default.

    python -m benchmarks.given_pulses --people 200

The people are those of `recruitment`, whose pairs are given at 90 % RMT. Before the pairs come pulses of TMS alone from
90 to 140 % RMT, evenly spaced, in an order of their own, without drift. Each person is examined without them, and with
each number of them: at the same level, and as pulses of a level that may be another. All F1 are of the same people, and
pairs have the same noise. Reported people come from seed 200,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Final, cast

import numpy as np
import pandas as pd
import torch
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.metrics import f1
from isiw.subjects.responses import RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from isiw.trials import Status, Trial

MARKS: Final = 10, 20
SPACE: Final = isiw.VALVE_SPACE
OVER_PCT_RMT: Final = 90.0, 140.0


def given(subject: SimulatedSubject, number: int, seed: int) -> list[Trial]:
    """Pulses of TMS alone over the curve, in an order by the seed."""
    response, trials = cast("RecruitmentResponse", subject.response), []
    over_pct_rmt = np.random.default_rng([seed, 45]).permutation(np.linspace(*OVER_PCT_RMT, number))
    for pulse, pct_rmt in enumerate(over_pct_rmt.tolist()):
        there = replace(subject, drift=None, response=replace(response, intensity_pct_rmt=pct_rmt))
        mep_mv = there.begin(1000 * seed + pulse).respond(None, SPACE.reference).mep_mv
        trials.append(Trial(pulse, Status.ACCEPTED, None, mep_mv=mep_mv, intensity_pct_rmt=pct_rmt))
    return trials


def session(subject: SimulatedSubject, seed: int, pulses: int, *, same_level: bool) -> dict[str, float]:
    """F1, and the F1 that was expected, after each of `MARKS` pairs."""
    responder, strategy = subject.begin(seed), isiw.make_strategy(seed=seed, hit_delay_ms=subject.stated_hit_delay_ms)
    strategy.learn_all(given(subject, pulses, seed), same_level=same_level)
    truth, found = subject.window(SPACE), dict[str, float]()
    for pair in range(1, MARKS[-1] + 1):
        response = responder.respond(strategy.ask(), SPACE.reference)
        strategy.tell(response.isi_ms, response.mep_mv)
        if pair in MARKS:
            estimate = strategy.estimate()
            found |= {f"F1 {pair}": f1(estimate, truth, SPACE), f"expected {pair}": estimate.expected_f1 or np.nan}
    return found


def main(
    people: Annotated[int, typer.Option(help="People.")] = 50,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 200_000,
    pulses: Annotated[list[int] | None, typer.Option(help="How many pulses; repeat it for several.")] = None,
) -> None:
    """Print how the sessions compare."""
    torch.set_num_threads(1)
    ways = [(0, True), *((number, same) for number in pulses or [30, 60] for same in (True, False))]
    rows = []
    for number, person in enumerate(isiw.subjects.cohort("recruitment", people, seed)):
        for given_before, same_level in ways:
            way = f"{given_before} pulses" + ("" if same_level else ", another level")
            found = session(person, seed + number, given_before, same_level=same_level)
            rows.append({"given": way, "person": number, **found})
    table = pd.DataFrame(rows)
    usual = table[table["given"] == "0 pulses"].set_index("person")
    for mark in MARKS:
        table[f"gain {mark}"] = table[f"F1 {mark}"] - table["person"].map(usual[f"F1 {mark}"])
    groups = table.drop(columns="person").groupby("given", sort=False)
    print(f"- command: `{command_of('given_pulses')}`; seed of the people {seed:,}")
    print(f"- {made_with('torch')}\n")
    print(
        groups.mean()
        .join(groups[[f"gain {mark}" for mark in MARKS]].sem().add_suffix(" SE"))
        .to_markdown(floatfmt=".3f")
    )


if __name__ == "__main__":
    understood("given_pulses")
    typer.run(main)
