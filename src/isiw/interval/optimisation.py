"""A computer in the person's place: Bayesian optimisation of the interval on the light of mode 2 [Kim2020, 6.3.3].

The text names neither model, acquisition function, range nor number of trials. Here a Gaussian process with fixed
hyperparameters sees the lights as 0 and 1, and the next interval is where its upper confidence bound is highest
[Srinivas2010]. Range and first intervals are read off the extremes of Tables 6.3 and 6.4: both are the ends of a range
of 200 to 400 ms, missed by a few milliseconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from isiw.checks import check_numbers, check_wholes, whole
from isiw.errors import InvalidValueError
from isiw.interval.task import score_pct
from isiw.lazy import botorch, gpytorch, torch
from isiw.log.production import LONGEST_MS, Block
from isiw.types import FloatArray

LIGHT_VARIANCE: Final = 0.1
"""Of a light about its probability, and of that probability over the range."""


@dataclass(frozen=True)
class LightSearch:
    """How the computer searches.

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

    low_ms: float = 200.0
    high_ms: float = 400.0
    initial: int = 7
    beta: float = 2.0
    length_scale_ms: float = 10.0
    timing_sd_ms: float = 5.0

    def __post_init__(self) -> None:
        check_numbers(self, "low_ms", "length_scale_ms", above=0.0)
        check_numbers(self, "high_ms", above=0.0, most=LONGEST_MS)
        check_numbers(self, "beta", "timing_sd_ms", least=0.0)
        check_wholes(self, "initial", least=2)
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
