"""One person's sessions: a method, under a reading, until its stopping rule, and judged by every truth."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
import torch
from scipy.stats import shapiro

import isiw
from benchmarks.reduction.guess import FIXED, UNRELATED, guessing, unrelated
from benchmarks.reduction.readings import BASE, Reading
from benchmarks.reduction.recorded import BASELINES, STEP_MS, SWEPT, TRIALS_PER_ISI, RecordedSweep, record, stops_inside
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.estimate import WindowEstimate
from isiw.signals import wrong_isi
from isiw.strategy.decisions import stimuli_left
from isiw.subjects.cohorts import cohort
from isiw.types import BoolArray, FloatArray
from isiw.window import Window

NEAR_MS = 25.0
"""How far before the true window an experimenter begins who expects it [ms]."""

ALONE = 1
"""Sets the draw of TMS alone apart from that of the pairs."""


@dataclass(frozen=True)
class Session:
    """One session of a study.

    Args:
        method: a named strategy.
        cohort: a named cohort.
        person: which person of it, from 0.
        seed: of the cohort; trial noise, draws and strategy use `seed + person`.
        reading: how the text is read.
        accelerometer: whether ISIs count from the impact.
        horizon: trials that are played at least, whatever the stopping rule says.
        alone: trials of TMS alone at the pairs' intensity that the strategy is told before the first pair; they are no
            trials of the session.
        settings: settings of the strategy beyond the reading's, as (name, value) pairs.
        wrong: which model that is wrong on purpose, one of those of `wrong`; empty: none.
    """

    method: str
    cohort: str
    person: int
    seed: int
    reading: Reading = BASE
    accelerometer: bool = False
    horizon: int = 0
    alone: int = 0
    settings: tuple[tuple[str, Any], ...] = field(default=())
    wrong: str = ""


@dataclass(frozen=True)
class Range:
    """What is searched.

    Args:
        space: the ISIs, from the valve command or the impact.
        offset_ms: what to add for an ISI from the valve command [ms].
    """

    space: DesignSpace
    offset_ms: float

    def from_valve(self, window: Window | None) -> Window | None:
        """A window of this space, counted from the valve command."""
        if window is None:
            return None
        segments = tuple((low + self.offset_ms, high + self.offset_ms) for low, high in window.segments)
        return Window(segments[0][0], segments[-1][1], segments)


def searched(session: Session, hit_delay_ms: float) -> Range:
    """What a session searches: with accelerometer, from the impact on (4.4.5, 4.4.7).

    Args:
        session: the session.
        hit_delay_ms: mean hit delay of the person [ms].
    """
    step_ms = VALVE_SPACE.step_ms if session.reading.observation == "live" else STEP_MS
    if not session.accelerometer:
        return Range(DesignSpace(0, 500, step_ms, reference="valve"), 0.0)
    hit_ms = step_ms * round(hit_delay_ms / step_ms)
    length_ms = 500.0 if session.reading.range_end == "hit" else 500.0 - hit_ms
    return Range(DesignSpace(0, length_ms, step_ms, reference="impact"), hit_ms)


def answers(session: Session, swept: RecordedSweep, offset_ms: float) -> Callable[[float], tuple[float, float]]:
    """What answers an asked ISI: the told ISI [ms] and its MEP [mV], as the reading has them."""
    reading = session.reading
    if reading.observation == "live":
        responder = swept.subject.begin(session.seed + session.person)
        reference = "impact" if session.accelerometer else "valve"

        def live(isi_ms: float) -> tuple[float, float]:
            response = responder.respond(isi_ms, reference)
            return isi_ms if response.isi_ms is None else response.isi_ms, response.mep_mv

        return live
    rng = np.random.default_rng([session.seed, session.person])
    inside = known(reading, swept)

    def recorded(isi_ms: float) -> tuple[float, float]:
        stop = swept.index(isi_ms + offset_ms)
        meps_mv = swept.kept_mv[stop]
        mep_mv = meps_mv.mean() if reading.observation == "mean" else meps_mv[rng.integers(len(meps_mv))]
        return isi_ms, float(mep_mv) if reading.outside == "recorded" or (stop < len(inside) and inside[stop]) else 0.0

    return recorded


def alone_mv(session: Session, swept: RecordedSweep) -> list[float]:
    """MEPs of TMS alone [mV] that a strategy is told first, drawn from those of the record."""
    recorded_mv = swept.alone_mv[BASELINES[1]]
    rng = np.random.default_rng([session.seed, session.person, ALONE])
    return rng.choice(recorded_mv, session.alone, replace=False).tolist()


def known(reading: Reading, swept: RecordedSweep) -> BoolArray:
    """At which ISIs of `SWEPT` a reading has MEPs other than zero, shape (t,)."""
    window = swept.windows[reading.truth]
    if reading.outside == "recorded":
        return np.ones(len(SWEPT.grid_ms), dtype=bool)
    return np.zeros(len(SWEPT.grid_ms), dtype=bool) if window is None else window.mask(SWEPT.grid_ms)


def profile_mv(estimate: WindowEstimate, where: Range) -> FloatArray | None:
    """The estimated profile [mV] on `SWEPT`, or on the part of it that was searched; None where there is none."""
    band = estimate.profile(SWEPT.grid_ms - where.offset_ms)
    return None if band is None else band.median_mv


def correlation(a: FloatArray | None, b: FloatArray) -> float:
    """Pearson's correlation of two profiles; NaN where one is missing, 0 where one is flat."""
    if a is None:
        return math.nan
    if np.ptp(a) <= 1e-12 or np.ptp(b) <= 1e-12:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])


