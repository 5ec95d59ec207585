"""How MEPs are corrected for the EMG floor before a curve is fitted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np

from isiw.checks import Checked, Positive
from isiw.models.shared.history import PersonTrials
from isiw.types import FloatArray

FloorKind: TypeAlias = Literal["subtracted", "lowest", "zeroed", "raw"]

GUESSED_AT: Final = {"subtracted": 0.5, "lowest": 0.1}
"""Which quantile of all MEPs is the guess where TMS alone was not told."""


@dataclass(frozen=True)
class FloorTreatment(Checked):
    """How MEPs are corrected for what they amount to where the tap does nothing, before a curve is fitted.

    The dissertation's plots have amplitudes of zero outside the window, and it does not say why [Kim2020, 4.3].

    Args:
        floor: `"subtracted"`, `"lowest"`: the expected MEP of TMS alone is subtracted; where that was not told, the
            median or the lowest tenth of all MEPs. The median is too high where a method asks mostly inside the window.
            `"zeroed"`: an MEP below the threshold is 0. `"raw"`: MEPs as they are; where the floor exceeds 0.135 of the
            peak, such a curve has no edges.
        threshold_mv: of `"zeroed"` [mV]; the dissertation's thresholds of a response are 0.015–0.033 mV (4.1.1).
    """

    floor: FloorKind = "subtracted"
    threshold_mv: Positive = 0.025

    def level_mv(self, trials: PersonTrials) -> float:
        """What is subtracted from the MEPs of one person [mV]: the mean of TMS alone, or a guess at it."""
        if self.floor not in GUESSED_AT:
            return 0.0
        if len(trials.baseline_mv):
            return float(trials.baseline_mv.mean())
        return float(np.quantile(trials.mep_mv, GUESSED_AT[self.floor])) if len(trials.mep_mv) else 0.0

    def excess_mv(self, mep_mv: FloatArray, level_mv: FloatArray | float = 0.0) -> FloatArray:
        """What MEPs have above the floor [mV], broadcast shape."""
        return np.where(mep_mv < self.threshold_mv, 0.0, mep_mv) if self.floor == "zeroed" else mep_mv - level_mv
