"""The units that waveforms may be in."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType

from isiw.errors import InvalidValueError

__all__ = ["ACCELERATION_UNITS", "EMG_UNITS_MV", "require_unit"]

EMG_UNITS_MV: Mapping[str, float] = MappingProxyType({"V": 1e3, "mV": 1.0, "uV": 1e-3, "µV": 1e-3, "μV": 1e-3})
"""One of each unit in mV; both of Unicode's micro signs are known."""

ACCELERATION_UNITS = frozenset({"m/s^2", "m/s²", "g", "V", "mV"})
"""Units of the acceleration; the impact is found in any of them."""


def require_unit(name: str, unit: str, known: Collection[str]) -> None:
    """Raise where a waveform is in a unit that nobody can judge.

    Args:
        name: of the channel.
        unit: its unit.
        known: `EMG_UNITS_MV` or `ACCELERATION_UNITS`.

    Raises:
        InvalidValueError: an unknown unit.
    """
    if unit not in known:
        raise InvalidValueError(
            f"the unit of the channel {name} is unknown", got=unit, expected=", ".join(sorted(known))
        )
