"""Settings of the strategies on the parametric window model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from isiw.models.beliefs import prior_with
from isiw.models.parametric import ParametricModel
from isiw.models.parametric.prior import Likelihood, WindowPrior
from isiw.strategy.settings.common import PosteriorSettings

__all__ = ["ParametricSettings"]


@dataclass(frozen=True)
class ParametricSettings(PosteriorSettings):
    """Strategies on the parametric window model; the rest as in `PosteriorSettings`.

    Args:
        likelihood: how MEPs scatter: "gamma", "log-normal" or "input-noise".
        samples: how many equally weighted samples the posterior has.
        prior: settings of `isiw.models.parametric.prior.WindowPrior` that differ from its defaults.
        detection_limit_mv: what a told amplitude of 0 is known to be below [mV].
        response_threshold_mv: what a told response is known to be above [mV].

    Raises:
        InvalidValueError: a value that cannot be, or a setting that the prior does not have.
    """

    likelihood: Likelihood = "input-noise"
    samples: int = 512
    prior: Mapping[str, Any] = field(default_factory=dict)
    detection_limit_mv: float = 0.005
    response_threshold_mv: float = 0.02

    def model(self) -> ParametricModel:
        """The parametric model."""
        return ParametricModel(
            beliefs=prior_with(self.prior, WindowPrior),
            likelihood=self.likelihood,
            samples=self.samples,
            detection_limit_mv=self.detection_limit_mv,
            response_threshold_mv=self.response_threshold_mv,
        )
