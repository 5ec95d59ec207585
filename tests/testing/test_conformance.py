"""Everything of ours passes the suites that others are given, and the suites find what is broken."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any, cast

import numpy as np
import pytest

from isiw.acquisition.information import MutualInformation
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.acquisition.registry import ACQUISITIONS
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError, StrategyError
from isiw.estimate import WindowEstimate
from isiw.models.particles import ParticleModel, ParticlePosterior
from isiw.models.protocol import Observation, Posterior, ProposesIsi
from isiw.strategy.catalogue import list_strategies, make_strategy
from isiw.strategy.strategy import Strategy
from isiw.subjects.cohorts import cohort
from isiw.testing import check_acquisition, check_model, check_strategy
from isiw.testing.suites import Trials, trials_that_break_things, usual_trials
from isiw.types import Array, FloatArray
from isiw.window import Window
from quick import quick

FEW: dict[str, Any] = {"particles": 100}
NAMES = sorted(list_strategies())
FITTED = ("parametric-", "gp", "supra-", "particles-", "nr", "svmr")
"""Strategies that take seconds begin so; the particle model itself is checked with the default."""
SLOW_FITS = [pytest.param(name, marks=pytest.mark.slow) if name.startswith(FITTED) else name for name in NAMES]
SCORING = sorted(name for name, make in ACQUISITIONS.items() if ProposesIsi not in make(0).needs)


@cache  # a posterior never changes
def particles_after(trials: Trials, people: int = 1) -> ParticlePosterior:
    model = ParticleModel(particles=100)
    posterior = model.begin(VALVE_SPACE, 1, people)
    for isi_ms, mep_mv in trials:
        posterior = model.update(posterior, Observation.of([isi_ms] * people, [mep_mv] * people))
    return posterior


@pytest.mark.parametrize("space", [VALVE_SPACE, IMPACT_SPACE], ids=["valve", "impact"])
def test_the_particle_model_conforms(space: DesignSpace) -> None:
    # Particles are a sample: two orders of the same trials differ by its error.
    check_model(lambda: ParticleModel(particles=400), space, order_tolerance_ms=40.0)


@pytest.mark.parametrize("name", SCORING)
@pytest.mark.parametrize("people", [1, 2])
def test_every_acquisition_function_conforms_on_particles(name: str, people: int) -> None:
    check_acquisition(ACQUISITIONS[name](3), particles_after(usual_trials(VALVE_SPACE)[:6], people), VALVE_SPACE)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCORING)
def test_every_acquisition_function_scores_what_breaks_things(name: str) -> None:
    for trials in trials_that_break_things(VALVE_SPACE).values():
        check_acquisition(ACQUISITIONS[name](3), particles_after(trials), VALVE_SPACE)


@pytest.mark.parametrize("name", SLOW_FITS)
def test_every_named_strategy_conforms(name: str) -> None:
    check_strategy(
        lambda: make_strategy(name, seed=1, **quick(name)), trials=4 if name.startswith("parametric-") else 8
    )


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_every_named_strategy_conforms_over_forty_trials(name: str) -> None:
    check_strategy(lambda: make_strategy(name, seed=1), trials=40)


@pytest.mark.parametrize("name", SLOW_FITS)
@pytest.mark.parametrize("people", ["recruitment", "nonresponder"])
def test_every_named_strategy_finishes_a_session(name: str, people: str) -> None:
    strategy = make_strategy(name, seed=1, **quick(name))
    responder = cohort(people, 1, 3)[0].begin(3)
    for _ in range(12 if name.startswith(("parametric-", "gp")) else 40):  # the long test has forty of each
        response = responder.respond(strategy.ask(), VALVE_SPACE.reference)
        strategy.tell(response.isi_ms, response.mep_mv)
    assert isinstance(strategy.estimate(), WindowEstimate)
    assert strategy.decision().reason


def test_an_acquisition_function_that_cannot_work_with_the_model_is_refused_with_the_reason() -> None:
    with pytest.raises(StrategyError, match="has no plan of its own"):
        make_strategy(acquisition="own")


class Backwards(ParticlePosterior):
    """Its band of nine of ten MEPs is the narrower one."""

    def prediction_mv(self, level: float, person: int = 0) -> tuple[FloatArray, FloatArray]:
        return super().prediction_mv(1.4 - level, person)


@dataclass(frozen=True)
class Broken:
    """The particle model with one promise broken."""

    fault: str
    model: ParticleModel = field(default_factory=lambda: ParticleModel(particles=50))

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> Posterior:
        before = self.model.begin(space, seed, people)
        object.__setattr__(before, "own_weights", np.zeros(9))
        backwards = self.fault == "predicts backwards"
        return Backwards(**{f.name: getattr(before, f.name) for f in fields(before)}) if backwards else before

    def update(self, posterior: Any, observation: Observation) -> Posterior:
        after = self.model.update(posterior, observation)
        match self.fault:
            case "counts twice":
                return self.model.update(after, observation)
            case "depends on chance":
                crowd, chance = after.swarm.crowd, 20 * np.random.default_rng().random()
                by_chance = crowd._replace(log_weights=crowd.log_weights + chance * crowd.log_likelihood)
                return replace(after, swarm=replace(after.swarm, crowd=by_chance))
            case "makes nothing":
                return None  # type: ignore[return-value]
            case "writes into the trial":
                observation.mep_mv[...] = 0.0
            case "writes into the posterior":
                for changed in fields(posterior) if posterior.trials else ():
                    object.__setattr__(posterior, changed.name, getattr(after, changed.name))
            case "forgets the first":
                return after if after.trials > 1 else posterior
            case "loses its weights":
                object.__setattr__(after, "own_weights", np.full(9, np.nan if after.trials > 5 else 0.0))
            case "weighs by the order":
                return self.model.update(posterior, replace(observation, mep_mv=observation.mep_mv * after.trials**4))
        return after


@pytest.mark.parametrize(
    ("fault", "promise"),
    [
        ("counts twice", "one trial more"),
        ("makes nothing", "makes a posterior"),
        ("writes into the trial", "leaves the observation"),
        ("writes into the posterior", "learnt from one trial more|never changes"),
        ("depends on chance", "same seed and trials"),
        ("forgets the first", "one trial more"),
        ("loses its weights", "does not become NaN after: usual trials; found: own_weights"),
        pytest.param("weighs by the order", "order", marks=pytest.mark.slow),
        pytest.param("predicts backwards", "holds those of smaller probability", marks=pytest.mark.slow),
    ],
)
def test_the_suite_finds_a_broken_model(fault: str, promise: str) -> None:
    with pytest.raises(AssertionError, match=f"check failed. Required: .*{promise}"):
        check_model(lambda: Broken(fault), VALVE_SPACE, order_tolerance_ms=20.0)


def test_a_model_that_fails_is_said_after_which_trials() -> None:
    class Naive(ParticleModel):
        def update(self, posterior: Any, observation: Observation) -> Any:
            if np.isnan(observation.isi_ms).any():
                raise ZeroDivisionError
            return super().update(posterior, observation)

    with pytest.raises(ZeroDivisionError) as failed:
        check_model(lambda: Naive(particles=50), VALVE_SPACE)
    assert "after: baselines only" in failed.value.__notes__[0]


def flat(_posterior: object, isi_ms: Array) -> Array:
    return np.zeros(len(isi_ms))


def undecided(_posterior: object, isi_ms: Array) -> Array:
    return np.full((1, len(isi_ms)), math.nan)


def of_each_sample(posterior: Any, isi_ms: Array) -> Any:
    return posterior.window_masks(isi_ms)[0]


def moody(_posterior: object, isi_ms: Array) -> Array:
    return np.random.default_rng().random((1, len(isi_ms)))


def listed(_posterior: object, isi_ms: Array) -> Any:
    return [[0.0] * len(isi_ms)]


def written_into(_posterior: object, isi_ms: Array) -> Array:
    isi_ms *= 0.0
    return isi_ms


@dataclass(frozen=True)
class Scoring:
    """An acquisition function of a plain function."""

    score: Callable[[Any, Array], Array]
    needs: tuple[type, ...] = ()

    def __call__(self, posterior: object, isi_ms: Array) -> Array:
        return self.score(posterior, isi_ms)


@pytest.mark.parametrize(
    ("acquisition", "promise"),
    [
        (Scoring(lambda _posterior, _isi_ms: np.zeros(1)), "shape"),
        (Scoring(of_each_sample), "for 1 ISI of 1 person"),
        (cast("Any", Scoring), "is no class"),
        (Scoring(undecided), "finite"),
        (Scoring(moody), "same scores"),
        (Scoring(written_into), "ISIs are left"),
        (Scoring(lambda _posterior, isi_ms: isi_ms.astype(str)), "numbers"),
        (Scoring(listed), "NumPy array"),
        (Scoring(flat, needs=(ProposesIsi,)), "not ProposesIsi"),
        (flat, "says what it needs"),
    ],
)
def test_the_suite_finds_a_broken_acquisition_function(acquisition: AcquisitionFunction, promise: str) -> None:
    with pytest.raises(AssertionError, match=promise):
        check_acquisition(acquisition, particles_after(()), VALVE_SPACE)


@pytest.mark.parametrize("people", [1, 3])
def test_scores_may_be_the_same_for_all_people(people: int) -> None:
    check_acquisition(Scoring(flat), particles_after((), people), VALVE_SPACE)


def test_a_suite_that_is_given_what_it_makes_itself_says_so() -> None:
    strategy = make_strategy("even", **FEW)
    with pytest.raises(
        InvalidValueError, match=r"(?s)makes the strategy itself; got .*; expected its class, or a function"
    ):
        check_strategy(cast("Any", strategy))
    with pytest.raises(InvalidValueError, match="makes the model itself"):
        check_model(cast("Any", strategy.model), VALVE_SPACE)


class Forgetful(Strategy):
    """Asks something else each time."""

    asked = 0

    def ask(self, deadline_s: float | None = None) -> float:
        self.asked += 1
        return self.space.snap(super().ask(deadline_s) + 10.0 * (self.asked % 2))


class Gullible(Strategy):
    """Accepts whatever it is told."""

    def tell(self, isi_ms: float | None, mep_mv: float | None = None, **others: Any) -> None:
        if mep_mv is not None and mep_mv >= 0:
            super().tell(isi_ms, mep_mv, **others)


class Adventurous(Strategy):
    """Reports a window that nobody could have asked about."""

    def estimate(self) -> WindowEstimate:
        return replace(super().estimate(), probability=0.9, window=Window(-100.0, 50.0))


@pytest.mark.parametrize(
    ("kind", "promise"), [(Forgetful, "until the next tell"), (Gullible, "refuses"), (Adventurous, "lies in the space")]
)
def test_the_suite_finds_a_broken_strategy(kind: type[Strategy], promise: str) -> None:
    usual = make_strategy("even", **FEW)
    with pytest.raises(AssertionError, match=promise):
        check_strategy(lambda: kind(usual.space, usual.model, usual.acquisition, usual.stopping))


def test_a_model_and_an_acquisition_function_from_outside_plug_in_as_objects() -> None:
    usual = make_strategy("default", **FEW)

    def make() -> Strategy:
        return Strategy(VALVE_SPACE, usual.model, MutualInformation(), usual.stopping, initial_ms=(100.0, 250.0))

    check_strategy(make)
