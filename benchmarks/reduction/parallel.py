"""Many independent pieces of work in several processes, behind a progress bar."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd
from joblib import Memory, Parallel, delayed
from rich.console import Console
from rich.progress import track

from benchmarks.reduction.sessions import Session, run

__all__ = ["Outcomes", "Workers", "frame", "in_parallel", "run_sessions"]

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

Outcomes = dict[Session, dict[str, Any]]
"""What sessions came to; see `sessions.run`."""


@dataclass(frozen=True)
class Workers:
    """Who does the work.

    Args:
        processes: how many.
        kept: folder where results are kept, from which a run that was interrupted goes on.
    """

    processes: int
    kept: Path


def in_parallel(
    function: Callable[[_Item], _Result], items: Sequence[_Item], workers: Workers, label: str
) -> list[_Result]:
    """Results in the order of the items.

    Args:
        function: what to do with each; importable.
        items: the pieces of work.
        workers: who does it.
        label: of the progress bar.
    """
    remembered = Memory(workers.kept, verbose=0).cache(function)
    done = Parallel(n_jobs=workers.processes, return_as="generator")(delayed(remembered)(item) for item in items)
    return list(track(done, label, len(items), console=Console(stderr=True)))


def run_sessions(sessions: Iterable[Session], workers: Workers) -> Outcomes:
    """Run each different session once; those of one person follow each other, and share the recorded sweep."""
    unique = sorted(dict.fromkeys(sessions), key=_of_person)
    return dict(zip(unique, in_parallel(run, unique, workers, "sessions"), strict=True))


def _of_person(session: Session) -> tuple[int, str, int]:
    return session.person, session.cohort, session.seed


def frame(sessions: Iterable[Session], outcomes: Outcomes) -> pd.DataFrame:
    """One row a session: its fields and its outcome."""
    rows = [vars(session) | dict(session.settings) | outcomes[session] for session in sessions]
    return pd.DataFrame(rows)
