"""An ISI that is at least so long, where a strategy chooses; a plan stays as it is."""

from __future__ import annotations

from isiw.design import DesignSpace
from isiw.strategy.catalogue import make_strategy

SPACE = DesignSpace(0, 320, reference="impact")


def test_the_next_longer_isi_of_the_grid_is_asked_until_it_is_told() -> None:
    strategy = make_strategy(space=SPACE, seed=3, particles=200)
    first = strategy.ask()
    assert strategy.ask_longer(first, "why") == first
    assert not strategy.fallback_reason
    assert first < 300.0
    assert strategy.ask_longer(299.5, "why") == 300.0
    assert strategy.ask() == 300.0
    assert str(strategy.fallback_reason) == "why"
    strategy.tell(300.0, 0.05)
    assert not strategy.fallback_reason


def test_a_plan_and_a_space_that_ends_before_stay_as_they_are() -> None:
    for strategy in (make_strategy("even", space=SPACE, particles=100), make_strategy(space=SPACE, particles=200)):
        planned = strategy.recipe.name == "even"
        asked = strategy.ask()
        assert strategy.ask_longer(300.0 if planned else 400.0, "why") == asked
        assert strategy.fallback_reason is None
