"""The bootstrap particle filter: generations, weights, resampling, the lattice, and several people."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from isiw.acquisition.fixed import OwnProposal
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.dissertation.bootstrap import BootstrapFilter, BootstrapPosterior, WindowKind, normalised, resampled
from isiw.errors import InvalidValueError
from isiw.models.shared.history import FloorTreatment
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy
from isiw.testing import check_model
from isiw.types import ArrayLike
from isiw.window import Window
from known import known
from models.told_trials import bell_mv, observation, told

PF = BootstrapFilter()
STILL = BootstrapFilter(diffusion_ms=0.0)


def generation(posterior: BootstrapPosterior, mep_mv: Callable[[float], ArrayLike]) -> BootstrapPosterior:
    """After all particles were measured, with MEPs by ISI."""
    for isi_ms in posterior.proposed_isis_ms()[0].tolist():
        posterior = posterior.model.update(posterior, observation([isi_ms], [np.asarray(mep_mv(isi_ms)).item()]))
    return posterior


def test_nothing_is_learnt_before_the_generation_is_complete() -> None:
    posterior = PF.begin(VALVE_SPACE, 3)
    plan = posterior.proposed_isis_ms()[0].tolist()
    for told_so_far, isi_ms in enumerate(plan):
        assert posterior.proposed_isis_ms()[0].tolist() == plan[told_so_far:]
        assert posterior.estimate().window is None
        posterior = PF.update(posterior, observation([isi_ms], [float(bell_mv(isi_ms))]))
    assert posterior.estimate().window is not None
    assert posterior.proposed_isis_ms().shape == (1, 30)
    assert posterior.proposed_isis_ms()[0].tolist() != plan


@pytest.mark.parametrize("space", [VALVE_SPACE, IMPACT_SPACE], ids=["valve", "impact"])
def test_a_batch_of_all_particles_is_what_is_asked_one_by_one(space: DesignSpace) -> None:
    batched, single = (make_strategy("pf", space, seed=2) for _ in range(2))
    for _ in range(3):
        batch, asked = batched.ask_batch(30), []
        for isi_ms in batch:
            asked.append(single.ask())
            for strategy in (batched, single):
                strategy.tell(isi_ms, 0.01 + float(bell_mv(isi_ms)))
        assert asked == batch


def test_a_batch_reaches_to_the_end_of_the_generation_and_no_further() -> None:
    strategy = make_strategy("pf", seed=2)
    batch = strategy.ask_batch(30)
    strategy.tell(strategy.ask(), 0.1)
    assert strategy.ask_batch(29) == batch[1:]
    with pytest.raises(Exception, match="at most 29 ISIs"):
        strategy.ask_batch(30)


def test_the_first_generation_is_uniform_over_the_range() -> None:
    plan = BootstrapFilter(particles=4000, diffusion_ms=0.0).begin(VALVE_SPACE, 1).proposed_isis_ms()[0]
    assert np.histogram(plan, bins=5, range=(-2.5, 502.5))[0] / 4000 == pytest.approx([0.2] * 5, abs=0.03)


@pytest.mark.parametrize("space", [VALVE_SPACE, DesignSpace(3.0, 321.0, reference="impact")], ids=["valve", "odd"])
def test_particles_stay_on_the_lattice_and_in_the_range(space: DesignSpace) -> None:
    posterior = BootstrapFilter(diffusion_ms=60.0).begin(space, 5)
    for _ in range(3):
        plan = posterior.proposed_isis_ms()[0]
        assert ((plan - space.low_ms) % 5.0 == 0.0).all()
        assert plan.min() >= space.low_ms
        assert plan.max() <= space.high_ms
        posterior = generation(posterior, lambda _: 0.05)


def test_weights_are_in_proportion_to_the_meps() -> None:
    assert normalised(np.array([[1.0, 3.0, 0.0]])).tolist() == [[0.25, 0.75, 0.0]]
    assert normalised(np.zeros((1, 4))).tolist() == [[0.25] * 4]


def test_resampling_draws_particles_in_proportion_to_their_weights() -> None:
    particles = np.tile([0.0, 100.0, 200.0], (1, 4000))
    weights = normalised(np.tile([1.0, 3.0, 0.0], (1, 4000)))
    drawn = resampled(particles, weights, np.random.default_rng(1).uniform(size=particles.shape))
    assert (drawn == 100.0).mean() == pytest.approx(0.75, abs=0.02)
    assert (drawn == 200.0).sum() == 0


def test_a_draw_at_either_end_is_a_particle_with_weight() -> None:
    particles, weights = np.array([[1.0, 2.0, 3.0]]), np.array([[0.0, 1.0, 0.0]])
    assert resampled(particles, weights, np.array([[0.0, 0.5, 1.0 - 1e-16]])).tolist() == [[2.0, 2.0, 2.0]]


def test_without_diffusion_all_particles_go_where_the_only_mep_was() -> None:
    posterior = STILL.begin(VALVE_SPACE, 4)
    chosen = posterior.proposed_isis_ms()[0, 11].item()
    after = generation(posterior, lambda isi_ms: 0.1 if isi_ms == chosen else 0.0)
    assert after.proposed_isis_ms()[0].tolist() == [chosen] * 30
    assert after.spread_ms[0] == 0.0


def test_the_window_is_the_weighted_mean_of_the_measured_particles_and_75_ms_to_either_side() -> None:
    posterior = STILL.begin(VALVE_SPACE, 4)
    plan = posterior.proposed_isis_ms()[0]
    meps = 0.01 + bell_mv(plan)
    after = generation(posterior, lambda isi_ms: 0.01 + bell_mv(isi_ms))
    assert after.expectation_ms[0] == pytest.approx((meps * plan).sum() / meps.sum(), abs=1e-4)
    window = after.estimate().window
    assert (known(window).start_ms, known(window).end_ms) == pytest.approx(
        (after.expectation_ms[0] - 75.0, after.expectation_ms[0] + 75.0), abs=0.5
    )


@pytest.mark.parametrize("floor_mv", [0.0, 0.01])
def test_the_profile_is_a_gaussian_through_the_meps_and_there_is_none_before(floor_mv: float) -> None:
    first = PF.begin(VALVE_SPACE, 3)
    assert first.estimate().profile([263.0]) is None
    posterior = generation(first, lambda isi_ms: floor_mv + bell_mv(isi_ms))
    profile_mv = known(posterior.estimate().profile(VALVE_SPACE.grid_ms)).median_mv
    assert VALVE_SPACE.grid_ms[profile_mv.argmax()] == pytest.approx(263.0, abs=4)
    assert np.corrcoef(profile_mv, bell_mv(VALVE_SPACE.grid_ms))[0, 1] > 0.99


def test_the_window_can_be_the_fits_or_reach_from_the_first_to_the_last_particle() -> None:
    def window(kind: WindowKind) -> Window:
        return known(generation(BootstrapFilter(window=kind).begin(VALVE_SPACE, 3), bell_mv).estimate().window)

    assert (window("fit").start_ms, window("fit").end_ms) == pytest.approx((213.0, 313.0), abs=2)
    posterior = generation(STILL.begin(VALVE_SPACE, 3), bell_mv)
    particles = generation(replace(STILL, window="particles").begin(VALVE_SPACE, 3), bell_mv).estimate().window
    plan_ms = posterior.proposed_isis_ms()[0].tolist()  # without diffusion, the resampled particles
    assert particles == Window(min(plan_ms), max(plan_ms))


def test_the_spread_is_the_population_sd_of_the_resampled_particles() -> None:
    after = generation(STILL.begin(VALVE_SPACE, 4), lambda isi_ms: 0.01 + bell_mv(isi_ms))
    assert after.estimate().spread_ms == pytest.approx(np.std(after.proposed_isis_ms()[0].astype(float)))


def test_diffusion_moves_particles_by_its_sd() -> None:
    model = BootstrapFilter(particles=2000, diffusion_ms=20.0)
    first = STILL.begin(VALVE_SPACE, 4).proposed_isis_ms()[0, 0].item()
    posterior = told(replace(model), [(250.0, 0.1)] * 2000)
    plan = posterior.proposed_isis_ms()[0].astype(float)
    assert first % 5.0 == 0.0
    assert plan.mean().item() == pytest.approx(250.0, abs=2.0)
    assert plan.std().item() == pytest.approx(math.sqrt(20.0**2 + 25.0 / 12), rel=0.06)


def test_the_particles_gather_in_the_window_and_the_strategy_stops() -> None:
    strategy = make_strategy("pf", seed=1)
    while not strategy.decision().stop:
        for isi_ms in strategy.ask_batch(30):
            strategy.tell(isi_ms, 0.01 + float(bell_mv(isi_ms)))
    assert "The particles have converged" in strategy.decision().reason
    assert known(strategy.estimate().spread_ms) <= 25.0
    window = strategy.estimate().window
    assert 0.5 * (known(window).start_ms + known(window).end_ms) == pytest.approx(263.0, abs=20.0)


def test_tms_alone_measures_no_particle() -> None:
    posterior = PF.begin(VALVE_SPACE, 3)
    plan = posterior.proposed_isis_ms()[0].tolist()
    posterior = PF.update(posterior, observation([None], [0.02]))
    assert posterior.proposed_isis_ms()[0].tolist() == plan
    assert posterior.trials == 1


def test_a_generation_without_a_mep_above_the_floor_says_so_and_spreads_evenly() -> None:
    model = BootstrapFilter(floor=FloorTreatment("zeroed", threshold_mv=0.02))
    posterior = generation(model.begin(VALVE_SPACE, 3), lambda _: 0.01)
    assert "all of its particles were given the same weight" in known(posterior.trouble)
    assert posterior.spread_ms[0] > 80.0
    assert generation(posterior, bell_mv).trouble is None


def test_a_particle_is_where_its_mep_was_measured() -> None:
    posterior = told(STILL, [(101.0, 0.1)] * 30)
    assert posterior.proposed_isis_ms()[0].tolist() == [100.0] * 30


def test_people_whose_generations_end_at_different_trials_do_not_disturb_one_another() -> None:
    posterior = PF.begin(VALVE_SPACE, 3, people=2)
    second = posterior.proposed_isis_ms()[1].tolist()
    posterior = PF.update(posterior, observation([100.0, None], [0.1, 0.01]))
    assert posterior.proposed_isis_ms().shape == (2, 29)
    assert posterior.proposed_isis_ms()[1].tolist() == second[:29]
    for _ in range(29):
        posterior = PF.update(posterior, observation([100.0, 200.0], [0.1, 0.1]))
    assert posterior.estimate(0).window is not None
    assert posterior.estimate(1).window is None
    assert posterior.proposed_isis_ms()[1].tolist() == second[29:]


def test_equal_seeds_ask_equally_and_others_do_not() -> None:
    batches = [Strategy(VALVE_SPACE, PF, OwnProposal(), Budget(9), seed=seed).ask_batch(30) for seed in (1, 1, 2)]
    assert batches[0] == batches[1] != batches[2]


@pytest.mark.parametrize("space", [VALVE_SPACE, IMPACT_SPACE], ids=["valve", "impact"])
def test_the_model_conforms(space: DesignSpace) -> None:
    check_model(lambda: BootstrapFilter(particles=5), space, order_tolerance_ms=None)


@pytest.mark.parametrize(
    "settings",
    [
        {"particles": 1},
        {"particles": 2.5},
        {"diffusion_ms": -1.0},
        {"lattice_ms": 0.0},
        {"half_width_ms": math.nan},
        {"window": "wide"},
    ],
)
def test_an_invalid_setting_is_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(settings))):
        BootstrapFilter(**settings)
