"""What a model of one person's responses, and its posterior, must answer.

A model is a frozen settings object with two verbs: `prior` gives the posterior before any trial, `update` gives the
posterior after one more. A posterior never changes; it holds `b` people at once, and one person is b = 1. Acquisition
functions and strategies see these protocols only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias, runtime_checkable

import torch

from isiw.design import DesignSpace
from isiw.window import WindowEstimate

__all__ = ["Observation", "Posterior", "PredictsOutcomes", "ResponseModel", "SamplesWindows", "Tensor"]

Tensor: TypeAlias = torch.Tensor


@dataclass(frozen=True, eq=False)
class Observation:
    """One trial of each of b people, as told to a model.

    Args:
        isi_ms: the realised ISI [ms], shape (b,); NaN means TMS alone.
        mep_mv: amplitude of the MEP [mV], shape (b,); 0 is left-censored at the detection limit; NaN where only
            `response` is known.
        isi_sd_ms: SD of the realised ISI [ms], shape (b,).
        response: 1 seen, 0 not seen, NaN where the amplitude is told instead, shape (b,).
    """

    isi_ms: Tensor
    mep_mv: Tensor
    isi_sd_ms: Tensor
    response: Tensor


@runtime_checkable
class Posterior(Protocol):
    """What is believed about b people after the trials so far."""

    @property
    def trials(self) -> int:
        """How many trials of each person it has been told."""

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""


@runtime_checkable
class PredictsOutcomes(Protocol):
    """Capability: the predictive distribution of the next MEP, sample by sample."""

    def outcome_mass(self, isi_ms: Tensor) -> tuple[Tensor, Tensor]:
        """Probability of each value of the next MEP, on a grid of values that covers all of them.

        Args:
            isi_ms: candidate ISIs [ms], shape (t,).

        Returns:
            Weights of the posterior samples, shape (b, s), and the probability of each value given each sample,
            shape (b, s, t, y), summing to 1 over y.
        """


@runtime_checkable
class SamplesWindows(Protocol):
    """Capability: windows sampled from the posterior, the same samples as in `outcome_mass`."""

    def window_masks(self, isi_ms: Tensor) -> Tensor:
        """Which ISIs [ms] (shape (t,)) each sampled window holds, as 0 or 1, shape (b, s, t); all 0 means no window."""


@runtime_checkable
class ResponseModel(Protocol):
    """A model: settings, from which posteriors are made."""

    def prior(self, space: DesignSpace, seed: int, people: int = 1) -> Posterior:
        """The posterior before the first trial."""

    def update(self, posterior: Any, observation: Observation) -> Posterior:
        """The posterior after one more trial."""
