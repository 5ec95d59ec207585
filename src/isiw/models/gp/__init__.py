"""The Gaussian process on the transformed MEP."""

from isiw.models.gp.model import GaussianProcess, GaussianProcessPosterior
from isiw.models.gp.prior import ProcessSettings

__all__ = ["GaussianProcess", "GaussianProcessPosterior", "ProcessSettings"]
