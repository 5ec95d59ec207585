"""isiw: between which inter-stimulus intervals does the tap enhance the MEP, and how sure are we?

The public surface is loaded lazily (PEP 562), so that `import isiw` costs nothing until a name is used.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "DesignSpace": "design",
    "IMPACT_SPACE": "design",
    "VALVE_SPACE": "design",
    "Window": "window",
    "WindowEstimate": "window",
    "Channel": "trials",
    "Measurement": "trials",
    "Stimulus": "trials",
    "Sweep": "trials",
    "Trial": "trials",
    "TrialTable": "trials",
}
_MODULES = {"errors", "metrics", "signals", "subjects"}

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
