"""Realised ISIs that are far from those asked: they count only once they are confirmed."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence

import pytest

from isiw.decision import StopKind
from isiw.design import DesignSpace
from isiw.errors import ImplausibleDataWarning, InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.findings import Kind
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.summary import IN_DOUBT
from isiw.trials import Trial

SPACE = DesignSpace(20, 320, reference="impact")

Wrong = Callable[[Sequence[float]], float]

WRONG: dict[str, Wrong] = {
    "the first": lambda asked: asked[0],
    "the one before": lambda asked: asked[-2] if len(asked) > 1 else asked[0],
    "half": lambda asked: asked[-1] / 2,
}


def a_strategy(seed: int = 1) -> Strategy:
    return make_strategy("random", space=SPACE, seed=seed, particles=20, max_trials=30)


def mep_mv(isi_ms: float) -> float:
    return 0.4 + isi_ms / 1e4 if 80 < isi_ms < 160 else 0.015 + isi_ms / 1e5


def told_wrongly(strategy: Strategy, wrong: Wrong) -> int:
    """After how many trials the next one is refused."""
    asked: list[float] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImplausibleDataWarning)
        while len(asked) < 30:
            asked.append(strategy.ask())
            try:
                strategy.tell(wrong(asked), mep_mv(asked[-1]))
            except InvalidValueError as error:
                return len(asked) - 1 if error.found is Kind.ISIS_FAR else 30
    return len(asked)


def windows(estimate: WindowEstimate) -> tuple[object, ...]:
    return estimate.window, estimate.start_ms, estimate.end_ms, estimate.interval()


@pytest.mark.parametrize("kind", WRONG)
def test_a_loop_that_tells_wrong_isis_is_refused_after_a_few_and_none_of_them_counts(kind: str) -> None:
    strategy = a_strategy()
    assert told_wrongly(strategy, WRONG[kind]) <= 6
    estimate = strategy.estimate()
    assert estimate.pairs is not None
    assert estimate.pairs <= 1
    assert (windows(estimate), estimate.has_answer) == ((None, None, None, None), False)
    assert str(estimate) == f"{IN_DOUBT}"
    decision = strategy.decision()
    assert (decision.stop, decision.kind) == (False, StopKind.TOO_LITTLE)


def test_trials_in_doubt_use_up_the_budget() -> None:
    strategy = a_strategy()
    told = told_wrongly(strategy, WRONG["half"])
    assert strategy.delivered == strategy.spent == told


def test_once_they_are_confirmed_all_isis_count_and_are_not_asked_about_again() -> None:
    strategy, asked = a_strategy(), list[float]()
    told = told_wrongly(strategy, WRONG["half"])
    other = a_strategy()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImplausibleDataWarning)
        for number in range(told + 6):
            asked.append(other.ask())
            other.learn(Trial.of(asked[-1] / 2, mep_mv(asked[-1])))
            if number >= told:
                strategy.ask()
                strategy.tell(asked[-1] / 2, mep_mv(asked[-1]), confirm=number == told)
    assert strategy.estimate().probability == other.estimate().probability
    assert (strategy.delivered, strategy.in_doubt) == (told + 6, False)


def test_tms_alone_is_learnt_and_confirms_nothing() -> None:
    strategy = a_strategy()
    told_wrongly(strategy, WRONG["half"])
    strategy.tell(None, 0.02)
    assert strategy.in_doubt
    with pytest.raises(InvalidValueError, match="confirm=True"):
        strategy.tell(strategy.ask(), 0.1)


def test_existing_trials_that_were_not_asked_for_are_not_doubted() -> None:
    strategy = a_strategy()
    for number in range(12):
        strategy.tell(30.0 + 20 * number, mep_mv(30.0 + 20 * number))
    assert not strategy.in_doubt


@pytest.mark.parametrize(
    "rig", [lambda isi_ms: isi_ms + 8, lambda isi_ms: 10 * (isi_ms // 10), lambda isi_ms: isi_ms - 12]
)
def test_a_rig_with_a_delay_or_coarse_steps_is_not_doubted(rig: Callable[[float], float]) -> None:
    strategy = a_strategy()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImplausibleDataWarning)
        for _ in range(20):
            asked_ms = strategy.ask()
            strategy.tell(rig(asked_ms), mep_mv(asked_ms))
    assert not strategy.in_doubt
