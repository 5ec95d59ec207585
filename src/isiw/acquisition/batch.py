"""A batch of ISIs to deliver before anything is learnt, chosen greedily: each as if those before went as expected."""

from __future__ import annotations

from collections.abc import Callable

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.errors import StrategyError
from isiw.lazy import torch
from isiw.models.protocol import Conditions, Posterior, ProposesIsi, SamplesProfiles


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
    isi = torch.tensor([isi_ms], dtype=torch.float32)
    return posterior.condition(isi, posterior.profiles_mv(isi).median(dim=1).values.squeeze(-1))
