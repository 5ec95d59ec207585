"""What pulses of TMS alone over the recruitment curve, given before the pairs, are worth to the default.

    python -m benchmarks.given_pulses --people 200
    python -m benchmarks.given_pulses --people 200 --known
    python -m benchmarks.given_pulses --people 100 --pulses 60 --wrong
    python -m benchmarks.given_pulses --people 100 --pulses 60 --wrong --recorded

The people are those of `recruitment`, whose pairs are given at 90 % RMT. Before the pairs come pulses of TMS alone from
90 to 140 % RMT, evenly spaced, in an order of their own, without drift. Each person is examined without them, and with
each number of them: at the same level, and as pulses of a level that may be another. `--known` examines them without
pulses, but with a prior that knows what pulses could at most teach (the person's curve, kind of noise and EMG floor),
what they cannot (the law of the cohort's windows), and both. With `--wrong` the pulses, stated as of the same level,
are the right ones, and of each curve of `wrong_curves`. `--recorded` examines people whose MEPs were recorded instead,
the pulses being of the law that pairs are drawn from, or with `--banks coils` of the other half of the pulses
(`benchmarks.recorded_people`). With `--to-stopping 60` each goes on until the session's own rule ends it, after 60
pairs at the latest. All F1 are of the same people, and pairs have the same noise. Standard errors are by person. Rows
are kept beside `--out` as people are done, and the same command continues where it was interrupted. Reported people
come from seed 190,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Final, TypeAlias, cast

import numpy as np
import pandas as pd
import torch
import typer

import isiw
from benchmarks.provenance import facts_of
from benchmarks.quick import understood
from benchmarks.recorded_people import Banks, RecordedPerson, recordings
from benchmarks.recorded_tables import error_by_person
from benchmarks.tables import kept, write_table
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
STOP_PAIRS, STOP_F1 = "stop pairs", "stop F1"
MORE: Final = {f"F1 {mark}": f"gain {mark}" for mark in MARKS} | {STOP_PAIRS: "more pairs", STOP_F1: "gain at the stop"}
"""What differences to nothing given are called, by their figures."""

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


Curve: TypeAlias = Callable[[float, int], float]
"""The amplitude [mV] of a pulse alone by its intensity [% RMT] and its number."""


@dataclass(frozen=True, eq=False)
class Examined:
    """A person whose pulses alone are given before the pairs.

    Args:
        subject: the person in pairs.
        pulse: the person's curve.
        floor_mv: about what a sweep has without a response [mV].
        over_pct_rmt: intensities of any number of pulses, in their order [% RMT].
        whose: who counts as one person in standard errors.
    """

    subject: SimulatedSubject
    pulse: Curve
    floor_mv: float
    over_pct_rmt: Callable[[int], Sequence[float]]
    whose: int

    @classmethod
    def simulated(cls, subject: SimulatedSubject, number: int, seed: int) -> Examined:
        """One of `recruitment`, without drift."""
        response = cast("RecruitmentResponse", subject.response)

        def pulse(pct_rmt: float, number: int) -> float:
            there = replace(subject, drift=None, response=replace(response, intensity_pct_rmt=pct_rmt))
            return there.begin(1000 * seed + number).respond(None, SPACE.reference).mep_mv

        def over(pulses: int) -> list[float]:
            evenly = np.linspace(*OVER_PCT_RMT, pulses)
            return np.random.default_rng([seed, 45]).permutation(evenly).tolist()  # type: ignore[no-any-return]

        return cls(subject, pulse, response.floor.median_mv, over, number)

    @classmethod
    def recorded(cls, person: RecordedPerson) -> Examined:
        """One whose MEPs were recorded; pulses are of the same law as pairs, or of the other half of a coil's."""
        bank = person.bank.half("other")

        def pulse(pct_rmt: float, number: int) -> float:
            rng = np.random.default_rng([person.seed, person.number, 2, number])
            return bank.drawn_mv(float(bank.places(pct_rmt)), rng)

        def over(pulses: int) -> list[float]:
            return [pct_rmt for pct_rmt, _ in person.single_pulses(pulses)]

        return cls(person.subject(), pulse, float(np.median(bank.amplitudes_mv[0])), over, bank.person)


