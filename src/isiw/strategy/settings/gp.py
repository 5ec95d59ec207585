"""Settings of the strategies on a Gaussian process."""

from __future__ import annotations

from dataclasses import dataclass, field

from isiw.models.gp import GaussianProcess
from isiw.strategy.settings.common import Asking, Stopping


@dataclass(frozen=True)
class GPSettings:
    """Strategies on a Gaussian process.

    Args:
        model: the Gaussian process.
        asking: what is asked.
        stopping: when to stop.
    """

    model: GaussianProcess = field(default_factory=GaussianProcess)
    asking: Asking = field(default_factory=lambda: Asking("straddle", initial_trials=5))
    stopping: Stopping = field(default_factory=Stopping)
