"""The vectorised engine: a batch of people, examined side by side by one strategy.

Models hold b people at once, on a CPU or a GPU. Each person's session follows the rules of a single one
(`isiw.strategy.course`); only the draws of the models' randomness differ, so that a batch of one is that one session.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, is_dataclass, replace
from typing import Any

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.errors import StudyError
from isiw.estimate import WindowEstimate
from isiw.lazy import pd, torch
from isiw.models.protocol import Observation, Posterior, ReportsTrouble, Tensor
from isiw.strategy.choice import Choice, instead_of_lost
from isiw.strategy.course import Method
from isiw.strategy.stopping import StopDecision
from isiw.strategy.strategy import Strategy
from isiw.studies.execution import one_torch_thread
from isiw.studies.players import Player
from isiw.studies.sessions import SimulatedSession, examine
from isiw.subjects.subject import Response


def simulate_batch(sessions: Sequence[SimulatedSession], device: str = "cpu") -> pd.DataFrame:
    """Run sessions side by side; columns as in `examine`."""
    with one_torch_thread():
        return examine(sessions, _Batch(sessions, device))


class _Batch:
    """A strategy with b people; the counterpart of `Strategy`, without TMS alone and without deadlines."""

    def __init__(self, sessions: Sequence[SimulatedSession], device: str) -> None:
        if len({(session.strategy, repr(session.settings)) for session in sessions}) > 1:
            raise StudyError(
                "the people of a batch have strategies with different settings",
                remedy="Run them in batches of their own.",
            )
        players = [_strategy(session.player()) for session in sessions]
        first = players[0]
        model: Any = first.model
        if is_dataclass(first.model) and hasattr(first.model, "device"):
            model = replace(first.model, device=device)
        acquisition, all_of_them = first.acquisition, [player.acquisition for player in players]
        if any(each != acquisition for each in all_of_them):
            acquisition = _EachTheirOwn(all_of_them)
        method = Method(first.space, model, acquisition, first.stopping, first.initial_ms, first.cost)
        self.stopping = first.stopping
        self.course = method.begin(first.seed, len(players))
        self.mistrials, self.lost = [0] * len(players), [0] * len(players)

    def ask(self) -> Sequence[Choice]:
        return self.course.choices

    def tell(self, responses: Sequence[Response]) -> None:
        isis_ms = [self.course.method.space.check_realised(r.isi_ms) for r in responses if r.isi_ms is not None]
        meps_mv, sds_ms = [r.mep_mv for r in responses], [r.isi_sd_ms for r in responses]
        self.course = self.course.after(Observation.of(isis_ms, meps_mv, sds_ms))
        self.lost = [0] * len(responses)

    def count_mistrial(self, person: int, lost: Choice) -> Choice:
        self.mistrials[person] += 1
        self.lost[person] += 1
        delivered = self.course.told + self.mistrials[person]
        other = instead_of_lost(self.course.method.space, self.lost[person], delivered)
        if other is None or self.course.plans_ahead:
            return lost
        self.lost[person] = 0
        return other

    def estimate(self, person: int) -> WindowEstimate:
        return self.course.estimate(person)

    def decision(self, person: int) -> StopDecision:
        return self.course.decision(person, self.mistrials[person])

    def trouble(self) -> bool | None:
        """Whose fit failed is not known; only whether any did."""
        posterior = self.course.posterior
        failed = isinstance(posterior, ReportsTrouble) and posterior.trouble is not None
        return None if failed and self.course.people > 1 else failed


def _strategy(player: Player) -> Strategy:
    if not isinstance(player, Strategy):
        raise StudyError(
            "only a model with an acquisition function examines people side by side",
            got=type(player).__name__,
            expected="an isiw.Strategy",
            remedy='Use engine = "single".',
        )
    return player


@dataclass(frozen=True)
class _EachTheirOwn:
    """Acquisition functions that draw: one a person, with a seed of their own."""

    functions: Sequence[AcquisitionFunction]

    @property
    def needs(self) -> tuple[type, ...]:
        return self.functions[0].needs

    def __call__(self, posterior: Posterior, isi_ms: Tensor) -> Tensor:
        scores = (score(posterior, isi_ms).expand(len(self.functions), -1) for score in self.functions)
        return torch.stack([of_all[person] for person, of_all in enumerate(scores)])
