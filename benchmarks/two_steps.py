"""What a session below the motor threshold is worth to the search above it.

    python -m benchmarks.two_steps --people 24 --out benchmarks/results/two_steps

The people are those of `supra-threshold`. Each is examined at 120 % RMT without a first step, and after 20 stimuli at
90 % RMT, whose window is used. Every tenth stimulus is TMS alone. The trials above the threshold have the same noise
in both. Reported people come from seed 160,000 on; seeds below
1,000 are for work.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Final, cast

import pandas as pd
import torch
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.log.record import SessionRecord
from isiw.metrics import f1
from isiw.strategy.strategy import Strategy
from isiw.subjects.responses import RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from isiw.trials import Trial

SPACE: Final = isiw.DesignSpace(0, 120, reference="impact")
FIRST_SPACE: Final = isiw.DesignSpace(10, 120, reference="impact")
BELOW_PCT_RMT: Final = 90.0
FIRST: Final = 20
MARKS: Final = 10, 20, 40
ALONE_EVERY: Final = 10


def below(person: SimulatedSubject) -> SimulatedSubject:
    """The same person at a pulse below the threshold."""
    response = cast("RecruitmentResponse", person.response)
    return replace(person, response=replace(response, intensity_pct_rmt=BELOW_PCT_RMT))


def is_alone(trial: int) -> bool:
    """Whether a trial is TMS alone."""
    return trial % ALONE_EVERY == ALONE_EVERY - 1


def first_step(person: SimulatedSubject, seed: int, log: Path) -> tuple[SessionRecord, float]:
    """The log of a session below the threshold, and the F1 of its window."""
    subject = below(person)
    strategy, rig = (
        isiw.make_strategy("default", FIRST_SPACE, seed, intensity_pct_rmt=BELOW_PCT_RMT),
        subject.begin(seed),
    )
    visit = isiw.Visit(intensity_pct_rmt=BELOW_PCT_RMT)
    with isiw.open_session(strategy, log=log, subject=f"P{seed}", visit=visit) as session:
        for trial in range(FIRST):
            outcome = rig.respond(None if is_alone(trial) else session.ask(), SPACE.reference)
            session.tell(outcome.isi_ms, outcome.mep_mv)
    return isiw.read_session(log), f1(strategy.estimate(), subject.window(FIRST_SPACE), FIRST_SPACE)


def second_step(person: SimulatedSubject, seed: int, strategy: Strategy) -> dict[str, float]:
    """The F1 of both segments after each of `MARKS` stimuli."""
    rig, found = person.begin(100_000_000 + seed), dict[str, float]()
    for trial in range(MARKS[-1]):
        outcome = rig.respond(None if is_alone(trial) else strategy.ask(), SPACE.reference)
        strategy.learn(Trial.of(outcome.isi_ms, outcome.mep_mv))
        if trial + 1 in MARKS:
            estimate = strategy.estimate()
            found[f"enhanced {trial + 1}"] = f1(estimate.window, person.window(SPACE), SPACE)
            found[f"depressed {trial + 1}"] = f1(estimate.depressed, person.depressed(SPACE), SPACE)
    return found


def of_person(person: SimulatedSubject, seed: int) -> list[dict[str, object]]:
    """A row for each way into the search above the threshold."""
    with TemporaryDirectory() as folder:
        record, first_f1 = first_step(person, seed, Path(folder) / "below.mcap")
        priors = {"nothing": None, "the window": isiw.priors.above(record)}
    rows: list[dict[str, object]] = []
    for way, prior in priors.items():
        more = {} if prior is None else {"prior": prior}
        strategy = isiw.make_strategy("supra-threshold", SPACE, seed, **more)
        rows.append({"used": way, "person": seed, "first step": first_f1, **second_step(person, seed, strategy)})
    return rows


def report(table: pd.DataFrame) -> str:
    """Means and gains over nothing used, with standard errors."""
    usual = table[table["used"] == "nothing"].set_index("person")
    names = [f"{kind} {mark}" for kind in ("enhanced", "depressed") for mark in MARKS]
    lines = []
    for way, rows in table.groupby("used", sort=False):
        line: dict[str, object] = {"used": way}
        for name in names:
            gain = rows.set_index("person")[name] - usual[name]
            line[name] = f"{rows[name].mean():.2f}" + (
                "" if way == "nothing" else f" ({gain.mean():+.3f}, SE {gain.sem():.3f})"
            )
        lines.append(line)
    return str(pd.DataFrame(lines).to_markdown(index=False))


def main(
    people: Annotated[int, typer.Option(help="People.")] = 24,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 160_000,
    out: Annotated[Path | None, typer.Option(help="Path of the result, without suffix.")] = None,
) -> None:
    """Print what a first step is worth, and write it where it is wanted."""
    torch.set_num_threads(1)
    persons = isiw.subjects.cohort("supra-threshold", people, seed)
    table = pd.DataFrame([row for n, person in enumerate(persons) for row in of_person(person, seed + n)])
    first = table[table["used"] == "nothing"]["first step"]
    shown = f"{first.mean():.2f} (SE {first.sem():.2f})"
    said = f"""\
# The search above the threshold after one below it

- command: `{command_of("two_steps")}`; {people} people of `supra-threshold`, seed {seed:,}
- {made_with("torch")}
- F1 of the first step's window after {FIRST} stimuli at {BELOW_PCT_RMT:g} % RMT: {shown}

F1 after so many stimuli above the threshold, and how much more it is than with nothing used.

{report(table)}
"""
    print(said)
    if out is not None:
        out.with_suffix(".md").write_text(said)


if __name__ == "__main__":
    understood("two_steps")
    typer.run(main)
