"""The tap's own response in the EMG: its course, learnt from EMG that shows it alone, and amplitudes without it.

What a tap evokes comes at its own times after the hit. Where an MEP window meets these, the mean course is subtracted,
and as far as sizes outside the window tell those within it, the course of the size that the trial shows outside. How
much is left is known from how far each course is from what the others say, never from the trial's own amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from typing import Final, NamedTuple

import numpy as np

from isiw.signals.courses import GRID_MS, STEP_MS, Courses, Span, Sums, size_at_rest_mv, within
from isiw.signals.limits import EMG_UNITS_MV
from isiw.signals.mep import EARLIEST_ONSET_MS, at_rest, disturbance
from isiw.signals.spans import HIT_DELAY_MS, MEP_WINDOW_MS, TAP_MS
from isiw.signals.taps_alone import LEAST_WEIGHT, is_inside
from isiw.signals.waveforms import PULSE_GUARD_MS, samples
from isiw.sweeps import Sweep
from isiw.trials import Trial, TrialTable
from isiw.types import BoolArray, FloatArray, IntArray
from isiw.window import Window

LEAST_SHOWN: Final = 3
"""So many sweeps say what the tap does at a time after the hit; with fewer nobody knows how much it varies."""

ENOUGH_SHOWN, TAP_EVERY = 12, 4
"""With fewer sweeps that show a response within a window, every so many-th trial is one more tap alone."""

LONGER_MS: Final = 10.0
"""So much longer is an ISI than those whose MEP windows it is to show, as hits come some ms sooner or later."""

CLEAR: Final = 0.7
"""By this share, over the root of the number of sweeps, EMG after the hit is larger than at rest by chance at most."""

TINY: Final = 1e-12
USUAL_VARIANCE, USUAL_COUNTS = 0.43, 3.0
"""Relative variance of the response's size that is expected, that of a log SD of .6; it counts as so many sweeps."""

LEAST_BOTH: Final = 6
"""So many sweeps say whether the response's size outside an MEP window tells that within: three agree by chance."""

TOGETHER_MS: Final = 2.5
"""EMG within so much time says the same of the response's size, as neighbouring samples rise and fall together."""

ARTEFACT_MS: Final = 5.0
"""So long after the pulse its artefact hides the response."""

SAME_MV, SAME_SHARE = 0.003, 0.1
"""What changes an amplitude by less is not worth a correction."""


class Left(NamedTuple):
    """What is left of the response in an amplitude: mean and SD [mV]; how many sweeps say so; what was subtracted."""

    mean_mv: float
    sd_mv: float
    shown: int
    course_mv: FloatArray


class _MepWindow(NamedTuple):
    """A trial's MEP window: its EMG, its times after the hit, and the sweep that it is in."""

    emg_mv: FloatArray
    since_hit_ms: FloatArray
    is_free: bool  # of any response to the tap, as it is before the hit, or long after it
    course_mv: FloatArray  # the sweep's EMG at `GRID_MS`
    is_outside: BoolArray  # which of it can show neither an MEP nor the pulse's artefact
    row: int  # its place among the windows

    @property
    def span(self) -> Span:
        """The times of `GRID_MS` that it meets."""
        return Span.between(self.since_hit_ms[0] - STEP_MS, self.since_hit_ms[-1] + STEP_MS)


class _Subtracted(NamedTuple):
    """What is subtracted from a trial's MEP window, and from those of the sweeps that show it, if others say it."""

    course_mv: FloatArray
    others_mv: FloatArray
    variance: float  # what is left of the response's size, relative to its mean


class _Places(NamedTuple):
    """The MEP windows of trials, as arrays of shape (n,): what they meet, and how much is known there."""

    spans: IntArray  # (n, 2)
    counts: IntArray  # how many sweeps show all of it
    rests_on: IntArray  # on how many its trial's amplitude rests
    are_free: BoolArray

    @classmethod
    def none(cls) -> _Places:
        nothing = np.zeros(0, dtype=np.int64)
        return cls(nothing.reshape(0, 2), nothing, nothing, nothing.astype(bool))

    def seen(self, by: Span) -> _Places:
        """The same after one more sweep, which shows so much."""
        return self._replace(counts=self.counts + ((self.spans[:, 0] >= by.first) & (self.spans[:, 1] <= by.end)))

    def appended(self, span: Span, count: int, *, is_free: bool) -> _Places:
        """The same and one more window."""
        return _Places(
            np.vstack([self.spans, span]),
            np.append(self.counts, count),
            np.append(self.rests_on, 0),
            np.append(self.are_free, is_free),
        )

    def due(self, *, rest: bool) -> BoolArray:
        """Those of which twice as much is known as their amplitudes rest on; new ones, if free of any response."""
        known = (self.counts >= np.maximum(2 * self.rests_on, LEAST_SHOWN)) & rest
        return np.where(self.are_free, self.rests_on == 0, known)


