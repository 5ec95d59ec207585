"""The task: which blocks a session has, and the score, the light and the words that answer a produced interval."""

from __future__ import annotations

import math
import queue
import time
from collections.abc import Callable, Iterable
from typing import Final

import numpy as np

from isiw.checks import choice, whole
from isiw.errors import InvalidValueError
from isiw.log.production import LONGEST_MS, Block, Production
from isiw.types import ArrayLike, FloatArray

START: Final = "f"
END: Final = "j"
QUIT: Final = "q"

_GLANCE_S = 0.2


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
        elif key.lower() == START:
            self._begin(now_s)
        elif key.lower() == END and self._begun_s is not None:
            self._intervals.put(1000.0 * (now_s - self._begun_s))
            self._begun_s = None

    def leave(self) -> None:
        """Nobody is there any more."""
        self.left = True

    def next_ms(self) -> float | None:
        """Wait for the next interval [ms]; None where the person leaves instead."""
        while not self.left:
            try:
                return self._intervals.get(timeout=_GLANCE_S)
            except queue.Empty:
                continue
        return None

    def _begin(self, now_s: float) -> None:
        if self._begun_s is None or 1000.0 * (now_s - self._begun_s) > LONGEST_MS:
            self._begun_s = now_s


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


def session_blocks(session: int, modes: Iterable[int] = (), trials: int = 200) -> tuple[Block, ...]:
    """The blocks of a session.

    Args:
        session: 1, 2 or 3.
        modes: only these, in this order; all of the session where there are none.
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
    """What a produced interval is answered with, as it is logged."""
    if not (math.isfinite(produced_ms) and produced_ms > 0):
        raise InvalidValueError("a produced interval must be a positive time in ms", got=produced_ms)
    seed, trial = whole("seed", seed, least=0), whole("trial", trial, least=0)
    score = float(score_pct(produced_ms, block.target_ms, block.scale_pct))
    light = bool(np.random.default_rng([seed, trial]).random() < score / 100) if block.mode == 2 else None
    return Production(trial=trial, block=index, produced_ms=produced_ms, score_pct=score, light=light)


def feedback(block: Block, production: Production) -> str:
    """What a person sees after a trial."""
    target, produced = f"target {block.target_ms:.0f} ms", production.produced_ms
    if block.mode == 1:
        filled = round(_BAR * production.score_pct / 100)
        return f"score  0 |{'#' * filled}{'.' * (_BAR - filled)}| 100"
    if block.mode == 2:
        return "light  ON" if production.light else "light  off"
    if block.mode == 3:
        return f"{target}, yours {produced:.0f} ms"
    return f"{target}, off by {abs(produced - block.target_ms):.0f} ms"
