"""The course of the examination of b people: outcomes that were learnt so far, and what is asked of each next."""

from __future__ import annotations

import math
import threading
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, TypedDict

import numpy as np

from isiw.acquisition.protocol import AcquisitionFunction, FollowsPlan, own_plan
from isiw.change import MOST_NOTED
from isiw.checks import Amplitude, AmplitudeInterval, Checked, Flag, NonNegative, can
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.models.protocol import (
    ExpectsTheUsual,
    NotesChanges,
    Observation,
    Posterior,
    ProposesIsi,
    ResponseModel,
)
from isiw.signals.tap import TapsAlone, is_inside, meets_response, taps_anywhere, taps_near
from isiw.strategy.choice import Choice, Cost, best_choices, evenly_spaced
from isiw.strategy.stopping import Progress, StopDecision, StoppingRule, looks_back
from isiw.trials import Trial
from isiw.types import Reference
from isiw.window import Window

STEPS_MV: Final = (0.1, 0.05, 0.025, 0.02, 0.01, 0.005, 0.002)
"""Steps of converters and displays that are looked for, the largest first [mV]; finer ones matter to nobody."""

FINEST_MV: Final = 0.001
"""To this, amplitudes may be rounded anyway [mV]."""

BY_CHANCE, LEAST_DIFFERENT = 1e-6, 3
"""A step is found if all amplitudes would be its multiples by chance less often than this; of so many that differ."""

NEAR_A_STEP: Final = 1e-6
"""An amplitude is a multiple of a step if it is as near to one, in steps."""


class Details(TypedDict, total=False):
    """Details of an outcome besides its amplitude; see `Strategy.tell`."""

    response: bool | None
    isi_sd_ms: float
    mep_sd_mv: float
    mep_interval_mv: tuple[float, float] | None
    tap_mv: float | None


def details_of(trial: Trial) -> Details:
    """The details of a trial's outcome besides ISI and amplitude."""
    return {
        "isi_sd_ms": trial.isi_sd_ms,
        "mep_sd_mv": trial.mep_sd_mv,
        "mep_interval_mv": trial.mep_interval_mv,
        "tap_mv": trial.tap_mv,
    }


SEEN_MV: Final = 0.01
"""An amplitude so much above the smallest shows something [mV]."""


@dataclass(frozen=True)
class Outcome(Checked):
    """The outcome of one pulse; see `Strategy.tell`."""

    isi_ms: float | None
    mep_mv: Amplitude | None = None
    response: Flag | None = None
    isi_sd_ms: NonNegative = 0.0
    mep_sd_mv: NonNegative = 0.0
    mep_interval_mv: AmplitudeInterval | None = None
    tap_mv: NonNegative | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        told = self.mep_mv, self.mep_interval_mv, self.response
        if sum(value is not None for value in told) != 1:
            raise InvalidValueError("tell needs one of mep_mv, mep_interval_mv and response", got=told)

    @classmethod
    def of(cls, trial: Trial) -> Outcome:
        """The outcome of a trial that was judged before."""
        return cls(trial.isi_ms, None if trial.mep_interval_mv else trial.mep_mv, **details_of(trial))


