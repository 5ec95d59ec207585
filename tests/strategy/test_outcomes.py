"""What an amplitude stands for: a point, an interval, or more than the MEP alone."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.session.resuming import open_session
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.outcomes import Outcome, Outcomes, found_step_mv
from isiw.strategy.strategy import Strategy
from isiw.trials import Status, Trial
from isiw.window import Window
from known import known

IMPACT = DesignSpace(0, 320, reference="impact")
ISIS_MS = (0.0, 20.0, 40.0, 60.0, 80.0, 120.0, 160.0, 200.0, 240.0, 280.0)


def strategy(**settings: Any) -> Strategy:
    return make_strategy(space=IMPACT, seed=1, particles=200, **settings)


def test_a_stated_step_makes_an_interval_of_each_amplitude() -> None:
    seen = Outcomes("impact", 0.02).observation(Outcome(100.0, 0.04))
    assert (seen.mep_mv.item(), known(seen.mep_high_mv).item()) == pytest.approx((0.03, 0.05))
    least = Outcomes("impact", 0.02).observation(Outcome(100.0, 0.005))
    assert least.mep_mv.item() == 0.0
    nothing = Outcomes("impact", 0.02).observation(Outcome(100.0, 0.0))
    assert (nothing.mep_mv.item(), known(nothing.mep_high_mv).item()) == pytest.approx((0.0, 0.01))
    assert Outcomes("impact", 0.0).observation(Outcome(100.0, 0.04)).mep_high_mv is None


@pytest.mark.parametrize("step_mv", [0.005, 0.01, 0.02])
def test_a_step_is_found_in_amplitudes_that_are_its_multiples(step_mv: float) -> None:
    sizes = step_mv * np.random.default_rng(0).integers(1, 30, 40)
    found = [found_step_mv(sizes[:n].tolist()) for n in range(40)]
    assert found[3] == 0.0
    assert found[-1] == step_mv


def test_no_step_is_found_in_amplitudes_that_were_rounded_to_a_microvolt() -> None:
    for seed in range(200):
        sizes = np.random.default_rng(seed).lognormal(-3, 0.8, 40).round(3)
        assert {found_step_mv(sizes[:n].tolist()) for n in (5, 10, 40)} == {0.0}


def test_a_step_is_found_in_a_few_small_amplitudes_but_not_in_equal_ones() -> None:
    assert found_step_mv([0.0, 0.02, 0.0, 0.04, 0.02, 0.02, 0.04, 0.0]) == 0.02
    assert found_step_mv([0.02] * 20) == 0.0
    assert found_step_mv([0.0, 0.02] * 10) == 0.0


def test_a_step_that_is_found_is_learnt_as_one_that_was_stated() -> None:
    sizes = 0.02 * np.random.default_rng(1).integers(1, 12, 10)
    found, stated = strategy(), strategy(amplitude_step_mv=0.02)
    for isi_ms, mep_mv in zip(ISIS_MS, sizes.tolist(), strict=True):
        found.learn(Trial.of(isi_ms, mep_mv))
        stated.learn(Trial.of(isi_ms, mep_mv))
    assert found.estimate().probability == stated.estimate().probability
    assert found.ask() == stated.ask()


@pytest.mark.parametrize("wrong", [(0.2, 0.1), (-0.1, 0.1), (0.1,), (math.nan, 1.0)])
def test_an_interval_that_is_none_is_refused(wrong: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"interval|lower end"):
        strategy().tell(100.0, mep_interval_mv=wrong)


def test_an_interval_is_told_instead_of_an_amplitude() -> None:
    one = strategy()
    one.tell(100.0, mep_interval_mv=(0.0, 0.05))
    one.tell(120.0, mep_interval_mv=(0.05, math.inf))
    assert one.delivered == 2
    with pytest.raises(InvalidValueError, match="needs one of"):
        one.tell(100.0, 0.05, mep_interval_mv=(0.0, 0.05))


def test_taps_alone_say_what_of_an_amplitude_is_theirs() -> None:
    told = Outcomes("impact")
    for isi_ms, mep_mv in ((0.0, 0.01), (20.0, 0.25), (25.0, 0.35), (30.0, 0.3), (60.0, 0.012), (90.0, 0.01)):
        told = told.after_tap(isi_ms, mep_mv)
    near, far = (told.observation(Outcome(isi_ms, 0.3)).known_mv for isi_ms in (25.0, 75.0))
    assert known(near)[0, 0].item() == pytest.approx(0.29, abs=0.03)
    assert 0.05 < known(near)[0, 1].item() < 0.2
    between = known(told.observation(Outcome(45.0, 0.3)).known_mv)
    assert 0.1 < known(near)[0, 2].item() < 0.5 < between[0, 2].item()
    assert far is None or far[0, 0].item() < 0.01
    assert told.observation(Outcome(None, 0.3)).known_mv is None
    assert told.observation(Outcome(200.0, 0.3)).known_mv is None


@pytest.mark.slow
def test_a_tap_alone_uses_up_no_budget_and_what_was_told_before_it_is_learnt_again() -> None:
    taps = [(float(isi_ms), 0.3 if 10 <= isi_ms <= 50 else 0.01) for isi_ms in range(0, 90, 15)]
    pulses = [(isi_ms, 0.3 if 10 <= isi_ms <= 50 else 0.01) for isi_ms in ISIS_MS] * 2
    before, after, without = strategy(), strategy(), strategy()
    for isi_ms, mep_mv in taps:
        before.tell(isi_ms, mep_mv, pulse=False)
    for isi_ms, mep_mv in pulses:
        for one in (before, after, without):
            one.learn(Trial.of(isi_ms, mep_mv))
    for isi_ms, mep_mv in taps:
        after.tell(isi_ms, mep_mv, pulse=False)
    assert before.spent == after.spent == 20
    assert before.delivered == after.delivered == 26
    assert before.estimate().probability == pytest.approx(known(after.estimate().probability))
    assert known(before.estimate().probability) < 0.5 < known(without.estimate().probability)


def test_a_window_that_the_tap_could_explain_is_reported_with_that_sentence() -> None:
    pulses = [(isi_ms, 0.3 if 10 <= isi_ms <= 50 else 0.01) for isi_ms in ISIS_MS] * 2
    one = strategy()
    for isi_ms, mep_mv in pulses:
        one.learn(Trial.of(isi_ms, mep_mv))
    assert one.estimate().window is not None
    assert "Deliver the tap or electrical pulse alone at these ISIs too" in f"{one.estimate()}"


def test_a_late_window_or_one_at_isis_whose_taps_are_known_has_no_such_sentence() -> None:
    told = Outcomes("impact")
    for isi_ms in ISIS_MS:
        told = told.after(Outcome(isi_ms, 0.1))
    assert told.about_the_tap(Window(10.0, 70.0))["tap_may_explain"]
    assert not told.about_the_tap(Window(150.0, 250.0))["tap_may_explain"]
    assert not told.about_the_tap(None)["tap_may_explain"]
    for isi_ms in (10.0, 30.0, 50.0, 70.0):
        told = told.after_tap(isi_ms, 0.01)
    assert not told.about_the_tap(Window(10.0, 70.0))["tap_may_explain"]
    known_part = Outcomes("impact").after(Outcome(20.0, 0.1, tap_mv=0.0))
    assert not known_part.about_the_tap(Window(10.0, 70.0))["tap_may_explain"]


def test_a_window_whose_amplitudes_a_few_taps_alone_match_has_that_sentence_too() -> None:
    taps = ((0.0, 0.01), (30.0, 0.05), (60.0, 0.01))
    for mep_mv, explained in ((0.1, True), (1.0, False), (0.01, False)):
        told = Outcomes("impact")
        for isi_ms, tap_mv in taps:
            told = told.after_tap(isi_ms, tap_mv)
        for isi_ms in (20.0, 25.0, 35.0, 40.0):
            told = told.after(Outcome(isi_ms, mep_mv))
        assert told.about_the_tap(Window(15.0, 45.0)) == {"tap_may_explain": explained, "tap_is_likely": explained}


def test_responses_without_amplitudes_do_not_show_a_tap_that_is_known() -> None:
    told = Outcomes("impact")
    for isi_ms in (0.0, 30.0, 60.0):
        told = told.after_tap(isi_ms, 0.05)
    for isi_ms in (20.0, 25.0, 35.0, 40.0):
        told = told.after(Outcome(isi_ms, response=True))
    assert told.about_the_tap(Window(15.0, 45.0)) == {"tap_may_explain": False, "tap_is_likely": False}


@pytest.mark.parametrize(("tap_mv", "likely"), [(0.0, False), (0.12, True)])
def test_taps_alone_that_were_measured_at_no_isi_tell_whether_a_window_may_be_the_taps(
    tap_mv: float, *, likely: bool
) -> None:
    window, told = (
        Window(10.0, 70.0),
        Outcomes("impact").of(
            Trial(k, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=0.1 if isi_ms <= 70 else 0.01)
            for k, isi_ms in enumerate(ISIS_MS)
        ),
    )
    assert told.about_the_tap(window) == {"tap_may_explain": True, "tap_is_likely": False}
    told = told.of(Trial(k, Status.ACCEPTED, None, mep_mv=tap_mv, tap_alone=True) for k in range(13))
    assert told.about_the_tap(window) == {"tap_may_explain": likely, "tap_is_likely": likely}


@pytest.mark.parametrize("wrong", [(None, 0.1), (20.0, None), (20.0, -0.1), (math.nan, 0.1)])
def test_a_tap_alone_needs_an_isi_and_an_amplitude(wrong: Any) -> None:
    one = strategy()
    with pytest.raises(InvalidValueError):
        one.tell(*wrong, pulse=False)
    assert one.delivered == 0


@pytest.mark.parametrize(
    "slip",
    [
        {"mep_interval_mv": (50, 500)},
        {"mep_interval_mv": (50, math.inf)},
        {"mep_interval_mv": (0, 50)},
        {"mep_mv": 0.3, "mep_sd_mv": 20.0},
    ],
)
def test_an_interval_or_an_sd_in_microvolts_is_refused(tmp_path: Path, slip: dict[str, Any]) -> None:
    one = strategy()
    with pytest.raises(InvalidValueError, match="Is it in µV"):
        one.tell(100.0, **slip)
    with open_session(strategy(), tmp_path / "s.mcap") as session:
        isi_ms = session.ask()
        with pytest.raises(InvalidValueError, match="Is it in µV"):
            session.tell(isi_ms, **slip)
        assert (one.delivered, len(session.trials)) == (0, 0)


@pytest.mark.parametrize("pulse", ["no", None, 0, 1])
def test_whether_a_pulse_was_given_is_true_or_false(tmp_path: Path, pulse: Any) -> None:
    one = strategy()
    with pytest.raises(InvalidValueError, match="pulse must be True or False"):
        one.tell(100.0, 0.1, pulse=pulse)
    with open_session(strategy(), tmp_path / "s.mcap") as session:
        isi_ms = session.ask()
        with pytest.raises(InvalidValueError, match="pulse must be True or False"):
            session.tell(isi_ms, 0.1, pulse=pulse)
        assert (one.delivered, len(session.trials)) == (0, 0)