@dataclass(frozen=True, eq=False)
class TapResponses:
    """What the sweeps of a session show of the tap alone, and the MEP windows of its trials."""

    mep_window_ms: tuple[float, float] = MEP_WINDOW_MS
    courses: Courses = field(default_factory=Courses.none)
    windows: Mapping[int, _MepWindow] = field(default_factory=dict)  # by the trial's number
    places: _Places = field(default_factory=_Places.none)
    _found: dict[int, Left] = field(default_factory=dict, repr=False)
    """What was worked out before, by the trial's number."""

    def after(self, trial: Trial, sweep: Sweep) -> TapResponses:
        """The same after one more trial; of TMS alone, and of a trial that was lost, nothing is learnt."""
        hit_ms = hit_of(trial)
        is_control = trial.commanded_isi_ms is None and not trial.tap_alone
        if hit_ms is None or is_control or "emg" not in sweep.channels:
            return self
        emg = sweep.channels["emg"]
        values = emg.values * EMG_UNITS_MV[emg.unit]
        times_ms = emg.t0_ms + np.arange(values.size) * 1000 / emg.rate_hz
        rest = at_rest(emg, trial) if trial.t_tms_ms is not None else times_ms < hit_ms - PULSE_GUARD_MS
        found = disturbance(values, emg.rate_hz, rest)
        values = values if found is None else values - found.course_mv
        values = values - np.median(values[rest]) if rest.any() else values
        course = np.interp(GRID_MS, times_ms - hit_ms, values)
        learnt = self
        if trial.counts:
            until_ms = times_ms[-1] if trial.t_tms_ms is None else trial.t_tms_ms - PULSE_GUARD_MS
            span = Span.between(times_ms[0] - hit_ms, until_ms - hit_ms)
            each = samples(self.mep_window_ms[1] - self.mep_window_ms[0], emg.rate_hz) + 1
            courses = self.courses.appended(course, span, size_at_rest_mv(values[rest], each))
            learnt = replace(self, courses=courses, places=self.places.seen(span), _found=dict(self._found))
        if trial.mep_mv is None or trial.t_tms_ms is None:
            return learnt
        first, last = (trial.t_tms_ms + edge for edge in self.mep_window_ms)
        inside = (times_ms >= first - 1e-6) & (times_ms <= last + 1e-6)
        since_ms, over_ms = times_ms[inside] - hit_ms, float(GRID_MS[-1]) if trial.t_hit_ms is None else TAP_MS
        since_pulse = GRID_MS + hit_ms - trial.t_tms_ms
        outside = (since_pulse < -PULSE_GUARD_MS) | (since_pulse > self.mep_window_ms[1])
        outside |= (since_pulse > ARTEFACT_MS) & (since_pulse < EARLIEST_ONSET_MS)
        outside &= (times_ms[0] - hit_ms <= GRID_MS) & (times_ms[-1] - hit_ms >= GRID_MS)
        is_free = bool(since_ms[-1] < 0 or since_ms[0] > over_ms)
        window = _MepWindow(values[inside], since_ms, is_free, course, outside, len(self.windows))
        return learnt.meeting(trial.index, window)

    def meeting(self, number: int, window: _MepWindow) -> TapResponses:
        """The same with a trial's MEP window."""
        count = int(self.courses.showing(window.span).sum())
        places = self.places.appended(window.span, count, is_free=window.is_free)
        return replace(self, windows={**self.windows, number: window}, places=places)

    def measured(self, trial: Trial) -> Trial:
        """The trial with its amplitude without the tap's response, as far as that is known; else as it is."""
        window, left = self.windows.get(trial.index), self._left(trial.index)
        if window is None or left is None or trial.mep_mv is None:
            return trial
        mep_mv = float(np.ptp(window.emg_mv - left.course_mv)) if left.mean_mv else trial.mep_mv
        return replace(trial, mep_mv=mep_mv, mep_sd_mv=left.sd_mv, tap_mv=left.mean_mv)

    def without(self, emg_mv: FloatArray, since_hit_ms: FloatArray) -> FloatArray:
        """Some EMG without the mean course, as far as it is known [mV], shape (w,)."""
        return np.asarray(emg_mv - np.interp(since_hit_ms, GRID_MS, self._mean_mv, left=0.0, right=0.0))

    @cached_property
    def _mean_mv(self) -> FloatArray:
        return self.courses.mean_mv(LEAST_SHOWN)

    def corrected(self, trials: Iterable[Trial]) -> tuple[TapResponses, list[Trial]]:
        """The trials whose amplitudes are others by what is known now; each is looked at when twice as much is."""
        due = self.places.due(rest=self.courses.has_rest)
        if not due.any():
            return self, []
        wanted, rests_on, found = set(compress(self.windows, due)), self.places.rests_on.copy(), []
        for trial in (trial for trial in trials if trial.index in wanted):
            if (left := self._left(trial.index)) is None:
                continue
            rests_on[self.windows[trial.index].row] = left.shown
            again = self.measured(trial)
            pairs = ((trial.mep_mv or 0.0, again.mep_mv or 0.0), (trial.tap_mv or 0.0, again.tap_mv or 0.0))
            differs = any(abs(new - old) > max(SAME_MV, SAME_SHARE * max(new, old)) for old, new in pairs)
            if trial.counts and differs:
                found.append(again)
        return replace(self, places=self.places._replace(rests_on=rests_on)), found

    def wants_taps(self, window: Window | None, trials: TrialTable) -> bool:
        """Whether a window rests on trials whose part of the tap's response few sweeps, or none, have shown."""
        if window is None or any(trial.tap_alone for trial in trials.trials[-TAP_EVERY + 1 :]):
            return False
        few = self._inside(window, trials, self.places.counts < ENOUGH_SHOWN)
        return any(left is None or left.mean_mv > 0 for left in map(self._left, few))

    def shown_from_ms(self, window: Window | None, trials: TrialTable) -> float | None:
        """From which ISI on a pair would show the response at all trials within a window; None if it is known there.

        Sweeps that begin too late, or have no rest, never show it: it is tried a few times only.
        """
        unknown = ~self.places.are_free
        if self.courses.has_rest:
            unknown &= self.places.counts < LEAST_SHOWN
        unknown_ms = [] if window is None else list(self._inside(window, trials, unknown).values())
        if not unknown_ms:
            return None
        least_ms = max(unknown_ms) + self.mep_window_ms[1] + LONGER_MS
        tried = sum(abs((trial.isi_ms or 0.0) - least_ms - LONGER_MS) <= LONGER_MS for trial in trials.told)
        return least_ms if tried < LEAST_SHOWN else None

    def _inside(self, window: Window, trials: TrialTable, which: BoolArray) -> dict[int, float]:
        """The trials that a window rests on, of those with some of the MEP windows, and their ISIs [ms]."""
        numbers = set(compress(self.windows, which))
        found = ((trial.index, trial.isi_ms) for trial in trials.told if trial.index in numbers) if numbers else ()
        return {number: isi_ms for number, isi_ms in found if isi_ms is not None and is_inside(window, isi_ms)}

    def _count(self, number: int) -> int:
        """How many sweeps show what a trial's MEP window meets."""
        return int(self.places.counts[self.windows[number].row])

    def _is_known(self, number: int) -> bool:
        """Whether enough sweeps show what the tap does in a trial's MEP window, or that is free of it."""
        return self.windows[number].is_free or (self._count(number) >= LEAST_SHOWN and self.courses.has_rest)

    def _left(self, number: int) -> Left | None:
        """What subtracting the course leaves of the response in a trial's MEP window; None where unknown."""
        window = self.windows.get(number)
        if window is None or not self._is_known(number):
            return None
        if window.is_free:
            return Left(0.0, 0.0, LEAST_SHOWN, np.zeros_like(window.since_hit_ms))
        if (known := self._found.get(number)) is None or known.shown != self._count(number):
            self._found[number] = known = _left_of(window, self.courses)
        return known