@dataclass(frozen=True)
class Outcomes:
    """All outcomes so far: of pulses, and ISI [ms] and amplitude [mV] of taps alone; changes by pulses before.

    Of taps alone that were measured at no ISI the amplitude is the largest at any time; they only say whether a window
    may be the tap's own response.
    Pulses whose ISI is `doubted`, by their numbers, are no observations.
    """

    reference: Reference
    stated_step_mv: float | None = None
    pulses: tuple[Outcome, ...] = ()
    taps: tuple[tuple[float, float], ...] = ()
    taps_anywhere_mv: tuple[float, ...] = ()
    changes: tuple[int, ...] = ()
    doubted: frozenset[int] = frozenset()

    def of(self, trials: Iterable[Trial]) -> Outcomes:
        """The same after some trials of a session."""
        outcomes = self
        for trial in trials:
            if trial.told:
                outcomes = outcomes.after(Outcome.of(trial))
            elif trial.counts and trial.mep_mv is not None:
                outcomes = outcomes.after_tap(trial.isi_ms, trial.mep_mv)
        return outcomes

    def after(self, outcome: Outcome) -> Outcomes:
        """The same after one more pulse."""
        return replace(self, pulses=(*self.pulses, outcome))

    def after_tap(self, isi_ms: float | None, mep_mv: float) -> Outcomes:
        """The same after one more tap alone."""
        if isi_ms is None:
            return replace(self, taps_anywhere_mv=(*self.taps_anywhere_mv, mep_mv))
        return replace(self, taps=(*self.taps, (isi_ms, mep_mv)))

    def changing(self) -> Outcomes:
        """The same if something changes now: several notes at one trial are one change, and `MOST_NOTED` are learnt."""
        known = len(self.pulses) in self.changes or len(self.changes) >= MOST_NOTED
        return self if known else replace(self, changes=(*self.changes, len(self.pulses)))

    @cached_property
    def step_mv(self) -> float:
        """The step that amplitudes are multiples of [mV]; 0 if there is none."""
        if self.stated_step_mv is not None:
            return self.stated_step_mv
        return found_step_mv([one.mep_mv for one in self.pulses if one.mep_mv is not None])

    @property
    def observations(self) -> tuple[Observation | None, ...]:
        """The observations of all pulses, as they are understood now; None if something changed there."""
        told: list[Observation | None] = []
        for number, one in enumerate((*self.pulses, None)):
            told += [None] * self.changes.count(number)
            told += [] if one is None or number in self.doubted else [self.observation(one)]
        return tuple(told)

    def observation(self, outcome: Outcome) -> Observation:
        """The observation that a model learns from an outcome."""
        low_mv, high_mv = outcome.mep_mv, math.nan
        if outcome.mep_interval_mv is not None:
            low_mv, high_mv = outcome.mep_interval_mv
        elif self.step_mv and outcome.mep_mv is not None:
            low_mv, high_mv = max(0.0, outcome.mep_mv - self.step_mv / 2), outcome.mep_mv + self.step_mv / 2
        mean_mv, sd_mv, log_sd = self._tap_mv(outcome) or (0.0, 0.0, 0.0)
        sd_mv = math.hypot(sd_mv, outcome.mep_sd_mv)
        return Observation.of(
            [outcome.isi_ms],
            [low_mv],
            [outcome.isi_sd_ms],
            [outcome.response],
            None if math.isnan(high_mv) else [high_mv],
            [(mean_mv, sd_mv, log_sd)] if mean_mv or sd_mv else None,
        )

    def _tap_mv(self, outcome: Outcome) -> tuple[float, float, float] | None:
        """Mean and SD of the tap's own part of an amplitude [mV], and the SD of its log mean; None if it is unknown."""
        if outcome.isi_ms is None or outcome.tap_mv is not None:
            return outcome.tap_mv or 0.0, 0.0, 0.0
        alone = self._alone_at(outcome.isi_ms)
        return None if alone is None else (alone.mean_mv, alone.sd_mv, alone.log_sd)

    def _alone_at(self, isi_ms: float) -> TapsAlone | None:
        """The evidence of taps alone near an ISI; None if there are too few."""
        return taps_near(self.taps, isi_ms, self._least_mv) if self.taps else None

    @cached_property
    def _least_mv(self) -> float:
        """The smallest amplitude of all, also of taps alone [mV]."""
        sizes_mv = [mep_mv for _, mep_mv in self.taps] + [one.mep_mv for one in self.pulses if one.mep_mv]
        return min(sizes_mv, default=0.0)

    def _of_the_tap(self, one: Outcome) -> bool | None:
        """Whether the tap alone evokes as much as an amplitude shows; None if nobody knows what it evokes."""
        if one.isi_ms is None or one.tap_mv is not None:
            return False
        alone = self._alone_at(one.isi_ms) or taps_anywhere(self.taps_anywhere_mv, self._least_mv)
        if alone is None or one.mep_mv is None:
            return None if alone is None else False
        return SEEN_MV < one.mep_mv - self._least_mv <= alone.most_mv

    def about_the_tap(self, window: Window | None) -> dict[str, bool]:
        """Whether the tap's own response may be what is larger within a window, and whether that is likely."""
        met = [one for one in self.pulses if one.isi_ms is not None and meets_response(one.isi_ms, self.reference)]
        inside = [one for one in met if window is not None and is_inside(window, one.isi_ms or 0.0)]
        counts = Counter(self._of_the_tap(one) for one in inside)
        may_explain = counts[None] + counts[True] > counts[False]
        return {"tap_may_explain": may_explain, "tap_is_likely": may_explain and counts[True] > counts[False]}


def found_step_mv(amplitudes_mv: Sequence[float]) -> float:
    """The largest step that all of some amplitudes are multiples of, unless by chance [mV]; 0 if there is none."""
    sizes = np.asarray(amplitudes_mv)
    if len(set(amplitudes_mv)) < LEAST_DIFFERENT:
        return 0.0
    for step_mv in STEPS_MV:
        newest = amplitudes_mv[-1] / step_mv
        if abs(newest - round(newest)) >= NEAR_A_STEP:  # most often, so that no other has to be looked at
            continue
        by_chance = np.count_nonzero(sizes) * math.log(FINEST_MV / step_mv)
        multiples = sizes / step_mv
        if by_chance < math.log(BY_CHANCE) and bool((np.abs(multiples - multiples.round()) < NEAR_A_STEP).all()):
            return step_mv
    return 0.0


