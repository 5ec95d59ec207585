"""The vectorised engine: a batch of people, examined side by side by one strategy.

Models hold b people at once, on a CPU or a GPU. Each person follows the law that one session follows
(`isiw.strategy.choosing`); only the draws of the models' randomness differ, so that a batch of one is that one session.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import is_dataclass, replace
from functools import partial
from typing import Any

import pandas as pd
import torch

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.models.protocol import Observation, Posterior, ReportsTrouble, ResponseModel
from isiw.strategy.choosing import Choice, best_choices, planned_choices, remembered
from isiw.strategy.stopping import Progress, StopDecision
from isiw.studies.sessions import SimulatedSession, examine
from isiw.subjects.subject import Response
from isiw.window import WindowEstimate

__all__ = ["simulate_batch"]


def simulate_batch(sessions: Sequence[SimulatedSession], device: str = "cpu") -> pd.DataFrame:
    """Run sessions side by side; columns as in `examine`.

    Args:
        sessions: sessions of one strategy, alike but for the person; the first gives the seed of the models' draws.
        device: torch device of the models that have one; the others compute on the CPU.
    """
    torch.set_num_threads(1)
    return examine(sessions, _Batch(sessions, device))


class _Batch:
    """A strategy with b people; the counterpart of `Strategy`, without TMS alone and without deadlines."""

    def __init__(self, sessions: Sequence[SimulatedSession], device: str) -> None:
        players = [session.player() for session in sessions]
        first = players[0]
        self.people, self.space, self.cost = len(players), first.space, first.cost
        self.stopping, self.initial_ms = first.stopping, first.initial_ms
        self.model = _on_device(first.model, device)
        # Most acquisition functions draw nothing, and then one serves all.
        self.acquisitions = [player.acquisition for player in players]
        self.alike = all(acquisition == first.acquisition for acquisition in self.acquisitions)
        self.posterior: Posterior = self.model.prior(self.space, first.seed, self.people)
        self.told = 0
        self.mistrials = [0] * self.people
        self.past: list[tuple[WindowEstimate, ...]] = [()] * self.people
        self.estimates: dict[int, WindowEstimate] = {}

    def ask(self) -> Sequence[Choice]:
        first, left = self.acquisitions[0], self.initial_ms[self.told :]
        if planned := planned_choices(self.posterior, first, self.space, left, self.people):
            return planned
        if self.alike:
            return self._best(first)
        return [self._best(acquisition)[person] for person, acquisition in enumerate(self.acquisitions)]

    def _best(self, acquisition: AcquisitionFunction) -> list[Choice]:
        return best_choices(self.posterior, acquisition, self.space, told=self.told, people=self.people, cost=self.cost)

    def tell(self, responses: Sequence[Response]) -> None:
        isis_ms = [self.space.check_realised(r.isi_ms) for r in responses if r.isi_ms is not None]
        observation = Observation(
            isi_ms=torch.tensor(isis_ms),
            mep_mv=torch.tensor([response.mep_mv for response in responses]),
            isi_sd_ms=torch.tensor([response.isi_sd_ms for response in responses]),
            response=torch.full((self.people,), torch.nan),
        )
        self.posterior = self.model.update(self.posterior, observation)
        self.told += 1
        self.estimates = {}
        since_initial = self.told - len(self.initial_ms)
        self.past = [
            remembered(past, partial(self.estimate, person), self.stopping, since_initial)
            for person, past in enumerate(self.past)
        ]

    def count_mistrial(self, person: int) -> None:
        self.mistrials[person] += 1

    def estimate(self, person: int) -> WindowEstimate:
        if person not in self.estimates:
            self.estimates[person] = self.posterior.estimate(person)
        return self.estimates[person]

    def decision(self, person: int) -> StopDecision:
        delivered = self.told + self.mistrials[person]
        return self.stopping(Progress(delivered, self.told, self.estimate(person), past=self.past[person]))

    def trouble(self) -> bool | None:
        """Whose fit it was is not told, except that nobody's failed."""
        failed = isinstance(self.posterior, ReportsTrouble) and self.posterior.trouble is not None
        return None if failed and self.people > 1 else failed


def _on_device(model: ResponseModel, device: str) -> Any:
    """The model on a torch device, where it has one."""
    return replace(model, device=device) if is_dataclass(model) and hasattr(model, "device") else model
