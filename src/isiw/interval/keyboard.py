"""The task at a terminal: a person presses two keys, the trial is made durable, and then its feedback is shown."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from isiw.checks import number
from isiw.errors import DeviceError
from isiw.interval.record import ProductionRecord, begin_log, continue_log, read_productions
from isiw.interval.task import END, QUIT, START, Presses, answer, feedback
from isiw.log.production import LONGEST_MS, MODES, Block
from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.session.terminal import Keys, Screen, somebody_there
from isiw.text.numbers import counted

SHORTEST_MS: Final = 20.0
"""Shorter than anybody's two presses; two keys that a stalled terminal hands over together lie closer."""

REST_S: Final = 120.0
"""Between blocks [s] [Kim2020, 6.2.3]."""

_NAP_S = 0.2


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
        What is in the log; `left` says what is missing where the person left before the end.

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

    Returns:
        What is in the log.

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
    if not somebody_there():
        raise DeviceError(
            "the task needs a person who sees the terminal and presses its keys",
            got="input or output that is no terminal",
            remedy="Start it in a terminal window; isiw.interval.produce simulates people.",
        )
    return number("rest_s", rest_s, least=0.0)


def _conduct(record: ProductionRecord, log: LogWriter, rest_s: float) -> ProductionRecord:
    presses = Presses()
    with log, Screen() as screen, Keys(presses.press, presses.leave):
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
    with _resting(presses):
        end_s = time.monotonic() + rest_s
        while (left_s := end_s - time.monotonic()) > 0 and not presses.left:
            screen.count_down(f"Rest: {math.ceil(left_s) // 60}:{math.ceil(left_s) % 60:02d} left")
            time.sleep(min(left_s, _NAP_S))
        screen.counted_down()
    block = record.header.blocks[index]
    target = f"target {block.target_ms:.0f} ms" if block.mode in {3, 4} else "find the hidden target"
    place = f"Block {index + 1} of {len(record.header.blocks)}"
    left = sum(of == index for _, of in record.left)
    trials = counted(left, "trial") + (" left" if left < block.trials else "")
    screen.say(f"{place}: {trials}, feedback: {MODES[block.mode]}; {target}.")


@contextmanager
def _resting(presses: Presses) -> Iterator[None]:
    presses.resting = True
    try:
        yield
    finally:
        presses.resting = False


def _one_trial(
    record: ProductionRecord, log: LogWriter, screen: Screen, presses: Presses, trial: int, index: int
) -> bool:
    """Wait for an interval that counts, log it, and show its feedback; False where the person leaves."""
    block = record.header.blocks[index]
    while (produced_ms := presses.next_ms()) is not None:
        if SHORTEST_MS <= produced_ms <= LONGEST_MS:
            production = answer(block, index, trial, produced_ms, record.header.seed)
            log.append(production)
            log.sync()
            log.require_in_place()
            screen.say(f"{trial + 1:4d}  {feedback(block, production)}")
            return True
        text = f"An interval of {produced_ms:.0f} ms does not count; press again."
        log.append(Event(kind="note", trial=trial, text=text))
        screen.say(text)
    return False
