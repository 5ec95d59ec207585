"""The conformance suites of strategies and of acquisition functions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError, StrategyError
from isiw.lazy import torch
from isiw.models.protocol import Posterior
from isiw.strategy.stopping import StopDecision
from isiw.strategy.strategy import Strategy
from isiw.testing.requirements import (
    Trials,
    broken,
    check_estimate,
    require,
    same_estimates,
    trials_that_break_things,
    usual_trials,
)


def check_strategy(make: Callable[[], Strategy], *, trials: int = 12) -> None:
    """Check that a strategy keeps the promises of ask and tell.

    Args:
        make: makes the strategy, before its first trial, the same each time.
        trials: how many trials each check runs at most; a strategy that plans several trials at once needs more.

    Raises:
        AssertionError: a promise is broken; the message says which.
    """
    _check_asking(make())
    _check_refusals(make())
    for what, told in trials_that_break_things(make().space, trials).items():
        _check_learning(make(), told, f"after: {what}")
    _check_replay(make, usual_trials(make().space)[:trials])
    _check_mistrials(make)
    _check_deadline(make())


def _check_asking(strategy: Strategy) -> None:
    isi_ms = strategy.ask()
    require(isi_ms in strategy.space.grid_ms, "ask answers an ISI on the grid", str(isi_ms))
    require(strategy.ask() == isi_ms, "ask answers the same until the next tell")
    require(strategy.ask_batch(1) == [isi_ms], "a batch of one is what ask answers")
    try:
        batch = strategy.ask_batch(3)
    except StrategyError:
        return
    require(len(batch) == 3 and batch[0] == isi_ms, "a batch has n ISIs and begins with ask's", str(batch))
    require(all(isi in strategy.space.grid_ms for isi in batch), "a batch is on the grid", str(batch))


def _check_refusals(strategy: Strategy) -> None:
    isi_ms, far_ms = strategy.ask(), strategy.space.high_ms + 2 * strategy.space.tolerance_ms + 1
    before = strategy.estimate()
    refused: list[tuple[float | None, dict[str, Any]]] = [
        (isi_ms, {"mep_mv": math.nan}),
        (isi_ms, {"mep_mv": -1.0}),
        (isi_ms, {}),
        (isi_ms, {"mep_mv": 0.1, "response": True}),
        (isi_ms, {"response": math.nan}),
        (isi_ms, {"response": 0.5}),
        (math.nan, {"mep_mv": 0.1}),
        (far_ms, {"mep_mv": 0.1}),
    ]
    for isi, outcome in refused:
        try:
            strategy.tell(isi, **outcome)
        except InvalidValueError:
            continue
        raise broken(f"tell refuses {outcome} at {isi} ms", "it was taken")
    unchanged = strategy.ask() == isi_ms and same_estimates(strategy.estimate(), before)
    require(unchanged, "a tell that was refused changes nothing")


def _check_learning(strategy: Strategy, told: Trials, when: str) -> None:
    for isi_ms, mep_mv in told:
        strategy.learn(isi_ms, mep_mv)
    require(strategy.ask() in strategy.space.grid_ms, f"ask answers an ISI on the grid {when}")
    check_estimate(strategy.estimate(), strategy.space, when)
    decision = strategy.decision()
    require(isinstance(decision, StopDecision) and decision.reason.endswith("."), f"a decision has its reason {when}")
    require(strategy.decision() == decision, f"deciding changes nothing {when}")


def _check_replay(make: Callable[[], Strategy], told: Trials) -> None:
    first = make()
    asked = _asks(first, told)
    for what, other in (("the same again", make()), ("restarted()", first.restarted())):
        require(_asks(other, told) == asked, f"{what} asks the same after the same tells")
        require(same_estimates(other.estimate(), first.estimate()), f"{what} estimates the same after the same tells")


def _asks(strategy: Strategy, told: Trials) -> list[float]:
    asked = []
    for isi_ms, mep_mv in told:
        asked.append(strategy.ask())
        strategy.learn(isi_ms, mep_mv)
    return [*asked, strategy.ask()]


def _check_mistrials(make: Callable[[], Strategy]) -> None:
    strategy, other = make(), make()
    strategy.count_mistrial()
    require(strategy.ask() == other.ask(), "a mistrial does not change what is asked")
    require(same_estimates(strategy.estimate(), other.estimate()), "a mistrial does not change the estimate")


def _check_deadline(strategy: Strategy) -> None:
    isi_ms = strategy.ask(deadline_s=0.0)
    require(isi_ms in strategy.space.grid_ms, "ask answers an ISI on the grid although its deadline has passed")
    require(strategy.ask() == isi_ms, "what a deadline was answered with stays until the next tell")


def check_acquisition(acquisition: AcquisitionFunction, posterior: Posterior, space: DesignSpace) -> None:
    """Check that an acquisition function keeps the promises of `isiw.acquisition.protocol`.

    Args:
        acquisition: the acquisition function.
        posterior: a posterior that has the capabilities it needs, after some trials, of any number of people.
        space: the design space of the posterior.

    Raises:
        AssertionError: a promise is broken; the message says which.
    """
    require(isinstance(acquisition, AcquisitionFunction), "an acquisition function is callable and says what it needs")
    missing = [c.__name__ for c in acquisition.needs if not isinstance(posterior, c)]
    require(not missing, "the posterior has what the acquisition function needs", f"not {', '.join(missing)}")
    before = posterior.estimate()
    for count in (1, 2, 23):
        isi_ms = torch.linspace(space.low_ms, space.high_ms, count, dtype=torch.float32)
        scores = acquisition(posterior, isi_ms)
        shaped = scores.dim() == 2 and scores.shape[1] == count
        require(shaped, "scores have the shape (b, t)", f"{tuple(scores.shape)} for {count} ISIs")
        require(bool(scores.isfinite().all()), "scores are finite", str(scores.tolist()))
        require(torch.equal(scores, acquisition(posterior, isi_ms)), "the same posterior gives the same scores")
    require(same_estimates(posterior.estimate(), before), "scoring leaves the posterior as it was")
