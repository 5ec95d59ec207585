"""Settings of the strategies on the parametric window model."""

from __future__ import annotations

from dataclasses import dataclass, field

from isiw.models.parametric import ParametricModel
from isiw.strategy.settings.common import Asking, Stopping


@dataclass(frozen=True)
class ParametricSettings:
    """Strategies on the parametric window model.

    Args:
        model: the parametric model.
        asking: what is asked.
        stopping: when to stop.
    """

    model: ParametricModel = field(default_factory=ParametricModel)
    asking: Asking = field(default_factory=Asking)
    stopping: Stopping = field(default_factory=Stopping)
