"""Settings of the strategies on the particle posterior, the default among them."""

from __future__ import annotations

from dataclasses import dataclass, field

from isiw.models.particles import ParticleModel
from isiw.strategy.settings.common import Asking, Stopping


@dataclass(frozen=True)
class ParticleSettings:
    """Strategies on the particle posterior.

    Args:
        model: the particle posterior.
        asking: what is asked.
        stopping: when to stop.
    """

    model: ParticleModel = field(default_factory=ParticleModel)
    asking: Asking = field(default_factory=Asking)
    stopping: Stopping = field(default_factory=Stopping)
