"""Settings of the strategy for TMS above the motor threshold."""

from __future__ import annotations

from dataclasses import dataclass, field

from isiw.checks import Checked, Count
from isiw.models.particles.supra import SupraModel
from isiw.strategy.settings.common import Asking
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


@dataclass(frozen=True)
class SupraSettings:
    """The strategy for TMS above the motor threshold.

    Args:
        model: the particle posterior with both kinds of segment.
        asking: what is asked.
        stopping: when to stop.
    """

    model: SupraModel = field(default_factory=SupraModel)
    asking: Asking = field(default_factory=Asking)
    stopping: SupraStopping = field(default_factory=SupraStopping)
