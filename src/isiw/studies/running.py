"""Running a study into its folder, continuing it, and running one of its units once more."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError, StudyError
from isiw.lazy import pd
from isiw.studies.execution import Executor, Failure, Processes
from isiw.studies.plan import Study, Unit, run_unit
from isiw.studies.sessions import TIMES, SimulatedSession, simulate
from isiw.studies.store import Store, begin_store, code_checksum


def conduct(
    study: Study,
    folder: str | Path,
    executor: Executor | None = None,
    *,
    retry: bool = False,
    on_done: Callable[[Unit, pd.DataFrame | Failure], None] = lambda _unit, _result: None,
) -> Store:
    """Run what is left of a study.

    Args:
        study: the study.
        folder: where its parts are kept; what is finished there already is not run again.
        executor: where the work is done; by default in this process.
        retry: run the units that failed once more.
        on_done: called after each unit, once it is kept.

    Raises:
        InvalidValueError: something else than an executor.
        StudyError: a folder of another study, of other code, in use, or not writable, or a lost executor.
    """
    if executor is not None and not callable(getattr(executor, "results", None)):
        raise InvalidValueError("no executor", got=executor, expected="Processes(workers), or a DaskCluster")
    if unnamed := [each.label for each in study.strategies if each.own is not None and not each.own.reference]:
        raise StudyError(
            f"{', '.join(unnamed)}: code of your own, which the folder of a study does not name",
            remedy="Run the STUDY.toml that names it, with --out and this folder.",
        )
    store, run = begin_store(study, folder), partial(_run_with, code_checksum())
    with store.locked():
        if left := store.left(retry=retry):
            store.require_same_code()
        # Closed at once if it is interrupted, so that no worker goes on in vain.
        with closing((executor or Processes()).results(run, left)) as results:
            for unit, result in results:
                store.keep(unit, result)
                on_done(unit, result)
    return store


def _run_with(code: str, unit: Unit) -> pd.DataFrame:
    """Run a unit, where it is handed to, with the code of the process that hands it out."""
    if code_checksum() != code:
        raise StudyError(
            "the worker has other code of isiw than the process that runs the study",
            got=code_checksum(),
            expected=code,
            remedy="Install the same isiw for all workers, then run the study again with --retry.",
        )
    return run_unit(unit)


@dataclass(frozen=True, eq=False)
class Replay:
    """A unit that was run once more.

    Args:
        kept: its rows in the study.
        again: its rows now.
        differing: the columns that differ; those that measure time never count.
    """

    kept: pd.DataFrame
    again: pd.DataFrame
    differing: tuple[str, ...]


def replay(store: Store, key: str, person: int | None = None) -> Replay:
    """Run a unit of a study once more, here and alone.

    Args:
        store: the study.
        key: the unit; a batch runs as a whole, because its people share the draws of the model.
        person: compare the rows of this person only.

    Raises:
        StudyError: there is no such unit, it is not finished, or the person is not in it.
    """
    unit, rows = store.unit(key), store.rows()
    kept = rows[rows["unit"] == key] if len(rows) else rows
    if not len(kept):
        raise StudyError("the unit is not finished", got=key, remedy="Continue the study, and see its errors.")
    again = run_unit(unit)
    if person is not None:
        kept, again = (table[table["person"] == person] for table in (kept, again))
    if not len(kept):
        raise StudyError("the person is not in the unit", got=person)
    kept, again = kept.reset_index(drop=True), again.reset_index(drop=True)
    same = (kept == again) | (kept.isna() & again.isna())
    return Replay(kept, again, tuple(name for name in kept.columns if name not in TIMES and not same[name].all()))


def unit_of_row(store: Store, row: int) -> tuple[str, int]:
    """The unit and the person of a row of `store.rows()`, by its number."""
    rows = store.rows()
    if not 0 <= row < len(rows):
        raise StudyError("the study has no such row", got=row, expected=f"0 to {len(rows) - 1}")
    return str(rows["unit"].iloc[row]), int(rows["person"].iloc[row])


def run_study(
    sessions: Sequence[SimulatedSession],
    *,
    workers: int = 1,
    run: Callable[[SimulatedSession], pd.DataFrame] = simulate,
    on_done: Callable[[SimulatedSession, pd.DataFrame], None] = lambda _session, _rows: None,
) -> pd.DataFrame:
    """Run sessions to one table, without a folder. One that fails ends none of the others.

    Args:
        sessions: the sessions.
        workers: how many processes; 1 runs them here.
        run: runs one session; importable if it is to run in another process.
        on_done: called after each session with its rows, for progress, and to keep them.

    Returns:
        One row a mark of each session, sorted, with the :doc:`columns </studies>` of a study but `unit` and `code`.

    Raises:
        InvalidValueError: no sessions, or fewer than one worker.
        StudyError: sessions failed, once the others are done, or `run` gave no rows of one.
    """
    if not sessions:
        raise InvalidValueError("a study needs sessions", got=sessions, remedy="paired_sessions(...) makes some.")
    keys = ["strategy", "cohort", "person", "trial"]
    tables, failed = list[pd.DataFrame](), list[tuple[SimulatedSession, Failure]]()
    for session, result in Processes(workers).results(run, sessions):
        if isinstance(result, Failure):
            failed.append((session, result))
            continue
        if not (isinstance(result, pd.DataFrame) and {*keys} <= {*result.columns}):
            raise StudyError(
                "what runs a session gave no rows of it",
                got=type(result).__name__,
                expected=f"a table with {', '.join(keys)}",
                remedy="Return what play(session, player) gives.",
            )
        tables.append(result)
        on_done(session, result)
    if failed:
        session, first = failed[0]
        raise StudyError(
            f"{len(failed)} of {len(sessions)} sessions failed, the first with: {first.error}",
            got=session,
            remedy=f"on_done was given the rows of the others. {first.details}",
        )
    return pd.concat(tables, ignore_index=True).sort_values(keys, ignore_index=True)


def paired_sessions(
    strategies: Iterable[str],
    cohorts: Iterable[str],
    people: int,
    *,
    seed: int,
    trials: int,
    marks: tuple[int, ...],
    space: DesignSpace = VALVE_SPACE,
) -> list[SimulatedSession]:
    """Every strategy with the same people of every cohort.

    Args:
        strategies: names of strategies.
        cohorts: names of cohorts.
        people: how many of each cohort.
        seed: of the people and the trials.
        trials: how many stimuli each session has.
        marks: after which trials it is looked at.
        space: the ISIs that may be asked.
    """
    return [
        SimulatedSession(strategy, name, person, seed, trials, marks, space)
        for strategy, name, person in itertools.product(strategies, cohorts, range(people))
    ]