def _left_of(window: _MepWindow, courses: Courses) -> Left:
    """What subtracting the course leaves of the response in a MEP window that enough sweeps show."""
    which, met = courses.showing(window.span), window.span.places
    shown, rest = courses.courses_mv[:, met][which], courses.rest_mv(which)
    count = len(shown)
    size, whole = float(np.ptp(shown, axis=-1).mean()), float(np.ptp(shown.mean(axis=0)))
    if size <= rest * (1 + CLEAR / math.sqrt(count)) and whole <= 2 * rest / math.sqrt(count):
        return Left(0.0, 0.0, count, np.zeros_like(window.since_hit_ms))
    found = _subtracted(window, courses, which, rest / math.sqrt(count))
    apart = np.ptp(shown - found.others_mv, axis=-1)
    excess = max(0.0, float(apart.mean()) - rest * math.sqrt(count / (count - 1)))
    mean_share, sd_share = _left_of_varying_size(found.variance, count)
    course_mv = np.interp(window.since_hit_ms, GRID_MS[met], found.course_mv)
    mean_mv = max(excess, math.hypot(whole * mean_share, rest) - rest)  # what is added to EMG at rest
    return Left(mean_mv, max(float(apart.std()), whole * sd_share), count, course_mv)


def _subtracted(window: _MepWindow, courses: Courses, which: BoolArray, clear_mv: float) -> _Subtracted:
    """What is subtracted: the mean course, moved towards that of the size which is shown outside the window.

    By how much is fitted to the sweeps that show both, and to a few usual ones besides.
    """
    met = window.span.places
    shown, spans = courses.courses_mv[:, met][which], courses.spans[which]
    count, mean, sizes = len(shown), shown.mean(axis=0), _sizes(shown)
    others = (count * mean - shown) / (count - 1)
    sums = courses.sums(which, sizes)
    one = sums.courses_mv / np.maximum(sums.weights, LEAST_WEIGHT)
    seen = window.is_outside & (sums.shown >= LEAST_SHOWN) & (np.abs(one) > clear_mv)
    # A sweep says its size if it shows half as much of the response as the one that shows most.
    power = within(spans, seen * one**2)
    both = power > 0.5 * power.max()
    # How many independent pieces of EMG say the size: with one alone, the error of its fit is unknown.
    pieces = float(seen @ one**2) ** 2 / max(float(seen @ one**4), TINY) * STEP_MS / TOGETHER_MS
    if pieces <= 1 or both.sum() < LEAST_BOTH:
        return _Subtracted(mean, others, _variance(sizes - 1))
    outside = np.ones(count)
    rows, at = np.flatnonzero(which)[both], np.flatnonzero(seen)
    outside[both] = _sizes_by_others(courses.courses_mv[np.ix_(rows, at)], spans[both], at, sizes[both], sums)
    own = float(one[at] @ window.course_mv[at]) / max(float(one[at] @ one[at]), TINY)
    apart = seen * (one * (window.course_mv - own * one)) ** 2
    error = float(apart.sum() / (seen @ one**2) ** 2) * TOGETHER_MS / STEP_MS * pieces / (pieces - 1)
    # A ridge regression of sizes within on sizes outside, whose prior is that both are the same.
    usual, known = USUAL_COUNTS * USUAL_VARIANCE, both.sum() + USUAL_COUNTS
    products = usual + float((sizes - 1) @ (outside - 1))
    share = float(np.clip(products / (usual + ((outside - 1) ** 2).sum() + known * error), 0.0, 1.0))
    left = np.where(both, sizes - 1 - share * (outside - 1), (1 - share) * (sizes - 1))
    variance = _variance(left, (1 - share) ** 2)
    course = mean + share * (own * one[met] - mean)
    without = _units_of_others(shown, sizes, sums.courses_mv[met], sums.weights[met])
    others = others + share * (outside[:, None] * without - others)
    return _Subtracted(course, others, variance + share**2 * error)


