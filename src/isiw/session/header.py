"""What a log says first: how its session can be made again."""

from __future__ import annotations

import importlib.metadata
import os
import platform
from pathlib import Path
from types import UnionType
from typing import Any, get_args

import isiw
from isiw.errors import InvalidValueError
from isiw.log.clock import now
from isiw.log.durable import log_of
from isiw.log.schema import Header, StrategyRecipe
from isiw.strategy.strategy import Strategy

__all__ = ["OWN_LOOP", "header_of", "header_with", "require_parts", "versions"]

OWN_LOOP = "a loop of the lab's own"
"""What the log calls the device of a session whose loop is not isiw's."""

_PACKAGES = ("numpy", "torch", "botorch", "gpytorch")


def versions() -> dict[str, str]:
    """The versions that what a strategy asks depends on, by package."""
    installed = {package: importlib.metadata.version(package) for package in _PACKAGES}
    return {"isiw": isiw.__version__, "python": platform.python_version()} | installed


def require_parts(log: object, **parts: tuple[object, type | UnionType]) -> Path:
    """The log's path; raise where a part of a session is something else than it should be.

    Args:
        log: where the log will be.
        **parts: by its name, each part and its class, with `None` where it may be left out.

    Raises:
        InvalidValueError: a part of another class, or no path.
    """
    for name, (part, kind) in parts.items():
        if not isinstance(part, kind):
            wanted, *_ = get_args(kind) or (kind,)
            expected = f"an isiw.{wanted.__name__}"
            raise InvalidValueError(f"a session cannot use this {name}", got=part, expected=expected)
    if not isinstance(log, str | os.PathLike):
        raise InvalidValueError("a session needs a log", got=log, expected='a path, such as "P07.mcap"')
    return log_of(Path(log))


def header_of(strategy: Strategy, **details: Any) -> Header:
    """The header of a session that begins now.

    Args:
        strategy: the session's.
        **details: the other fields of `Header`.
    """
    recipe, limit_mv = strategy.recipe, strategy.detection_limit_mv
    # Of a user's own objects nothing else is known; what is learnt from the log later needs to know it.
    known = {} if recipe.name or limit_mv is None else {"detection_limit_mv": limit_mv}
    logged = StrategyRecipe(name=recipe.name, seed=recipe.seed, settings={**recipe.settings, **known})
    return header_with(logged, space=strategy.space, **details)


def header_with(recipe: StrategyRecipe, **details: Any) -> Header:
    """The header of a session that begins now, with what it is made again from.

    Args:
        recipe: of its strategy.
        **details: the other fields of `Header`.
    """
    return Header(
        isiw_version=isiw.__version__,
        created=now().isoformat(timespec="seconds"),
        seed=recipe.seed,
        strategy=recipe,
        versions={name: version for name, version in versions().items() if name != "isiw"},
        **details,
    )
