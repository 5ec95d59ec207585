"""The outcomes of trials, as a strategy keeps them, and the observations that a model learns from them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

import numpy as np

from isiw.change import MOST_NOTED
from isiw.checks import Amplitude, AmplitudeInterval, Checked, Flag, NonNegative, Positive
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError, StrategyError
from isiw.findings import Finding
from isiw.models.protocol import Observation
from isiw.signals.plausible import Counted, Doubts, doubtful_from, is_far, isi_far, odd_amplitudes, unconfirmed
from isiw.signals.taps_alone import TapsAlone, is_inside, meets_response, taps_anywhere, taps_near
from isiw.summary import IN_DOUBT
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
    intensity_pct_rmt: Positive | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        given = [name for name in ("mep_mv", "mep_interval_mv", "response") if getattr(self, name) is not None]
        if len(given) != 1:
            one_of = "one of mep_mv and mep_interval_mv (or of Strategy.tell a response)"
            raise InvalidValueError(f"an outcome needs {one_of}", got=", ".join(given) or "none of them")

    @classmethod
    def of(cls, trial: Trial) -> Outcome:
        """The outcome of a trial that was judged before."""
        return cls(
            trial.isi_ms,
            None if trial.mep_interval_mv else trial.mep_mv,
            None,
            trial.isi_sd_ms,
            trial.mep_sd_mv,
            trial.mep_interval_mv,
            trial.tap_mv,
            trial.intensity_pct_rmt,
        )


@dataclass(frozen=True)
class Outcomes:
    """All outcomes so far: of pulses, and ISI [ms] and amplitude [mV] of taps alone; changes by pulses before.

    Of taps alone that were measured at no ISI the amplitude is the largest at any time; they only say whether a window
    may be the tap's own response.
    Pulses whose ISI is `doubted`, by their numbers, are no observations. `pairs_pct_rmt` is None for a model that
    has no law of TMS alone at another intensity than the pairs'.
    """

    reference: Reference
    stated_step_mv: float | None = None
    pulses: tuple[Outcome, ...] = ()
    taps: tuple[tuple[float, float], ...] = ()
    taps_anywhere_mv: tuple[float, ...] = ()
    changes: tuple[int, ...] = ()
    doubted: frozenset[int] = frozenset()
    pairs_pct_rmt: float | None = None

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
        self.require_law(outcome)
        return replace(self, pulses=(*self.pulses, outcome))

    def require_law(self, outcome: Outcome) -> None:
        """Raise where the model has no law of a pair of such an intensity."""
        if outcome.isi_ms is not None and outcome.intensity_pct_rmt is not None and self.pairs_pct_rmt is None:
            raise StrategyError(
                "the model has no law of pairs at another intensity",
                got=f"a pair at {outcome.intensity_pct_rmt:g} % of RMT",
                remedy="Leave out the intensity if it is the usual one, or choose the default.",
            )

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
        newest = next((one.mep_mv for one in reversed(self.pulses) if one.mep_mv is not None), None)
        if newest is None or not any(is_multiple(newest, step_mv) for step_mv in STEPS_MV):
            return 0.0
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
            self._shift_pct_rmt(outcome),
        )

    def _shift_pct_rmt(self, outcome: Outcome) -> list[float] | None:
        """By how much a pulse is stronger than the pairs' [% RMT]: NaN without a law of it, None if it is not stated.

        TMS alone of a stated intensity is a pulse over the curve, also where it is the pairs' (decision 53).
        """
        stated = outcome.intensity_pct_rmt
        if stated is None or (stated == self.pairs_pct_rmt and outcome.isi_ms is not None):
            return None
        return [math.nan if self.pairs_pct_rmt is None else stated - self.pairs_pct_rmt]

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


def is_multiple(mep_mv: float, step_mv: float) -> bool:
    """Whether an amplitude is a multiple of a step."""
    steps = mep_mv / step_mv
    return abs(steps - round(steps)) < NEAR_A_STEP


def found_step_mv(amplitudes_mv: Sequence[float]) -> float:
    """The largest step that all of some amplitudes are multiples of, unless by chance [mV]; 0 if there is none."""
    sizes = np.asarray(amplitudes_mv)
    if len(set(amplitudes_mv)) < LEAST_DIFFERENT:
        return 0.0
    for step_mv in STEPS_MV:
        if not is_multiple(amplitudes_mv[-1], step_mv):  # most often, so that no other has to be looked at
            continue
        by_chance = np.count_nonzero(sizes) * math.log(FINEST_MV / step_mv)
        multiples = sizes / step_mv
        if by_chance < math.log(BY_CHANCE) and bool((np.abs(multiples - multiples.round()) < NEAR_A_STEP).all()):
            return step_mv
    return 0.0


@dataclass(frozen=True)
class Reported:
    """The outcomes so far: the pulses, by number, whose ISI was asked for, and whether the realised one was far."""

    space: DesignSpace
    asked: tuple[tuple[int, bool], ...] = ()
    confirmed: bool = False
    doubts: Doubts = field(default_factory=Doubts)

    @property
    def new(self) -> Finding | None:
        """What is odd since the last pulse."""
        return self.doubts.new

    @cached_property
    def doubted(self) -> frozenset[int]:
        """The pulses whose ISIs are in doubt."""
        first = None if self.confirmed else doubtful_from([far for _, far in self.asked])
        return frozenset() if first is None else frozenset(pulse for pulse, _ in self.asked[first:])

    def confirmed_by(self, *, confirm: bool) -> Reported:
        """The same once all ISIs are confirmed; raise if some are in doubt, and are not."""
        if not self.doubted:
            return self
        if not confirm:
            raise unconfirmed(self.doubted, self.space, "put your loop right, and begin with a new strategy")
        return replace(self, confirmed=True)

    def after(self, pulses: Sequence[Outcome], asked_ms: float | None, detection_limit_mv: float | None) -> Reported:
        """The same after one more pulse, the last of all; its ISI is as asked, or was not asked for."""
        isi_ms, isi_sd_ms = pulses[-1].isi_ms, pulses[-1].isi_sd_ms
        found, reported = isi_far(isi_ms, asked_ms, self.space), self
        if isi_ms is not None and asked_ms is not None:
            far = is_far(isi_ms - asked_ms, self.space, isi_sd_ms)
            reported = replace(self, asked=(*self.asked, (len(pulses) - 1, far)))
        of_pairs = [one for one in pulses if one.intensity_pct_rmt is None]
        told = [Counted(one.mep_mv, one.isi_ms) for one in of_pairs if one.mep_mv is not None]
        odd = (IN_DOUBT if reported.doubted else found, *odd_amplitudes(told, detection_limit_mv))
        return replace(reported, doubts=self.doubts.after(odd))


def require_trials(trials: object) -> tuple[Trial, ...]:
    """Earlier trials, each of which must be a `Trial`."""
    given = tuple(trials) if isinstance(trials, Iterable) and getattr(trials, "ndim", 1) != 0 else (trials,)
    for trial in given:
        if not isinstance(trial, Trial):
            raise InvalidValueError(
                "earlier trials must be of the type isiw.Trial",
                got=trial,
                remedy="Of a log they are isiw.read_session(log).table; its .trials is a table of pandas.",
            )
    return given
