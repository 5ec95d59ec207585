"""How often each sentence is said of sessions in which nothing is wrong, and whether a change of amplitudes is seen.

    python -m benchmarks.said --only 1                # to 4: each quarter within ten minutes of one processor core
    python -m benchmarks.said > benchmarks/results/said.md

Sessions of the default with simulated people run until the default stops, as `isiw run` runs them but without a log on
the disk. The people of `RIGHT` are steady and their rigs right, so that every warning is a false one. In those of
`CHANGED` all that is evoked grows or shrinks during the session, by the factor of their cohort or by its square.
Sessions are kept in a folder as they finish, and the sentences are made of them afterwards: both tests of a change get
the same sessions. Reported people have seeds from 10,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import json
import math
import statistics
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import pandas as pd
import scipy.stats
import torch
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.devices.simulated import SimulatedPerson
from isiw.log.record import SessionRecord
from isiw.log.schema import EstimateRecord, Event
from isiw.report.evidence import ENOUGH_ON_EACH_SIDE, changed_with_time
from isiw.report.words import Role, Said, in_lines, statement
from isiw.session.examination import recorded
from isiw.session.loop import Session
from isiw.signals.plausible import Doubts, counted_of
from isiw.signals.rig import Evidence
from isiw.signals.watch import findings
from isiw.subjects.cohorts import person_of
from isiw.subjects.subject import SimulatedSubject
from isiw.trials import Status, Trial, TrialTable
from isiw.types import FloatArray
from isiw.window import Window

RIGHT: Final = {
    "recruitment": 300, "gaussian": 200, "nonresponder": 100, "weak": 100, "late": 100, "plateau": 100,
    "kim11-measured": 100,
}  # fmt: skip
SQUARED: Final = " squared"
CHANGED: Final = {"ramp": 200, "step": 120, f"ramp{SQUARED}": 200, f"step{SQUARED}": 200}
"""How many people of each cohort, of a thousand right sessions."""

QUARTERS: Final = 4

MOST_WORDS: Final = 90


def person(cohort: str, seed: int) -> SimulatedSubject:
    """The first person of a cohort, whose change may be larger than the cohort's."""
    subject = person_of(cohort.removesuffix(SQUARED), 0, seed)
    if not cohort.endswith(SQUARED) or subject.change is None:
        return subject
    return replace(subject, change=replace(subject.change, log_gain=2.0 * subject.change.log_gain))


def session(cohort: str, seed: int) -> dict[str, Any]:
    """One session until it stops: its trials, its last estimate, and what was doubtful on the way."""
    subject, space = person(cohort, seed), isiw.VALVE_SPACE
    responder, strategy = (
        subject.begin(seed),
        isiw.make_strategy(space=space, seed=seed, hit_delay_ms=subject.stated_hit_delay_ms),
    )
    trials, doubts, raised = TrialTable(), Doubts(), list[tuple[int, str]]()
    while not strategy.decision().stop:
        asked_ms = strategy.ask()
        outcome = responder.respond(asked_ms, space.reference)
        trial = Trial(len(trials), Status.ACCEPTED, asked_ms, isi_ms=outcome.isi_ms, mep_mv=outcome.mep_mv)
        trials = trials.appended(trial)
        strategy.learn(trial)
        doubts = doubts.after(
            findings(Evidence(told=counted_of(trials), detection_limit_mv=strategy.detection_limit_mv))
        )
        raised += [] if doubts.new is None else [(trial.index, f"{doubts.new}")]
    last = recorded(strategy.estimate(), len(trials) - 1, strategy.decision(), None)
    return {
        "cohort": cohort,
        "seed": seed,
        "isi_ms": [trial.isi_ms for trial in trials],
        "mep_mv": [trial.mep_mv for trial in trials],
        "estimate": last.model_dump_json(),
        "doubts": raised,
    }


def record_of(kept: dict[str, Any], like: SessionRecord) -> SessionRecord:
    """A kept session as its log would hold it, with the header of another one."""
    pairs = enumerate(zip(kept["isi_ms"], kept["mep_mv"], strict=True))
    trials = [Trial(k, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=mep_mv) for k, (isi_ms, mep_mv) in pairs]
    events = [Event(kind="doubt", trial=trial, text=text) for trial, text in kept["doubts"]]
    estimate = EstimateRecord.model_validate_json(kept["estimate"])
    return SessionRecord(like.path, like.header, (*trials, *events, estimate), losses=(), finished=True)


def empty_record(folder: Path) -> SessionRecord:
    """A session of `isiw run` before its first trial."""
    person = SimulatedPerson(lambda _: None, "valve")  # type: ignore[arg-type, return-value]  # nobody is stimulated
    strategy = isiw.make_strategy(seed=0, hit_delay_ms=(150.0, 5.0))
    opened = Session(isiw.SimulatedDevice(person), strategy, log=folder / "none.mcap")
    return SessionRecord(opened.log_path, opened.header, (), losses=(), finished=True)


def run_all(folder: Path, seed: int, share: float, quarter: int | None) -> Iterator[dict[str, Any]]:
    """All sessions or a quarter of them, of which those that are kept are not run again."""
    folder.mkdir(parents=True, exist_ok=True)
    wanted = [(cohort, seed + k) for cohort, n in (RIGHT | CHANGED).items() for k in range(math.ceil(share * n))]
    for cohort, number in wanted if quarter is None else wanted[quarter - 1 :: QUARTERS]:
        file = folder / f"{cohort.replace(' ', '-')}-{number}.json"
        if not file.is_file():
            file.write_text(json.dumps(session(cohort, number)), encoding="utf-8")
        yield json.loads(file.read_text(encoding="utf-8"))


