"""The trials told so far, for models that fit all of them anew after each."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from isiw.errors import StrategyError
from isiw.models.protocol import Observation
from isiw.types import FloatArray

__all__ = ["PersonTrials", "Told"]


@dataclass(frozen=True, eq=False)
class PersonTrials:
    """What was told of one person.

    Args:
        isi_ms: realised ISIs [ms], shape (n,).
        mep_mv: their MEPs [mV], shape (n,).
        baseline_mv: MEPs of TMS alone [mV], shape (m,).
    """

    isi_ms: FloatArray
    mep_mv: FloatArray
    baseline_mv: FloatArray


@dataclass(frozen=True, eq=False)
class Told:
    """Trials of b people, in the order of telling.

    Args:
        isi_ms: realised ISIs [ms]; NaN is TMS alone, shape (b, n).
        mep_mv: their MEPs [mV], shape (b, n).
    """

    isi_ms: FloatArray
    mep_mv: FloatArray

    @classmethod
    def nothing(cls, people: int) -> Told:
        """No trials."""
        return cls(np.empty((people, 0)), np.empty((people, 0)))

    @property
    def trials(self) -> int:
        """How many trials of each person."""
        return int(self.isi_ms.shape[1])

    @property
    def people(self) -> int:
        """How many people."""
        return int(self.isi_ms.shape[0])

    def appended(self, observation: Observation) -> Told:
        """These and one more trial.

        Raises:
            StrategyError: a response without an amplitude, which a fit to amplitudes cannot learn from.
        """
        isi_ms, mep_mv = (x.detach().cpu().double().numpy()[:, None] for x in (observation.isi_ms, observation.mep_mv))
        if np.isnan(mep_mv).any():
            raise StrategyError(
                "the model learns from amplitudes only",
                got="a response without its amplitude",
                remedy="Tell mep_mv, or choose a model with a likelihood for responses, as the default has.",
            )
        return replace(self, isi_ms=np.hstack((self.isi_ms, isi_ms)), mep_mv=np.hstack((self.mep_mv, mep_mv)))

    def person(self, person: int) -> PersonTrials:
        """What was told of one person."""
        isi_ms, mep_mv = self.isi_ms[person], self.mep_mv[person]
        alone = np.isnan(isi_ms)
        return PersonTrials(isi_ms[~alone], mep_mv[~alone], mep_mv[alone])
