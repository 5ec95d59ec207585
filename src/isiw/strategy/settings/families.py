"""The usual settings of each family of strategies; loaded, with its models, when a strategy of one is made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from isiw.checks import Checked, Count
from isiw.models.gp import GaussianProcess
from isiw.models.parametric import ParametricModel
from isiw.models.particles import ParticleModel
from isiw.models.particles.supra import SupraModel
from isiw.strategy.settings.common import Choosing, Settings, Stopping
from isiw.strategy.stopping import Budget, StoppingRule


@dataclass(frozen=True)
class SupraStopping(Checked):
    """When the strategy stops: the rules of the default look at the window alone, and would leave a depression unknown.

    Args:
        max_trials: stop after this many stimuli; mistrials count, control trials do not.
    """

    max_trials: Count = 60

    def rule(self, initial: int) -> StoppingRule:  # noqa: ARG002 - the budget counts from the first stimulus
        """The budget used up."""
        return Budget(self.max_trials)


PARTICLES: Final = Settings(ParticleModel(), Choosing(), Stopping())
SUPRA: Final = Settings(SupraModel(), Choosing(), SupraStopping())
PARAMETRIC: Final = Settings(ParametricModel(), Choosing(), Stopping())
GAUSSIAN_PROCESS: Final = Settings(GaussianProcess(), Choosing("straddle", initial_trials=5), Stopping())