def another_muscle(subject: SimulatedSubject, seed: int) -> SimulatedSubject:
    """The same with a flatter curve, with another threshold and another size."""
    own, rng = cast("RecruitmentResponse", subject.response), np.random.default_rng([seed, 46])
    curve = replace(
        own,
        slope_per_pct=own.slope_per_pct * rng.uniform(0.4, 0.8),
        x50_pct_rmt=own.x50_pct_rmt + rng.uniform(-8.0, 12.0),
        amplitude_mv=own.amplitude_mv * float(np.exp(0.8 * rng.standard_normal())),
    )
    return replace(subject, response=curve)


def coil_moved(own: Examined, rng: np.random.Generator) -> Curve:
    """The curve under a coil that lay elsewhere: a higher threshold, and less of what is above the EMG floor."""
    shift_pct_rmt, left = rng.uniform(10.0, 20.0), rng.uniform(0.4, 0.8)
    least_mv = own.floor_mv

    def pulse(pct_rmt: float, number: int) -> float:
        mep_mv = own.pulse(pct_rmt - shift_pct_rmt, number)
        return min(mep_mv, least_mv) + left * max(0.0, mep_mv - least_mv)

    return pulse


def wrong_curves(own: Examined, other: Examined, seed: int) -> dict[str, Curve]:
    """The right curve and wrong ones, by what is wrong.

    Args:
        own: the person.
        other: whose curve stands for that of another muscle.
        seed: how far the coil lay off, and whether the intensities stated are too low by a tenth or too high.
    """
    rng = np.random.default_rng([seed, 69])
    scale = 1.1 if rng.random() < 0.5 else 1 / 1.1
    return {
        "right": own.pulse,
        "another muscle": other.pulse,
        "coil moved": coil_moved(own, rng),
        "scale off by 10 %": lambda pct_rmt, number: own.pulse(scale * pct_rmt, number),
        "level × 3": lambda pct_rmt, number: 3.0 * own.pulse(pct_rmt, number),
    }


def given(own: Examined, curve: Curve, number: int) -> list[Trial]:
    """Pulses of TMS alone, at the person's intensities, of some curve."""
    over_pct_rmt = enumerate(own.over_pct_rmt(number))
    return [
        Trial(pulse, Status.ACCEPTED, None, mep_mv=curve(pct_rmt, pulse), intensity_pct_rmt=pct_rmt)
        for pulse, pct_rmt in over_pct_rmt
    ]


def strategies(own: Examined, other: Examined, seed: int, pulses: list[int], what: str) -> dict[str, Strategy]:
    """The default before the first pair, by what it knows; `what` is "known", "wrong" or "right"."""

    def default(prior: Prior | None = None) -> Strategy:
        more = {} if prior is None else {"prior": prior}
        return isiw.make_strategy("default", SPACE, seed, hit_delay_ms=own.subject.stated_hit_delay_ms, **more)

    def after(curve: Curve, number: int, *, same_level: bool) -> Strategy:
        strategy = default()
        strategy.learn_all(given(own, curve, number), same_level=same_level)
        return strategy

    ways = {"nothing": default()}
    if what == "known":
        windows = replace(Prior(), profile=WINDOWS)
        ways |= {"the curve": default(with_curve(Prior(), own.subject)), "the windows' law": default(windows)}
        return ways | {"both": default(with_curve(windows, own.subject))}
    for number in pulses:
        if what == "wrong":
            curves = wrong_curves(own, other, seed)
            ways |= {f"{number} pulses, {name}": after(each, number, same_level=True) for name, each in curves.items()}
        else:
            ways[f"{number} pulses"] = after(own.pulse, number, same_level=True)
            ways[f"{number} pulses, another level"] = after(own.pulse, number, same_level=False)
    return ways


def session(subject: SimulatedSubject, seed: int, strategy: Strategy, most: int = 0) -> dict[str, float]:
    """After each of `MARKS` pairs the F1, the F1 expected, and what is said against pulses, pairs and law.

    Args:
        subject: the person.
        seed: of the responses.
        strategy: before the first pair.
        most: pairs after which it ends if its own rule has not ended it; 0 does not ask the rule.
    """
    responder, truth, found = subject.begin(seed), subject.window(SPACE), dict[str, float]()
    for pair in range(1, max(MARKS[-1], most) + 1):
        response = responder.respond(strategy.ask(), SPACE.reference)
        strategy.learn(Trial.of(response.isi_ms, response.mep_mv))
        if most and STOP_PAIRS not in found and (pair == most or strategy.decision().stop):
            found |= {STOP_PAIRS: pair, STOP_F1: f1(strategy.estimate(), truth, SPACE)}
        if pair in MARKS:
            estimate = strategy.estimate()
            misfit, change = estimate.misfit, estimate.change
            changed = change is not None and change.trial == 0 and change.is_sure
            found |= {
                f"F1 {pair}": f1(estimate, truth, SPACE),
                f"expected {pair}": estimate.expected_f1 or np.nan,
                f"no fit {pair}": float(changed or (misfit is not None and misfit.of_curve)),
                f"law doubted {pair}": float(misfit is not None and misfit.of_law),
            }
        if pair >= MARKS[-1] and STOP_PAIRS in found:
            break
    return found


