"""Looks at amplitudes that begin with the last ones find what a look at all of them does, and are as quick later on."""

from __future__ import annotations

import statistics
import time

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.signals import plausible, watch
from isiw.signals.limits import SignalLimits
from isiw.signals.plausible import Counted, Response, is_silent, large, silent, small, stopped
from isiw.signals.watch import Watch
from isiw.strategy.outcomes import Outcome, Outcomes, found_step_mv
from isiw.sweeps import Measurement
from isiw.trials import Status, Trial


def told(rng: np.random.Generator) -> Counted:
    """A trial of a series in which something is often odd."""
    mep_mv = float(rng.choice([0.0, 0.0, 5e-4, 0.002, 0.1, 0.1, 0.1001, 6.0, rng.gamma(2.0, 0.1)]))
    outside = Response(float(rng.choice([50.0, 51.0, 70.0])), 0.1) if rng.random() < 0.6 else None
    rest_uv = [None, 0.0, 3.0][rng.integers(3)]
    return Counted(mep_mv, [None, 10.0, 30.0, 90.0][rng.integers(4)], rest_uv, outside)


def kinds_plainly(series: tuple[Counted, ...]) -> set[str]:
    """What is found in some amplitudes by going through all of them."""
    found, meps_mv = set[str](), [one.mep_mv for one in series]
    seen = [mep_mv for mep_mv in meps_mv if mep_mv > 0]
    if len(meps_mv) >= plausible.SILENT_FROM_THE_START and is_silent([Trial.of(90.0, mep_mv) for mep_mv in meps_mv]):
        found.add("silent")
    if plausible.stopped_after([one.isi_ms for one in series], [one.stands_out for one in series]) is not None:
        found.add("stopped")
    if len(seen) >= plausible.IN_A_ROW and max(seen[-plausible.IN_A_ROW :]) < plausible.SMALL_MV:
        found.add("small")
    usual_mv = statistics.geometric_mean(seen[-plausible.IN_A_ROW :]) if len(seen) >= plausible.IN_A_ROW else 0.0
    if usual_mv >= plausible.LARGE_MV:
        earlier = seen[: -plausible.IN_A_ROW]
        if not earlier or usual_mv / statistics.median(earlier) >= plausible.JUMP:
            found.add("large")
    since = next((n for n, one in enumerate(series[::-1]) if one.rest_uv and one.stands_out), len(series))
    outside = [one.outside for one in series[::-1][:since] if one.outside is not None]
    alike = next((n for n, one in enumerate(outside) if abs(one.at_ms - outside[0].at_ms) > watch.ALIKE_MS), 99)
    isis_ms = [one.isi_ms for one in series[::-1][:since] if one.outside is not None][:alike]
    pairs_ms = [isi_ms for isi_ms in isis_ms if isi_ms is not None]
    differ = len(pairs_ms) < len(isis_ms) or max(pairs_ms) - min(pairs_ms) >= watch.DIFFERING_MS if isis_ms else False
    if len(isis_ms) >= watch.IN_A_ROW and differ:
        found.add("misplaced")
    return found


def test_what_is_odd_is_found_as_by_a_look_at_all_amplitudes() -> None:
    rng, met = np.random.default_rng(0), set[str]()
    checks = {check.__name__: check for check in (silent, stopped, small, large)}
    for _ in range(400):
        quiet = rng.random() < 0.3
        series = tuple(told(rng) for _ in range(rng.integers(1, 25)))
        series += tuple(Counted(0.0, 20.0) for _ in range(rng.integers(0, 60))) if quiet else ()
        series += (Counted(6.0, 20.0),) * 3 if rng.random() < 0.2 else ()
        series = tuple(Counted(0.0, one.isi_ms) for one in series) if rng.random() < 0.1 else series
        plain = kinds_plainly(series)
        found = {name for name, check in checks.items() if check(series) is not None}
        assert found == plain - {"misplaced"}
        isis_ms = [isi_ms for isi_ms, _ in watch._last_alike(series)]  # noqa: SLF001 - what it is found by
        follows = len(isis_ms) >= watch.IN_A_ROW and watch._follow_the_pulse(isis_ms)  # noqa: SLF001 - the same
        assert follows == ("misplaced" in plain)
        met |= plain
    assert met == {*checks, "misplaced"}


@pytest.mark.parametrize("step_mv", [0.1, 0.025, 0.002, 0.001])
def test_a_step_of_amplitudes_is_found_after_each_trial_as_by_a_look_at_all_of_them(step_mv: float) -> None:
    rng, outcomes, learnt_mv = np.random.default_rng(1), Outcomes("impact"), list[float]()
    for number in range(60):
        mep_mv = step_mv * int(rng.integers(0, 40)) if number < 50 else float(rng.gamma(2.0, 0.1))
        outcomes = outcomes.after(Outcome(10.0, mep_mv))
        learnt_mv.append(mep_mv)
        assert outcomes.step_mv == found_step_mv(learnt_mv)


@pytest.mark.slow
def test_a_look_at_a_trial_behind_3000_others_takes_hardly_longer_than_behind_100() -> None:
    rng, spent_s = np.random.default_rng(2), list[float]()
    watched = Watch(DesignSpace(0, 200, reference="impact"), SignalLimits(), 10**9)
    for number in range(3000):
        isi_ms, mep_mv = float(rng.integers(0, 200)), float(rng.gamma(2.0, 0.1))
        trial = Trial(number, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=mep_mv)
        begun_s = time.process_time()
        watched = watched.after(trial, Measurement(mep_mv, isi_ms))
        spent_s.append(time.process_time() - begun_s)
    assert np.median(spent_s[-100:]) < 8 * np.median(spent_s[50:150])  # 50 times before
