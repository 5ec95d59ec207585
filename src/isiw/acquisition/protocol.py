"""The protocol of acquisition functions, and how scores become the next ISI, or a batch of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Protocol, runtime_checkable

import numpy as np

from isiw.design import DesignSpace
from isiw.errors import StrategyError
from isiw.models.protocol import Conditions, Posterior, PredictsOutcomes, ProposesIsi, SamplesProfiles, SamplesWindows
from isiw.types import Array, IntArray

_GOLDEN = (5**0.5 - 1) / 2


class ForeseesProfiles(PredictsOutcomes, SamplesProfiles, Protocol):
    """A posterior of profiles that predicts the next MEP."""


class ForeseesWindows(PredictsOutcomes, SamplesWindows, Protocol):
    """A posterior of windows that predicts the next MEP."""


@runtime_checkable
class AcquisitionFunction(Protocol):
    """A settings object that scores candidate ISIs under a posterior; higher is better."""

    @property
    def needs(self) -> tuple[type, ...]:
        """The capability protocols that a posterior must have."""

    def __call__(self, posterior: Any, isi_ms: Array) -> Array:
        """Score the candidate ISIs for each person.

        Args:
            posterior: the posterior of b people, with the capabilities of `needs`.
            isi_ms: the candidate ISIs [ms], shape (t,).

        Returns:
            The scores, shape (b, t), or (t,) if they are the same for all people; one that is not finite loses.
        """


@runtime_checkable
class FollowsPlan(Protocol):
    """An acquisition function whose choice is known beforehand, on the grid of the space, whatever is known."""

    def planned_isi_ms(self, space: DesignSpace, pairs: int) -> float:
        """The ISI [ms] of the pair of stimuli after so many pairs.

        Args:
            space: the ISIs that may be asked.
            pairs: how many pairs were learnt; TMS alone is none.
        """


def require_capabilities(acquisition: AcquisitionFunction, model: object, posterior: Posterior) -> None:
    """Raise if a model's posterior lacks what an acquisition function needs."""
    if missing := [capability.__name__ for capability in acquisition.needs if not isinstance(posterior, capability)]:
        raise StrategyError(
            f"{type(acquisition).__name__} cannot work with {type(model).__name__}",
            got=f"a posterior without {', '.join(missing)}",
            remedy="Choose another acquisition function, or a model whose posterior has the capability.",
        )


def require_objects(model: object, acquisition: object) -> None:
    """Raise if a class is given for an object of it, or something else for an acquisition function."""
    for what, given in (("an acquisition function", acquisition), ("a model", model)):
        if isinstance(given, type):
            remedy = f"Make one: {given.__name__}()."
            raise StrategyError(f"{what} is needed, and not its class", got=given, remedy=remedy)
    if not (isinstance(acquisition, AcquisitionFunction) and isinstance(acquisition.needs, Iterable)):
        raise StrategyError(
            "it cannot be an acquisition function",
            got=acquisition,
            expected="something that can be called with a posterior and ISIs, and has needs",
            remedy="Give its class `needs`, a tuple of what it uses of isiw.models.protocol; () where it uses nothing.",
        )


def require_scores(acquisition: AcquisitionFunction, scores: object, candidates: int, people: int = 1) -> Array:
    """The scores of an acquisition function, which has one for each ISI, for all people alike or for each of them."""
    what = f"{type(acquisition).__name__} must score each ISI"
    shape = f"shape ({candidates},) or ({people}, {candidates})"
    try:
        given = np.asarray(scores)
    except (RuntimeError, TypeError, ValueError) as error:  # ragged lists; tensors with gradients, or on a GPU
        remedy = "Return a NumPy array; of a torch tensor, scores.detach().cpu().numpy()."
        raise StrategyError(what, got=f"{type(scores).__name__}: {error}", expected=shape, remedy=remedy) from error
    if given.dtype.kind not in "biuf":
        remedy = "Return a NumPy array of numbers."
        raise StrategyError(what, got=type(scores).__name__, expected=f"numbers of {shape}", remedy=remedy)
    if given.shape not in {(candidates,), (1, candidates), (people, candidates)}:
        raise StrategyError(what, got=given.shape, expected=f"scores of {shape}")
    return given if given.dtype.kind == "f" else given.astype(float)


def golden_index(trial: int, candidates: int) -> int:
    """The candidate of a trial in an order that fills the range evenly, however long it goes on."""
    return int((0.5 + trial * _GOLDEN) % 1.0 * candidates)


def best_candidate(scores: Array, first: int = 0) -> IntArray:
    """Index of the best candidate for each person, shape (b,); a score that is not finite loses."""
    ranked = np.where(np.isfinite(scores), scores, -np.inf)
    from_first = np.concatenate((ranked[..., first:], ranked[..., :first]), axis=-1)
    best: IntArray = (from_first.argmax(-1) + first) % scores.shape[-1]
    return best


def own_plan(posterior: Posterior, acquisition: AcquisitionFunction) -> list[float]:
    """The ISIs [ms] that the method itself wants next for one person; empty where it is not asked for them."""
    if ProposesIsi in acquisition.needs and isinstance(posterior, ProposesIsi):
        return [float(isi_ms) for isi_ms in posterior.proposed_isis_ms()[0]]
    return []


def greedy_batch(
    posterior: Posterior,
    acquisition: AcquisitionFunction,
    chosen_ms: list[float],
    n: int,
    choose: Callable[[Posterior], float],
) -> list[float]:
    """ISIs [ms] for the next n trials of one person.

    A method with a plan of its own keeps to it. For all others the posterior is conditioned on the median MEP that it
    expects at each ISI chosen so far (the kriging believer [Ginsbourger2010]).
    """
    batch = chosen_ms[:n]
    if len(batch) < n and own_plan(posterior, acquisition):
        raise StrategyError("the method plans no further ahead", got=n, expected=f"at most {len(batch)} ISIs")
    imagined = 0
    while len(batch) < n:
        for isi_ms in batch[imagined:]:
            posterior = _as_expected(posterior, isi_ms)
        imagined = len(batch)
        batch.append(choose(posterior))
    return batch


def _as_expected(posterior: Posterior, isi_ms: float) -> Posterior:
    missing = [c.__name__ for c in (Conditions, SamplesProfiles) if not isinstance(posterior, c)]
    if not (isinstance(posterior, Conditions) and isinstance(posterior, SamplesProfiles)):
        raise StrategyError(
            f"{type(posterior).__name__} cannot imagine trials, which a batch needs",
            got=f"a posterior without {', '.join(missing)}",
            remedy="Ask for one ISI at a time, or choose another model.",
        )
    isi = np.array([isi_ms], dtype=np.float32)
    profiles_mv = posterior.profiles_mv(isi)[..., 0]
    middle = (profiles_mv.shape[1] - 1) // 2
    return posterior.condition(isi, np.sort(profiles_mv, axis=1)[:, middle])
