"""Who produces intervals: simulated people, by a law of timing noise and of feedback, and a computer in their place.

A person aims at a time a = m + s·z around what they remember, m, searching with SD s, and produces

    t = a·(1 + w·h) + b·z'

z and z' are standard normal; h has Student's t distribution with three degrees of freedom, scaled to SD 1. Noise that
grows with the interval is scalar timing [Gibbon1977]; b is the noise of the two presses, which does not [Wing1973].

- Hidden target (modes 1 and 2): with the reward r, the score as a fraction or the light, 0 or 1,
  m ← m + λ·r·(a − m) and s ← s − λ·r·s + ρ·(1 − r)·(S − s): a reward draws towards what was aimed at and ends the
  search; without rewards the search begins again.
- Target and produced time (mode 3): m ← m − λ·(t − M), with M the target.
- Absolute error (mode 4): it does not say in which direction, so m stays at what the person takes for M.

The law is ours; the dissertation has none. All but w is in ms, since the score's bell is equally wide at both targets.

In the place of a person a computer optimises the interval on the light of mode 2 [Kim2020, 6.3.3]. The text names
neither model, acquisition function, range nor number of trials. Here a Gaussian process with fixed hyperparameters sees
the lights as 0 and 1, and the next interval is where its upper confidence bound is highest [Srinivas2010]. Range and
first intervals are read off the extremes of Tables 6.3 and 6.4: both are the ends of a range of 200 to 400 ms, missed
by a few milliseconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final, NamedTuple

import numpy as np

from isiw.checks import Checked, NonNegative, Number, Positive, Share, number, whole
from isiw.dissertation.interval.task import SHORTEST_MS, score_pct
from isiw.errors import InvalidValueError
from isiw.lazy import botorch, gpytorch, torch
from isiw.log.headers import LONGEST_MS, Block
from isiw.types import FloatArray

SHORTEST_AIM_MS: Final = 50.0
TAIL: Final = 3
"""Degrees of freedom of the timing noise: now and then a press comes far too early or too late."""


@dataclass(frozen=True)
class Producer(Checked):
    """Protocol of people who produce intervals.

    The defaults are fitted to session 1 of [Kim2020, Table 6.2], target 300 ms, and the share of mode 2 within 20 ms
    of the target [Kim2020, 6.3.2], by `python -m benchmarks.interval --fit`; but for `motor_ms`, which one target does
    not identify, and which is chosen.

    Args:
        timing_cv: w, SD of the timing noise as a fraction of the time aimed at.
        motor_ms: b, SD of the noise of the two presses [ms].
        offset_ms: by how much people take another time for a stated target, mean [ms].
        offset_sd_ms: the same, SD over people [ms].
        start_sd_ms: SD over people of the first aim about a hidden target [ms].
        search_ms: S, SD of the search without rewards [ms].
        learning: λ, the share of what feedback shows that is taken over.
        restlessness: ρ, the share of the way back to searching after a trial without reward.
    """

    timing_cv: NonNegative = 0.1098
    motor_ms: NonNegative = 10.0
    offset_ms: Number = -16.7
    offset_sd_ms: NonNegative = 38.9
    start_sd_ms: NonNegative = 69.7
    search_ms: NonNegative = 83.2
    learning: Share = 0.233
    restlessness: Share = 0.0108


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
    if block.mode in {3, 4}:
        begun_ms, search_ms = block.target_ms + law.offset_ms + law.offset_sd_ms * person, 0.0
    else:
        begun_ms, search_ms = block.target_ms + law.start_sd_ms * person, law.search_ms
    state, produced_ms = _State(begun_ms, np.full_like(person, search_ms)), np.empty((people, block.trials))
    for trial in range(block.trials):
        aim_ms, produced_ms[:, trial] = _tried(law, state, rng)
        state = _learnt(law, block, state, aim_ms, produced_ms[:, trial], rng.random(people))
    return produced_ms


class _State(NamedTuple):
    """The remembered interval, m, and the SD of the search, s [ms], shape (b,)."""

    memory_ms: FloatArray
    search_ms: FloatArray


def _tried(law: Producer, state: _State, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """The intervals that everybody aims at, and those that they produce [ms], shape (b,) each."""
    people = len(state.memory_ms)
    searching, pressing = rng.standard_normal((2, people))
    timing = rng.standard_t(TAIL, people) / np.sqrt(TAIL / (TAIL - 2))
    aim_ms = np.maximum(state.memory_ms + state.search_ms * searching, SHORTEST_AIM_MS)
    produced_ms = aim_ms * (1 + law.timing_cv * timing) + law.motor_ms * pressing
    return aim_ms, np.clip(produced_ms, SHORTEST_MS, LONGEST_MS)


def _learnt(
    law: Producer, block: Block, state: _State, aim_ms: FloatArray, produced_ms: FloatArray, luck: FloatArray
) -> _State:
    """The state after a trial; luck is uniform in 0–1, shape (b,), and decides about the light."""
    if block.mode == 4:
        return state
    if block.mode == 3:
        return state._replace(memory_ms=state.memory_ms - law.learning * (produced_ms - block.target_ms))
    score = score_pct(produced_ms, block.target_ms, block.scale_pct) / 100
    reward = score if block.mode == 1 else np.where(luck < score, 1.0, 0.0)
    learnt = law.learning * reward
    back = law.restlessness * (1 - reward) * (law.search_ms - state.search_ms)
    memory_ms = state.memory_ms + learnt * (aim_ms - state.memory_ms)
    return _State(memory_ms, state.search_ms * (1 - learnt) + back)


LIGHT_VARIANCE: Final = 0.1
"""Of a light about its probability, and of that probability over the range."""


@dataclass(frozen=True)
class LightSearch(Checked):
    """Settings of the computer's search.

    Args:
        low_ms: the shortest interval [ms].
        high_ms: the longest interval [ms].
        initial: evenly spaced intervals that are tried first, both ends included.
        beta: square of how many posterior SDs the upper bound lies above the mean.
        length_scale_ms: of the Gaussian process [ms]; by default √V of the score.
        timing_sd_ms: SD of the delivered about the chosen interval [ms]; the text gives 5 for the robot.

    Raises:
        InvalidValueError: a number out of range, or a range that is empty.
    """

    low_ms: Positive = 200.0
    high_ms: Annotated[float, partial(number, above=0, most=LONGEST_MS)] = 400.0
    initial: Annotated[int, partial(whole, least=2)] = 7
    beta: NonNegative = 2.0
    length_scale_ms: Positive = 10.0
    timing_sd_ms: NonNegative = 5.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.high_ms <= self.low_ms:
            raise InvalidValueError("the longest interval must exceed the shortest", got=(self.low_ms, self.high_ms))


def search_light(block: Block, seed: int, search: LightSearch | None = None) -> FloatArray:
    """The intervals that Bayesian optimisation produces in one run.

    Args:
        block: of mode 2; its trials are the length of the run.
        seed: of the timing errors and the lights.
        search: how; by default `LightSearch()`.

    Returns:
        Delivered intervals [ms], shape (n,).

    Raises:
        InvalidValueError: a block of another mode, or a negative seed.
    """
    if block.mode != 2:
        raise InvalidValueError(
            "Bayesian optimisation answers to the light", got=f"mode {block.mode}", expected="mode 2"
        )
    how, rng = search or LightSearch(), np.random.default_rng(whole("seed", seed, least=0))
    first_ms, grid_ms = np.linspace(how.low_ms, how.high_ms, how.initial), np.arange(how.low_ms, how.high_ms + 1)
    produced_ms, lights = np.empty(block.trials), np.empty(block.trials)
    for trial in range(block.trials):
        told = produced_ms[:trial], lights[:trial]
        chosen_ms = first_ms[trial] if trial < how.initial else _next_ms(how, grid_ms, *told)
        produced_ms[trial] = max(chosen_ms + how.timing_sd_ms * rng.standard_normal(), 0.0)
        score = score_pct(produced_ms[trial], block.target_ms, block.scale_pct)
        lights[trial] = rng.random() < score / 100
    return produced_ms


def _next_ms(how: LightSearch, grid_ms: FloatArray, produced_ms: FloatArray, lights: FloatArray) -> float:
    """Where the upper confidence bound is highest [ms]."""
    kernel = gpytorch.kernels.ScaleKernel(gpytorch.kernels.RBFKernel()).double()
    length_scale_ms, variance, beta = torch.tensor([how.length_scale_ms, LIGHT_VARIANCE, how.beta], dtype=torch.float32)
    kernel.base_kernel.lengthscale, kernel.outputscale = length_scale_ms.double(), variance.double()
    model = botorch.models.SingleTaskGP(
        torch.tensor(produced_ms)[:, None],
        torch.tensor(lights)[:, None],
        torch.full((len(lights), 1), LIGHT_VARIANCE, dtype=torch.double),
        covar_module=kernel,
        outcome_transform=None,
    )
    with torch.no_grad():
        bounds = botorch.acquisition.analytic.UpperConfidenceBound(model, beta=beta)(
            torch.tensor(grid_ms)[:, None, None]
        )
    return float(grid_ms[int(bounds.argmax())])
