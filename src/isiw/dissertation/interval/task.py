"""The task at a terminal: its blocks, two keys that a person presses, feedback once a trial is durable, and the log."""

from __future__ import annotations

import itertools
import math
import queue
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

import isiw
from isiw.checks import choice, number, text, whole
from isiw.errors import DeviceError, InvalidValueError
from isiw.lazy import pd
from isiw.log.headers import (
    LONGEST_MS,
    MODES,
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
from isiw.log.schema import Event
from isiw.log.writer import LogWriter, now
from isiw.session.terminal import Keys, Screen, is_attended
from isiw.text.sanitize import counted
from isiw.types import ArrayLike, FloatArray

__all__ = ["SCORE_VARIANCE_MS2", "SESSIONS", "Block", "answer", "feedback", "score_pct", "session_blocks"]

SCORE_VARIANCE_MS2: Final = 100.0
"""V of equation 6.1 [ms²]. The text prints ms; its own example, a score of 70 at 294 ms, is that of ms²."""

SESSIONS: Final[dict[int, tuple[Block, ...]]] = {
    1: tuple(Block(mode, 300.0) for mode in (1, 2, 3, 4)),
    2: tuple(Block(mode, 500.0) for mode in (1, 2, 3, 4)),
    3: tuple(Block(mode, 300.0, scale_pct=50.0) for mode in (1, 2)),
}
"""The blocks of the three sessions [Kim2020, 6.2.3]."""

_BAR = 40

SHORTEST_MS: Final = 20.0
"""Shorter than anybody's two presses; two keys that a stalled terminal hands over together lie closer."""

REST_S: Final = 120.0
"""Between blocks [s] [Kim2020, 6.2.3]."""

START: Final = "f"
END: Final = "j"
QUIT: Final = "q"

_GLANCE_S = 0.2


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
        records.losses_said,
    )


class Presses:
    """Turns key presses into intervals; the thread that reads the keys presses, another one waits."""

    def __init__(self, clock_s: Callable[[], float] = time.perf_counter) -> None:
        self._clock_s = clock_s
        self._begun_s: float | None = None
        self._intervals: queue.SimpleQueue[float] = queue.SimpleQueue()
        self.left, self.resting = False, False

    def press(self, key: str) -> None:
        """Take a key: the first start counts, so that a key that is held down begins one interval only."""
        now_s = self._clock_s()
        if key.lower() == QUIT:
            self.left = True
        elif self.resting:
            self._begun_s = None
        elif key.lower() == START and (self._begun_s is None or 1000.0 * (now_s - self._begun_s) > LONGEST_MS):
            self._begun_s = now_s
        elif key.lower() == END and self._begun_s is not None:
            self._intervals.put(1000.0 * (now_s - self._begun_s))
            self._begun_s = None

    def next_ms(self) -> float | None:
        """Wait for the next interval [ms]; None if the person leaves instead."""
        while not self.left:
            try:
                return self._intervals.get(timeout=_GLANCE_S)
            except queue.Empty:
                continue
        return None


def session_blocks(session: int, modes: Iterable[int] = (), trials: int = 200) -> tuple[Block, ...]:
    """The blocks of a session.

    Args:
        session: 1, 2 or 3.
        modes: only these, in this order; all of the session if there are none.
        trials: in each block.

    Raises:
        InvalidValueError: no such session, a mode that the session does not have, or no trials.
    """
    known = {block.mode: block for block in SESSIONS[choice("session", session, SESSIONS)]}
    wanted = [choice(f"a mode of session {session}", mode, known) for mode in modes] or list(known)
    return tuple(Block(mode, known[mode].target_ms, known[mode].scale_pct, trials) for mode in wanted)


def score_pct(produced_ms: ArrayLike, target_ms: float, scale_pct: float = 100.0) -> FloatArray:
    """The score of produced intervals, A·exp(−(t − M)²/V) [Kim2020, 6.1].

    Args:
        produced_ms: t [ms], any shape.
        target_ms: M [ms].
        scale_pct: A [%].

    Returns:
        Scores [%], of the same shape.
    """
    error_ms = np.asarray(produced_ms, dtype=np.float64) - target_ms
    return np.asarray(scale_pct * np.exp(-(error_ms**2) / SCORE_VARIANCE_MS2))


def answer(block: Block, index: int, trial: int, produced_ms: float, seed: int) -> Production:
    """The answer to a produced interval, as it is logged."""
    score = float(score_pct(produced_ms, block.target_ms, block.scale_pct))
    light = bool(np.random.default_rng([seed, trial]).random() < score / 100) if block.mode == 2 else None
    return Production(trial=trial, block=index, produced_ms=produced_ms, score_pct=score, light=light)


