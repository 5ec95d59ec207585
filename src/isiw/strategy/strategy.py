"""The strategy: model, acquisition function, and stopping rule, as one ask/tell object that changes over time."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

from isiw.acquisition.protocol import AcquisitionFunction, greedy_batch, require_capabilities, require_objects
from isiw.checks import amplitude, deadline, flag, number, whole
from isiw.decision import StopDecision
from isiw.design import DesignSpace, require_space
from isiw.errors import ImplausibleDataWarning, InvalidValueError, StrategyError, warn
from isiw.estimate import WindowEstimate
from isiw.models.protocol import Posterior, PredictsMeps, ReportsTrouble, ResponseModel, pairs_pct_rmt_of
from isiw.signals.plausible import require_plausible, require_plausible_range
from isiw.strategy.choice import Asked, Choice, Cost, instead_of_lost
from isiw.strategy.course import Known, Method
from isiw.strategy.decisions import StoppingRule, stimuli_left
from isiw.strategy.intensities import NONE, Intensities
from isiw.strategy.outcomes import Outcome, Outcomes, Reported, require_trials
from isiw.strategy.recipe import Recipe
from isiw.trials import Trial, require_pulse
from isiw.types import FloatArray

MOST_OF_A_BATCH = 1000
"""ISIs to be delivered before anything is learnt; more than any session has."""


class Strategy:
    """Proposes the next ISI and learns from each outcome; it changes with each.

    Args:
        space: the ISIs that may be asked.
        model: the model of the person's responses.
        acquisition: the acquisition function that scores candidate ISIs.
        stopping: the rule that says when to stop.
        initial_ms: ISIs to ask for first [ms], whatever the responses; each becomes the nearest on the grid.
        cost: what each of some ISIs [ms] (shape (t,)) costs, in the unit of the scores, shape (t,).
        seed: seed of all randomness; the same seed and tells give the same asks.
        recipe: how the catalogue made this strategy; None if it was built by hand.
        intensities: the intensities of the pairs, if they have several.

    Raises:
        StrategyError: no acquisition function, or one that needs a capability that the model's posterior lacks.
        InvalidValueError: no design space, an initial ISI that is not a finite number, or an invalid seed.
    """

    def __init__(  # noqa: PLR0913 - its parts
        self,
        space: DesignSpace,
        model: ResponseModel,
        acquisition: AcquisitionFunction,
        stopping: StoppingRule,
        *,
        initial_ms: Sequence[float] = (),
        cost: Cost | None = None,
        seed: int = 0,
        recipe: Recipe | None = None,
        intensities: Intensities = NONE,
    ) -> None:
        require_space(space)
        require_objects(model, acquisition)
        seed = whole("the seed", seed, least=0)
        self.space, self.model, self.acquisition, self.stopping = space, model, acquisition, stopping
        self.intensities, self.initial_ms = intensities, tuple(space.snap(isi_ms) for isi_ms in initial_ms)
        self.recipe, self.cost, self.seed = recipe or Recipe(name="", seed=seed), cost, seed
        self._course = Method(space, model, acquisition, stopping, self.initial_ms, cost, intensities).begin(seed)
        require_capabilities(acquisition, model, self.posterior)
        self._mistrials = self._controls = self._lost = 0
        self._outcomes = Outcomes(space.reference, self.amplitude_step_mv, pairs_pct_rmt=pairs_pct_rmt_of(model))
        self.earlier: tuple[Trial, ...] = ()  # learnt before the first ask
        self.earlier_changed: tuple[int, ...] = ()  # places of those after which something changed
        self.same_level, self.earlier_given = True, 0  # stimuli, also of trials from which nothing was learnt
        self.in_doubt, self._asked, self._reported = False, Asked(), Reported(space)
        self.only_counts = False  # in an intervention, which changes what a search would learn of as if it stayed

    def __str__(self) -> str:
        name = f"Strategy {self.recipe.name!r}" if self.recipe.name else "Strategy"
        return (
            f"{name}, seed {self.seed}\nSpace: {self.space}\n"
            f"Model: {type(self.model).__name__}, ISIs chosen by {type(self.acquisition).__name__}\n"
            f"Trials: {self._course.told} learnt, {self._mistrials} mistrials"
        )

    __repr__ = __str__  # in a notebook, too, somebody sees from which event its ISIs count

    def restarted(self) -> Strategy:
        """The same strategy before its first trial; it has learnt the earlier ones."""
        how = {name: getattr(self, name) for name in ("initial_ms", "cost", "seed", "recipe", "intensities")}
        again = Strategy(self.space, self.model, self.acquisition, self.stopping, **how)
        again.learn_all(self.earlier, same_level=self.same_level, changed_after=self.earlier_changed)
        again.earlier_given, again.only_counts = self.earlier_given, self.only_counts
        return again

    @property
    def posterior(self) -> Posterior:
        """The posterior after the trials so far."""
        return self._course.posterior

    @property
    def delivered(self) -> int:
        """Number of stimuli so far, mistrials and control trials included."""
        return self._course.told + self._mistrials + self._controls

    @property
    def spent(self) -> int:
        """Number of stimuli that count towards the budget: pairs, mistrials included, but no control trials."""
        return self._course.paired_trials + self._mistrials

    @property
    def stimuli_planned(self) -> int | None:
        """Largest number of stimuli that its plan takes; None for a method that chooses as it learns."""
        ahead = self._course.plans_ahead and len(self._course.ahead_ms(2)) > 1
        return stimuli_left(self.stopping, 0) if ahead else None

    @property
    def detection_limit_mv(self) -> float | None:
        """Detection limit below which an amplitude of 0 lies [mV]; None if neither setting nor model states it."""
        return self._stated("detection_limit_mv")

    @property
    def amplitude_step_mv(self) -> float | None:
        """The step of the amplitudes [mV]; None if it is to be found, 0 if there is none."""
        return self._stated("amplitude_step_mv")

    def _stated(self, setting: str) -> float | None:
        return self.recipe.settings.get(setting, getattr(self.model, setting, None))  # type: ignore[no-any-return]

    def ask(self, deadline_s: float | None = None) -> float:
        """The next ISI [ms], on the grid; the same until the next `tell`, or until its trial was lost three times.

        A method that plans its ISIs ahead, such as a sweep, repeats one however often its trial was lost.

        Args:
            deadline_s: answer within this time [s]: past it with an evenly spaced ISI, and a `fallback_reason`.
                None and infinity are no deadline.

        Raises:
            InvalidValueError: a deadline that is negative or not a number.
        """
        deadline_s = deadline("deadline_s", deadline_s)
        if (choice := self._asked.choice) is None:
            choice = (self._course.choices if deadline_s is None else self._course.choices_within(deadline_s))[0]
            self._asked = replace(self._asked.noting(choice), choice=choice)
        return choice.isi_ms

    def ask_longer(self, least_ms: float, reason: str) -> float:
        """The next ISI [ms] as `ask` has it, or the first of the grid that is at least so long.

        Args:
            least_ms: the shortest [ms]; what is asked whatever the responses stays, and so does all in a shorter space.
            reason: why, as its `fallback_reason`.
        """
        isi_ms, choice = self.ask(), self.choice
        if choice is None or not self.acquisition.needs:
            return isi_ms
        later = choice.at_least(least_ms, self.space, reason)
        self._asked = replace(self._asked, choice=later, fallback=later.fallback or self._asked.fallback)
        return later.isi_ms

    def ask_batch(self, n: int) -> list[float]:
        """The next n ISIs [ms], to be delivered before any outcome, which may come in any order; the first is `ask`'s.

        Args:
            n: how many, at most 1,000.

        Raises:
            InvalidValueError: fewer than one, or too many.
            StrategyError: the model cannot imagine trials, or does not plan so far ahead.
        """
        n = whole("the size of a batch", n, least=1, most=MOST_OF_A_BATCH)
        if self.intensities:
            raise StrategyError("pairs of several intensities are asked one at a time", got=n, remedy="Call ask().")
        chosen = [self.ask(), *self._course.ahead_ms(n)[1:]][:n]
        batch_ms = greedy_batch(self.posterior, self.acquisition, chosen, n, self._next_of_batch)
        self._asked = replace(self._asked, batch_ms=tuple(batch_ms))
        return batch_ms

    def _next_of_batch(self, posterior: Posterior) -> float:
        choice = self._course.chosen(posterior)[0]
        self._asked = self._asked.noting(choice)
        return choice.isi_ms

    @property
    def choice(self) -> Choice | None:
        """The current ISI and what it was chosen by; None if nothing was asked since the last tell."""
        return self._asked.choice

    @property
    def intensity_pct_rmt(self) -> float | None:
        """The intensity of the current pair [% RMT]; None where all pairs of the session have the usual one."""
        return self.intensities.of(self.choice)

    @property
    def usual_pct_rmt(self) -> float | None:
        """The usual intensity of the pairs that the model reckons with [% RMT]; None if it has no law of others."""
        return self._outcomes.pairs_pct_rmt

    @property
    def fallback_reason(self) -> str | None:
        """Why the current ISI, or one of the batch, is not the acquisition function's choice; None if all are."""
        return self._asked.fallback

    @property
    def trouble(self) -> str | None:
        """The fault of the last fit and what replaces it; None if there was none."""
        return self.posterior.trouble if isinstance(self.posterior, ReportsTrouble) else None

    def tell(  # noqa: PLR0913 - what may be known of an outcome
        self,
        isi_ms: float | None,
        mep_mv: float | None = None,
        *,
        response: bool | None = None,
        isi_sd_ms: float = 0.0,
        mep_sd_mv: float = 0.0,
        mep_interval_mv: tuple[float, float] | None = None,
        pulse: bool = True,
        confirm: bool = False,
        intensity_pct_rmt: float | None = None,
    ) -> None:
        """Learn from one accepted trial.

        After three realised ISIs that are far from those asked, what was told since the first does not count and no
        window is reported, until the next `tell` confirms them.

        Args:
            isi_ms: the realised ISI on the space's reference [ms]; None for TMS alone, which uses up no budget.
            mep_mv: peak-to-peak amplitude [mV]; 0 is left-censored at the detection limit.
            response: whether a response was seen, instead of an amplitude; sessions log amplitudes alone.
            isi_sd_ms: SD of the realised ISI [ms], at most 50; 0 if it was measured.
            mep_sd_mv: SD of the amplitude, as of the mean of several [mV]; 0 if it was measured once.
            mep_interval_mv: the ends between which the amplitude lies, instead of it [mV]; the upper may be infinite.
            pulse: whether the magnetic pulse was given. Without it, this is a tap alone, which uses up no budget:
                `mep_mv` is the amplitude of what the MEP window would hold at `isi_ms`, and what the tap itself adds to
                amplitudes near this ISI is learnt.
            confirm: whether all realised ISIs are right, however far from those asked.
            intensity_pct_rmt: intensity of the pulse [% RMT]; None for the usual one of the pairs. TMS alone at another
                one teaches the default the person's recruitment curve, and other models nothing.

        Raises:
            InvalidValueError: a value that cannot be, not exactly one of `mep_mv`, `mep_interval_mv` and `response`, an
                amplitude that no muscle gives, swapped arguments, another unit, a pulse before the impact, an ISI that
                is too uncertain, a tap alone without ISI or amplitude or with an intensity, or ISIs to be confirmed.
            OutOfSpaceError: an ISI beyond the space and its tolerance.
            StrategyError: a kind of outcome that the model cannot learn from, such as a pair of another intensity.

        Warns:
            ImplausibleDataWarning: an ISI far from all that were asked and not told yet, or amplitudes that look like a
                slip of unit or a rig in trouble; once of each kind.
        """
        plain_ms = None if isi_ms is None else number("a realised ISI [ms]", isi_ms)
        plain_mv = None if mep_mv is None else number("mep_mv", mep_mv, least=0)
        if not flag("pulse", pulse):
            require_pulse(intensity_pct_rmt, tap_alone=True)
            self._tell_tap(plain_ms, plain_mv)
            return
        asked_ms = None if plain_ms is None else self._asked.meant_ms(plain_ms, plain_mv, self.space)
        require_plausible(plain_ms, plain_mv, asked_ms, self.space, isi_sd_ms)
        realised_ms = None if isi_ms is None else self.space.check_realised(isi_ms)
        outcome = Outcome(realised_ms, mep_mv, response, isi_sd_ms, mep_sd_mv, mep_interval_mv, None, intensity_pct_rmt)
        require_plausible_range(outcome.mep_sd_mv, outcome.mep_interval_mv, outcome.intensity_pct_rmt)
        reported = self._reported if plain_ms is None else self._reported.confirmed_by(confirm=flag("confirm", confirm))
        self._learn(outcome)
        self._reported = reported.after(self._outcomes.pulses, asked_ms, self.detection_limit_mv)
        self._leave_out(self._reported.doubted)
        if self._reported.new is not None:
            warn(f"{self._reported.new}", ImplausibleDataWarning)

    def _leave_out(self, doubted: frozenset[int]) -> None:
        """Learn again without the pulses in doubt; they use up budget."""
        if doubted == self._outcomes.doubted:
            return
        self._mistrials += len(doubted) - len(self._outcomes.doubted)
        self._outcomes, self.in_doubt = replace(self._outcomes, doubted=doubted), bool(doubted)
        self._course, self._asked = self._course.again(self.seed, self._outcomes.observations), self._asked.again()

    def learn(self, trial: Trial) -> None:
        """Learn what there is to learn from one trial, however implausible, and count what it uses up.

        Everything that delivers, replays or reads trials learns them by this.

        Args:
            trial: a trial that was judged: a pair, TMS alone or a tap alone, also one that was lost or excluded.

        Raises:
            StrategyError: a kind of outcome that the model cannot learn from.
        """
        if self.only_counts:
            self._controls += 1
        elif trial.told:
            self._learn(Outcome.of(trial))
        elif trial.counts and trial.isi_ms is not None and trial.mep_mv is not None:
            self._learn_tap(trial.isi_ms, trial.mep_mv)
        elif trial.is_control:
            if trial.counts and trial.mep_mv is not None:  # what a tap alone evoked, at any time
                self._outcomes = self._outcomes.after_tap(None, trial.mep_mv)
            self._controls += 1
        elif trial.excluded and trial.reason is None:  # it was not lost
            self._mistrials, self._lost = self._mistrials + 1, 0
        else:
            self.count_mistrial()

    def require_law(self, outcome: Outcome) -> None:
        """Raise StrategyError where the model has no law of a pair of such an intensity."""
        self._outcomes.require_law(outcome)

    def learn_all(
        self, trials: Iterable[Trial], *, same_level: bool = False, changed_after: Collection[int] = ()
    ) -> None:
        """Learn trials that were delivered before the first ask, at whatever ISIs; no plan and no budget counts them.

        Args:
            trials: the trials, in order; mistrials and taps alone teach nothing. For `max_pulses` of limits all count.
            same_level: whether electrodes, coil and intensity stay as they were. Otherwise the level of the MEPs from
                here on may be another one, as far as the model can say so; the window stays.
            changed_after: places of trials, from 0, after which something changed that may bear on all MEPs.

        Raises:
            InvalidValueError: an amplitude that no amplifier gives.
            StrategyError: an ISI was asked or learnt before, trials of another level were learnt before, or the model
                cannot learn from such a trial.
        """
        if self.delivered or self.choice is not None or (self.earlier and not (same_level and self.same_level)):
            raise StrategyError(
                "earlier trials are learnt once, before the first ask", remedy="Let a new strategy learn all of them."
            )
        before = len(self.earlier)
        for place, trial in enumerate(require_trials(trials)):
            if trial.told:
                self._learn(Outcome.of(trial))
                self.earlier = (*self.earlier, trial)
            if place in changed_after and len(self.earlier) > before:
                self.note_change()
                self.earlier_changed = (*self.earlier_changed, len(self.earlier) - 1)
            self.earlier_given += 1
        self._course, self.same_level = self._course.begun_here(), same_level
        if len(self.earlier) > before and not same_level:
            self.note_change()

    def _learn(self, outcome: Outcome) -> None:
        """Learn from one trial, wherever its ISI lies."""
        outcomes, course = self._outcomes.after(outcome), self._course
        same = outcomes.step_mv == self._outcomes.step_mv
        learnt = course.after(outcomes.observation(outcome)) if same else course.again(self.seed, outcomes.observations)
        lost, asked = self._lost if outcome.isi_ms is None else 0, self._asked.after(outcome.isi_ms)
        # Without a call between, at which Ctrl-C may come: a trial is learnt wholly or not at all.
        self._course, self._outcomes, self._asked, self._lost = learnt, outcomes, asked, lost

    def _tell_tap(self, isi_ms: float | None, mep_mv: float | None) -> None:
        if isi_ms is None or mep_mv is None:
            needed = "the ISI at which the MEP window would lie, and the amplitude of what it holds"
            raise InvalidValueError(f"a tap alone needs {needed}", got=(isi_ms, mep_mv))
        self._learn_tap(self.space.check_realised(isi_ms), amplitude("mep_mv", mep_mv))

    def _learn_tap(self, isi_ms: float, mep_mv: float) -> None:
        """Learn from a tap alone, whatever was learnt before it."""
        outcomes = self._outcomes.after_tap(isi_ms, mep_mv)
        if outcomes.pulses:
            self._course, self._asked = self._course.again(self.seed, outcomes.observations), self._asked.again()
        self._outcomes = outcomes
        self._controls += 1

    def note_change(self) -> None:
        """Learn that something changed that may bear on all MEPs from here on, such as the place of the coil.

        A model that reckons with changes takes one for likely between the last trial and the next, and what is asked
        next is chosen again; to other models it means nothing. Several at one trial are one change, and at most 20
        (`isiw.change.MOST_NOTED`) are learnt.
        """
        if (outcomes := self._outcomes.changing()) is not self._outcomes:
            self._course, self._outcomes, self._asked = self._course.noting_change(), outcomes, self._asked.again()

    def count_mistrial(self) -> None:
        """Count a delivered stimulus without an outcome: it uses up budget, and its ISI is repeated at most twice."""
        mistrials, lost = self._mistrials + 1, self._lost + 1
        choice = None if self.choice is None else replace(self.choice, by="again")
        asked = replace(self._asked, choice=choice)
        other = instead_of_lost(self.space, lost, self._course.told + mistrials)
        if other is not None and not self._course.plans_ahead:
            other = self.intensities.in_turn(other, self._course.paired_trials)
            asked, lost = replace(asked, choice=other, fallback=other.fallback), 0
        self._mistrials, self._lost, self._asked = mistrials, lost, asked

    @property
    def _known(self) -> Known:
        limit_mv, lost = self.detection_limit_mv, self._mistrials
        return Known(self._course, self._outcomes, limit_mv, mistrials=lost, in_doubt=self.in_doubt)

    def estimate(self) -> WindowEstimate:
        """The present estimate of the window."""
        return self._known.estimate()

    def prediction_mv(self) -> tuple[FloatArray, FloatArray] | None:
        """The ends [mV] between which nine of ten MEPs lie at `estimate().grid_ms`, (t,) each; None if unknown."""
        return self.posterior.prediction_mv(0.9) if isinstance(self.posterior, PredictsMeps) else None

    def decision(self) -> StopDecision:
        """The decision to stop now or not, with its reason."""
        return self._known.decision()
