"""The log of a task: begun, continued, and read back."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

import isiw
from isiw.checks import text, whole
from isiw.errors import InvalidValueError
from isiw.lazy import pd
from isiw.log.headers import (
    PRODUCTION_VERSION,
    SCHEMA_VERSION,
    Block,
    Header,
    Production,
    ProductionHeader,
    ThresholdHeader,
)
from isiw.log.kinds import LogKind, kind_of, of_another_kind
from isiw.log.records import Records
from isiw.log.salvage import Salvage, salvage
from isiw.log.schema import Event, now
from isiw.log.writer import LogWriter

NEAR_MS = 20.0
"""Half of the 40 ms in which an interval counts as effective [Kim2020, 6.3.1]."""


@dataclass(frozen=True, eq=False)
class ProductionRecord:
    """A task as its log tells it.

    Args:
        path: the file that was read.
        header: who, when, and which blocks.
        productions: the produced intervals, in the order in which they were logged.
        events: resumptions, and presses that do not count.
        losses: what could not be read, a sentence each.
    """

    path: Path
    header: ProductionHeader
    productions: tuple[Production, ...] = field(repr=False)
    events: tuple[Event, ...] = field(repr=False, default=())
    losses: tuple[str, ...] = ()

    @cached_property
    def left(self) -> tuple[tuple[int, int], ...]:
        """Trials that are not in the log yet, as the trial's and its block's number."""
        blocks = [block for block, of in enumerate(self.header.blocks) for _ in range(of.trials)]
        next_trial = max((production.trial for production in self.productions), default=-1) + 1
        return tuple(itertools.islice(enumerate(blocks), next_trial, None))

    @property
    def table(self) -> pd.DataFrame:
        """A row a block that was begun.

        Columns mode, target_ms, scale_pct, n, mean_ms, sd_ms (of the n trials; 0 for one), and near, the share within
        20 ms of the target.
        """
        rows: list[dict[str, float]] = []
        for index, block in enumerate(self.header.blocks):
            times_ms = np.array([each.produced_ms for each in self.productions if each.block == index])
            if times_ms.size:
                rows.append(
                    {
                        "mode": block.mode,
                        "target_ms": block.target_ms,
                        "scale_pct": block.scale_pct,
                        "n": len(times_ms),
                        "mean_ms": float(times_ms.mean()),
                        "sd_ms": float(times_ms.std()),
                        "near": float(np.mean(np.abs(times_ms - block.target_ms) <= NEAR_MS)),
                    }
                )
        return pd.DataFrame(rows)


def begin_log(
    path: str | Path, blocks: tuple[Block, ...], subject: str, seed: int
) -> tuple[ProductionRecord, LogWriter]:
    """A task that begins, and its open log."""
    if not blocks:
        raise InvalidValueError("a task needs at least one block", remedy="Take those of isiw.interval.session_blocks.")
    header = ProductionHeader(
        isiw_version=isiw.__version__,
        created=now().isoformat(timespec="seconds"),
        subject=text("subject", subject),
        seed=whole("seed", seed, least=0),
        blocks=blocks,
    )
    return ProductionRecord(Path(path), header, ()), LogWriter.create(path, header)


def continue_log(path: str | Path) -> tuple[ProductionRecord, LogWriter]:
    """A task that was interrupted, and its log, open again."""
    found = salvage(path)
    record = _record_of(found)
    if not record.left:
        raise InvalidValueError(
            "this task is complete",
            got=str(record.path),
            remedy=f"Look at it with: {LogKind.PRODUCTION.shown_by(record.path)}",
        )
    log = LogWriter.continuing(path, found, record.header)
    log.append(Event(kind="resume", trial=None, text=f"Resumed before trial {record.left[0][0]}."))
    return record, log


def read_productions(path: str | Path) -> ProductionRecord:
    """Read the log of a task, finished or not, whole or damaged; `losses` says what is missing.

    Args:
        path: the log, with or without `.part`.

    Raises:
        LogError: no such file, not a log, or one of something else, or from a newer version.
        DamagedLogError: a log of which not even the header can be read.
    """
    return _record_of(salvage(path))


def _record_of(found: Salvage) -> ProductionRecord:
    records = Records.of(found)
    if any(message.topic == "/header" for message in found.messages):
        kind = kind_of(records.header_of((Header, ThresholdHeader), SCHEMA_VERSION))
        raise of_another_kind(found.path, kind, LogKind.PRODUCTION)
    return ProductionRecord(
        found.path,
        records.header_of((ProductionHeader,), PRODUCTION_VERSION),
        tuple(record for record in records.history if isinstance(record, Production)),
        tuple(record for record in records.history if isinstance(record, Event)),
        records.told_losses,
    )