def _units_of_others(
    shown: FloatArray, sizes: FloatArray, courses_mv: FloatArray, weights: FloatArray | float
) -> FloatArray:
    """For each sweep the course of a size of 1, as all others say it, shape (k, w)."""
    own = sizes[:, None]
    return np.asarray((courses_mv - own * shown) / np.maximum(weights - own**2, LEAST_WEIGHT))


def _sizes_by_others(shown: FloatArray, spans: IntArray, at: IntArray, sizes: FloatArray, sums: Sums) -> FloatArray:
    """The size of each response at some places of `GRID_MS`, by the course that all others say, shape (k,)."""
    unit = _units_of_others(shown, sizes, sums.courses_mv[at], sums.weights[at])
    unit *= (spans[:, :1] <= at) & (spans[:, 1:] > at)
    return np.asarray(np.einsum("kw,kw->k", unit, shown) / np.maximum(np.einsum("kw,kw->k", unit, unit), TINY))


def _sizes(waves: FloatArray) -> FloatArray:
    """The size of each response as a share of that of their mean course, shape (k,)."""
    mean = waves.mean(axis=0)
    centred = mean - mean.mean()
    return np.asarray(waves @ centred / max(float(centred @ centred), TINY))


def _variance(left: FloatArray, usual_share: float = 1.0) -> float:
    """Relative variance of the response's size, from what is left of it in each sweep and of the usual variance."""
    usual = USUAL_COUNTS * USUAL_VARIANCE * usual_share
    return (usual + float((left**2).sum())) / (USUAL_COUNTS + len(left) - 1)


def _left_of_varying_size(variance: float, count: int) -> tuple[float, float]:
    """Mean and SD of what is left of a response of log-normal size without its mean, as shares of its mean size."""
    log_sd = math.sqrt(math.log1p(variance) * (1 + 2 / count))  # as the mean, too, is known from so few only
    left = 2 * math.erf(log_sd / math.sqrt(8))
    return left, math.sqrt(max(math.expm1(log_sd**2) - left**2, 0.0))


def hit_of(trial: Trial) -> float | None:
    """The hit, as it was measured or is to be expected [ms on the sweep's clock]; None without a time of the tap."""
    if trial.t_hit_ms is None and trial.t_valve_ms is not None:
        return trial.t_valve_ms + HIT_DELAY_MS
    return trial.t_hit_ms
