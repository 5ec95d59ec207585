"""BoTorch's acquisition functions, on models that can be asked for a BoTorch model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from isiw.lazy import torch
from isiw.models.protocol import HasBotorchModel
from isiw.types import Array, FloatArray


@dataclass(frozen=True)
class BotorchAcquisition:
    """An acquisition function of BoTorch's, made again for each posterior.

        BotorchAcquisition(lambda model: qNegIntegratedPosteriorVariance(model, mc_points=grid_ms))

    Args:
        make: from a BoTorch model to a BoTorch acquisition function. The model's input is the ISI [ms], so `grid_ms`
            above is a double tensor of ISIs [ms] of shape (N, 1); its outcome is on the scale of the model.
        seed: of BoTorch's draws, which disturb nobody else's: equal posteriors have equal scores.
    """

    make: Callable[[Any], Callable[[Any], Any]]
    seed: int = 0
    needs: ClassVar[tuple[type, ...]] = (HasBotorchModel,)

    def __call__(self, posterior: HasBotorchModel, isi_ms: Array) -> Array:
        """Score the candidate ISIs, one at a time, shape (b, t)."""
        inputs = torch.tensor(isi_ms, dtype=torch.double)[:, None, None]
        with torch.no_grad(), torch.random.fork_rng(devices=[]):
            torch.default_generator.manual_seed(self.seed)
            scores = [self.make(posterior.botorch_model(person))(inputs) for person in range(posterior.people)]
        found: FloatArray = torch.stack(scores).double().numpy()
        return found
