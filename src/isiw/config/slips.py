"""Slips of unit in a configuration: values that are possible, and hardly meant.

They are refused where somebody states them; a log that was made with them is read, and goes on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from isiw.errors import ConfigError

__all__ = ["require_units"]

LEAST_PCT: Final = 3.0
"""Nobody stimulates with so low an intensity; 1.2 is meant as 120 %."""

SHORTEST_S, LONGEST_S = 0.005, 1.0
"""A width between these is in seconds, which no interval of an edge is in ms; what is below is to stop nothing."""


def require_units(values: Mapping[str, Any]) -> None:
    """Check that no value looks as if it were in another unit than its key says.

    Args:
        values: a configuration's sections, as they were given.

    Raises:
        ConfigError: one does.
    """
    for name in ("intensity_pct_rmt", "intensity_pct_mso"):
        _require_percent(f"visit.{name}", _given(values, "visit", name))
    _require_ms("strategy.settings.stop_width_ms", _given(values, "strategy", "settings", "stop_width_ms"))


def _given(values: Any, *keys: str) -> float | None:
    """The number that was given under some keys; None where there is none."""
    for key in keys:
        values = values.get(key) if isinstance(values, Mapping) else None
    return values if isinstance(values, int | float) else None


def _require_percent(key: str, intensity_pct: float | None) -> None:
    if intensity_pct is not None and intensity_pct < LEAST_PCT:
        raise ConfigError(
            f"{key} is in %, and this is probably a ratio",
            got=intensity_pct,
            expected=f"at least {LEAST_PCT:g}",
            remedy="Multiply it by 100: 90 for 90 %.",
        )


def _require_ms(key: str, width_ms: float | None) -> None:
    if width_ms is not None and SHORTEST_S <= width_ms < LONGEST_S:
        raise ConfigError(
            f"{key} is in ms, and this is probably in s",
            got=width_ms,
            expected=f"at least {LONGEST_S:g}",
            remedy="Multiply it by 1000: 25 for 25 ms. If no width is to end the session, write 0.001.",
        )
