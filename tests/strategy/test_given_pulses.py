"""TMS alone at intensities of its own: what it teaches, and what it leaves as it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from isiw.design import VALVE_SPACE
from isiw.errors import InvalidValueError
from isiw.models.particles.laws import NoiseShares
from isiw.models.particles.model import ParticleModel
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Prior
from isiw.models.particles.records import LOG_FLOOR, LOG_RATIO
from isiw.models.protocol import Observation
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.trials import Status, Trial

WITHOUT_CURVE = "constant-CV noise", "missing responses", "all-or-none responses"

CURVE = [(pct_rmt, 0.01 + 2.0 / (1.0 + math.exp(-(pct_rmt - 112.0) / 4.0))) for pct_rmt in (140, 100, 120, 130, 110)]
"""Intensities [% RMT], and MEPs [mV] of a saturating curve."""


def small(name: str = "default", **settings: Any) -> Strategy:
    few: dict[str, Any] = {"particles": 200} if name == "default" else {}
    return make_strategy(name, seed=3, **few, **settings)


def given(strategy: Strategy, curve: Sequence[tuple[float, float]] = CURVE) -> Strategy:
    for pct_rmt, mep_mv in curve:
        strategy.tell(None, mep_mv, intensity_pct_rmt=pct_rmt)
    return strategy


def without_curve(strategy: Strategy) -> float:
    hypotheses = strategy.estimate().hypotheses
    assert hypotheses is not None
    return sum(hypotheses[name] for name in WITHOUT_CURVE)


def test_pulses_over_the_curve_teach_the_largest_mep_of_those_who_have_one() -> None:
    model = ParticleModel(Prior(other_curve=0.0), particles=600)
    posterior = model.begin(VALVE_SPACE, 5)
    for _ in range(4):
        for pct_rmt, mep_mv in CURVE:
            observation = Observation.of([None], [mep_mv], shift_pct_rmt=[pct_rmt - model.pairs_pct_rmt])
            posterior = model.update(posterior, observation)
    latents, fields = posterior.swarm.picked(posterior.law, 600)
    log_largest = (fields[..., LOG_RATIO] + fields[..., LOG_FLOOR])[latents.noise == NoiseKind.RECRUITMENT]
    assert 1.2 < np.exp(np.median(log_largest)) < 3.2
    assert log_largest.std() < 0.5  # of the prior it is more than 1


def test_kinds_of_noise_that_know_no_other_intensity_are_neither_favoured_nor_excluded() -> None:
    assert without_curve(given(small())) == pytest.approx(without_curve(small()), abs=0.25)


def apart(strategy: Strategy) -> float:
    """The probability that pulses given alone are of another curve than the pairs."""
    swarm = strategy.posterior.swarm  # type: ignore[attr-defined] # of the default
    return float(np.exp(swarm.log_weights[0])[~swarm.of_given].sum())


def test_pulses_alone_of_a_stated_intensity_leave_open_whether_the_pairs_have_their_curve() -> None:
    strategy = small()
    assert apart(strategy) == 0
    for pct_rmt, mep_mv in CURVE:
        strategy.tell(None, mep_mv, intensity_pct_rmt=pct_rmt)
        assert apart(strategy) == pytest.approx(Prior().other_curve)
    strategy.tell(None, 0.05, intensity_pct_rmt=90.0)  # that of the pairs is one of the curve, too
    assert apart(strategy) == pytest.approx(Prior().other_curve)


def test_pulses_of_another_curve_are_left_and_those_of_the_same_are_not() -> None:
    prior = Prior(noise=NoiseShares(0.0, 0.0, 1.0, 0.0, 0.0))
    another = [(pct_rmt - 18.0, mep_mv) for pct_rmt, mep_mv in CURVE * 2]
    right, wrong = given(small(prior=prior)), given(small(prior=prior), another)
    silent_mv = 0.02 * np.exp(0.3 * np.random.default_rng(2).standard_normal(8))
    for strategy in (right, wrong):
        for pair, mep_mv in enumerate(silent_mv.tolist()):
            strategy.tell(60.0 * pair, mep_mv)
    assert apart(right) < 0.5 < apart(wrong)


def test_a_prior_may_know_that_pulses_and_pairs_have_one_curve() -> None:
    assert apart(given(small(prior=Prior(other_curve=0.0)))) == 0


@pytest.mark.parametrize("name", ["nr", "supra-threshold"])
def test_a_method_without_a_law_of_other_intensities_is_not_misled_by_them(name: str) -> None:
    plain, taught = small(name), given(small(name))
    assert taught.ask() == plain.ask()
    for strategy in (plain, taught):
        strategy.tell(strategy.ask(), 0.05)
    assert taught.estimate().window == plain.estimate().window
    assert taught.spent == plain.spent == 1
    assert taught.delivered == 1 + len(CURVE)


def test_earlier_pulses_teach_what_pulses_of_the_session_do_and_starting_again_knows_them() -> None:
    trials = [
        Trial(number, Status.ACCEPTED, None, mep_mv=mep_mv, intensity_pct_rmt=pct_rmt)
        for number, (pct_rmt, mep_mv) in enumerate(CURVE)
    ]
    told, earlier, other_level = given(small()), small(), small()
    earlier.learn_all(trials, same_level=True)
    other_level.learn_all(trials)
    assert earlier.estimate().hypotheses == told.estimate().hypotheses
    assert other_level.estimate().hypotheses != told.estimate().hypotheses
    for strategy in (earlier, other_level):
        again = strategy.restarted()
        for _ in range(3):
            assert strategy.ask() == again.ask()
            strategy.tell(strategy.ask(), 0.05)
            again.tell(again.ask(), 0.05)
        assert strategy.spent == 3


def test_an_intensity_of_a_tap_alone_is_refused() -> None:
    strategy = small()
    with pytest.raises(InvalidValueError, match="a tap alone"):
        strategy.tell(50.0, 0.1, pulse=False, intensity_pct_rmt=110.0)
    with pytest.raises(InvalidValueError, match="intensity_pct_rmt"):
        strategy.tell(None, 0.1, intensity_pct_rmt=-1.0)
    assert strategy.delivered == 0


def test_an_intensity_in_another_unit_is_refused_but_one_of_an_old_log_is_learnt() -> None:
    strategy = small()
    for isi_ms in (None, strategy.ask()):
        with pytest.raises(InvalidValueError, match=r"in another unit.*Multiply by 100"):
            strategy.tell(isi_ms, 0.5, intensity_pct_rmt=1.2)
    assert strategy.delivered == 0
    strategy.learn(Trial.of(None, 0.5, intensity_pct_rmt=1.2))
    assert strategy.delivered == 1


def test_amplitudes_over_the_curve_do_not_look_like_a_slip_of_unit() -> None:
    strategy = small()
    for number in range(6):
        strategy.tell(None, 0.011 + 0.001 * number)
    given(strategy, [(140.0, 3.0 + 0.4 * number) for number in range(6)])  # warnings are errors
    assert strategy.delivered == 12
