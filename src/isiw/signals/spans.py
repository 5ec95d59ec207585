"""When after a stimulus the EMG shows it: MEP and tap."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

MEP_WINDOW_MS = (15.0, 35.0)
"""Where the MEP of the forearm is sought [ms after the pulse] [Kim2020, 5.2.3]."""

MEP_WINDOWS_MS: Mapping[str, tuple[float, float]] = MappingProxyType({"forearm": MEP_WINDOW_MS, "hand": (15.0, 50.0)})
"""Windows by muscle group. In hand muscles the onset is near 23 ms and the second turn may lie beyond 35 ms."""

TAP_MS: Final = 150.0
"""How long after the hit the tap may move the EMG, its reflexes included [ms]."""

HIT_DELAY_MS: Final = 180.0
"""From the valve command to the hit, usually [ms]."""
