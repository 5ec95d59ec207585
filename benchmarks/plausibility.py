"""Slips of unit and order are refused or flagged, right data never: `python -m benchmarks.plausibility`.

Simulated people are asked by the default strategy, and what they answer is told to it: with a slip, for four trials,
and as it is, for a whole session. Besides, the tapping robot runs sessions in which nothing is wrong. A refusal is an
error, a flag is a warning; see `isiw.Strategy.tell`.

    python -m benchmarks.plausibility --isis

looks at realised ISIs instead, of right rigs and of loops with a mistake, by the rule that asks for a confirmation.
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import isiw
from benchmarks.plausibility_isis import isis_report
from benchmarks.provenance import command_of
from benchmarks.quick import understood
from isiw.errors import ImplausibleDataWarning, InvalidValueError

RESULTS = Path(__file__).parent / "results" / "plausibility"
SEED = 10_000
RIG: Final = isiw.TapperSettings(accelerometer=True, rate_hz=3000.0)
IN_TIME = 4
RIG_TRIALS = 12

Slip = Callable[[float, float], tuple[float, float]]

SLIPS: Final[Mapping[str, Slip]] = {
    "V told as mV": lambda isi_ms, mep_mv: (isi_ms, mep_mv / 1e3),
    "µV told as mV": lambda isi_ms, mep_mv: (isi_ms, mep_mv * 1e3),
    "seconds for milliseconds": lambda isi_ms, mep_mv: (isi_ms / 1e3, mep_mv),
    "swapped arguments": lambda isi_ms, mep_mv: (mep_mv, isi_ms),
}

COHORTS: Final = ("gaussian", "recruitment", "outliers", "drift", "nonresponder")
SCALED: Final = (("gaussian", 10.0), ("gaussian", 1 / 3), ("recruitment", 10.0), ("recruitment", 1 / 3))


@dataclass(frozen=True)
class Told:
    """How one session went.

    Args:
        trials: after how many trials it was refused or flagged; None where it never was.
        words: by what words.
    """

    trials: int | None
    words: str = ""


def session(
    cohort: str, person: int, trials: int, slip: Slip | None = None, scale: float = 1.0, particles: int | None = None
) -> Told:
    """Ask and tell so many trials, or until one is refused or flagged.

    Args:
        cohort: a named cohort.
        person: which person of it.
        trials: how many trials.
        slip: what is done to an ISI [ms] and an amplitude [mV] before they are told.
        scale: factor on all amplitudes.
        particles: of the strategy; its default where None.
    """
    settings = {} if particles is None else {"particles": particles}
    strategy = isiw.make_strategy("default", seed=person, **settings)
    responder = isiw.subjects.cohort(cohort, person + 1, SEED)[person].begin(person)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ImplausibleDataWarning)
        for trial in range(trials):
            outcome = responder.respond(strategy.ask(), "valve")
            told = (outcome.isi_ms, scale * outcome.mep_mv)
            try:
                strategy.tell(*(told if slip is None else slip(*told)))
            except (InvalidValueError, ImplausibleDataWarning) as words:
                return Told(trial + 1, str(words))
    return Told(None)


def slips(people: int, particles: int | None = None) -> dict[str, list[Told]]:
    """Sessions of each slip, person after person through the cohorts.

    Args:
        people: how many of each.
        particles: as for `session`.
    """
    return {
        name: [
            session(COHORTS[person % len(COHORTS)], person, IN_TIME, slip, particles=particles)
            for person in range(people)
        ]
        for name, slip in SLIPS.items()
    }


def right(people: int, trials: int, particles: int | None = None) -> dict[str, list[Told]]:
    """Sessions of right data.

    Args:
        people: how many of each kind.
        trials: how many trials each.
        particles: as for `session`.
    """
    kinds = [*((cohort, 1.0) for cohort in COHORTS), *SCALED]
    return {
        f"{cohort} × {scale:.3g}": [
            session(cohort, person, trials, scale=scale, particles=particles) for person in range(people)
        ]
        for cohort, scale in kinds
    }


def right_rig(sessions: int, trials: int) -> int:
    """How many sessions with the tapping robot, raw sweeps and all, are paused or doubted although nothing is wrong.

    Args:
        sessions: how many, each with another person.
        trials: how many trials each.
    """
    space = isiw.DesignSpace(0, 320, reference="impact")
    people = isiw.subjects.cohort("gaussian", sessions, SEED)
    accused = 0
    with tempfile.TemporaryDirectory() as folder:
        for number, person in enumerate(people):
            respond = partial(person.begin(number).respond, reference="impact")
            device = isiw.SimulatedDevice(isiw.Tapper(respond, "subject1", RIG, seed=number))
            strategy = isiw.make_strategy("default", space, seed=number, particles=200, max_trials=trials)
            result = isiw.Session(device, strategy, log=Path(folder) / f"{number}.mcap").run(progress=False)
            kinds = {event.kind for event in isiw.read_session(result.log).events}
            accused += not result.decision.stop or bool(kinds & {"pause", "doubt"})
    return accused


def report(slipped: Mapping[str, list[Told]], as_it_is: Mapping[str, list[Told]], trials: int, command: str) -> str:
    """The tables as Markdown.

    Args:
        slipped: sessions by slip.
        as_it_is: sessions of right data, by kind.
        trials: how long those were.
        command: what made them.
    """
    lines = ["# Slips of unit and order, and right data", "", f"`{command}`", ""]
    lines += ["| slip | refused or flagged within four trials | at the latest after |", "|---|---|---|"]
    for name, sessions in slipped.items():
        caught = [told.trials for told in sessions if told.trials is not None]
        lines.append(f"| {name} | {len(caught)} of {len(sessions)} | {max(caught, default=0)} trials |")
    everyone = [told for sessions in slipped.values() for told in sessions]
    lines += [f"| all | {sum(told.trials is not None for told in everyone)} of {len(everyone)} | |", ""]
    lines += [f"| right data, {trials} trials each | refused or flagged |", "|---|---|"]
    for name, sessions in as_it_is.items():
        lines.append(f"| {name} | {sum(told.trials is not None for told in sessions)} of {len(sessions)} |")
    everyone = [told for sessions in as_it_is.values() for told in sessions]
    lines.append(f"| all | {sum(told.trials is not None for told in everyone)} of {len(everyone)} |")
    return "\n".join((*lines, ""))


def main() -> None:
    """Run all sessions, and write the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=30, help="people of each kind of right data")
    parser.add_argument("--trials", type=int, default=40, help="trials of each session of right data")
    parser.add_argument("--rigs", type=int, default=200, help="sessions of the right robot")
    parser.add_argument("--out", type=Path, default=RESULTS, help="path of the report, without suffix")
    parser.add_argument("--isis", action="store_true", help="realised ISIs alone, of right rigs and wrong loops")
    parser.add_argument("--sessions", type=int, default=1000, help="with --isis, sessions of each rig and loop")
    given = parser.parse_args()
    if given.isis:
        out = RESULTS.with_name("plausibility_isis") if given.out == RESULTS else given.out
        text = isis_report(given.sessions, given.trials, command_of("plausibility"))
        out.with_suffix(".md").write_text(text, encoding="utf-8")
        print(text)
        return
    accused = right_rig(given.rigs, RIG_TRIALS)
    rigs = f"The right robot, {RIG_TRIALS} trials with raw sweeps: paused or doubted in {accused} of {given.rigs}.\n"
    told = report(slips(12), right(given.people, given.trials), given.trials, command_of("plausibility"))
    text = f"{told}\n{rigs}"
    given.out.with_suffix(".md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    understood("plausibility")
    main()
