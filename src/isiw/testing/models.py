"""The conformance suite of models and their posteriors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from isiw.design import DesignSpace
from isiw.lazy import torch
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
    Tensor,
)
from isiw.testing.requirements import (
    Trials,
    check_estimate,
    require,
    same_estimates,
    trials_that_break_things,
    usual_trials,
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
    """
    model = make()
    require(isinstance(model, ResponseModel), "a model has begin() and update()")
    require(make() == model, "a model is settings: two made alike are equal")
    usual = usual_trials(space)
    _check_learning(model, space, usual)
    _check_determinism(make, space, usual)
    for what, trials in trials_that_break_things(space).items():
        posterior = _after(model, space, trials)
        check_estimate(posterior.estimate(), space, f"after: {what}")
        _check_capabilities(posterior, space, 1, f"after: {what}")
    if people > 1:
        _check_people(model, space, usual, people)
    if order_tolerance_ms is not None:
        _check_order(model, space, usual, order_tolerance_ms)


def _observation(isi_ms: float | None, mep_mv: float, people: int = 1) -> Observation:
    return Observation.of([isi_ms] * people, [mep_mv] * people)


def _after(model: ResponseModel, space: DesignSpace, trials: Trials, *, seed: int = 1, people: int = 1) -> Posterior:
    posterior = model.begin(space, seed, people)
    for isi_ms, mep_mv in trials:
        posterior = model.update(posterior, _observation(isi_ms, mep_mv, people))
    return posterior


def _check_learning(model: ResponseModel, space: DesignSpace, trials: Trials) -> None:
    before = model.begin(space, 1)
    require(isinstance(before, Posterior), "a posterior has trials and estimate()")
    require(before.trials == 0, "a prior has learnt from no trials")
    estimate = before.estimate()
    after = model.update(before, _observation(*trials[0]))
    require(after.trials == 1 and before.trials == 0, "update makes a posterior that has learnt from one trial more")
    require(same_estimates(before.estimate(), estimate), "a posterior never changes")


def _check_determinism(make: Callable[[], ResponseModel], space: DesignSpace, trials: Trials) -> None:
    once, again = (_after(make(), space, trials) for _ in range(2))
    same = same_estimates(once.estimate(), again.estimate())
    require(same, "the same seed and trials give the same posterior")


def _check_people(model: ResponseModel, space: DesignSpace, trials: Trials, people: int) -> None:
    posterior = _after(model, space, trials[:6], people=people)
    for person in range(people):
        check_estimate(posterior.estimate(person), space, f"for person {person} of {people}")
    _check_capabilities(posterior, space, people, f"for {people} people")


def _check_order(model: ResponseModel, space: DesignSpace, trials: Trials, tolerance_ms: float) -> None:
    windows = [_after(model, space, order).estimate().window for order in (trials, trials[::-1])]
    require((windows[0] is None) == (windows[1] is None), "whether there is a window does not depend on the order")
    if windows[0] is not None and windows[1] is not None:
        off_ms = max(abs(windows[0].start_ms - windows[1].start_ms), abs(windows[0].end_ms - windows[1].end_ms))
        within = off_ms <= tolerance_ms
        require(within, f"the reported edges depend on the order by at most {tolerance_ms:g} ms", f"{off_ms:g} ms")


def _check_capabilities(posterior: Posterior, space: DesignSpace, people: int, when: str) -> None:
    isi_ms = torch.linspace(space.low_ms, space.high_ms, 7, dtype=torch.float32)
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


def _sample_shapes(posterior: Any, isi_ms: Tensor, when: str) -> list[tuple[int, ...]]:
    """Shapes of whatever the posterior samples, after a look at the values."""
    shapes = []
    if isinstance(posterior, PredictsOutcomes):
        mass = posterior.outcome_mass(isi_ms)
        require(mass.dim() == 4, f"outcome_mass has the shape (b, s, t, y) {when}", str(tuple(mass.shape)))
        proper = bool((mass >= 0).all()) and bool(((mass.sum(-1) - 1).abs() < 1e-3).all())
        require(proper, f"outcome_mass is a probability of each value {when}")
        shapes.append(tuple(mass.shape))
    if isinstance(posterior, SamplesWindows):
        masks = posterior.window_masks(isi_ms)
        require(bool(((masks == 0) | (masks == 1)).all()), f"window_masks are 0 or 1 {when}")
        shapes.append(tuple(masks.shape))
    if isinstance(posterior, SamplesProfiles):
        profiles, baselines = posterior.profiles_mv(isi_ms), posterior.baselines_mv()
        require(bool(profiles.isfinite().all() and baselines.isfinite().all()), f"profiles are finite {when}")
        shapes += [tuple(profiles.shape), tuple(baselines.shape)]
    return shapes


def _check_further(posterior: Posterior, people: int, when: str) -> None:
    trials = posterior.trials
    if isinstance(posterior, Conditions):
        isi_ms, mep_mv = torch.tensor([[100.0] * people, [0.05] * people], dtype=torch.float32)
        imagined = posterior.condition(isi_ms, mep_mv)
        require(imagined.trials == trials + 1, f"condition adds one trial {when}")
    if isinstance(posterior, HasEvidence):
        evidence = posterior.log_evidence()
        fine = tuple(evidence.shape) == (people,) and bool(evidence.isfinite().all())
        require(fine, f"log_evidence is finite and has the shape (b,) {when}", str(evidence))
    if isinstance(posterior, ProposesIsi):
        plan = posterior.proposed_isis_ms()
        fine = plan.dim() == 2 and plan.shape[0] == people and plan.shape[1] > 0 and bool(plan.isfinite().all())
        require(fine, f"proposed_isis_ms has the shape (b, k) with k of at least 1 {when}", str(tuple(plan.shape)))
    if isinstance(posterior, ReportsTrouble):
        trouble = posterior.trouble
        require(trouble is None or trouble.endswith("."), f"trouble is stated in sentences {when}", repr(trouble))
