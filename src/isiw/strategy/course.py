"""The course of the examination of b people: outcomes learnt so far, what is known, and what is asked of each next."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from isiw.acquisition.protocol import AcquisitionFunction, FollowsPlan, own_plan
from isiw.checks import can
from isiw.decision import StopDecision, StopKind
from isiw.design import DesignSpace
from isiw.errors import StrategyError
from isiw.estimate import WindowEstimate
from isiw.findings import Finding, Kind
from isiw.lazy import Later, WorkedOut
from isiw.models.protocol import ExpectsTheUsual, NotesChanges, Observation, Posterior, ProposesIsi, ResponseModel
from isiw.signals.plausible import is_silent
from isiw.strategy.choice import Choice, Cost, best_choices, evenly_spaced
from isiw.strategy.decisions import Progress, StoppingRule, looks_back
from isiw.strategy.intensities import NONE, Intensities
from isiw.strategy.outcomes import Outcomes
from isiw.summary import lacking


@dataclass(frozen=True)
class Method:
    """The method by which people are examined: the parts of a `Strategy`."""

    space: DesignSpace
    model: ResponseModel
    acquisition: AcquisitionFunction
    stopping: StoppingRule
    initial_ms: tuple[float, ...] = ()
    cost: Cost | None = None
    intensities: Intensities = NONE

    def begin(self, seed: int, people: int = 1) -> Course:
        """The course before the first trial."""
        posterior = self.model.begin(self.space, seed, people)

        def probabilities() -> tuple[float | None, ...]:
            return tuple(posterior.estimate(person).probability for person in range(people))

        # Of many people no second posterior is kept, which takes a quarter of a megabyte each.
        before = Beforehand(Later(probabilities) if people == 1 else probabilities())
        return Course(self, posterior, people, before)


@dataclass(frozen=True, eq=False)
class Beforehand:
    """The probability of a window of each of b people before any trial."""

    probabilities: WorkedOut[tuple[float | None, ...]] = field(default=WorkedOut("probabilities", ()))


@dataclass(frozen=True, eq=False)
class Estimates:
    """The estimates of b people after so many pairs, each made once if somebody asks; then no posterior is kept."""

    posterior: Posterior | None
    pairs: int
    beforehand: Beforehand
    made: dict[int, WindowEstimate] = field(default_factory=dict)

    def estimate(self, person: int) -> WindowEstimate:
        """The estimate of the window of one person."""
        if person not in self.made and self.posterior is not None:
            estimate = self.posterior.estimate(person)
            before = None if estimate.probability is None else self.beforehand.probabilities[person]
            self.made[person] = estimate.noting(pairs=self.pairs, beforehand=before)
        return self.made[person]

    def without_posterior(self) -> Estimates:
        """The same where nobody asks for another estimate."""
        return self if self.posterior is None else replace(self, posterior=None)


@dataclass(frozen=True, eq=False)
class Course:
    """The trials of b people so far, the posterior, and what is asked of each next.

    `alone` of the `told` trials were TMS alone; `earlier` are the states that the stopping rule looks back on. What was
    learnt before the first ask, `known` pairs and `known_all` trials, counts for no plan and no budget. Pulses of a
    stated intensity before the first pair are `given`.
    """

    method: Method
    posterior: Posterior
    people: int
    beforehand: Beforehand
    told: int = 0
    alone: int = 0
    earlier: tuple[Estimates, ...] = ()
    paired: bool = False
    known: int = 0
    known_all: int = 0
    given: int = 0

    def begun_here(self) -> Course:
        """The course whose first trial is the next one, whatever was learnt before."""
        known, told = self.known + self.paired_trials, self.known_all + self.told
        return replace(self, told=0, alone=0, earlier=(), paired=False, known=known, known_all=told)

    def again(self, seed: int, observations: Iterable[Observation | None]) -> Course:
        """The course of the same people after some trials from the beginning; None is a change."""
        course = self.method.begin(seed, self.people)
        for observation in observations:
            course = course.noting_change() if observation is None else course.after(observation)
            course = course.begun_here() if course.told == self.known_all and not course.known_all else course
        return course

    def after(self, observation: Observation) -> Course:
        """The course after one more trial of each person; all of them pairs of stimuli, or all TMS alone."""
        alone, shift = bool(np.isnan(observation.isi_ms).all()), observation.shift_pct_rmt
        learnt = shift is None or not np.isnan(shift).any()  # else the model has no law of this intensity
        return replace(
            self,
            posterior=self.method.model.update(self.posterior, observation) if learnt else self.posterior,
            told=self.told + 1,
            alone=self.alone + alone,
            given=self.given + (alone and learnt and shift is not None and self.known + self.paired_trials == 0),
            earlier=tuple(e.without_posterior() if len(e.made) == self.people else e for e in self.past),
            paired=not alone,
        )

    def noting_change(self) -> Course:
        """The course if something changes now that bears on all MEPs; the same if the model knows no changes."""
        posterior = self.posterior
        return replace(self, posterior=posterior.noting_change()) if isinstance(posterior, NotesChanges) else self

    @property
    def paired_trials(self) -> int:
        """Number of pairs of stimuli that were learnt of each person."""
        return self.told - self.alone

    @cached_property
    def estimates(self) -> Estimates:
        """The posterior now, with its estimates."""
        return Estimates(self.posterior, self.known + self.paired_trials, self.beforehand)

    @cached_property
    def past(self) -> tuple[Estimates, ...]:
        """The posteriors that the stopping rule looks back on, the first after the last initial ISI."""
        kept = looks_back(self.method.stopping)
        if not kept or not self.paired or self.paired_trials < len(self.method.initial_ms):
            return self.earlier
        return (*self.earlier, self.estimates)[-kept:]

    @property
    def initial_left(self) -> tuple[float, ...]:
        """The initial ISIs that are left [ms]."""
        return self.method.initial_ms[self.paired_trials :]

    def ahead_ms(self, n: int) -> list[float]:
        """The next ISIs [ms] of one person that stand already, whatever comes of them; at most n of a design's."""
        acquisition, space, left = self.method.acquisition, self.method.space, self.initial_left
        if can(acquisition, FollowsPlan):
            pairs = range(self.paired_trials + len(left), self.paired_trials + n)
            return [*left, *(acquisition.planned_isi_ms(space, pair) for pair in pairs)]
        return [*left, *map(space.snap, own_plan(self.posterior, acquisition))]

    @property
    def plans_ahead(self) -> bool:
        """True if the model or the design has a plan of ISIs, so that a lost one is asked again."""
        acquisition = self.method.acquisition
        proposes = ProposesIsi in acquisition.needs and isinstance(self.posterior, ProposesIsi)
        return proposes or can(acquisition, FollowsPlan)

    @cached_property
    def planned(self) -> tuple[Choice, ...] | None:
        """Each person's next ISI, if that stands already; None if the acquisition function chooses."""
        in_turn = partial(self.method.intensities.in_turn, pairs=self.paired_trials)
        if self.initial_left:
            return (in_turn(Choice(self.initial_left[0], by="initial")),) * self.people
        if can(acquisition := self.method.acquisition, FollowsPlan):
            isi_ms = acquisition.planned_isi_ms(self.method.space, self.paired_trials)
            return (in_turn(Choice(isi_ms, by="plan")),) * self.people
        if self.plans_ahead and isinstance(self.posterior, ProposesIsi):
            wanted_ms = self.posterior.proposed_isis_ms()[:, 0].tolist()
            return tuple(Choice(self.method.space.snap(isi_ms), by="plan") for isi_ms in wanted_ms)
        return None

    @cached_property
    def choices(self) -> tuple[Choice, ...]:
        """Each person's next ISI."""
        return self.planned or self.chosen(self.posterior)

    def choices_within(self, deadline_s: float) -> tuple[Choice, ...]:
        """Each person's next ISI; an evenly spaced one if that is not chosen within a time [s]."""
        if self.planned:
            return self.planned
        answer: Future[tuple[Choice, ...]] = Future()

        def choose() -> None:
            try:
                answer.set_result(self.chosen(self.posterior))
            except Exception as error:  # noqa: BLE001 - handed over to whoever waits for the answer
                answer.set_exception(error)

        # A course never changes, so a late thread can go on with it and be forgotten.
        threading.Thread(target=choose, daemon=True).start()
        try:
            return answer.result(min(deadline_s, threading.TIMEOUT_MAX))
        except TimeoutError:
            reason = f"No choice within {deadline_s:g} s: an evenly spaced ISI instead."
            even = Choice(evenly_spaced(self.method.space, self.told), reason, by="fallback")
            return (self.method.intensities.in_turn(even, self.paired_trials),) * self.people

    def chosen(self, posterior: Posterior) -> tuple[Choice, ...]:
        """The ISI that the acquisition function chooses for each person, whatever is planned."""
        if can(posterior, ExpectsTheUsual):
            posterior = posterior.as_usual
        method, how = self.method, {"told": self.told, "people": self.people, "cost": self.method.cost}

        def best(posterior: Posterior) -> tuple[Choice, ...]:
            return best_choices(posterior, method.acquisition, method.space, **how)  # type: ignore[arg-type]

        if not method.intensities:
            return best(posterior)
        return (method.intensities.best(posterior, self.paired_trials, lambda there: best(there)[0]),)

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The estimate of the window of one person."""
        estimate = self.estimates.estimate(person)
        if not self.known_all:
            return estimate
        return estimate.noting(change=Later(lambda: estimate.change and estimate.change.counted_from(self.known_all)))

    def decision(self, person: int = 0, mistrials: int = 0, *, silent: bool = False) -> StopDecision:
        """The decision to stop with one person or not, with its reason."""
        past = tuple(each.estimate(person) for each in self.past)
        estimate = self.estimate(person).noting(silent=silent)
        pairs = self.paired_trials
        progress = Progress(pairs + mistrials, pairs, estimate, past=past, given=self.given)
        decision = self.method.stopping(progress)
        if not isinstance(decision, StopDecision):
            raise StrategyError(
                "a stopping rule must answer with a StopDecision",
                got=decision,
                remedy="Return isiw.StopDecision(stop, reason).",
            )
        return decision


@dataclass(frozen=True)
class Known:
    """One person of a course, and their outcomes: the only place where an estimate and a decision are made.

    `mistrials` use up budget; `in_doubt` is whether trials do not count whose realised ISIs are doubted.
    """

    course: Course
    outcomes: Outcomes
    detection_limit_mv: float | None
    person: int = 0
    mistrials: int = 0
    in_doubt: bool = False

    def estimate(self) -> WindowEstimate:
        """The present estimate of the window."""
        estimate = self.course.estimate(self.person)
        noted = self.outcomes.about_the_tap(estimate.window) | {"silent": self._is_silent}
        estimate = estimate.noting(**noted) if any(noted.values()) else estimate
        return estimate.doubted() if self.in_doubt else estimate

    def decision(self) -> StopDecision:
        """The decision to stop now or not, with its reason."""
        silent = self._is_silent
        decision = self.course.decision(self.person, self.mistrials, silent=silent)
        return _for_lack(decision, lacking(None, silent=silent, in_doubt=self.in_doubt))

    @property
    def _is_silent(self) -> bool:
        return is_silent(self.outcomes.pulses, self.detection_limit_mv)


def _for_lack(decision: StopDecision, found: Finding | None) -> StopDecision:
    """The decision if something is lacking to speak of a window; in doubt none but a budget stops."""
    if found is None or (decision.stop and (found.kind is not Kind.ISIS_FAR or decision.kind is StopKind.BUDGET)):
        return decision
    return StopKind.TOO_LITTLE.go_on(f"{found}")
