"""Many independent pieces of work in several processes, behind a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import groupby
from typing import Any, TypeVar

import pandas as pd
from joblib import Parallel, delayed
from rich.console import Console
from rich.progress import track

from benchmarks.reduction.sessions import Session, run

__all__ = ["Outcomes", "frame", "in_parallel", "run_sessions"]

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

Outcomes = dict[Session, dict[str, Any]]
"""What sessions came to; see `sessions.run`."""


def in_parallel(
    function: Callable[[_Item], _Result], items: Sequence[_Item], workers: int, label: str
) -> list[_Result]:
    """Results in the order of the items.

    Args:
        function: what to do with each; importable.
        items: the pieces of work.
        workers: how many processes.
        label: of the progress bar.
    """
    done = Parallel(n_jobs=workers, return_as="generator")(delayed(function)(item) for item in items)
    return list(track(done, label, len(items), console=Console(stderr=True)))


def run_sessions(sessions: Iterable[Session], workers: int) -> Outcomes:
    """Run each different session once; those of one person share the recorded sweep."""
    unique = sorted(set(sessions), key=_of_person)
    people = [list(group) for _, group in groupby(unique, key=_of_person)]
    results = in_parallel(_run_person, people, workers, "people's sessions")
    return {
        session: result
        for group, rows in zip(people, results, strict=True)
        for session, result in zip(group, rows, strict=True)
    }


def _of_person(session: Session) -> tuple[str, int, int]:
    return session.cohort, session.person, session.seed


def _run_person(sessions: list[Session]) -> list[dict[str, Any]]:
    return [run(session) for session in sessions]


def frame(sessions: Iterable[Session], outcomes: Outcomes) -> pd.DataFrame:
    """One row a session: its fields and its outcome."""
    rows = [vars(session) | dict(session.settings) | outcomes[session] for session in sessions]
    return pd.DataFrame(rows)
