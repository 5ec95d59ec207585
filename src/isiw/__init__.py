"""isiw: between which inter-stimulus intervals does the tap enhance the MEP, and how sure are we?

The public surface is loaded lazily (PEP 562), so that `import isiw` costs nothing until a name is used.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "CallbackDevice": "devices.callback",
    "DesignSpace": "design",
    "Device": "devices.protocol",
    "DeviceInfo": "devices.protocol",
    "IMPACT_SPACE": "design",
    "Limits": "devices.limits",
    "RecordedDevice": "devices.recorded",
    "ReplayDevice": "devices.replay",
    "Session": "session",
    "SimulatedDevice": "devices.simulated",
    "StopDecision": "stopping",
    "Strategy": "asktell",
    "VALVE_SPACE": "design",
    "Window": "window",
    "VirtualClock": "devices.clock",
    "WindowEstimate": "window",
    "Channel": "trials",
    "Measurement": "trials",
    "Stimulus": "trials",
    "Sweep": "trials",
    "Tapper": "devices.tapper",
    "TapperSettings": "devices.tapper",
    "Trial": "trials",
    "TrialTable": "trials",
    "exclude": "resumption",
    "list_strategies": "catalogue",
    "make_strategy": "catalogue",
    "read_session": "log.reader",
    "resume": "resumption",
}
_MODULES = {
    "acquisition",
    "config",
    "counts",
    "errors",
    "metrics",
    "models",
    "plots",
    "plots_studies",
    "plots_timing",
    "report",
    "signals",
    "studies",
    "subjects",
    "testing",
    "timing",
}

__all__ = ["__version__", *sorted(_HOME), *sorted(_MODULES)]  # noqa: PLE0604 - the names are strings, listed above


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(importlib.import_module(f"isiw.{_HOME[name]}"), name)
    elif name in _MODULES:
        value = importlib.import_module(f"isiw.{name}")
    else:
        raise AttributeError(f"module 'isiw' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
