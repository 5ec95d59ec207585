"""What pulses of TMS alone over the recruitment curve, given before the pairs, are worth to the default.

    python -m benchmarks.given_pulses --people 200
    python -m benchmarks.given_pulses --people 200 --known
    python -m benchmarks.given_pulses --people 200 --pulses 60 --times 3

The people are those of `recruitment`, whose pairs are given at 90 % RMT. Before the pairs come pulses of TMS alone from
90 to 140 % RMT, evenly spaced, in an order of their own, without drift. Each person is examined without them, and with
each number of them: at the same level, and as pulses of a level that may be another. `--known` examines them without
pulses, but with a prior that knows what pulses could at most teach (the person's curve, kind of noise and EMG floor),
what they cannot (the law of the cohort's windows), and both. With `--times` the given amplitudes are so many times what
they were: a wrong curve. All F1 are of the same people, and pairs have the same noise. Reported people come from seed
200,000 on; seeds below 1,000 are for work.
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
from isiw.models.particles.laws import FOREARM, Floor, NoiseShares
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior, ShapeShares, Width
from isiw.models.shared.scales import Scale
from isiw.models.shared.start import Span, StartPrior
from isiw.strategy.strategy import Strategy
from isiw.subjects.responses import RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from isiw.trials import Status, Trial

MARKS: Final = 10, 20
SPACE: Final = isiw.VALVE_SPACE
OVER_PCT_RMT: Final = 90.0, 140.0
NEARLY: Final = 0.03
"""How far from the truth what is known may be, natural log."""

WINDOWS: Final = ProfilePrior(
    shapes=ShapeShares(1.0, 0.0, 0.0, 0.0),
    start=StartPrior(spans=(Span(1.0, 5.0, 110.0),)),
    widths=(Width(1.0, Scale(100.0, 0.42)),),
    early=(),
)
"""The windows of the cohort, and that some have none."""


def with_curve(prior: Prior, subject: SimulatedSubject) -> Prior:
    """A prior that knows a person's recruitment curve and EMG floor, but not by how much the tap shifts the input."""
    person = cast("RecruitmentResponse", subject.response)
    slope, floor_mv = person.slope_per_pct, person.floor.median_mv
    curve = replace(
        FOREARM,
        share=1.0,
        ratio=Scale(person.amplitude_mv / floor_mv, NEARLY),
        slope_per_pct=Scale(slope, NEARLY),
        input_sd=Scale(slope * person.sigma_x_pct_rmt, NEARLY),
        sigma_y=Scale(person.sigma_y, NEARLY),
        rest_pct=Scale(person.intensity_pct_rmt - person.x50_pct_rmt, 0.2),
    )
    return replace(
        prior,
        noise=NoiseShares(0.0, 0.0, 1.0, 0.0, 0.0),
        muscles=(curve,),
        intensity_pct_rmt=person.intensity_pct_rmt,
        floors=(Floor(1.0, Scale(floor_mv, NEARLY), Scale(person.floor.log_sd, NEARLY)),),
    )


def given(subject: SimulatedSubject, number: int, seed: int, times: float = 1.0) -> list[Trial]:
    """Pulses of TMS alone over the curve, in an order by the seed."""
    response, trials = cast("RecruitmentResponse", subject.response), []
    over_pct_rmt = np.random.default_rng([seed, 45]).permutation(np.linspace(*OVER_PCT_RMT, number))
    for pulse, pct_rmt in enumerate(over_pct_rmt.tolist()):
        there = replace(subject, drift=None, response=replace(response, intensity_pct_rmt=pct_rmt))
        mep_mv = times * there.begin(1000 * seed + pulse).respond(None, SPACE.reference).mep_mv
        trials.append(Trial(pulse, Status.ACCEPTED, None, mep_mv=mep_mv, intensity_pct_rmt=pct_rmt))
    return trials


def strategies(
    subject: SimulatedSubject, seed: int, pulses: list[int], times: float, *, known: bool
) -> dict[str, Strategy]:
    """The default before the first pair, by what it knows."""

    def default(prior: Prior | None = None) -> Strategy:
        more = {} if prior is None else {"prior": prior}
        return isiw.make_strategy("default", SPACE, seed, hit_delay_ms=subject.stated_hit_delay_ms, **more)

    ways = {"nothing": default()}
    if known:
        windows = replace(Prior(), profile=WINDOWS)
        ways |= {"the curve": default(with_curve(Prior(), subject)), "the windows' law": default(windows)}
        return ways | {"both": default(with_curve(windows, subject))}
    for number in pulses:
        for same_level in (True, False):
            way = f"{number} pulses" + ("" if same_level else ", another level")
            ways[way] = default()
            ways[way].learn_all(given(subject, number, seed, times), same_level=same_level)
    return ways


def session(subject: SimulatedSubject, seed: int, strategy: Strategy) -> dict[str, float]:
    """After each of `MARKS` pairs the F1, the F1 expected, and whether pulses and pairs are said not to fit."""
    responder, truth, found = subject.begin(seed), subject.window(SPACE), dict[str, float]()
    for pair in range(1, MARKS[-1] + 1):
        response = responder.respond(strategy.ask(), SPACE.reference)
        strategy.learn(response.isi_ms, response.mep_mv)
        if pair in MARKS:
            estimate = strategy.estimate()
            misfit, change = estimate.misfit, estimate.change
            changed = change is not None and change.trial == 0 and change.is_sure
            found |= {
                f"F1 {pair}": f1(estimate, truth, SPACE),
                f"expected {pair}": estimate.expected_f1 or np.nan,
                f"no fit {pair}": float(changed or (misfit is not None and misfit.of_curve)),
            }
    return found


def main(
    people: Annotated[int, typer.Option(help="People.")] = 50,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 200_000,
    pulses: Annotated[list[int] | None, typer.Option(help="How many pulses; repeat it for several.")] = None,
    times: Annotated[float, typer.Option(help="By what given amplitudes are multiplied.")] = 1.0,
    *,
    known: Annotated[bool, typer.Option("--known", help="No pulses, but priors that know parts of the truth.")] = False,
) -> None:
    """Print how the sessions compare."""
    torch.set_num_threads(1)
    rows = []
    for number, person in enumerate(isiw.subjects.cohort("recruitment", people, seed)):
        ways = strategies(person, seed + number, pulses or [30, 60], times, known=known)
        rows += [{"known": way, "person": number, **session(person, seed + number, each)} for way, each in ways.items()]
    table = pd.DataFrame(rows)
    usual = table[table["known"] == "nothing"].set_index("person")
    for mark in MARKS:
        table[f"gain {mark}"] = table[f"F1 {mark}"] - table["person"].map(usual[f"F1 {mark}"])
    groups = table.drop(columns="person").groupby("known", sort=False)
    print(f"- command: `{command_of('given_pulses')}`; seed of the people {seed:,}")
    print(f"- {made_with('torch')}\n")
    print(
        groups.mean()
        .join(groups[[f"gain {mark}" for mark in MARKS]].sem().add_suffix(" SE"))
        .to_markdown(floatfmt=".3f")
    )


if __name__ == "__main__":
    understood("given_pulses", prints=True)
    typer.run(main)
