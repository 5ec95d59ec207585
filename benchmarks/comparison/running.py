"""Running the parts of the comparison into a folder, each as a study, and reading what is there.

Recorded people are no cohort of isiw's: their sessions are handed to the same executor, and each unit keeps a file.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import pandas as pd

from benchmarks.comparison.rows import Part
from benchmarks.recorded_people import RecordedPerson, recordings
from benchmarks.tables import kept
from isiw.studies import Failure, Processes, SimulatedSession, Study, Unit, conduct, open_store, run_unit
from isiw.studies.execution import Executor, one_thread
from isiw.subjects import SimulatedSubject

RECORDED: Final = "recorded"
COHORTS: Final = ("recruitment", "gaussian", "kim11-measured", RECORDED)
BESIDE: Final = "nonresponder"
"""People without a window, who are run where they are asked for."""
MARKS: Final = (0, 5, 10, 15, 20, 25, 30, 35, 40, 50, 60)
TIMED: Final = 20
"""Trials of the session that processor time is measured in, at most."""


@dataclass(frozen=True)
class RecordedSession(SimulatedSession):
    """A session with one of the people whose MEPs were recorded."""

    def subject(self) -> SimulatedSubject:
        """The person."""
        return RecordedPerson(self.person, self.seed, recordings()).subject()


@dataclass(frozen=True)
class Plan:
    """How many people and trials there are, and where rows are kept.

    Args:
        folder: where.
        people: people of each cohort.
        trials: pairs a session.
        seed: of people and strategies.
        first: stop after so many people of each row; 0 for all. The rest can be run later.
        executor: where sessions run.
    """

    folder: Path
    people: int
    trials: int
    seed: int
    first: int = 0
    executor: Executor = field(default_factory=Processes)

    def study(self, part: Part, cohort: str) -> Study:
        """The study of a part with one cohort; that of recorded people names another cohort."""
        people = min(self.people, part.people or self.people)
        return Study(
            part.strategies,
            ("recruitment" if cohort == RECORDED else cohort,),
            people,
            self.seed,
            self.trials,
            tuple(mark for mark in MARKS if mark <= self.trials),
            stopping="ignored",
            engine="batched",
            batch=part.batch,
            hit_delay="stated",
        )

    def folder_of(self, part: Part, cohort: str) -> Path:
        """Where the rows of a part and cohort are kept."""
        return self.folder / cohort / part.name


class _Enough(Exception):  # noqa: N818 - no error: it ends a study early
    """The people that were asked for are done."""


def run_part(plan: Plan, part: Part, cohort: str, on_done: Callable[[str], None] = lambda _key: None) -> None:
    """Run what is left of a part with one cohort.

    Args:
        plan: people, trials and folder.
        part: the rows.
        cohort: one of `COHORTS`.
        on_done: called with the name of each unit that is finished.

    Raises:
        SystemExit: a session failed.
    """
    if part.cohorts and cohort not in part.cohorts:
        return
    study = plan.study(part, cohort)
    if cohort == RECORDED:
        _run_recorded(plan, plan.folder_of(part, cohort), study, on_done)
        return
    wanted = {unit.key for unit in _wanted(plan, study.units())}
    wanted -= _finished(plan.folder_of(part, cohort))

    def note(unit: Unit, result: pd.DataFrame | Failure) -> None:
        _require(unit, result)
        on_done(unit.key)
        wanted.discard(unit.key)
        if not wanted:
            raise _Enough

    if wanted:
        try:
            conduct(study, plan.folder_of(part, cohort), plan.executor, retry=True, on_done=note)
        except _Enough:
            return


def _wanted(plan: Plan, units: Sequence[Unit]) -> list[Unit]:
    return [unit for unit in units if not plan.first or unit.sessions[0].person < plan.first]


def _finished(folder: Path) -> set[str]:
    """The units of a study's folder that have rows."""
    rows = open_store(folder).rows() if (folder / "study.toml").is_file() else pd.DataFrame()
    return set(rows["unit"]) if len(rows) else set()


def _require(unit: Unit, result: pd.DataFrame | Failure) -> pd.DataFrame:
    if isinstance(result, Failure):
        raise SystemExit(f"{unit.key} failed: {result.error}\n{result.details}")
    return result


def recorded_units(study: Study) -> list[Unit]:
    """The units of a study with recorded people in the place of its own.

    Args:
        study: of which a unit has sessions whose settings do not depend on the person.
    """
    return [
        Unit(
            unit.key.replace(unit.sessions[0].cohort, RECORDED),
            tuple(_recorded(session) for session in unit.sessions),
            unit.engine,
        )
        for unit in study.units()
    ]


def _recorded(session: SimulatedSession) -> SimulatedSession:
    values = {name: getattr(session, name) for name in SimulatedSession.__dataclass_fields__}
    settings = {key: value for key, value in session.settings if key != "hit_delay_ms"}
    stated = RecordedSession(**{**values, "cohort": RECORDED, "settings": tuple(settings.items())})
    return stated.as_the_rig_states()


def _run_recorded(plan: Plan, folder: Path, study: Study, on_done: Callable[[str], None]) -> None:
    if not recordings().is_dir():
        return
    folder.mkdir(parents=True, exist_ok=True)
    left = [unit for unit in _wanted(plan, recorded_units(study)) if not (folder / f"{unit.key}.parquet").is_file()]
    for unit, result in plan.executor.results(run_unit, left):
        kept(folder / f"{unit.key}.parquet", lambda: _require(unit, result))  # noqa: B023 - it is called at once
        on_done(unit.key)


def rows_of(plan: Plan, every: Sequence[Part]) -> pd.DataFrame:
    """All rows that are there, of all cohorts.

    Args:
        plan: the folder.
        every: the parts.

    Raises:
        SystemExit: there are none.
    """
    read = [_read(plan.folder_of(part, cohort)) for cohort in (*COHORTS, BESIDE) for part in every]
    if not (found := [table for table in read if len(table)]):
        raise SystemExit(f"{plan.folder} has no rows yet.")
    return pd.concat(found, ignore_index=True)


def _read(folder: Path) -> pd.DataFrame:
    if (folder / "study.toml").is_file():
        return open_store(folder).rows()
    files = sorted(folder.glob("*.parquet"))
    return pd.concat(map(pd.read_parquet, files), ignore_index=True) if files else pd.DataFrame()


def processor_ms(plan: Plan, part: Part) -> None:
    """Time each row of a part, one session of one person alone; what was timed before is not timed again."""
    study = Study(part.strategies, ("recruitment",), 1, plan.seed, min(plan.trials, TIMED), (1,), hit_delay="stated")
    folder = plan.folder / "processor"
    folder.mkdir(parents=True, exist_ok=True)
    for unit in study.units():
        (session,) = unit.sessions
        file = folder / f"{session.label}.json"
        if not file.is_file():
            file.write_text(json.dumps(_processor_ms(session)), encoding="utf-8")


def _processor_ms(session: SimulatedSession) -> float:
    """Mean processor time of an `ask` and a `tell` [ms]; the first trial, which loads things, does not count."""
    with one_thread():
        player, responder = session.player(), session.subject().begin(session.seed)
        began_s = 0.0
        for trial in range(session.trials):
            if trial == 1:
                began_s = time.process_time()
            response = responder.respond(player.ask(), session.space.reference)
            player.tell(response.isi_ms, response.mep_mv)
        return 1e3 * (time.process_time() - began_s) / max(1, session.trials - 1)


def timed(plan: Plan) -> dict[str, float]:
    """Processor time of a trial [ms] by row, as far as it was measured."""
    files = (plan.folder / "processor").glob("*.json")
    return {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in files}