def feedback(block: Block, production: Production) -> str:
    """The feedback that a person sees after a trial."""
    target, produced = f"target {block.target_ms:.0f} ms", production.produced_ms
    if block.mode == 1:
        filled = round(_BAR * production.score_pct / 100)
        return f"score  0 |{'#' * filled}{'.' * (_BAR - filled)}| 100"
    if block.mode == 2:
        return "light  ON" if production.light else "light  off"
    if block.mode == 3:
        return f"{target}, yours {produced:.0f} ms"
    return f"{target}, off by {abs(produced - block.target_ms):.0f} ms"


def run_task(
    path: str | Path, blocks: Iterable[Block], *, subject: str = "", seed: int = 0, rest_s: float = REST_S
) -> ProductionRecord:
    """Let the person at this terminal produce intervals.

    Args:
        path: the log, without `.part`.
        blocks: what to produce, such as `session_blocks(1)`.
        subject: who the person is.
        seed: of the lights of mode 2.
        rest_s: between blocks [s].

    Returns:
        What is in the log; `left` says what is missing if the person left before the end.

    Raises:
        DeviceError: nobody is at a terminal, or its keys cannot be timed.
        InvalidValueError: no blocks, or a negative seed or rest.
        LogError: there is a log already, or it cannot be written.
    """
    rest_s = _ready(rest_s)
    return _conduct(*begin_log(path, tuple(blocks), subject, seed), rest_s)


def resume_task(path: str | Path, *, rest_s: float = REST_S) -> ProductionRecord:
    """Let a person go on where a task was left.

    Args:
        path: the log, with or without `.part`.
        rest_s: between blocks [s].

    Raises:
        DeviceError: nobody is at a terminal, or its keys cannot be timed.
        InvalidValueError: the task is complete, or a negative rest.
        LogError: no such log, one that is still written, or of something else.
        DamagedLogError: a log of which not even the header can be read.
    """
    rest_s = _ready(rest_s)
    return _conduct(*continue_log(path), rest_s)


def _ready(rest_s: float) -> float:
    if sys.platform == "win32":  # where keys are looked for in steps, see session.terminal
        raise DeviceError(
            "key presses in a Windows console are read every 100 ms, too coarse to time them",
            remedy="Run the task in a terminal of Linux or macOS.",
        )
    if not is_attended():
        raise DeviceError(
            "the task needs a person who sees the terminal and presses its keys",
            got="input or output that is no terminal",
            remedy="Start it in a terminal window; isiw.interval.produce simulates people.",
        )
    return number("rest_s", rest_s, least=0.0)


def _conduct(record: ProductionRecord, log: LogWriter, rest_s: float) -> ProductionRecord:
    presses = Presses()
    with log, Screen() as screen, Keys(presses.press, lambda: presses.press(QUIT)):
        screen.say(f"{START} starts an interval, {END} ends it, {QUIT} leaves; the task can be resumed later.")
        block_before: int | None = None
        for trial, index in record.left:
            if index != block_before:
                _open_block(record, index, screen, presses, 0.0 if block_before is None else rest_s)
                block_before = index
            if not _one_trial(record, log, screen, presses, trial, index):
                break
    return read_productions(log.path)


def _open_block(record: ProductionRecord, index: int, screen: Screen, presses: Presses, rest_s: float) -> None:
    """Rest, and say what comes; the target of modes 1 and 2 stays hidden."""
    presses.resting, end_s = True, time.monotonic() + rest_s
    while (left_s := end_s - time.monotonic()) > 0 and not presses.left:
        screen.count_down(f"Rest: {math.ceil(left_s) // 60}:{math.ceil(left_s) % 60:02d} left")
        time.sleep(min(left_s, _GLANCE_S))
    screen.counted_down()
    presses.resting = False
    block = record.header.blocks[index]
    target = f"target {block.target_ms:.0f} ms" if block.mode in {3, 4} else "find the hidden target"
    place = f"Block {index + 1} of {len(record.header.blocks)}"
    left = sum(of == index for _, of in record.left)
    trials = counted(left, "trial") + (" left" if left < block.trials else "")
    screen.say(f"{place}: {trials}, feedback: {MODES[block.mode]}; {target}.")


def _one_trial(
    record: ProductionRecord, log: LogWriter, screen: Screen, presses: Presses, trial: int, index: int
) -> bool:
    """Wait for an interval that counts, log it, and show its feedback; False if the person leaves."""
    block = record.header.blocks[index]
    while (produced_ms := presses.next_ms()) is not None:
        if SHORTEST_MS <= produced_ms <= LONGEST_MS:
            production = answer(block, index, trial, produced_ms, record.header.seed)
            log.append(production)
            log.sync()
            log.require_in_place()
            screen.say(f"{trial + 1:4d}  {feedback(block, production)}")
            return True
        said = f"An interval of {produced_ms:.0f} ms does not count; press again."
        log.append(Event(kind="note", trial=trial, text=said))
        screen.say(said)
    return False
