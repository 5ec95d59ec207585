"""A stimulator that stops firing in mid-session: noticed how soon, and how often where nothing is wrong.

    python -m benchmarks.silence

Simulated people answer pulses at random ISIs of the whole range, or mostly about the edges of their window, as a
strategy asks that has nearly found it. What lies below a detection limit, which nobody states, is 0. Each person has a
session in which nothing is wrong, and one in which no pulse comes any more after the 15th trial.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal, get_args

import numpy as np
import pandas as pd
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.design import VALVE_SPACE
from isiw.signals.plausible import stopped_after
from isiw.types import FloatArray

RESULTS = Path(__file__).parent / "results" / "silence"
SEED: Final = 10_000
COHORTS: Final = ("recruitment", "weak", "gaussian", "drift")
LIMITS_MV: Final = (0.015, 0.03, 0.05)
TRIALS, FIRED = 60, 15
NEAR_MS, SHARE_NEAR = 25.0, 2 / 3

Asked = Literal["anywhere", "near the edges"]


@dataclass(frozen=True)
class Kind:
    """Sessions that are alike.

    Args:
        cohort: whose.
        asked: which ISIs.
        limit_mv: the detection limit [mV].
    """

    cohort: str
    asked: Asked
    limit_mv: float


def isis_ms(person: isiw.subjects.SimulatedSubject, asked: Asked, rng: np.random.Generator) -> FloatArray:
    """The ISIs of one session [ms], shape (TRIALS,)."""
    anywhere_ms = rng.uniform(VALVE_SPACE.low_ms, VALVE_SPACE.high_ms, TRIALS)
    window = person.window(VALVE_SPACE)
    if asked == "anywhere" or window is None:
        return anywhere_ms
    near_ms = rng.choice(np.ravel(window.segments), TRIALS) + NEAR_MS * rng.standard_normal(TRIALS)
    chosen = np.where(rng.random(TRIALS) < SHARE_NEAR, near_ms, anywhere_ms)
    return np.clip(chosen, VALVE_SPACE.low_ms, VALVE_SPACE.high_ms)


def noticed_at(person: isiw.subjects.SimulatedSubject, number: int, kind: Kind, fired: int) -> float:
    """After how many trials silence is noticed where the first `fired` pulses come; NaN where it never is."""
    responder, rng = person.begin(number), np.random.default_rng(number)
    told_ms, answered = list[float | None](), list[bool]()
    for trial, isi_ms in enumerate(isis_ms(person, kind.asked, rng).tolist()):
        response = responder.respond(isi_ms, "valve")
        told_ms.append(response.isi_ms)
        answered.append(trial < fired and response.mep_mv >= kind.limit_mv)
        if stopped_after(told_ms, answered) is not None:
            return trial + 1.0
    return np.nan


def measured(kind: Kind, number: int) -> dict[str, object]:
    """One row: false alarms in right sessions, and what is noticed where the stimulator stops."""
    people = isiw.subjects.cohort(kind.cohort, number, SEED)
    right = np.array([noticed_at(person, number, kind, TRIALS) for number, person in enumerate(people)])
    stopped = np.array([noticed_at(person, number, kind, FIRED) for number, person in enumerate(people)])
    in_time = stopped[np.isfinite(stopped)]
    return {
        "cohort": kind.cohort,
        "asked": kind.asked,
        "detection limit [mV]": kind.limit_mv,
        f"right sessions doubted, of {number}": int(np.isfinite(right).sum()),
        f"stops noticed, of {number}": len(in_time),
        "pulses after the stop until then (median)": float(np.median(in_time) - FIRED) if len(in_time) else np.nan,
    }


def main(
    people: Annotated[int, typer.Option(help="People of each kind.")] = 100,
    out: Annotated[Path, typer.Option(help="Path of the result, without suffix.")] = RESULTS,
) -> None:
    """Run all kinds of session, and write the table."""
    kinds = (Kind(*values) for values in itertools.product(COHORTS, get_args(Asked), LIMITS_MV))
    table = pd.DataFrame([measured(kind, people) for kind in kinds])
    intro = (
        f"# A stimulator that stops firing\n\n`{command_of('silence')}`, seed {SEED}, {made_with()}\n\n"
        f"{people} people of each kind, {TRIALS} trials; in the sessions that stop, "
        f"no pulse comes after the first {FIRED}.\nWhere few pulses are answered, silence may be chance.\n\n"
    )
    text = f"{intro}{table.to_markdown(index=False)}\n"
    out.with_suffix(".md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    understood("silence")
    typer.run(main)
