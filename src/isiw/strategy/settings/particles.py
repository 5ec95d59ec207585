"""Settings of the strategies on the particle posterior, the default among them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from isiw.models.beliefs import prior_with
from isiw.models.particles import ParticleModel
from isiw.models.particles.prior import Prior
from isiw.strategy.settings.common import PosteriorSettings

__all__ = ["ParticleSettings"]


@dataclass(frozen=True)
class ParticleSettings(PosteriorSettings):
    """Strategies on the particle posterior; the rest as in `PosteriorSettings`.

    Args:
        particles: how many particles the posterior has.
        prior: settings of `isiw.models.particles.prior.Prior` that differ from its defaults.
        detection_limit_mv: what a told amplitude of 0 is known to be below [mV].
        response_threshold_mv: what a told response is known to be above [mV].

    Raises:
        InvalidValueError: a value that cannot be, or a setting that the prior does not have.
    """

    particles: int = 1000
    prior: Mapping[str, Any] = field(default_factory=dict)
    detection_limit_mv: float = 0.005
    response_threshold_mv: float = 0.02

    def model(self) -> ParticleModel:
        """The particle model."""
        return ParticleModel(
            beliefs=prior_with(self.prior, Prior),
            particles=self.particles,
            detection_limit_mv=self.detection_limit_mv,
            response_threshold_mv=self.response_threshold_mv,
        )
