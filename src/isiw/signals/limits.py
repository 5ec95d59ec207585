"""What a sweep must satisfy to be accepted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from isiw.checks import ascending, check_numbers
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.findings import BACKGROUND_LIMIT_UV, WINDOW_END_MS
from isiw.signals.mep import MEP_WINDOW_MS

ARTEFACT_MS: Final = 3.0
"""How long after the pulse its own artefact lasts, at least [ms]."""


@dataclass(frozen=True)
class SignalLimits:
    """What a sweep must satisfy to be accepted.

    Args:
        mep_window_ms: where the MEP is sought [ms after the pulse]; `MEP_WINDOWS_MS` has one for each muscle group.
        background_uv: the most EMG at rest before the pulse [µV RMS]; above it the muscle was not relaxed.
        full_scale_mv: the largest EMG that the amplifier can show [mV]; None to look for flat tops only, which are
            looked for in any case.
        isi_tolerance_ms: how far the realised ISI may be from the commanded one [ms], where that is less than the
            space's tolerance.
        tap_artefact_ms: how long the artefact of the tap lasts in the EMG [ms]; what it covers of the MEP window does
            not count.

    Raises:
        InvalidValueError: a limit that is not positive, a window without first and last ms, or a slip of unit.
    """

    mep_window_ms: tuple[float, float] = MEP_WINDOW_MS
    background_uv: float = 10.0
    full_scale_mv: float | None = None
    isi_tolerance_ms: float | None = None
    tap_artefact_ms: float = 8.0

    def __post_init__(self) -> None:
        check_numbers(self, "background_uv", "tap_artefact_ms", above=0)
        check_numbers(self, "full_scale_mv", "isi_tolerance_ms", above=0, optional=True)
        _check_window(self.mep_window_ms)
        if (slip := BACKGROUND_LIMIT_UV.slip(self.background_uv)) is not None:
            raise InvalidValueError(
                "SignalLimits.background_uv is less than any amplifier's noise",
                got=self.background_uv,
                expected="µV RMS, such as 10",
                remedy=slip,
            )

    def require_behind_artefact(self) -> None:
        """Raise where the window would hold the pulse's own artefact.

        It is for limits that somebody states: those of earlier logs stay readable.

        Raises:
            InvalidValueError: the MEP window begins less than 3 ms after the pulse, as also where its first ms is in s.
        """
        if self.mep_window_ms[0] < ARTEFACT_MS:
            raise InvalidValueError(
                "SignalLimits.mep_window_ms begins in the pulse's artefact, which would be measured as an MEP",
                got=self.mep_window_ms,
                expected=f"from {ARTEFACT_MS:g} ms after the pulse on, such as {MEP_WINDOW_MS}",
                remedy="Set when MEPs of this muscle begin [ms].",
            )

    def tolerance_ms(self, space: DesignSpace) -> float:
        """How far a realised ISI may be from the commanded one [ms]."""
        return min(space.tolerance_ms, self.isi_tolerance_ms or math.inf)


def _check_window(window_ms: tuple[float, float]) -> None:
    """Raise where this is no span of time after the pulse in which an MEP may be."""
    name, such_as = "SignalLimits.mep_window_ms", f"such as {MEP_WINDOW_MS}"
    if not isinstance(window_ms, Sequence) or len(window_ms) != 2:
        raise InvalidValueError(f"{name} must be its first and its last ms", got=window_ms, expected=such_as)
    _, last_ms = ascending(name, window_ms, least=0)
    if (slip := WINDOW_END_MS.slip(last_ms)) is not None:
        raise InvalidValueError(
            f"{name} ends before any MEP begins",
            got=window_ms,
            expected=f"ms after the pulse, {such_as}",
            remedy=slip,
        )
