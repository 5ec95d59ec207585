"""What models are told in tests: trials of one person, or of several alike."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.models.protocol import Observation

Trial = tuple[float | None, float]


def observation(isi_ms: Iterable[float | None], mep_mv: Iterable[float]) -> Observation:
    """One trial of each person."""
    return Observation.of(list(isi_ms), list(mep_mv))


def told(model: Any, trials: Iterable[Trial], space: DesignSpace = VALVE_SPACE, seed: int = 1) -> Any:
    """The posterior of one person after some trials."""
    posterior = model.begin(space, seed)
    for isi_ms, mep_mv in trials:
        posterior = model.update(posterior, observation([isi_ms], [mep_mv]))
    return posterior


def bell_mv(isi_ms: Any, amplitude_mv: float = 0.1, mean_ms: float = 263.0, sd_ms: float = 25.0) -> np.ndarray:
    """A Gaussian profile; its window is 213–313 ms."""
    return amplitude_mv * np.exp(-0.5 * ((np.asarray(isi_ms) - mean_ms) / sd_ms) ** 2)


def trials_of(profile_mv: Any, every_ms: float = 20.0, space: DesignSpace = VALVE_SPACE) -> list[Trial]:
    """Evenly spaced trials without noise."""
    isis_ms = np.arange(space.low_ms, space.high_ms + 1e-9, every_ms)
    return list(zip(isis_ms.tolist(), np.asarray(profile_mv(isis_ms)).tolist(), strict=True))