def strategy_of(session: Session, where: Range) -> isiw.Strategy:
    """The strategy of a session before its first trial."""
    settings = session.reading.settings(session.method) | dict(session.settings)
    usual = isiw.make_strategy(session.method, where.space, session.seed + session.person, **settings)
    return guessing(usual, where.offset_ms) if session.wrong == FIXED else usual


def play(
    session: Session, swept: RecordedSweep, change: Callable[[isiw.Strategy], isiw.Strategy] = lambda usual: usual
) -> dict[str, Any]:
    """Run a session until its stopping rule, and to its horizon where that is later; see `run`.

    Args:
        session: the session.
        swept: the person's recorded sweep.
        change: makes another strategy of the session's own.
    """
    where = searched(session, swept.subject.hit_delay_ms)
    strategy = change(strategy_of(session, where))
    answer = answers(session, swept, where.offset_ms)
    if session.wrong == UNRELATED:
        answer = unrelated(answer, where.space, session.seed + session.person)
    for mep_mv in alone_mv(session, swept):
        strategy.tell(None, mep_mv)
    by_trial: dict[str, list[float]] = {f"f1, {session.reading.truth}": [], "f1, true": []}
    before = f1_by_truth(where.from_valve(strategy.estimate().window), swept)
    trials, stopped, spread_ms = 0, None, []
    while stopped is None or trials < session.horizon:
        asked_ms = strategy.ask()
        isi_ms, mep_mv = answer(asked_ms)
        trials += 1
        if wrong_isi(isi_ms, asked_ms, where.space) is None:
            strategy.tell(isi_ms, mep_mv)
        else:
            strategy.count_mistrial()
        estimate = strategy.estimate()
        if trials <= session.horizon:
            scores = f1_by_truth(where.from_valve(estimate.window), swept)
            for name, values in by_trial.items():
                values.append(scores[name])
        if estimate.spread_ms is not None and not (spread_ms and spread_ms[-1] == estimate.spread_ms):
            spread_ms.append(estimate.spread_ms)
        if stopped is None and strategy.decision().stop:
            left = stimuli_left(strategy.stopping, trials)
            stopped = {"trials": trials, "converged": left is None or left > 0}
            stopped |= judged(estimate, where, swept, session.reading)
            stopped["amplitudes_mv"] = amplitudes_mv(strategy)
    measured, true = by_trial.values()
    before_any = {"f1 before, measured": before[f"f1, {session.reading.truth}"], "f1 before, true": before["f1, true"]}
    return stopped | before_any | {"f1_by_trial": true, "f1_measured_by_trial": measured, "spread_ms": spread_ms}


