"""The conformance suite of acquisition functions."""

from __future__ import annotations

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.design import DesignSpace
from isiw.lazy import torch
from isiw.models.protocol import Posterior
from isiw.testing.requirements import require, same_estimates


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
