"""Simulated sessions: one person and a strategy, or some people side by side, to rows of a table.

Every strategy meets the same people with the same trial noise, so that differences can be read pairwise.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from isiw.acquisition.protocol import AcquisitionFunction, require_scores
from isiw.checks import Checked, Count, Natural, Positive, whole
from isiw.decision import StopDecision
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError, StudyError
from isiw.estimate import WindowEstimate
from isiw.lazy import pd
from isiw.metrics import covers, f1
from isiw.models.protocol import Observation, Posterior, ReportsTrouble
from isiw.signals import wrong_isi
from isiw.strategy.catalogue import known_settings, make_strategy
from isiw.strategy.choice import Choice, instead_of_lost
from isiw.strategy.course import Course, Known, Method
from isiw.strategy.decisions import stimuli_left
from isiw.strategy.outcomes import Outcome, Outcomes
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy
from isiw.studies.execution import one_thread
from isiw.studies.players import Alone, OwnCode, Player, Reported
from isiw.subjects.cohorts import COHORTS, person_of
from isiw.subjects.subject import Response, SimulatedSubject
from isiw.summary import bayes_factor
from isiw.types import Array, Reference
from isiw.window import Window

TIMES = ("ask_ms", "tell_ms")
"""Columns that differ each time a session is run."""

_OF_THE_STOP = ("f1", "start_covered", "end_covered")

_MOST_DELIVERIES = 1000

OWN_STRATEGY = 'One of your own objects takes part through run_study: see "A strategy of your own" in docs/studies.md.'
"""The way out if a strategy is given in the place of its name."""

Stopping: TypeAlias = Literal["ignored", "noted", "ends"]


def require_cohorts(names: Iterable[object]) -> None:
    """Raise if something is not the name of a cohort."""
    if unknown := [name for name in names if not (isinstance(name, str) and name in COHORTS)]:
        raise InvalidValueError(
            "unknown cohorts",
            got=[name if isinstance(name, str) else f"<{type(name).__name__}>" for name in unknown],
            expected=", ".join(COHORTS),
            remedy='Your own people take part through run_study: see "People of your own" in docs/studies.md.',
        )


@dataclass(frozen=True)
class SimulatedSession(Checked):
    """One session of a study.

    Args:
        strategy: a named strategy; with a player of one's own only what it is called.
        cohort: a named cohort; if a subclass gives people of its own, only what they are called.
        person: which person of it, from 0.
        seed: seed of the cohort; trial noise and strategy use `seed + person`.
        trials: how many trials to run at most.
        marks: after which trials the estimate is recorded; 0 is before any. Trials with an outcome count, no mistrials.
        space: the design space.
        settings: settings of the strategy, as (name, value) pairs.
        label: what the strategy is called in the table; by default its name.
        stopping: the strategy's stopping rule is `"ignored"`, or `"noted"` when it fires, or `"ends"` the session.
        amplitude: factor on all of the person's amplitudes, as of another rig or muscle.
        own: code of one's own that makes the strategy; None for a named one.

    Raises:
        InvalidValueError: no trial, no mark or one beyond the trials, or an invalid number, cohort or choice.
    """

    strategy: str
    cohort: str
    person: Natural
    seed: Natural
    trials: Count
    marks: tuple[int, ...]
    space: DesignSpace = VALVE_SPACE
    settings: tuple[tuple[str, Any], ...] = field(default=())
    label: str = ""
    stopping: Stopping = "ignored"
    amplitude: Positive = 1.0
    own: OwnCode | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.strategy, str):
            what = "a session knows its strategy by a name"
            raise InvalidValueError(what, got=type(self.strategy).__name__, expected="a text", remedy=OWN_STRATEGY)
        if type(self).subject is SimulatedSession.subject:
            require_cohorts([self.cohort])
        given = tuple(self.marks) if isinstance(self.marks, Iterable) else (self.marks,)
        if not given:
            raise InvalidValueError("a session without a mark has no rows", remedy=f"Give it marks=({self.trials},).")
        what = f"a mark of a session of {self.trials} trials"
        object.__setattr__(self, "marks", tuple(whole(what, mark, least=0, most=self.trials) for mark in given))

    def subject(self) -> SimulatedSubject:
        """The simulated person."""
        usual = person_of(self.cohort, self.person, self.seed)
        return replace(usual, scale=self.amplitude * usual.scale)

    def as_the_rig_states(self) -> SimulatedSession:
        """The same with hit delay (from the valve) and stimulus as the rig states them, if the strategy has a use."""
        subject = self.subject()
        delay_ms = subject.stated_hit_delay_ms if self.space.reference == "valve" else None
        stimulus = None if subject.conditioning == "tap" else subject.conditioning
        return self._knowing({"hit_delay_ms": delay_ms, "conditioning": stimulus})

    def as_the_visit_states(self) -> SimulatedSession:
        """The same with the intensity as a setting of the strategy, if it is stated and the strategy can use it."""
        return self._knowing({"intensity_pct_rmt": self.subject().stated_intensity_pct_rmt})

    def _knowing(self, stated: Mapping[str, Any]) -> SimulatedSession:
        if self.own is not None:  # which knows its settings alone
            return self
        known = known_settings(self.strategy, stated)
        return replace(self, settings=tuple((known | dict(self.settings)).items()))

    def player(self) -> Player:
        """The strategy before its first trial."""
        seed, settings = self.seed + self.person, dict(self.settings)
        if self.own is not None:
            return self.own.player(self.space, seed, settings)
        strategy = make_strategy(self.strategy, self.space, seed, **settings)
        if strategy.intensities:
            raise StudyError(
                "a study gives all pairs the person's usual intensity",
                got=f"intensities_pct_rmt = {strategy.intensities.named_pct_rmt}",
                remedy="Leave intensities_pct_rmt out, or run sessions of several intensities with isiw.Session.",
            )
        return strategy


def simulate(session: SimulatedSession) -> pd.DataFrame:
    """Run one session with its named strategy, to rows with the :doc:`columns </studies>` of a study."""
    with one_thread():
        return play(session, session.player())


def play(session: SimulatedSession, player: Player) -> pd.DataFrame:
    """Run one session with any player, to rows with the :doc:`columns </studies>` of a study.

    Args:
        session: the session.
        player: what chooses ISIs in it.
    """
    return examine([session], Alone(player))


def examine(sessions: Sequence[SimulatedSession], crowd: Alone | _Batch) -> pd.DataFrame:
    """Run sessions of equally many trials side by side."""
    people = [_Participant(session, number, crowd) for number, session in enumerate(sessions)]
    for trial in range(1, sessions[0].trials + 1):
        began_s = time.perf_counter()
        choices = crowd.ask()
        asked_s = time.perf_counter()
        responses = [person.respond(trial, choice) for person, choice in zip(people, choices, strict=True)]
        answered_s = time.perf_counter()
        crowd.tell(responses)
        learnt_s = time.perf_counter()
        spent_ms = [1e3 * spent_s / len(people) for spent_s in (asked_s - began_s, learnt_s - answered_s)]
        for person in people:
            person.note(trial, dict(zip(TIMES, spent_ms, strict=True)))
        if all(person.ended for person in people):
            break
    return pd.DataFrame([row for person in people for row in person.rows])


class _Participant:
    """One person in a running session, and what is noted about it."""

    def __init__(self, session: SimulatedSession, number: int, crowd: Alone | _Batch) -> None:
        subject = session.subject()
        self.session, self.number, self.crowd = session, number, crowd
        self.still = subject.window(session.space) if subject.change is None else None
        self.responder = subject.begin(session.seed + session.person)
        self.mistrials = self.fallbacks = 0
        self.troubles = 0.0
        converged = math.nan if session.stopping == "ignored" else 0.0
        self.stop: dict[str, Any] = {"stop_trial": math.nan, "stop_kind": "", "stop_reason": "", "converged": converged}
        self.stop |= {f"stop_{name}": math.nan for name in _OF_THE_STOP}
        self.rows = [self._row(0) | dict.fromkeys(TIMES, math.nan)] if 0 in session.marks else []

    @property
    def truth(self) -> Window | None:
        """The true window now; in a person who does not change, always the same."""
        responder = self.responder
        if responder.subject.change is None:
            return self.still
        return responder.subject.window(self.session.space, responder.trials)

    @property
    def ended(self) -> bool:
        return self.session.stopping == "ends" and not math.isnan(self.stop["stop_trial"])

    def respond(self, trial: int, choice: Choice) -> Response:
        """Deliver pairs until one is learnt; the first has the same noise with every strategy, others their own."""
        space = self.session.space
        respond: Callable[[float, Reference], Response] = self.responder.respond
        for _ in range(_MOST_DELIVERIES):
            response = respond(choice.isi_ms, space.reference)
            if response.isi_ms is not None and wrong_isi(response.isi_ms, choice.isi_ms, space) is None:
                self.fallbacks += choice.fallback is not None and not self.ended
                return response
            choice, respond = self._after_mistrial(trial, choice), self.responder.respond_instead
        raise StudyError(
            "a person's realised ISIs are hardly ever near enough to the commanded one",
            got=f"{_MOST_DELIVERIES} mistrials in a row at {choice.isi_ms:g} ms",
            expected=f"ISIs within {space.tolerance_ms:g} ms of it",
            remedy="Give the space a wider tolerance_ms.",
        )

    def _after_mistrial(self, trial: int, lost: Choice) -> Choice:
        going_on = not self.ended
        self.mistrials += going_on
        choice = self.crowd.count_mistrial(self.number, lost)
        if going_on:
            self._note_stop(trial - 1 + self.mistrials)
            self._note_marks(trial, dict.fromkeys(TIMES, math.nan), reached=False)
        return choice

    def note(self, trial: int, spent_ms: dict[str, float]) -> None:
        if self.ended:
            return
        trouble = self.crowd.trouble()
        self.troubles += math.nan if trouble is None else trouble
        self._note_stop(trial + self.mistrials)
        self._note_marks(trial, spent_ms, reached=True)

    def _note_marks(self, trial: int, spent_ms: dict[str, float], *, reached: bool) -> None:
        """Note a trial that was learnt (`reached`), and if the session has ended all that would have come."""
        marks = [m for m in self.session.marks if (reached and m == trial) or (self.ended and m >= trial + reached)]
        if marks:
            row = self._row(trial - (not reached) + self.mistrials) | spent_ms
            self.rows += [row | {"trial": mark} for mark in marks]

    def _note_stop(self, delivered: int) -> None:
        """Note where the rule fires first; it is not asked if it is ignored."""
        if self.session.stopping == "ignored" or not math.isnan(self.stop["stop_trial"]):
            return
        rule = self.crowd.stopping
        if rule is not None and (decision := self.crowd.decision(self.number)).stop:
            left = stimuli_left(rule, delivered)
            why = {"stop_kind": str(decision.kind), "stop_reason": decision.reason}
            self.stop = {"stop_trial": float(delivered), **why, "converged": float(left != 0)}
            judged = _judged(self.crowd.estimate(self.number), self.truth, self.session.space)
            self.stop |= {f"stop_{name}": judged[name] for name in _OF_THE_STOP}

    def _row(self, delivered: int) -> dict[str, Any]:
        session = self.session
        who = {"strategy": session.label or session.strategy, "cohort": session.cohort, "person": session.person}
        counts = {"seed": session.seed, "trial": 0, "delivered": delivered, "mistrials": self.mistrials}
        judged = _judged(self.crowd.estimate(self.number), self.truth, session.space)
        return who | counts | judged | {"fallbacks": self.fallbacks, "troubles": self.troubles} | self.stop


def _judged(estimate: Reported, truth: Window | None, space: DesignSpace) -> dict[str, Any]:
    posterior = estimate if isinstance(estimate, WindowEstimate) else None
    reported = posterior.window if posterior is not None else estimate
    factor = None if posterior is None else bayes_factor(posterior.probability, posterior.beforehand)
    covered = None if posterior is None else covers(posterior, truth, space)
    return {
        "f1": f1(estimate, truth, space),
        "true_window": truth is not None,
        "answered": posterior is None or posterior.has_answer,
        "reported_window": reported is not None,
        "start_ms": math.nan if reported is None else reported.start_ms,
        "end_ms": math.nan if reported is None else reported.end_ms,
        "probability": math.nan if posterior is None or posterior.probability is None else posterior.probability,
        "bayes_factor": math.nan if factor is None else factor,
        "expected_f1": math.nan if posterior is None or posterior.expected_f1 is None else posterior.expected_f1,
        "start_covered": math.nan if covered is None else float(covered[0]),
        "end_covered": math.nan if covered is None else float(covered[1]),
    }


def simulate_batch(sessions: Sequence[SimulatedSession]) -> pd.DataFrame:
    """Run sessions side by side, by the rules of single ones; only the models' draws differ."""
    with one_thread():
        return examine(sessions, _Batch(sessions))