def judged(estimate: WindowEstimate, where: Range, swept: RecordedSweep, reading: Reading) -> dict[str, Any]:
    """F1 by every truth, and correlations with the measured and the true profile.

    A sweep that shows no window cannot judge: every subject of the dissertation had one.
    """
    window, profile = where.from_valve(estimate.window), profile_mv(estimate, where)
    scores = f1_by_truth(window, swept)
    scores["f1, measured"] = scores[f"f1, {reading.truth}"]
    inside = SWEPT.grid_ms >= where.offset_ms
    profiles = {"measured": np.where(known(reading, swept), swept.measured_mv, 0.0), "true": swept.true_mv}
    part = None if profile is None else profile[inside]
    return scores | {f"correlation, {name}": correlation(part, mv[inside]) for name, mv in profiles.items()}


def f1_by_truth(window: Window | None, swept: RecordedSweep) -> dict[str, float]:
    """F1 of a window from the valve command by every truth; NaN where a sweep shows no window to judge by."""
    return {
        f"f1, {name}": math.nan if name != "true" and truth is None else isiw.metrics.f1(window, truth, SWEPT)
        for name, truth in swept.windows.items()
    }


def amplitudes_mv(strategy: isiw.Strategy) -> tuple[float, ...]:
    """Of the Gaussians that a regression's curve is made of [mV]; empty for other methods."""
    curves = getattr(strategy.posterior, "curves", ())
    return curves[0].amplitudes_mv if curves else ()


@lru_cache(maxsize=4)
def recorded_person(name: str, person: int, seed: int) -> RecordedSweep:
    """A person's recorded sweep."""
    return record(cohort(name, person + 1, seed)[person], seed + person)


def run(session: Session) -> dict[str, Any]:
    """Run one session.

    Returns:
        Trials to its stopping rule, whether it converged, F1 by every truth and correlations then; F1 by the true
        window and by the reading's measured one before any trial and after each trial of the horizon; and what only
        some methods have: the spread of the particles after each generation, and the amplitudes of the Gaussians. Of
        the conventional sweep: see `conventional`.
    """
    torch.set_num_threads(1)
    swept = recorded_person(session.cohort, session.person, session.seed)
    return conventional(session, swept) if session.method == "incremental" else play(session, swept)


def conventional(session: Session, swept: RecordedSweep) -> dict[str, Any]:
    """The conventional sweep itself: its trials by where it begins and ends, and its window by the true one."""
    truth, hit_ms = swept.windows["true"], swept.subject.hit_delay_ms
    baseline, measured = session.reading.baseline, swept.windows[session.reading.truth]
    done = swept.sweep(hit_ms if session.accelerometer else 0.0, baseline)
    near_ms = hit_ms if truth is None else truth.start_ms - NEAR_MS
    return {
        "trials": done.terminated,
        "converged": done.terminated < done.trials,
        "whole": done.trials,
        "near": swept.sweep(near_ms, baseline).terminated,
        "inside measured": TRIALS_PER_ISI * stops_inside(measured),
        "inside measured, 90 %": TRIALS_PER_ISI * stops_inside(swept.windows["measured, 90 % RMT"]),
        "inside measured, .135": TRIALS_PER_ISI * stops_inside(swept.windows["measured, .135"]),
        "inside true": TRIALS_PER_ISI * stops_inside(truth),
        "shows a window": measured is not None,
        "shows a window, 90 %": swept.windows["measured, 90 % RMT"] is not None,
        "normal": normal(swept.measured_mv[inside_of(measured)]),
        "normal throughout": normal(swept.measured_mv),
        "f1, true": isiw.metrics.f1(done.window, truth, SWEPT),
        "f1, of .135": isiw.metrics.f1(swept.windows["measured, .135"], truth, SWEPT),
        "correlation, true": correlation(swept.measured_mv, swept.true_mv),
    }


def normal(values: FloatArray) -> float:
    """1 where a Shapiro–Wilk test does not reject that values are normal at .05, else 0; NaN of fewer than three."""
    return float(shapiro(values).pvalue >= 0.05) if len(values) >= 3 else math.nan


def inside_of(window: Window | None) -> BoolArray:
    """Which ISIs of `SWEPT` lie in a window; all where there is none."""
    return np.ones(len(SWEPT.grid_ms), dtype=bool) if window is None else window.mask(SWEPT.grid_ms)
