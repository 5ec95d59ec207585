"""The usual settings of each family of strategies; loaded, with its models, when a strategy of one is made."""

from __future__ import annotations

from typing import Final

from isiw.models.gp import GaussianProcess, ProcessSettings
from isiw.models.parametric import ParametricModel
from isiw.models.particles import ParticleModel
from isiw.models.particles.supra import SupraModel
from isiw.strategy.settings.common import Choosing, Settings, Stopping
from isiw.strategy.stopping import Budget

PARTICLES: Final = Settings(ParticleModel(), Choosing(), Stopping())
# The rules of the default look at the window alone, and would leave a depression unknown.
SUPRA: Final = Settings(SupraModel(), Choosing(), Budget(60))
PARAMETRIC: Final = Settings(ParametricModel(), Choosing(), Stopping())
GAUSSIAN_PROCESS: Final = Settings(
    GaussianProcess(ProcessSettings(profile="window")), Choosing("straddle", initial_trials=5), Stopping()
)
