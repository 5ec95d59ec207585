"""The particle posterior for TMS above the motor threshold: a segment that is enhanced, and one that is depressed."""

from __future__ import annotations

from isiw.models.particles.supra.model import SupraModel, SupraPosterior

__all__ = ["SupraModel", "SupraPosterior"]
