"""The Gaussian process on the transformed MEP."""

from __future__ import annotations

from isiw.models.gp.model import GaussianProcess, GaussianProcessPosterior, ProcessSettings

__all__ = ["GaussianProcess", "GaussianProcessPosterior", "ProcessSettings"]
