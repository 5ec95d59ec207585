"""Settings with which strategies are quick."""

from __future__ import annotations

from typing import Any, Final

SEARCHED_LITTLE: Final[dict[str, Any]] = {
    "samples": 64,
    "effort": {"scouts": 96, "starts": 4, "steps": 8, "draws": 150, "fits": 3, "enough": 100},
}
"""Of the strategies whose model is fitted."""
