"""Running the parts of the comparison, each as a study whose units keep a file each, and reading what is there.

What is needed of the rows stands beside the tables, in one small file that another computer continues from.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Final

import pandas as pd

from benchmarks.comparison.rows import EVEN, Part
from benchmarks.recorded_people import RecordedPerson, recordings
from benchmarks.tables import kept
from isiw.studies import Failure, Processes, SimulatedSession, Study, Unit, run_unit
from isiw.studies.execution import Executor, one_thread
from isiw.subjects import SimulatedSubject

RECORDED: Final = "recorded"
COHORTS: Final = ("recruitment", "gaussian", "kim11-measured", RECORDED)
BESIDE: Final = "nonresponder"
"""People without a window, who are run where they are asked for."""
MARKS: Final = (0, 5, 10, 15, 20, 25, 30, 35, 40, 50, 60)
OF_ROW: Final = ["cohort", "strategy", "person", "trial"]
ANSWERED: Final = ["true_window", "answered", "reported_window", "start_covered", "end_covered"]
KEPT: Final = [*OF_ROW, "seed", "unit", "f1", "expected_f1", *ANSWERED]
"""Columns of a study that the tables need."""

DECIMALS: Final = 4
"""Of what is kept."""

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
        out: path of the results, without suffix.
        people: people of each cohort.
        trials: pairs a session.
        seed: of people and strategies.
        first: stop after so many people of each row; 0 for all. The rest can be run later.
        executor: where sessions run.
    """

    out: Path
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

    @property
    def folder(self) -> Path:
        """Where the units of this computer are."""
        return self.out.with_suffix(".rows")

    @property
    def file(self) -> Path:
        """Where the rows of all computers are kept, with the processor time of each strategy."""
        return self.out.with_suffix(".parquet")

    @cached_property
    def kept(self) -> pd.DataFrame:
        """What was there before."""
        if not self.file.is_file():
            return pd.DataFrame(columns=[*KEPT, "processor_ms"])
        return pd.read_parquet(self.file)

    def wants(self, unit: Unit) -> bool:
        """Whether a unit is of the first people."""
        return not self.first or unit.sessions[0].person < self.first


def run_part(plan: Plan, part: Part, cohort: str, on_done: Callable[[str], None] = lambda _key: None) -> None:
    """Run what is left of a part with one cohort.

    Args:
        plan: people, trials and folder.
        part: the rows.
        cohort: one of `COHORTS`; recorded people are left out where their recordings are not at hand.
        on_done: called with the name of each unit that is finished.

    Raises:
        SystemExit: a session failed.
    """
    if (part.cohorts and cohort not in part.cohorts) or (cohort == RECORDED and not recordings().is_dir()):
        return
    study, folder = plan.study(part, cohort), plan.folder / cohort / part.name
    units = recorded_units(study) if cohort == RECORDED else study.units()
    there = set(plan.kept["unit"]) | {path.stem for path in folder.glob("*.parquet")}
    left = [unit for unit in units if unit.key not in there and plan.wants(unit)]
    for unit, result in plan.executor.results(run_unit, left):
        kept(folder / f"{unit.key}.parquet", lambda: _require(unit, result))  # noqa: B023 - it is called at once
        on_done(unit.key)


def _require(unit: Unit, result: pd.DataFrame | Failure) -> pd.DataFrame:
    if isinstance(result, Failure):
        raise SystemExit(f"{unit.key} failed: {result.error}\n{result.details}")
    return result


def require_same(plan: Plan, part: Part) -> None:
    """Require that isiw still comes to what was kept: the first people at even ISIs are examined again.

    ISIs that are chosen may differ between processors, where two are as good; even ones are the same everywhere.

    Args:
        plan: with what was kept.
        part: the one with even ISIs.

    Raises:
        SystemExit: it does not.
    """
    before = plan.kept[(plan.kept["strategy"] == EVEN) & (plan.kept["cohort"] != RECORDED)]
    if before.empty:
        return
    cohort = str(before["cohort"].iloc[0])
    unit = next(unit for unit in plan.study(part, cohort).units() if unit.sessions[0].label == EVEN)
    both = run_unit(unit).round(DECIMALS).merge(before[before["cohort"] == cohort], on=[*OF_ROW, "seed"])
    if both.empty or before["trial"].max() != plan.trials or (both["f1_x"] != both["f1_y"]).any():
        raise SystemExit(f"{plan.file} is of another comparison, or isiw comes to other answers now: use another --out")


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


def rows_of(plan: Plan) -> pd.DataFrame:
    """All rows that are there, of all cohorts: those that were kept, and those of the folder.

    Args:
        plan: where.

    Raises:
        SystemExit: there are none.
    """
    files = sorted(plan.folder.glob("*/*/*.parquet"))
    tables = [plan.kept[KEPT], *(pd.read_parquet(path, columns=KEPT) for path in files)]
    if not (found := [table for table in tables if len(table)]):
        raise SystemExit(f"{plan.out} has no rows yet.")
    rows = pd.concat(found, ignore_index=True).drop_duplicates(OF_ROW).sort_values(OF_ROW, ignore_index=True)
    return rows.round(DECIMALS)


def keep(plan: Plan, rows: pd.DataFrame) -> None:
    """Keep all rows, and the processor time of each strategy, for whoever continues.

    Args:
        plan: where.
        rows: what `rows_of` gives.
    """
    every = rows.assign(processor_ms=rows["strategy"].map(timed(plan)))
    every.to_parquet(plan.file, index=False, compression="zstd")


def as_study(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows that were kept with the other columns of a study, as far as they are known.

    Args:
        rows: what `rows_of` gives.
    """
    unknown = ("stop_trial", "stop_f1", "converged", "ask_ms", "tell_ms")
    return rows.assign(delivered=rows["trial"], **dict.fromkeys(unknown, math.nan))


def processor_ms(plan: Plan, part: Part) -> None:
    """Time each row of a part, one session of one person alone; what was timed before is not timed again.

    Args:
        plan: where times are kept.
        part: the rows.
    """
    study = Study(part.strategies, ("recruitment",), 1, plan.seed, min(plan.trials, TIMED), (1,), hit_delay="stated")
    folder = plan.folder / "processor"
    folder.mkdir(parents=True, exist_ok=True)
    before = timed(plan)
    for unit in study.units():
        (session,) = unit.sessions
        if session.label not in before:
            file = folder / f"{session.label}.json"
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
    """Processor time of a trial [ms] by row, as far as it was measured, here or by whoever kept rows."""
    before = plan.kept.groupby("strategy")["processor_ms"].first().dropna().to_dict()
    files = (plan.folder / "processor").glob("*.json")
    return before | {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in files}