class _Batch:
    """A strategy with b people, as `Alone` is with one: without TMS alone and without deadlines."""

    def __init__(self, sessions: Sequence[SimulatedSession]) -> None:
        if len({(session.strategy, repr(session.settings)) for session in sessions}) > 1:
            raise StudyError(
                "the people of a batch have strategies with different settings",
                remedy="Run them in batches of their own.",
            )
        players = [_strategy(session.player()) for session in sessions]
        first = players[0]
        self.players, acquisition = players, first.acquisition
        if any(player.acquisition != acquisition for player in players):
            acquisition = _EachTheirOwn([player.acquisition for player in players])
        ignored = all(session.stopping == "ignored" for session in sessions)
        # A rule that nobody asks need not look back, for which past posteriors would be kept.
        self.stopping = Budget(sessions[0].trials) if ignored else first.stopping
        method = Method(first.space, first.model, acquisition, self.stopping, first.initial_ms, first.cost)
        self.course = method.begin(first.seed, len(players))
        self.alone = dict[int, Course]()
        self.together = Outcomes(first.space.reference, first.amplitude_step_mv or 0.0)
        self.outcomes = [Outcomes(first.space.reference, first.amplitude_step_mv)] * len(players)
        self.mistrials, self.lost = [0] * len(players), [0] * len(players)

    def ask(self) -> Sequence[Choice]:
        together = enumerate(self.course.choices)
        return [self.alone[person].choices[0] if person in self.alone else choice for person, choice in together]

    def tell(self, responses: Sequence[Response]) -> None:
        check, before = self.course.method.space.check_realised, self.outcomes
        told = [Outcome(check(r.isi_ms), r.mep_mv, isi_sd_ms=r.isi_sd_ms) for r in responses if r.isi_ms is not None]
        self.outcomes = [outcomes.after(one) for outcomes, one in zip(before, told, strict=True)]
        self.course = self.course.after(Observation.side_by_side([self.together.observation(one) for one in told]))
        for person, (outcomes, one) in enumerate(zip(self.outcomes, told, strict=True)):
            if outcomes.step_mv != before[person].step_mv:  # amplitudes turn out to be rounded: from here on alone
                player = self.players[person]
                course = replace(self.course.method, acquisition=player.acquisition).begin(player.seed)
                self.alone[person] = course.again(player.seed, outcomes.observations)
            elif person in self.alone:
                self.alone[person] = self.alone[person].after(outcomes.observation(one))
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

    def _known(self, person: int) -> Known:
        course, number = (self.alone[person], 0) if person in self.alone else (self.course, person)
        limit_mv = self.players[person].detection_limit_mv
        return Known(course, self.outcomes[person], limit_mv, number, self.mistrials[person])

    def estimate(self, person: int) -> WindowEstimate:
        return self._known(person).estimate()

    def decision(self, person: int) -> StopDecision:
        return self._known(person).decision()

    def trouble(self) -> bool | None:
        """Whose fit failed is not known; only whether any did."""
        posteriors = [course.posterior for course in (self.course, *self.alone.values())]
        failed = any(isinstance(each, ReportsTrouble) and each.trouble is not None for each in posteriors)
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

    def __call__(self, posterior: Posterior, isi_ms: Array) -> Array:
        people, isis = len(self.functions), len(isi_ms)
        given = (require_scores(score, score(posterior, isi_ms), isis, people) for score in self.functions)
        return np.stack([np.broadcast_to(scores, (people, isis))[person] for person, scores in enumerate(given)])
