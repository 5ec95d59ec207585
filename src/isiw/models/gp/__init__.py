"""The Gaussian process on the transformed MEP."""

from isiw.models.gp.model import GaussianProcess, GaussianProcessPosterior, ProcessSettings

__all__ = ["GaussianProcess", "GaussianProcessPosterior", "ProcessSettings"]