def changed_before(window: Window | None, trials: TrialTable) -> bool:
    """Whether the test of before says a change: Kendall's on each side of the window by Stouffer, whatever the ISIs."""
    if window is None:
        return False
    meps_mv = np.array([trial.mep_mv for trial in trials])
    inside = np.array(window.mask([trial.isi_ms or 0.0 for trial in trials]))
    sides = [meps_mv[inside], meps_mv[~inside]]
    if min(len(set(side.tolist())) for side in sides) < ENOUGH_ON_EACH_SIDE:
        return False
    n = np.array([len(side) for side in sides])
    for sign in (1.0, -1.0):
        found = np.array([_growth_before(sign * side) for side in sides])
        both = float(np.sqrt(n) @ found) / math.sqrt(n.sum())
        if scipy.stats.norm.sf(both) < 0.00135 and scipy.stats.norm.sf(found.min()) < 0.05:
            return True
    return False


def _growth_before(meps_mv: FloatArray) -> float:
    """Kendall's statistic of amplitude against order [standard errors], corrected for ties and for continuity."""
    n, tied = len(meps_mv), np.unique(meps_mv, return_counts=True)[1].astype(float)
    larger_later = float(np.triu(np.sign(np.subtract.outer(meps_mv, meps_mv)).T).sum())
    variance = (n * (n - 1) * (2 * n + 5) - float((tied * (tied - 1) * (2 * tied + 5)).sum())) / 18
    return (larger_later - 1) / math.sqrt(variance)


def bound(count: int, n: int) -> float:
    """The upper end of the exact 95 % interval of a share."""
    return float(scipy.stats.beta.ppf(0.975, count + 1, n - count)) if count < n else 1.0


def row(name: str, count: int, n: int) -> dict[str, object]:
    """A row of a table of rates."""
    return {"what": name, "sessions": count, "of": n, "rate": f"{count / n:.1%}", "at most": f"{bound(count, n):.1%}"}


def compared(name: str, found: list[tuple[bool, bool]]) -> dict[str, object]:
    """A row of the table of both tests, which are given the same sessions."""
    n, now, before = len(found), sum(now for now, _ in found), sum(before for _, before in found)
    alone = {"now alone": sum(a and not b for a, b in found), "before alone": sum(b and not a for a, b in found)}
    rates = {
        test: f"{count / n:.1%} (at most {bound(count, n):.1%})" for test, count in (("now", now), ("before", before))
    }
    return {"what": name, "of": n, **rates, **alone}


def words(said: list[Said]) -> int:
    """How many words a statement has."""
    return len(in_lines(said).split())


def main(
    seed: Annotated[int, typer.Option(help="Seed of the first person of each cohort.")] = 10_000,
    share: Annotated[float, typer.Option(help="Share of the people of each cohort who are run.")] = 1.0,
    folder: Annotated[Path, typer.Option(help="Where sessions are kept.")] = Path("said"),
    only: Annotated[int | None, typer.Option(min=1, max=QUARTERS, help="A quarter, run and not reported.")] = None,
) -> None:
    """Run the sessions that are not there yet, and print how often each sentence was said."""
    torch.set_num_threads(1)
    like, all_said = empty_record(folder), list[tuple[str, list[Said], bool, bool]]()
    for kept in run_all(folder, seed, share, only):
        if only is None:
            record = record_of(kept, like)
            estimate, told = record.estimates[-1], record.table.told
            expected = (estimate.grid_ms, estimate.profile_mv) if estimate.profile_mv else None
            now = changed_with_time(estimate.window, told, expected) is not None
            all_said.append((kept["cohort"], statement(record), now, changed_before(estimate.window, record.table)))
    if only is not None:
        return
    right = [one for one in all_said if one[0] in RIGHT]
    n, lengths = len(right), [words(said) for _, said, _, _ in right]
    print("# What is said of sessions in which nothing is wrong\n")
    print(f"- command: `{command_of('said')}`; {made_with('torch')}")
    print(f"- {n} sessions of {', '.join(RIGHT)}; `at most` is the upper end of the exact 95 % interval")
    print(f"- people: one of each seed from {seed} on in each cohort\n")
    counts = Counter(name for _, said, _, _ in right for name in {(f"{one.role}", one.name) for one in said})
    roles = [f"{role}" for role in Role]
    ordered = sorted(counts.items(), key=lambda one: (roles.index(one[0][0]), -one[1]))
    rows = [row(": ".join(name), count, n) for name, count in ordered]
    warned = sum(any(one.role is Role.WARNING for one in said) for _, said, _, _ in right)
    rows.append(row("any warning", warned, n))
    rows.append(row(f"at most {MOST_WORDS} words", sum(length <= MOST_WORDS for length in lengths), n))
    print(pd.DataFrame(rows).to_markdown(index=False))
    print(f"\nWords: {statistics.median(lengths):.0f} (median), {max(lengths)} at most.\n")
    print("Amplitudes are said to have grown or shrunk, of the same sessions by the test now and by that of before:\n")
    groups = {"right": tuple(RIGHT), **{cohort: (cohort,) for cohort in CHANGED}}
    rows = [
        compared(name, [(one[2], one[3]) for one in all_said if one[0] in cohorts]) for name, cohorts in groups.items()
    ]
    print(pd.DataFrame(rows).to_markdown(index=False))


if __name__ == "__main__":
    understood("said", prints=True)
    typer.run(main)
