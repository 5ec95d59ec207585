"""A session's estimate once more, from its trials as they count now, without a device."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import isiw
from isiw.errors import LogError
from isiw.log.reader import read_salvaged
from isiw.log.salvage import salvage
from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.session.examination import estimate_record, learn
from isiw.session.replay import strategy_of
from isiw.strategy.strategy import Strategy


def estimate_again(
    path: str | Path, strategy: Strategy | None = None, *, replayed: Callable[[int], None] = lambda _: None
) -> None:
    """Compute a session's estimate from its trials as they count now, and append it to the log. Delivers nothing.

    Args:
        path: the log, with or without `.part`; no session may be writing it.
        strategy: needed where the session's strategy was built from a user's own objects: the same again.
        replayed: called after each trial with how many the strategy knows.

    Raises:
        LogError: no such log, one without trials, or one that is still being written.
        DamagedLogError: the log's end is missing; resume the session first.
        StrategyError: the strategy cannot be made again.
    """
    salvaged = salvage(path)
    record = read_salvaged(salvaged)
    record.require_end()
    record.require_read()
    if not record.table:
        raise LogError("there is no trial to estimate from", got=str(record.path))
    made = strategy_of(record.header) if strategy is None else strategy.restarted()
    trials = sorted([*record.table, *record.unknown_trials], key=lambda trial: trial.index)
    for number, trial in enumerate(trials, start=1):
        learn(made, trial)
        replayed(number)
    last = record.table[-1].index
    said = f"Estimated again with isiw {isiw.__version__} from the trials as they count now."
    with LogWriter.continuing(path, salvaged, record.header) as log:
        log.append(Event(kind="note", trial=last, text=" ".join([said, *record.losses])))
        log.append(estimate_record(made, last, made.decision(), None))
