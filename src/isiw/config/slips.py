"""Slips of unit in a configuration: values that are possible, and hardly meant.

They are refused where somebody states them; a log that was made with them is read, and goes on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from isiw.errors import ConfigError
from isiw.findings import INTENSITY_PCT, STOP_WIDTH_MS, Scale

_SCALES: Final[Mapping[tuple[str, ...], Scale]] = {
    ("visit", "intensity_pct_rmt"): INTENSITY_PCT,
    ("visit", "intensity_pct_mso"): INTENSITY_PCT,
    ("strategy", "settings", "stop_width_ms"): STOP_WIDTH_MS,
}

STOPS_NOTHING_MS: Final = 0.005
"""A smaller width to stop at is there to stop nothing."""


def require_units(values: Mapping[str, Any]) -> None:
    """Check that no value looks as if it were in another unit than its key says."""
    for keys, scale in _SCALES.items():
        value = _given(values, *keys)
        slip = None if value is None else scale.slip(value)
        if slip is not None and not (scale is STOP_WIDTH_MS and (value or 0.0) < STOPS_NOTHING_MS):
            remedy = f"{slip} If no width is to end the session, write 0.001." if scale is STOP_WIDTH_MS else slip
            expected = f"at least {scale.least:g}"
            raise ConfigError(
                f"{'.'.join(keys)} is probably in another unit", got=value, expected=expected, remedy=remedy
            )


def _given(values: Any, *keys: str) -> float | None:
    """The number that was given under some keys; None where there is none."""
    for key in keys:
        values = values.get(key) if isinstance(values, Mapping) else None
    return values if isinstance(values, int | float) else None
