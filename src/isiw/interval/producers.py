"""Simulated people who produce intervals: a law of timing noise, and of what each kind of feedback teaches.

A person aims at a time a = m + s·z around what they remember, m, searching with SD s, and produces

    t = a·(1 + w·h) + b·z'

z and z' are standard normal; h has Student's t distribution with three degrees of freedom, scaled to SD 1. Noise that
grows with the interval is scalar timing [Gibbon1977], and b is the noise of the two presses [Wing1973].

- Hidden target (modes 1 and 2): with the reward r, the score as a fraction or the light, 0 or 1,
  m ← m + λ·r·(a − m) and s ← s − λ·r·s + ρ·(1 − r)·(S − s): a reward draws towards what was aimed at and ends the
  search; without rewards the search begins again.
- Target and produced time (mode 3): m ← m − λ·(t − T).
- Absolute error (mode 4): it does not say in which direction, so m stays at what the person takes for T.

The law is ours; the dissertation has none. All but w is in ms, since the score's bell is equally wide at both targets.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from isiw.checks import check_numbers, check_probabilities, whole
from isiw.interval.task import score_pct
from isiw.log.production import LONGEST_MS, Block
from isiw.types import FloatArray

__all__ = ["Producer", "produce"]

SHORTEST_AIM_MS: Final = 50.0
SHORTEST_MS: Final = 20.0
TAIL: Final = 3
"""Degrees of freedom of the timing noise: now and then a press comes far too early or too late."""


@dataclass(frozen=True)
class Producer:
    """What people have in common who produce intervals.

    The defaults are fitted to session 1 of [Kim2020, Table 6.2], target 300 ms, and the share of mode 2 within 20 ms
    of the target [Kim2020, 6.3.2], by `python -m benchmarks.interval --fit`; but for `motor_ms`, which is not
    identified at one target, and is that of finger taps [Wing1973].

    Args:
        timing_cv: w, SD of the timing noise as a fraction of the time aimed at.
        motor_ms: b, SD of the noise of the two presses [ms].
        offset_ms: by how much people take another time for a told target, mean [ms].
        offset_sd_ms: the same, SD over people [ms].
        start_sd_ms: SD over people of the first aim about a hidden target [ms].
        search_ms: S, SD of the search without rewards [ms].
        learning: λ, the share of what feedback shows that is taken over.
        restlessness: ρ, the share of the way back to searching after a trial without reward.

    Raises:
        InvalidValueError: an SD that is negative, or a share that is not between 0 and 1.
    """

    timing_cv: float = 0.111
    motor_ms: float = 10.0
    offset_ms: float = -15.7
    offset_sd_ms: float = 38.6
    start_sd_ms: float = 70
    search_ms: float = 80
    learning: float = 0.24
    restlessness: float = 0.0105

    def __post_init__(self) -> None:
        check_numbers(self, "timing_cv", "motor_ms", "offset_sd_ms", "start_sd_ms", "search_ms", least=0.0)
        check_numbers(self, "offset_ms")
        check_probabilities(self, "learning", "restlessness")


def produce(block: Block, people: int, seed: int, producer: Producer | None = None) -> FloatArray:
    """Intervals that simulated people produce in a block.

    Args:
        block: target, feedback and trials.
        people: how many, b.
        seed: of the people and their trials; the same people take part in blocks of the same seed.
        producer: their law; by default the fitted one.

    Returns:
        Produced intervals [ms], shape (b, n).

    Raises:
        InvalidValueError: no people, or a negative seed.
    """
    people, seed = whole("people", people, least=1), whole("seed", seed, least=0)
    law = producer or Producer()
    person = np.random.default_rng(seed).standard_normal(people)
    rng = np.random.default_rng([seed, block.mode, round(block.target_ms), round(block.scale_pct)])
    state = _State(law, block, person)
    learn = {1: state.by_score, 2: state.by_light, 3: state.by_error, 4: state.by_nothing}[block.mode]
    return np.stack([_trial(state, learn, rng) for _ in range(block.trials)], axis=1)


class _State:
    """What simulated people remember, and how feedback changes it."""

    def __init__(self, law: Producer, block: Block, person: FloatArray) -> None:
        self.law, self.block = law, block
        told = block.mode in {3, 4}
        self.memory_ms = block.target_ms + (
            law.offset_ms + law.offset_sd_ms * person if told else law.start_sd_ms * person
        )
        self.search_ms = np.full(len(person), 0.0 if told else law.search_ms)

    def by_score(self, aim_ms: FloatArray, produced_ms: FloatArray, _luck: FloatArray) -> None:
        self._rewarded(aim_ms, self._score(produced_ms))

    def by_light(self, aim_ms: FloatArray, produced_ms: FloatArray, luck: FloatArray) -> None:
        self._rewarded(aim_ms, np.where(luck < self._score(produced_ms), 1.0, 0.0))

    def by_error(self, _aim_ms: FloatArray, produced_ms: FloatArray, _luck: FloatArray) -> None:
        self.memory_ms = self.memory_ms - self.law.learning * (produced_ms - self.block.target_ms)

    def by_nothing(self, _aim_ms: FloatArray, _produced_ms: FloatArray, _luck: FloatArray) -> None:
        pass

    def _score(self, produced_ms: FloatArray) -> FloatArray:
        return score_pct(produced_ms, self.block.target_ms, self.block.scale_pct) / 100

    def _rewarded(self, aim_ms: FloatArray, reward: FloatArray) -> None:
        law = self.law
        self.memory_ms = self.memory_ms + law.learning * reward * (aim_ms - self.memory_ms)
        rise = law.restlessness * (1 - reward) * (law.search_ms - self.search_ms)
        self.search_ms = self.search_ms * (1 - law.learning * reward) + rise


def _trial(
    state: _State, learn: Callable[[FloatArray, FloatArray, FloatArray], None], rng: np.random.Generator
) -> FloatArray:
    """One trial of everybody, shape (b,), from which they learn."""
    law, people = state.law, len(state.memory_ms)
    searching, pressing = rng.standard_normal((2, people))
    timing = rng.standard_t(TAIL, people) / np.sqrt(TAIL / (TAIL - 2))
    aim_ms = np.maximum(state.memory_ms + state.search_ms * searching, SHORTEST_AIM_MS)
    noisy_ms = aim_ms * (1 + law.timing_cv * timing) + law.motor_ms * pressing
    produced_ms: FloatArray = np.clip(noisy_ms, SHORTEST_MS, LONGEST_MS)
    learn(aim_ms, produced_ms, rng.random(people))
    return produced_ms
