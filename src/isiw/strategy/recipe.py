"""What a strategy was made from, as a log keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Recipe:
    """The name, seed and settings of a strategy, from which a log can make it again.

    Args:
        name: its name in the catalogue; empty for a strategy built from a user's own objects.
        seed: the seed of all its randomness.
        settings: the settings it was made with, as TOML values.
    """

    name: str
    seed: int
    settings: Mapping[str, Any] = field(default_factory=dict)