@dataclass(frozen=True)
class Method:
    """The method by which people are examined: the parts of a `Strategy`."""

    space: DesignSpace
    model: ResponseModel
    acquisition: AcquisitionFunction
    stopping: StoppingRule
    initial_ms: tuple[float, ...] = ()
    cost: Cost | None = None

    def begin(self, seed: int, people: int = 1) -> Course:
        """The course before the first trial."""
        posterior = self.model.begin(self.space, seed, people)
        return Course(self, posterior, people, Estimates(posterior, 0))


@dataclass(frozen=True, eq=False)
class Estimates:
    """The estimates of b people after so many pairs, each made once if somebody asks; then no posterior is kept."""

    posterior: Posterior | None
    pairs: int
    made: dict[int, WindowEstimate] = field(default_factory=dict)
    first: Estimates | None = None

    def estimate(self, person: int) -> WindowEstimate:
        """The estimate of the window of one person."""
        if person not in self.made and self.posterior is not None:
            estimate = self.posterior.estimate(person)
            knows = self.first is not None and estimate.probability is not None
            before = self.first.estimate(person).probability if self.first is not None and knows else None
            self.made[person] = estimate.noting(pairs=self.pairs, beforehand=before)
        return self.made[person]

    def without_posterior(self) -> Estimates:
        """The same where nobody asks for another estimate."""
        return self if self.posterior is None else replace(self, posterior=None)


@dataclass(frozen=True, eq=False)
class Course:
    """The trials of b people so far, the posterior, and what is asked of each next.

    `alone` of the `told` trials were TMS alone; `earlier` are the states that the stopping rule looks back on. What was
    learnt before the first ask, `known` pairs and `known_told` trials, counts for no plan and no budget.
    """

    method: Method
    posterior: Posterior
    people: int
    first: Estimates
    told: int = 0
    alone: int = 0
    earlier: tuple[Estimates, ...] = ()
    paired: bool = False
    known: int = 0
    known_told: int = 0

    def begun_here(self) -> Course:
        """The course whose first trial is the next one, whatever was learnt before."""
        known, told = self.known + self.paired_trials, self.known_told + self.told
        return replace(self, told=0, alone=0, earlier=(), paired=False, known=known, known_told=told)

    def again(self, seed: int, observations: Iterable[Observation | None]) -> Course:
        """The course of the same people after some trials from the beginning; None is a change."""
        course = self.method.begin(seed, self.people)
        for observation in observations:
            course = course.noting_change() if observation is None else course.after(observation)
        told, alone = course.told - self.known_told, course.alone - (self.known_told - self.known)
        return replace(course, told=told, alone=alone, known=self.known, known_told=self.known_told)

    def after(self, observation: Observation) -> Course:
        """The course after one more trial of each person; all of them pairs of stimuli, or all TMS alone."""
        alone = bool(observation.isi_ms.isnan().all())
        return replace(
            self,
            posterior=self.method.model.update(self.posterior, observation),
            told=self.told + 1,
            alone=self.alone + alone,
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
        return Estimates(self.posterior, self.known + self.paired_trials, first=self.first)

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
        if self.initial_left:
            return (Choice(self.initial_left[0], by="initial"),) * self.people
        if can(acquisition := self.method.acquisition, FollowsPlan):
            isi_ms = acquisition.planned_isi_ms(self.method.space, self.paired_trials)
            return (Choice(isi_ms, by="plan"),) * self.people
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
            return (Choice(evenly_spaced(self.method.space, self.told), reason, by="fallback"),) * self.people

    def chosen(self, posterior: Posterior) -> tuple[Choice, ...]:
        """The ISI that the acquisition function chooses for each person, whatever is planned."""
        if can(posterior, ExpectsTheUsual):
            posterior = posterior.as_usual
        method = self.method
        return best_choices(
            posterior, method.acquisition, method.space, told=self.told, people=self.people, cost=method.cost
        )

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The estimate of the window of one person."""
        return self.estimates.estimate(person)

    def decision(self, person: int = 0, mistrials: int = 0, *, silent: bool = False) -> StopDecision:
        """The decision to stop with one person or not, with its reason."""
        past = tuple(each.estimate(person) for each in self.past)
        estimate = self.estimate(person).noting(silent=silent)
        progress = Progress(self.paired_trials + mistrials, self.paired_trials, estimate, past=past)
        return self.method.stopping(progress)
