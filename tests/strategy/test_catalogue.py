"""The named strategies: each works, says what it is, and is made again from its recipe."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import isiw
from isiw.acquisition.fixed import EvenSpacing
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import ConfigError, InvalidValueError, StrategyError
from isiw.models.parametric import ParametricModel
from isiw.models.particles import ParticleModel
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.particles.swarm import Moving
from isiw.models.protocol import ResponseModel
from isiw.models.shared.scales import Scale
from isiw.strategy.catalogue import known_settings, list_strategies, make_strategy, settings_for
from isiw.strategy.strategy import Strategy
from known import instance, known
from quick import quick

NAMES = sorted(list_strategies())
PARTICLES = [name for name in NAMES if isinstance(settings_for(name).model, ParticleModel)]
FEW: dict[str, Any] = {"particles": 64}


def after(
    name: str, space: DesignSpace = VALVE_SPACE, seed: int = 2, meps_mv: tuple[float, ...] = (0.02, 0.1)
) -> tuple[Strategy, list[float]]:
    """A strategy after some trials, and all that it has asked."""
    strategy = make_strategy(name, space=space, seed=seed, **quick(name))
    asked = []
    for mep_mv in meps_mv:
        asked.append(strategy.ask())
        strategy.tell(asked[-1], mep_mv)
    return strategy, [*asked, strategy.ask()]


tried = cache(after)


def test_every_named_strategy_is_described_in_a_sentence() -> None:
    assert "default" in NAMES
    assert all(text[0].isupper() and text.endswith(".") for text in list_strategies().values())


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("space", [VALVE_SPACE, IMPACT_SPACE], ids=["valve", "impact"])
def test_every_named_strategy_asks_learns_and_decides(name: str, space: DesignSpace) -> None:
    strategy, asked = tried(name, space)
    assert asked[-1] in space.grid_ms
    probability = strategy.estimate().probability
    assert probability is None or 0 <= probability <= 1
    assert strategy.decision().reason


@pytest.mark.parametrize("name", NAMES)
def test_every_named_strategy_is_made_again_from_its_recipe(name: str) -> None:
    strategy = make_strategy(name, seed=5, **quick(name))
    recipe = strategy.recipe
    again = make_strategy(recipe.name, strategy.space, recipe.seed, **recipe.settings)
    assert again.recipe == recipe
    assert (again.model, again.acquisition, again.stopping) == (strategy.model, strategy.acquisition, strategy.stopping)


@pytest.mark.parametrize("name", NAMES)
def test_the_same_name_and_seed_give_the_same_asks(name: str) -> None:
    assert after(name, VALVE_SPACE)[1] == tried(name, VALVE_SPACE)[1]


@pytest.mark.parametrize("name", ["default", "random"])
def test_another_seed_gives_other_asks(name: str) -> None:
    assert after(name, seed=3)[1] != tried(name, VALVE_SPACE)[1]


def test_designs_that_do_not_look_at_the_responses_do_not() -> None:
    for name in ("even", "random"):
        assert after(name, meps_mv=(0.02, 0.02))[1] == after(name, meps_mv=(0.3, 0.3))[1]


@pytest.mark.parametrize("name", PARTICLES)
def test_a_named_strategy_is_rebuilt_from_its_recipe(name: str) -> None:
    strategy = make_strategy(name, seed=2, prior={"profile": {"p_window": 0.6, "start": {"p_robot": 0.3}}}, **FEW)
    assert isinstance(strategy.model, ResponseModel)
    assert isinstance(strategy.acquisition, AcquisitionFunction)
    again = make_strategy(strategy.recipe.name, seed=strategy.recipe.seed, **strategy.recipe.settings)
    assert again.model == strategy.model
    assert again.acquisition == strategy.acquisition
    assert again.stopping == strategy.stopping


@pytest.mark.parametrize("name", NAMES)
def test_every_strategy_follows_its_own_plan_or_says_how_to_give_it_an_acquisition_function(name: str) -> None:
    space = VALVE_SPACE
    try:
        planned = make_strategy(name, space, acquisition="own", **quick(name))
    except StrategyError as refused:
        found = re.search(r"isiw\.Strategy\(.*\)(?=\.)", str(refused))
        usual = make_strategy(name, space, **quick(name))
        names = {"isiw": isiw, "space": space, "usual": usual, "YOURS": EvenSpacing()}
        yours = eval(known(found)[0], names)  # noqa: S307 - what the message says
        assert space.low_ms <= yours.ask() <= space.high_ms
    else:
        assert planned.recipe == make_strategy(name, space, **quick(name)).recipe
        assert planned.ask() == make_strategy(name, space, **quick(name)).ask()


def test_settings_reach_the_parts_they_are_meant_for() -> None:
    strategy = make_strategy(max_trials=7, particles=32, prior={"profile": {"p_window": 0.6}})
    model = strategy.model
    assert isinstance(model, ParticleModel)
    assert (model.particles, model.prior.profile.p_window) == (32, 0.6)
    assert "7 stimuli are left" in strategy.decision().reason
    again = make_strategy(**strategy.recipe.settings)
    assert (strategy.recipe.name, strategy.recipe.seed) == ("default", 0)
    assert strategy.recipe.settings["max_trials"] == 7
    assert again.recipe == strategy.recipe
    assert again.model == model


def test_the_hit_delay_and_the_muscle_have_keys_of_their_own() -> None:
    strategy = make_strategy(hit_delay_ms=(150, 5.0), muscle="hand", **FEW)
    prior = Prior()
    start = replace(prior.profile.start, hit_delay_ms=(150.0, 5.0))
    told = replace(prior, profile=replace(prior.profile, start=start), muscle="hand")
    assert instance(ParticleModel, strategy.model).prior == told
    assert make_strategy(**strategy.recipe.settings).model == strategy.model
    parametric = make_strategy("parametric-mi", hit_delay_ms=[150.0, 5.0])
    assert instance(ParametricModel, parametric.model).prior.start.hit_delay_ms == (150.0, 5.0)


def test_a_strategy_that_was_told_of_electrical_pulses_is_made_again_from_its_recipe() -> None:
    strategy = make_strategy(space=IMPACT_SPACE, conditioning="electrical", muscle="hand", **FEW)
    assert instance(ParticleModel, strategy.model).prior == Prior(
        ProfilePrior(conditioning="electrical"), muscle="hand"
    )
    assert make_strategy(space=IMPACT_SPACE, **strategy.recipe.settings).model == strategy.model


def test_only_a_strategy_that_can_use_what_is_known_is_told() -> None:
    known = {"hit_delay_ms": (150.0, 5.0), "muscle": None}
    assert known_settings("default", known) == {"hit_delay_ms": (150.0, 5.0)}
    assert known_settings("nr", known) == {}


def test_a_prior_is_a_table_or_the_object_that_it_stands_for() -> None:
    table = make_strategy(prior={"profile": {"p_window": 0.6}, "switch": {"reliability": [0.5, 0.4]}}, **FEW)
    prior = Prior()
    prior = replace(
        prior, profile=replace(prior.profile, p_window=0.6), switch=replace(prior.switch, reliability=Scale(0.5, 0.4))
    )
    assert make_strategy(prior=prior, **FEW).model == table.model


def test_an_unknown_strategy_names_the_known_ones() -> None:
    with pytest.raises(StrategyError, match="oracle") as caught:
        make_strategy("oracle")
    assert all(name in str(caught.value) for name in NAMES)


def test_an_unknown_setting_names_the_known_ones() -> None:
    with pytest.raises(StrategyError, match="max_trails") as caught:
        make_strategy(max_trails=5)
    assert all(name in str(caught.value) for name in ("max_trials", "stop_width_ms", "particles", "prior"))


def test_an_unknown_setting_of_the_prior_names_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"profile\.p_windows.*p_window\?"):
        make_strategy(prior={"profile": {"p_windows": 0.5}})


@pytest.mark.parametrize(
    "settings", [{"stop_no_window": 1.5}, {"particles": 1}, {"intensities_pct_rmt": (100, 110), "particles": 20}]
)
def test_an_invalid_setting_is_refused_when_the_strategy_is_made(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(settings))):
        make_strategy(**settings)


def test_the_fewest_particles_allowed_do_learn() -> None:
    strategy = make_strategy(particles=2)
    for _ in range(3):
        strategy.tell(strategy.ask(), 0.05)
    assert 0 <= known(strategy.estimate().probability) <= 1


@pytest.mark.parametrize(("name", "initial"), [("nr", 6), ("nr2", 7), ("svmr", 7), ("gpr", 7)])
def test_the_dissertations_regressions_begin_with_evenly_spaced_isis_at_both_ends(name: str, initial: int) -> None:
    strategy = make_strategy(name, DesignSpace(0, 420, reference="impact"))
    assert strategy.ask_batch(initial) == [420.0 * k / (initial - 1) for k in range(initial)]


@pytest.mark.parametrize("name", ["nr", "svmr", "gpr"])
def test_a_regression_takes_five_values_after_its_initial_trials_at_least(name: str) -> None:
    strategy = make_strategy(name, initial=4)
    for trial in range(1, 9):
        assert not strategy.decision().stop
        strategy.tell(250.0 if trial % 2 else 50.0 * trial, 0.1 if trial % 2 else 0.01)


@pytest.mark.parametrize("name", ["nr", "svmr", "gpr"])
def test_a_regression_gives_up_after_99_iterations(name: str) -> None:
    strategy = make_strategy(name)
    for _ in range(strategy.recipe.settings["initial"] + 98):  # the first iteration fits the initial trials alone
        assert not strategy.decision().stop
        strategy.count_mistrial()
    assert "budget" in strategy.decision().reason


@pytest.mark.parametrize(
    ("name", "settings", "what"),
    [
        ("nr", {"initial": 1}, "at least 2"),
        ("nr", {"initial": 6.0}, "whole number"),
        ("svmr", {"acquisition": "best"}, "acquisition"),
        ("gpr", {"stop_edges": "none"}, "edges"),
        ("incremental", {"rule": "eye"}, "rule"),
        ("default", {"acquisition": np.arange(3.0)}, "acquisition"),
        ("default", {"hit_delay_ms": np.array(1.0)}, "a mean and an SD"),
        ("default", {"intensity_pct_rmt": 2e5}, "intensity_pct_rmt must"),
    ],
)
def test_an_invalid_setting_is_refused(name: str, settings: dict[str, Any], what: str) -> None:
    with pytest.raises(InvalidValueError, match=what):
        make_strategy(name, **settings)


@pytest.mark.parametrize("name", [None, [], {}, 5])
def test_a_name_of_another_type_is_unknown(name: str) -> None:
    with pytest.raises(StrategyError, match="unknown strategy"):
        make_strategy(name)


def test_a_function_of_ones_own_with_a_dot_for_the_colon_is_told_how() -> None:
    with pytest.raises(StrategyError, match=r"named with a colon, in a study: \"lab\.models:mine\""):
        settings_for("lab.models.mine")


@pytest.mark.parametrize("space", [None, "valve", (0, 500)])
def test_what_is_no_design_space_is_refused(space: DesignSpace) -> None:
    with pytest.raises(InvalidValueError, match=r"a design space.*isiw.DesignSpace"):
        make_strategy("incremental", space)


@pytest.mark.parametrize("setting", ["particles", "initial_trials", "max_trials"])
def test_a_setting_that_would_fill_the_memory_is_refused_at_once(setting: str) -> None:
    huge: dict[str, Any] = {setting: 10**9}
    with pytest.raises(InvalidValueError, match=rf"setting {setting} of random"):
        make_strategy("random", **huge)


@pytest.mark.parametrize("moves", [{"sweeps": 10**9}, Moving(sweeps=10**9)])
def test_a_setting_deep_in_a_part_is_refused_as_well(moves: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"setting moves of random: sweeps"):
        make_strategy("random", moves=moves)


def test_a_tap_that_hits_after_the_last_isi_is_refused() -> None:
    with pytest.raises(InvalidValueError, match=r"after the last ISI.* 5000 ms"):
        make_strategy(hit_delay_ms=(5000.0, 6.0), **FEW)
    assert make_strategy(space=IMPACT_SPACE, hit_delay_ms=(5000.0, 6.0), **FEW).estimate().window is not None


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_strategy_works_on_a_list_of_isis(name: str) -> None:
    listed = DesignSpace.of([10, 15, 20, 30, 50], reference="impact")
    strategy = make_strategy(name, listed, seed=1, **quick(name))
    fewer = 4 if name.startswith("parametric") else 7  # each is fitted to all before
    for mep_mv in (0.02, 0.3, 0.2, 0.02, 0.25, 0.03, 0.02)[:fewer]:
        asked = strategy.ask()
        assert asked in listed.isis_ms
        strategy.tell(asked, mep_mv)
    window = strategy.estimate().window
    assert window is None or name == "pf" or {window.start_ms, window.end_ms} <= set(listed.isis_ms)
