"""What a sweep must satisfy to be accepted, of any muscle; see `isiw.signals.plausible` for what cannot be true."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from isiw.checks import Checked, Flag, Positive, ascending
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.findings import BACKGROUND_LIMIT_UV, WINDOW_END_MS
from isiw.signals.spans import MEP_WINDOW_MS

ARTEFACT_MS: Final = 3.0
"""How long after the pulse its own artefact lasts, at least [ms]."""


@dataclass(frozen=True)
class SignalLimits(Checked):
    """Conditions that a sweep must satisfy to be accepted.

    Args:
        mep_window_ms: where the MEP is sought [ms after the pulse]; `MEP_WINDOWS_MS` has one for each muscle group.
        background_uv: the most EMG at rest before the pulse [µV RMS]; above it the muscle was not relaxed.
        contracted: whether the muscle is to be contracted, so that no EMG before the pulse is too much.
        full_scale_mv: the largest EMG that the amplifier can show [mV]; None to look for flat tops only, which are
            looked for in any case.
        isi_tolerance_ms: how far the realised ISI may be from the commanded one [ms], where that is less than the
            space's tolerance.

    Raises:
        InvalidValueError: a limit that is not positive, a window without first and last ms, or a slip of unit.
    """

    mep_window_ms: tuple[float, float] = MEP_WINDOW_MS
    background_uv: Positive = 10.0
    full_scale_mv: Positive | None = None
    isi_tolerance_ms: Positive | None = None
    contracted: Flag = False

    def __post_init__(self) -> None:
        super().__post_init__()
        name, window_ms, such_as = "SignalLimits.mep_window_ms", self.mep_window_ms, f"such as {MEP_WINDOW_MS}"
        if not isinstance(window_ms, Sequence) or len(window_ms) != 2:
            raise InvalidValueError(f"{name} must be its first and its last ms", got=window_ms, expected=such_as)
        _, end_ms = ascending(name, window_ms, least=0)
        ends_amiss = f"{name} ends before any MEP begins, or long after it"
        WINDOW_END_MS.require(ends_amiss, end_ms, f"ms after the pulse, {such_as}", got=window_ms)
        amiss = "SignalLimits.background_uv is less than any amplifier's noise, or more than any muscle's EMG"
        BACKGROUND_LIMIT_UV.require(amiss, self.background_uv, "µV RMS, such as 10")

    @property
    def most_background_uv(self) -> float:
        """The most EMG before the pulse [µV RMS]; infinite if the muscle is to be contracted."""
        return math.inf if self.contracted else self.background_uv

    def tolerance_ms(self, space: DesignSpace) -> float:
        """Largest difference between a realised ISI and the commanded one [ms]."""
        return min(space.tolerance_ms, self.isi_tolerance_ms or math.inf)


EMG_UNITS_MV: Mapping[str, float] = MappingProxyType({"V": 1e3, "mV": 1.0, "uV": 1e-3, "µV": 1e-3, "μV": 1e-3})
"""One of each unit in mV; both of Unicode's micro signs are known."""
