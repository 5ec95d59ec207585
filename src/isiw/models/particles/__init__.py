"""The particle posterior over profile, recruitment and noise: the default model."""

from __future__ import annotations

from isiw.models.particles.model import ParticleModel, ParticlePosterior

__all__ = ["ParticleModel", "ParticlePosterior"]
