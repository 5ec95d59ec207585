"""The units that waveforms may be in."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

EMG_UNITS_MV: Mapping[str, float] = MappingProxyType({"V": 1e3, "mV": 1.0, "uV": 1e-3, "µV": 1e-3, "μV": 1e-3})
"""One of each unit in mV; both of Unicode's micro signs are known."""

ACCELERATION_UNITS = frozenset({"m/s^2", "m/s²", "g", "V", "mV"})
"""Units of the acceleration; the impact is found in any of them."""
