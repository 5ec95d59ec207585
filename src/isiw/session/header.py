"""What a log says first: how its session can be made again."""

from __future__ import annotations

import datetime as dt
import importlib.metadata
import platform
from typing import Any

import isiw
from isiw.log.schema import Header, StrategyRecipe
from isiw.strategy.strategy import Strategy

__all__ = ["header_of", "versions"]

_PACKAGES = ("numpy", "torch", "botorch", "gpytorch")


def versions() -> dict[str, str]:
    """The versions that what a strategy asks depends on, by package."""
    installed = {package: importlib.metadata.version(package) for package in _PACKAGES}
    return {"isiw": isiw.__version__, "python": platform.python_version()} | installed


def header_of(strategy: Strategy, **details: Any) -> Header:
    """The header of a session that begins now.

    Args:
        strategy: the session's.
        **details: the other fields of `Header`.
    """
    recipe = strategy.recipe
    return Header(
        isiw_version=isiw.__version__,
        created=dt.datetime.now(dt.UTC).isoformat(timespec="seconds"),
        seed=recipe.seed,
        strategy=StrategyRecipe(name=recipe.name, seed=recipe.seed, settings=dict(recipe.settings)),
        space=strategy.space,
        versions={name: version for name, version in versions().items() if name != "isiw"},
        **details,
    )
