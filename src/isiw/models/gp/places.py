"""Where a Gaussian process may leave its constant: everywhere, or within a window that lies where windows can.

A profile within a window is the constant, plus a share of the ISI that is 1 in the window's middle and falls as a
Gaussian of a quarter of its width, times a rise and a smooth deviation from it. Noise grows with that share, since the
log MEP of a response scatters more than that of the floor. Place, width, noise and its growth are unknown: an ensemble
of processes at points of a Sobol sequence stands for their prior, and each is weighed by its marginal likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Annotated, Final, NamedTuple, TypeAlias

import numpy as np

from isiw.checks import Checked, Positive, number, share, whole
from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.shared.scales import PositiveLaw, Scale
from isiw.models.shared.start import StartPrior

Tensor: TypeAlias = "torch.Tensor"

DRAWN: Final = 1
"""Seed of the ensemble, which is the same for everybody."""

WIDTH_SDS: Final = 4.0
"""A window is so many SDs of its Gaussian share wide, as the least-excess rule has it."""

FLAT: Final = 7
"""Processes without a window, which differ in their noise."""

LEAST_QUANTILE: Final = 1e-4
"""No window of the ensemble is rarer than this at either end of a law."""


class Hyperparameters(NamedTuple):
    """Of q processes, amplitudes and noise in standardised units, shape (q,)."""

    length_ms: Tensor
    amplitude: Tensor  # SD of the profile, or within a window of its deviation; 0 if a tap changes nothing
    noise: Tensor  # SD of a trial about it, if the relative noise variance is 1

    def picked(self, picks: Tensor) -> Hyperparameters:
        """Some of them."""
        return Hyperparameters(*(column[picks] for column in self))


class Places(NamedTuple):
    """Where q processes leave their constants, (q,); on the scale of transformed amplitudes."""

    middle_ms: Tensor
    sd_ms: Tensor  # of the share of an ISI; infinite if the share is 1 everywhere
    rise: Tensor  # mean of the profile in the middle
    rise_sd: Tensor  # of all ISIs together
    growth: Tensor  # log ratio of the noise SD in the middle and outside

    @classmethod
    def everywhere(cls, size: int) -> Places:
        """Processes that may leave their constants everywhere, in either direction, under equal noise."""
        zeros = torch.zeros(size, dtype=torch.float64)
        return cls(zeros, torch.full_like(zeros, torch.inf), zeros, zeros, zeros)

    def picked(self, picks: Tensor) -> Places:
        """Some of them."""
        return Places(*(column[picks] for column in self))

    def share(self, isi_ms: Tensor) -> Tensor:
        """The share of the profile that each ISI [ms] (t,) has, (q, t)."""
        steps = (isi_ms - self.middle_ms.unsqueeze(-1)) / self.sd_ms.unsqueeze(-1)
        return torch.exp(-0.5 * steps.square())

    def mean(self, isi_ms: Tensor) -> Tensor:
        """By how much each ISI [ms] (t,) lies above the constant on average, (q, t)."""
        return self.rise.unsqueeze(-1) * self.share(isi_ms)

    def log_growth(self, isi_ms: Tensor) -> Tensor:
        """Log ratio of the noise SD at each ISI [ms] (t,) and outside, (q, t).

        It grows with the square root of the share: on a flank most stimuli evoke nothing and some evoke much.
        """
        return self.growth.unsqueeze(-1) * self.share(isi_ms).sqrt()

    def slope(self, isi_ms: Tensor) -> Tensor:
        """By how much the mean changes with each ISI [1/ms], (q, t)."""
        steps = (isi_ms - self.middle_ms.unsqueeze(-1)) / self.sd_ms.unsqueeze(-1)
        return -self.mean(isi_ms) * steps / self.sd_ms.unsqueeze(-1)


@dataclass(frozen=True)
class WindowsPrior(Checked):
    """Profiles of the log MEP that leave their constant within one window.

    Args:
        p_window: probability that the tap changes anything.
        start: where windows start; it knows the hit delay. Noise is Gaussian, so that no chance is left to windows
            anywhere: one large MEP before the hit would be enough for them.
        width_ms: how wide they are, each a median and a log SD, as for what follows.
        rise: mean and SD of the largest rise of the log MEP [natural log].
        deviation: SD of the smooth deviation from a Gaussian rise [natural log].
        length_share: over which share of the width it varies.
        noise: SD of the log MEP outside the window.
        growth: ratio of its SD in the middle of the window and outside; near the motor threshold a stimulus in the
            window evokes much, or nothing.
        stray: share of trials whose log MEP scatters three times as far: outside the window most stimuli evoke nothing,
            and a few evoke much.
        ensemble: how many processes with a window stand for the prior.
    """

    p_window: Annotated[float, partial(number, above=0, most=1)] = 0.75
    start: StartPrior = field(default_factory=lambda: StartPrior(p_anywhere=0.0))
    width_ms: PositiveLaw = Scale(100.0, 0.45)
    rise: PositiveLaw = Scale(1.3, 0.6)
    deviation: Positive = 0.35
    length_share: Positive = 0.25
    noise: PositiveLaw = Scale(0.55, 0.2)
    growth: PositiveLaw = Scale(1.7, 0.25)
    stray: Annotated[float, partial(share, least=0, most=0.5)] = 0.1
    ensemble: Annotated[int, partial(whole, least=16, most=8192)] = 256

    def processes(self, space: DesignSpace) -> tuple[Hyperparameters, Places, Tensor]:
        """The ensemble in a space: those with a window, then those without; and the log prior of each."""
        return _processes(self, space)


@lru_cache(maxsize=64)
def _processes(prior: WindowsPrior, space: DesignSpace) -> tuple[Hyperparameters, Places, Tensor]:
    sequence = torch.quasirandom.SobolEngine(4, scramble=True, seed=DRAWN)  # type: ignore[no-untyped-call]
    drawn = sequence.draw(prior.ensemble, dtype=torch.float64).clamp(LEAST_QUANTILE, 1 - LEAST_QUANTILE)
    knots = prior.start.knots(space)
    start_ms = torch.as_tensor(np.interp(drawn[:, 0].numpy(), knots.below, knots.start_ms))
    z = torch.special.ndtri(drawn[:, 1:])
    laws = (prior.width_ms, prior.noise, prior.growth)
    width_ms, noise, growth = (law.median * torch.exp(law.sd * z[:, i]) for i, law in enumerate(laws))
    flat = torch.special.ndtri((torch.arange(FLAT, dtype=torch.float64) + 0.5) / FLAT)
    quiet = prior.noise.median * torch.exp(prior.noise.sd * flat)
    nowhere = Places.everywhere(FLAT)
    ones = torch.ones_like(start_ms)
    rising = Places(
        start_ms + 0.5 * width_ms, width_ms / WIDTH_SDS, prior.rise.median * ones, prior.rise.sd * ones, growth.log()
    )
    lengths, amplitudes = prior.length_share * width_ms, prior.deviation * ones
    with_and_without = (
        (lengths, torch.full_like(quiet, float(lengths.median()))),
        (amplitudes, torch.zeros_like(quiet)),
        (noise, quiet),
    )
    shares = torch.tensor([prior.p_window / prior.ensemble, (1.0 - prior.p_window) / FLAT], dtype=torch.float64)
    log_prior = shares.log().repeat_interleave(torch.tensor([prior.ensemble, FLAT]))
    places = Places(*(torch.cat(pair) for pair in zip(rising, nowhere, strict=True)))
    return Hyperparameters(*(torch.cat(pair) for pair in with_and_without)), places, log_prior
