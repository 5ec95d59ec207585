"""Outcomes that a strategy has learnt from; each is a point, an interval, or more than the MEP alone."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, TypedDict

import numpy as np

from isiw.checks import Amplitude, AmplitudeInterval, Checked, Flag, NonNegative
from isiw.errors import InvalidValueError
from isiw.models.protocol import Observation
from isiw.signals.tap import may_be_the_taps, meets_response
from isiw.trials import Trial
from isiw.types import Reference
from isiw.window import Window

STEPS_MV: Final = (0.1, 0.05, 0.025, 0.02, 0.01, 0.005, 0.002)
"""Steps of converters and displays that are looked for, the largest first [mV]; finer ones matter to nobody."""

FINEST_MV: Final = 0.001
"""To this, amplitudes may be rounded anyway [mV]."""

BY_CHANCE, LEAST_DIFFERENT = 1e-6, 3
"""A step is found if all amplitudes would be its multiples by chance less often than this; of so many that differ."""

NEAR_MS: Final = 10.0
"""Taps alone speak for the ISIs around theirs, with weights of this SD [ms]."""

LEAST_WEIGHT: Final = 0.1
USUAL_SHARE, USUAL_COUNTS = 0.7, 2.0
"""SD of the tap's response from trial to trial as a share of its mean: that is expected, and counts as so many taps."""


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
    """All outcomes so far: of pulses, and ISI [ms] and amplitude [mV] of taps alone; changes by pulses before."""

    reference: Reference
    stated_step_mv: float | None = None
    pulses: tuple[Outcome, ...] = ()
    taps: tuple[tuple[float, float], ...] = ()
    changes: tuple[int, ...] = ()

    def of(self, trials: Iterable[Trial]) -> Outcomes:
        """The same after some trials of a session."""
        outcomes = self
        for trial in trials:
            if trial.told:
                outcomes = outcomes.after(Outcome.of(trial))
            elif trial.counts and trial.isi_ms is not None and trial.mep_mv is not None:
                outcomes = outcomes.after_tap(trial.isi_ms, trial.mep_mv)
        return outcomes

    def after(self, outcome: Outcome) -> Outcomes:
        """The same after one more pulse."""
        return replace(self, pulses=(*self.pulses, outcome))

    def after_tap(self, isi_ms: float, mep_mv: float) -> Outcomes:
        """The same after one more tap alone."""
        return replace(self, taps=(*self.taps, (isi_ms, mep_mv)))

    def after_change(self) -> Outcomes:
        """The same after something changed that may bear on all pulses from here on."""
        return replace(self, changes=(*self.changes, len(self.pulses)))

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
            told += [] if one is None else [self.observation(one)]
        return tuple(told)

    def observation(self, outcome: Outcome) -> Observation:
        """The observation that a model learns from an outcome."""
        low_mv, high_mv = outcome.mep_mv, math.nan
        if outcome.mep_interval_mv is not None:
            low_mv, high_mv = outcome.mep_interval_mv
        elif self.step_mv and outcome.mep_mv is not None:
            low_mv, high_mv = max(0.0, outcome.mep_mv - self.step_mv / 2), outcome.mep_mv + self.step_mv / 2
        mean_mv, sd_mv = self._tap_mv(outcome) or (0.0, 0.0)
        sd_mv = math.hypot(sd_mv, outcome.mep_sd_mv)
        return Observation.of(
            [outcome.isi_ms],
            [low_mv],
            [outcome.isi_sd_ms],
            [outcome.response],
            None if math.isnan(high_mv) else [high_mv],
            [(mean_mv, sd_mv)] if mean_mv or sd_mv else None,
        )

    def _tap_mv(self, outcome: Outcome) -> tuple[float, float] | None:
        """Mean and SD of the tap's own part of an amplitude [mV]; None if it is unknown."""
        if outcome.isi_ms is None or outcome.tap_mv is not None:
            return outcome.tap_mv or 0.0, 0.0
        if not self.taps:
            return None
        isis_ms, sizes_mv = np.array(self.taps).T
        weights = np.exp(-0.5 * ((isis_ms - outcome.isi_ms) / NEAR_MS) ** 2)
        count = float(weights.sum())
        if count < LEAST_WEIGHT:
            return None
        excess = sizes_mv - min(sizes_mv.min(), *(one.mep_mv for one in self.pulses if one.mep_mv), math.inf)
        mean = float(weights @ excess) / count
        variance = float(weights @ (excess - mean) ** 2)
        return mean, math.sqrt((variance + USUAL_COUNTS * (USUAL_SHARE * mean) ** 2) / (count + USUAL_COUNTS))

    def tap_may_explain(self, window: Window | None) -> bool:
        """True if the tap's own response could be what is larger within a window, since nobody knows it there."""
        met = [one for one in self.pulses if one.isi_ms is not None and meets_response(one.isi_ms, self.reference)]
        known = {one: self._tap_mv(one) is not None for one in met}
        unknown_ms, known_ms = ([one.isi_ms or 0.0 for one in met if known[one] is yes] for yes in (False, True))
        return may_be_the_taps(window, unknown_ms, known_ms)


def found_step_mv(amplitudes_mv: Sequence[float]) -> float:
    """The largest step that all of some amplitudes are multiples of, unless by chance [mV]; 0 if there is none."""
    sizes = np.asarray(amplitudes_mv)
    if len(set(amplitudes_mv)) < LEAST_DIFFERENT:
        return 0.0
    for step_mv in STEPS_MV:
        by_chance = np.count_nonzero(sizes) * math.log(FINEST_MV / step_mv)
        multiples = sizes / step_mv
        if by_chance < math.log(BY_CHANCE) and bool((np.abs(multiples - multiples.round()) < 1e-6).all()):
            return step_mv
    return 0.0
