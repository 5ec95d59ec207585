"""The parametric window model, as a Pyro program."""

from __future__ import annotations

from isiw.models.parametric.model import ParametricModel, ParametricPosterior

__all__ = ["ParametricModel", "ParametricPosterior"]