def examined(people: int, seed: int, banks: Banks | None = None) -> list[tuple[Examined, Examined]]:
    """The people, and beside each whose curve stands for that of another muscle: of recorded people the next one's.

    Args:
        people: how many.
        seed: of the cohort.
        banks: what a bank of recorded people is; None for people of `recruitment`.
    """
    if banks is not None:
        cohort = [RecordedPerson(number, seed, recordings(), banks=banks) for number in range(people + 1)]
        return list(pairwise(map(Examined.recorded, cohort)))
    subjects = enumerate(isiw.subjects.cohort("recruitment", people, seed))
    return [
        (
            Examined.simulated(subject, number, seed + number),
            Examined.simulated(another_muscle(subject, seed + number), number, seed + number),
        )
        for number, subject in subjects
    ]


def compared(rows: pd.DataFrame) -> pd.DataFrame:
    """Means of what is known beforehand, and F1 more than with nothing, with standard errors by person."""
    usual = rows[rows["known"] == "nothing"].set_index("number")
    table = []
    for known, part in rows.groupby("known", sort=False):
        figures = part.drop(columns=["known", "number", "whose"]).mean().to_dict()
        for column, name in MORE.items():
            if column in part:
                more = part[column] - part["number"].map(usual[column])
                figures |= {name: more.mean(), f"{name} SE": error_by_person(more, part["whose"])}
        table.append({"known": known, "people": len(part), **figures})
    return pd.DataFrame(table)


def main(  # noqa: PLR0913 - options of a command line
    people: Annotated[int, typer.Option(help="People.")] = 50,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 200_000,
    pulses: Annotated[list[int] | None, typer.Option(help="How many pulses; repeat it for several.")] = None,
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("given_pulses"),
    *,
    known: Annotated[bool, typer.Option("--known", help="No pulses, but priors that know parts of the truth.")] = False,
    wrong: Annotated[bool, typer.Option("--wrong", help="Pulses of wrong curves beside the right one.")] = False,
    recorded: Annotated[bool, typer.Option("--recorded", help="People whose MEPs were recorded.")] = False,
    banks: Annotated[str, typer.Option(help="What a bank of theirs is: curves or coils.")] = "curves",
    to_stopping: Annotated[int, typer.Option(help="Until the own rule stops, at most so many pairs; 0: 20.")] = 0,
) -> None:
    """Print how the sessions compare."""
    torch.set_num_threads(1)
    if recorded and not recordings().is_dir():
        print(f"Skipped: the recordings are not at hand, {recordings()} is no folder.")
        return
    if recorded and known:
        raise typer.BadParameter("who was recorded has no law that a prior could know")
    cohort, counts = examined(people, seed, cast("Banks", banks) if recorded else None), pulses or [30, 60]
    what = "known" if known else "wrong" if wrong else "right"
    whose = f"recorded-{banks}" if recorded else "recruitment"
    stops = f"-{to_stopping}" if to_stopping else ""
    folder = out.with_suffix(f".{what}-{'-'.join(map(str, counts))}-{whose}-{seed}{stops}.rows")

    def row_of(number: int) -> pd.DataFrame:
        own, other = cohort[number]
        ways = strategies(own, other, seed + number, counts, what).items()
        who = {"number": number, "whose": own.whose}
        found = ((way, session(own.subject, seed + number, strategy, to_stopping)) for way, strategy in ways)
        return pd.DataFrame([{"known": way, **who, **figures} for way, figures in found])

    rows = [kept(folder / f"{number}.parquet", partial(row_of, number)) for number in range(people)]
    table = compared(pd.concat(rows, ignore_index=True))
    write_table(table, facts_of("given_pulses", "torch", seed=seed, people=people), out)


if __name__ == "__main__":
    understood("given_pulses")
    typer.run(main)
