"""Settings with which strategies are quick."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

_PARTICLES: Final = {"particles": 100}
_PROCESS: Final = {"samples": 64}
_SEARCHED: Final = {
    "samples": 64,
    "effort": {"scouts": 16, "starts": 1, "steps": 2, "draws": 50, "fits": 1, "enough": 10},
}
QUICK: Final[Mapping[str, dict[str, Any]]] = {
    **dict.fromkeys(("default", "particles-window", "particles-mi", "even", "random", "supra-threshold"), _PARTICLES),
    **dict.fromkeys(("parametric-mi", "parametric-window"), _SEARCHED),
    **dict.fromkeys(("gp-straddle", "gp-variance", "gp-ei"), _PROCESS),
    "gpr": {"samples": 16, "max_fit_iterations": 10},
    "svmr": {"committee": 3},
}
"""By the strategy's name; the others are quick as they are."""


def quick(name: str) -> dict[str, Any]:
    """Of a named strategy."""
    return QUICK.get(name, {})
