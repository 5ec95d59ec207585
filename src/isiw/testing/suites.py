"""The conformance suites of models and their posteriors, of strategies, and of acquisition functions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.decision import StopDecision
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError, StrategyError
from isiw.estimate import WindowEstimate
from isiw.models.protocol import (
    Conditions,
    HasEvidence,
    Observation,
    Posterior,
    PredictsMeps,
    PredictsOutcomes,
    ProposesIsi,
    ReportsTrouble,
    ResponseModel,
    SamplesProfiles,
    SamplesWindows,
)
from isiw.strategy.strategy import Strategy
from isiw.text.sanitize import counted, shown
from isiw.trials import Trial
from isiw.types import Singles

Trials = tuple[tuple[float | None, float], ...]
"""ISIs [ms] (None is TMS alone) and MEPs [mV], in the order of telling."""

_USUAL_SHARES: Final = (0.0, 0.25, 0.5, 0.75, 1.0, 0.4, 0.6, 0.45, 0.55, 0.5, 0.35, 0.65)


def require(condition: object, promise: str, seen: str = "") -> None:
    """Raise if a promise is broken."""
    if not condition:
        raise broken(promise, seen)


def broken(promise: str, seen: str) -> AssertionError:
    """That a promise is broken, as an error whose message sets what was found against what must hold."""
    return AssertionError(f"check failed. Required: {promise}{f'; found: {seen}' if seen else ''}")


def require_maker(make: object, what: str) -> None:
    """Raise if a suite is given something else than what makes the object that it tries."""
    if not callable(make):
        raise InvalidValueError(f"the check makes {what} itself", got=make, expected="its class, or a function")


def people_of(posterior: Posterior, isi_ms: Singles) -> int | None:
    """How many people a posterior is of, as far as what it can do says so."""
    if isinstance(posterior, SamplesWindows):
        return len(posterior.window_masks(isi_ms))
    if isinstance(posterior, SamplesProfiles):
        return len(posterior.profiles_mv(isi_ms))
    return len(posterior.outcome_mass(isi_ms)) if isinstance(posterior, PredictsOutcomes) else None


def usual_trials(space: DesignSpace) -> Trials:
    """Trials of a person whose window lies in the middle of the space."""
    isis_ms = [space.snap(space.low_ms + share * (space.high_ms - space.low_ms)) for share in _USUAL_SHARES]
    meps_mv = [0.01 + 0.1 * float(np.exp(-0.5 * ((share - 0.5) / 0.08) ** 2)) for share in _USUAL_SHARES]
    return tuple(zip(isis_ms, meps_mv, strict=True))


def trials_that_break_things(space: DesignSpace, trials: int = 12) -> Mapping[str, Trials]:
    """Trials by what is odd about them."""
    low, high = space.low_ms, space.high_ms
    isis_ms = [space.snap(isi_ms) for isi_ms in np.linspace(low, high, trials)]
    middle = isis_ms[trials // 2]
    return {
        "no trials": (),
        "two trials only": ((low, 0.01), (middle, 0.1)),
        "baselines only": ((None, 0.01), (None, 0.02), (None, 0.0)),
        "all MEPs equal": tuple((isi_ms, 0.05) for isi_ms in isis_ms),
        "all MEPs zero": tuple((isi_ms, 0.0) for isi_ms in isis_ms),
        "one huge outlier": tuple((isi_ms, 25.0 if isi_ms == isis_ms[3] else 0.01) for isi_ms in isis_ms),
        "the same ISI again and again": tuple((middle, 0.01 + 0.01 * (k % 5)) for k in range(trials)),
        "both ends only": tuple(((low, high)[k % 2], (0.01, 0.3)[k % 2]) for k in range(trials)),
        "beyond the range": ((low - 0.9 * space.tolerance_ms, 0.01), (high + 0.9 * space.tolerance_ms, 0.02)),
    }


def check_estimate(estimate: object, space: DesignSpace, when: str) -> None:
    """Check that an estimate of the window can be used."""
    require(isinstance(estimate, WindowEstimate), f"an estimate is a WindowEstimate {when}", shown(estimate))
    if not isinstance(estimate, WindowEstimate):
        return
    if estimate.window is not None:
        inside = space.low_ms <= estimate.window.start_ms <= estimate.window.end_ms <= space.high_ms
        require(inside, f"the reported window lies in the space {when}", str(estimate.window))
    if estimate.edge_samples_ms is not None:
        shape = estimate.edge_samples_ms.shape
        require(len(shape) == 2 and shape[1] == 2, f"samples of the edges have the shape (s, 2) {when}", str(shape))
        require(not np.isnan(estimate.edge_samples_ms).any(), f"no sample of an edge is NaN {when}")
    if estimate.profile_quantiles_mv is not None:
        require(np.isfinite(estimate.profile_quantiles_mv).all(), f"the profile is finite {when}")
        require((np.diff(estimate.profile_quantiles_mv, axis=0) >= -1e-9).all(), f"its quantiles ascend {when}")


def same_estimates(one: WindowEstimate, other: WindowEstimate) -> bool:
    """True if two estimates are the same to the last bit."""
    arrays = ("grid_ms", "edge_samples_ms", "profile_quantiles_mv", "hypothesis_samples")
    plain = ("probability", "window", "start_ms", "end_ms", "spread_ms", "expected_f1", "best_isi", "largest_excluded")
    return all(getattr(one, name) == getattr(other, name) for name in plain) and all(
        np.array_equal(np.asarray(getattr(one, name)), np.asarray(getattr(other, name))) for name in arrays
    )


def check_model(
    make: Callable[[], ResponseModel], space: DesignSpace, *, order_tolerance_ms: float | None = 0.0, people: int = 2
) -> None:
    """Check that a model, and the posteriors it makes, keep the promises of `isiw.models.protocol`.

    Args:
        make: makes the model.
        space: the design space to check it in.
        order_tolerance_ms: by how much the reported edges may depend on the order of the trials [ms]: 0 for an exact
            model, some for one that samples, None for one that is not exchangeable (a sweep, a walk, a drift).
        people: how many people at once are tried, 1 for a model of one person at a time.

    Raises:
        AssertionError: a promise is broken; the message says which.
        InvalidValueError: no class or function that makes it.
    """
    require_maker(make, "the model")
    model = make()
    require(isinstance(model, ResponseModel), "a model has begin() and update()")
    require(make() == model, "a model is settings: two made alike are equal")
    usual = usual_trials(space)
    _check_learning(model, space, usual)
    once, again = (_after(make(), space, usual) for _ in range(2))
    require(same_estimates(once.estimate(), again.estimate()), "the same seed and trials give the same posterior")
    numbers_at_first = {name for name, is_nan in _all_nan(model.begin(space, 1)) if not is_nan}
    for what, trials in {"usual trials": usual, **trials_that_break_things(space)}.items():
        try:
            posterior = _after(model, space, trials)
            check_estimate(posterior.estimate(), space, f"after: {what}")
            _check_capabilities(posterior, space, 1, f"after: {what}")
            lost = {name for name, is_nan in _all_nan(posterior) if is_nan} & numbers_at_first
            require(not lost, f"what a posterior keeps does not become NaN after: {what}", ", ".join(sorted(lost)))
        except Exception as error:
            error.add_note(f"after: {what}, as (ISI [ms], MEP [mV]): {trials}; TMS alone, None, has the ISI NaN")
            raise
    if people > 1:
        posterior = _after(model, space, usual[:6], people=people)
        for person in range(people):
            check_estimate(posterior.estimate(person), space, f"for person {person} of {people}")
        _check_capabilities(posterior, space, people, f"for {people} people")
    if order_tolerance_ms is not None:
        _check_order(model, space, usual, order_tolerance_ms)


def _observation(isi_ms: float | None, mep_mv: float, people: int = 1) -> Observation:
    return Observation.of([isi_ms] * people, [mep_mv] * people)


def _after(model: ResponseModel, space: DesignSpace, trials: Trials, people: int = 1) -> Posterior:
    posterior = model.begin(space, 1, people)
    for isi_ms, mep_mv in trials:
        posterior = model.update(posterior, _observation(isi_ms, mep_mv, people))
    return posterior


def _check_learning(model: ResponseModel, space: DesignSpace, trials: Trials) -> None:
    posterior = model.begin(space, 1)
    require(isinstance(posterior, Posterior), "a posterior has trials and estimate()", shown(posterior))
    require(posterior.trials == 0, "a prior has learnt from no trials")
    for told, trial in enumerate(trials[:2]):  # many write into the posterior from the second trial on
        estimate, observation = posterior.estimate(), _observation(*trial)
        check_estimate(estimate, space, f"after {counted(told, 'trial')}")
        after = model.update(posterior, observation)
        require(isinstance(after, Posterior), "update makes a posterior", shown(after))
        require(
            (after.trials, posterior.trials) == (told + 1, told), "update makes one that has learnt from one trial more"
        )
        require(same_estimates(posterior.estimate(), estimate), "a posterior never changes")
        left = np.array_equal([observation.isi_ms, observation.mep_mv], np.array(trial, dtype=np.float32)[:, None])
        require(left, "update leaves the observation as it is")
        posterior = after


def _all_nan(kept: object, name: str = "", deepest: int = 3) -> Iterator[tuple[str, bool]]:
    """Each array of numbers that a posterior keeps, and whether all are NaN, as which its estimate need not look."""
    if isinstance(kept, np.ndarray) and kept.dtype.kind == "f" and kept.size:
        yield name, bool(np.isnan(kept).all())
    elif deepest and hasattr(kept, "__dict__"):
        for key, part in vars(kept).items():
            yield from _all_nan(part, f"{name}.{key}".lstrip("."), deepest - 1)


def _check_order(model: ResponseModel, space: DesignSpace, trials: Trials, tolerance_ms: float) -> None:
    windows = [_after(model, space, order).estimate().window for order in (trials, trials[::-1])]
    require((windows[0] is None) == (windows[1] is None), "whether there is a window does not depend on the order")
    if windows[0] is not None and windows[1] is not None:
        off_ms = max(abs(windows[0].start_ms - windows[1].start_ms), abs(windows[0].end_ms - windows[1].end_ms))
        within = off_ms <= tolerance_ms
        require(within, f"the reported edges depend on the order by at most {tolerance_ms:g} ms", f"{off_ms:g} ms")


def _check_capabilities(posterior: Posterior, space: DesignSpace, people: int, when: str) -> None:
    isi_ms = np.linspace(space.low_ms, space.high_ms, 7, dtype=np.float32)
    shapes = _sample_shapes(posterior, isi_ms, when)
    wrong = [shape for shape in shapes if shape[0] != people]
    require(not wrong, f"all samples are of {people} people {when}", str(wrong))
    require(len({shape[1] for shape in shapes}) <= 1, f"all capabilities have the same samples {when}", str(shapes))
    wrong = [shape for shape in shapes if len(shape) > 2 and shape[2] != len(isi_ms)]
    require(not wrong, f"there is a value for each of {len(isi_ms)} ISIs {when}", str(wrong))
    _check_further(posterior, people, when)
    if isinstance(posterior, PredictsMeps):
        for person in range(people):
            _check_prediction(posterior, person, when)


def _check_prediction(posterior: Any, person: int, when: str) -> None:
    if (grid_ms := posterior.estimate(person).grid_ms) is None:  # no answer yet
        return
    wide, narrow = (np.stack(posterior.prediction_mv(level, person)) for level in (0.9, 0.5))
    require(
        wide.shape == (2, len(grid_ms)),
        f"prediction_mv is at the ISIs of the estimate {when}",
        f"{wide.shape[-1]}, not {len(grid_ms)}",
    )
    require(bool(np.isfinite(wide).all()), f"prediction_mv is finite {when}")
    nested = bool((np.diff([wide[0], narrow[0], narrow[1], wide[1]], axis=0) >= -1e-9).all())
    require(nested, f"a band of prediction_mv holds those of smaller probability {when}")


def _sample_shapes(posterior: Any, isi_ms: Singles, when: str) -> list[tuple[int, ...]]:
    """Shapes of whatever the posterior samples, after a look at the values."""
    shapes = []
    if isinstance(posterior, PredictsOutcomes):
        mass = _array("outcome_mass", posterior.outcome_mass(isi_ms), when)
        require(mass.ndim == 4, f"outcome_mass has the shape (b, s, t, y) {when}", str(mass.shape))
        proper = bool((mass >= 0).all()) and bool((np.abs(mass.sum(-1) - 1) < 1e-3).all())
        require(proper, f"outcome_mass is a probability of each value {when}")
        shapes.append(mass.shape)
    if isinstance(posterior, SamplesWindows):
        masks = _array("window_masks", posterior.window_masks(isi_ms), when)
        require(bool(((masks == 0) | (masks == 1)).all()), f"window_masks are 0 or 1 {when}")
        shapes.append(masks.shape)
    if isinstance(posterior, SamplesProfiles):
        profiles = _array("profiles_mv", posterior.profiles_mv(isi_ms), when)
        baselines = _array("baselines_mv", posterior.baselines_mv(), when)
        finite = bool(np.isfinite(profiles).all() and np.isfinite(baselines).all())
        require(finite, f"profiles are finite {when}")
        shapes += [profiles.shape, baselines.shape]
    return shapes


def _array(what: str, given: Any, when: str = "") -> Any:
    require(isinstance(given, np.ndarray), f"{what} is a NumPy array {when}".rstrip(), type(given).__name__)
    return given


def _check_further(posterior: Posterior, people: int, when: str) -> None:
    trials = posterior.trials
    if isinstance(posterior, Conditions):
        isi_ms, mep_mv = np.array([[100.0] * people, [0.05] * people], dtype=np.float32)
        imagined = posterior.condition(isi_ms, mep_mv)
        require(imagined.trials == trials + 1, f"condition adds one trial {when}")
    if isinstance(posterior, HasEvidence):
        evidence = _array("log_evidence", posterior.log_evidence(), when)
        fine = evidence.shape == (people,) and bool(np.isfinite(evidence).all())
        require(fine, f"log_evidence is finite and has the shape (b,) {when}", str(evidence))
    if isinstance(posterior, ProposesIsi):
        plan = _array("proposed_isis_ms", posterior.proposed_isis_ms(), when)
        fine = plan.ndim == 2 and plan.shape[0] == people and plan.shape[1] > 0 and bool(np.isfinite(plan).all())
        require(fine, f"proposed_isis_ms has the shape (b, k) with k of at least 1 {when}", str(plan.shape))
    if isinstance(posterior, ReportsTrouble):
        trouble = posterior.trouble
        require(trouble is None or trouble.endswith("."), f"trouble is stated in sentences {when}", repr(trouble))


def check_strategy(make: Callable[[], Strategy], *, trials: int = 12) -> None:
    """Check that a strategy keeps the promises of ask and tell.

    Args:
        make: makes the strategy, before its first trial, the same each time.
        trials: how many trials each check runs at most; a strategy that plans several trials at once needs more.

    Raises:
        AssertionError: a promise is broken; the message says which.
        InvalidValueError: no class or function that makes it.
    """
    require_maker(make, "the strategy")
    _check_asking(make())
    _check_refusals(make())
    for what, told in trials_that_break_things(make().space, trials).items():
        _check_telling(make(), told, f"after: {what}")
    _check_replay(make, usual_trials(make().space)[:trials])
    strategy, other = make(), make()
    strategy.count_mistrial()
    require(strategy.ask() == other.ask(), "a mistrial does not change what is asked")
    require(same_estimates(strategy.estimate(), other.estimate()), "a mistrial does not change the estimate")
    strategy = make()
    isi_ms = strategy.ask(deadline_s=0.0)
    require(isi_ms in strategy.space.grid_ms, "ask answers an ISI on the grid although its deadline has passed")
    require(strategy.ask() == isi_ms, "what a deadline was answered with stays until the next tell")


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


def _check_telling(strategy: Strategy, told: Trials, when: str) -> None:
    for isi_ms, mep_mv in told:
        strategy.learn(Trial.of(isi_ms, mep_mv))
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
        strategy.learn(Trial.of(isi_ms, mep_mv))
    return [*asked, strategy.ask()]


def check_acquisition(acquisition: AcquisitionFunction, posterior: Posterior, space: DesignSpace) -> None:
    """Check that an acquisition function keeps the promises of `isiw.acquisition.protocol`.

    Args:
        acquisition: the acquisition function.
        posterior: a posterior that has the capabilities it needs, after some trials, of any number of people.
        space: the design space of the posterior.

    Raises:
        AssertionError: a promise is broken; the message says which.
    """
    require(not isinstance(acquisition, type), "an acquisition function is no class", shown(acquisition))
    require(isinstance(acquisition, AcquisitionFunction), "an acquisition function is callable and says what it needs")
    missing = [c.__name__ for c in acquisition.needs if not isinstance(posterior, c)]
    require(not missing, "the posterior has what the acquisition function needs", f"not {', '.join(missing)}")
    before = posterior.estimate()
    for count in (1, 2, 23):
        isi_ms = np.linspace(space.low_ms, space.high_ms, count, dtype=np.float32)
        kept_ms = isi_ms.copy()
        scores = _array("scores", acquisition(posterior, isi_ms))
        require(np.array_equal(isi_ms, kept_ms), "the ISIs are left as they are", str(isi_ms.tolist()))
        people = people_of(posterior, isi_ms)
        alike = scores.shape in {(count,), (1, count)}  # for all people
        shaped = alike or (scores.ndim == 2 and scores.shape == (people or len(scores), count))
        of = "" if people is None else f" of {counted(people, 'person', 'people')}"
        require(shaped, "scores have the shape (t,) or (b, t)", f"{scores.shape} for {counted(count, 'ISI')}{of}")
        require(scores.dtype.kind in "biuf", "scores are numbers", str(scores.dtype))
        require(bool(np.isfinite(scores).all()), "scores are finite", str(scores.tolist()))
        require(np.array_equal(scores, acquisition(posterior, isi_ms)), "the same posterior gives the same scores")
    require(same_estimates(posterior.estimate(), before), "scoring leaves the posterior as it was")
