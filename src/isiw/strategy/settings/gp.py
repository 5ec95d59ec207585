"""Settings of the strategies on a Gaussian process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from isiw.models.beliefs import prior_with
from isiw.models.gp import GaussianProcess
from isiw.models.gp.prior import HyperparameterPrior
from isiw.strategy.settings.common import PosteriorSettings

__all__ = ["GPSettings"]


@dataclass(frozen=True)
class GPSettings(PosteriorSettings):
    """Strategies on a Gaussian process; the rest as in `PosteriorSettings`.

    Args:
        kernel: `"rbf"` or `"matern"`.
        noise: `"equal"` at all ISIs, or `"by-isi"`.
        transform: of the MEP: `"log"`, `"sqrt"` or `"none"`.
        hyperparameters: `"marginalised"`, or the most likely ones, `"map"`.
        floor: what the 0.135 rule is applied above: `"subtracted"`, `"zeroed"` or `"raw"`.
        samples: how many paths represent the posterior.
        prior: settings of `isiw.models.gp.prior.HyperparameterPrior` that differ from its defaults.
        detection_limit_mv: what a told amplitude of 0 is known to be below [mV].
        zero_below_mv: threshold of the floor `"zeroed"` [mV].

    Raises:
        InvalidValueError: a value that cannot be, or a setting that the prior does not have.
    """

    acquisition: str = "straddle"
    initial_trials: int = 5
    kernel: str = "matern"
    noise: str = "equal"
    transform: str = "log"
    hyperparameters: str = "marginalised"
    floor: str = "subtracted"
    samples: int = 256
    prior: Mapping[str, Any] = field(default_factory=dict)
    detection_limit_mv: float = 0.005
    zero_below_mv: float = 0.025

    def model(self) -> GaussianProcess:
        """The Gaussian process."""
        names = ("kernel", "noise", "transform", "hyperparameters", "floor", "samples")
        chosen = {name: getattr(self, name) for name in (*names, "detection_limit_mv", "zero_below_mv")}
        return GaussianProcess(beliefs=prior_with(self.prior, HyperparameterPrior), **chosen)
