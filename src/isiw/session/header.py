"""What a log says first: how its session can be made again, and where it ended when it is continued."""

from __future__ import annotations

import importlib.metadata
import os
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import UnionType
from typing import Any, Final, get_args

import isiw
from isiw.compiled import version as engine_version
from isiw.errors import InvalidValueError
from isiw.log.clock import now
from isiw.log.durable import log_of
from isiw.log.schema import Event, Header, Record, StrategyRecipe
from isiw.log.writer import LogWriter
from isiw.strategy.strategy import Strategy
from isiw.trials import TrialTable

BELIEF_VERSION: Final = 1
ENGINE_VERSION: Final = 1
"""Which belief a session learns by, and which engine computes it, for its header."""

_PACKAGES = ("numpy", "torch", "botorch", "gpytorch")


@dataclass(frozen=True)
class Earlier:
    """Where an earlier run of a session ended; by default there was none.

    Args:
        open_log: opens the log, with the header that holds from here on.
        trials: what was delivered; the strategy has learnt it.
        events: what happened.
        kept: fields of the header that stay as they were logged.
        first_records: what is logged first; never empty if there was an earlier run.
        ages_s: how long ago each stimulus was [s].
    """

    open_log: Callable[[Header], LogWriter]
    trials: TrialTable = field(default_factory=TrialTable)
    events: tuple[Event, ...] = ()
    kept: Mapping[str, Any] = field(default_factory=dict)
    first_records: Sequence[Record] = ()
    ages_s: Callable[[], Sequence[float]] = tuple


def versions() -> dict[str, str]:
    """The versions that what a strategy asks depends on, by package; a log that states no engine is torch's."""
    installed = {package: importlib.metadata.version(package) for package in _PACKAGES}
    return {"isiw": isiw.__version__, "python": platform.python_version(), **installed, "engine": engine_version()}


def require_parts(log: object, **parts: tuple[object, type | UnionType]) -> Path:
    """The log's path; raise where a part of a session is something else than it should be."""
    for name, (part, kind) in parts.items():
        if not isinstance(part, kind):
            wanted, *_ = get_args(kind) or (kind,)
            expected = f"an isiw.{wanted.__name__}"
            raise InvalidValueError(f"a session cannot use this {name}", got=part, expected=expected)
    if not isinstance(log, str | os.PathLike):
        raise InvalidValueError("a session needs a log", got=log, expected='a path, such as "P07.mcap"')
    return log_of(Path(log))


def header_of(strategy: Strategy, **details: Any) -> Header:
    """The header of a session that begins now."""
    recipe, limit_mv = strategy.recipe, strategy.detection_limit_mv
    # Of a user's own objects nothing else is known; what is learnt from the log later needs to know it.
    known = {} if recipe.name or limit_mv is None else {"detection_limit_mv": limit_mv}
    logged = StrategyRecipe(name=recipe.name, seed=recipe.seed, settings={**recipe.settings, **known})
    return Header(
        **begun(recipe.seed),
        strategy=logged,
        space=strategy.space,
        belief_version=BELIEF_VERSION,
        engine_version=ENGINE_VERSION,
        **details,
    )


def begun(seed: int) -> dict[str, Any]:
    """What the header of all says that begins now."""
    return {
        "isiw_version": isiw.__version__,
        "created": now().isoformat(timespec="seconds"),
        "seed": seed,
        "versions": {name: version for name, version in versions().items() if name != "isiw"},
    }
