"""A strategy, model or acquisition function of a user's own in a study, named as `module:function`.

What runs is what the operator's own STUDY.toml names. The folder of a study keeps only the checksum of that code, so
that a folder from somebody else names nothing to import.
"""

from __future__ import annotations

import inspect
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.design import DesignSpace
from isiw.errors import ConfigError, StudyError
from isiw.models.protocol import ResponseModel
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.strategy import Strategy
from isiw.studies.players import Player
from isiw.text.named_code import named_code, require_fitting

OWN: Final = "own"
"""The name, in the folder of a study, of a strategy that the operator's own code makes."""


@dataclass(frozen=True)
class OwnCode:
    """Code of a user's own that makes a strategy.

    Args:
        reference: where it is, as `module:function`; empty where only its checksum is known, as from a study's folder.
        folder: where the module is looked for first; None for the installed packages.
        checksum: the CRC-32 of the module's file, or of all of its package's.
    """

    reference: str
    folder: Path | None
    checksum: str

    @classmethod
    def named(cls, reference: str, folder: Path | None) -> OwnCode:
        """The code that a study names, with the checksum that it has now."""
        named_code(reference, folder, "the strategy's function")
        return cls(reference, folder, _checksum(reference.partition(":")[0]))

    def player(self, space: DesignSpace, seed: int, settings: Mapping[str, Any]) -> Player:
        """The strategy before its first trial.

        The function gets the settings, and `space` and `seed` if it has parameters of these names. It returns a
        strategy or anything else with ask, tell and estimate; or a model or an acquisition function, which takes the
        place of the default's.
        """
        if not self.reference:
            raise StudyError(
                "this strategy is code of your own, which the folder of a study does not name",
                remedy="Give the STUDY.toml that names it: isiw study replay FOLDER KEY --study STUDY.toml.",
            )
        make = named_code(self.reference, self.folder, "the strategy's function")
        if (now := _checksum(self.reference.partition(":")[0])) != self.checksum:
            raise StudyError(
                f"the code of {self.reference} is not what the study began with",
                got=now,
                expected=self.checksum,
                remedy="Go back to that code, or begin in another folder. Workers elsewhere need the same file.",
            )
        offered = {"space": space, "seed": seed}
        known = {name: value for name, value in offered.items() if name in inspect.signature(make).parameters}
        require_fitting(make, {**known, **settings}, "the strategy's settings")
        return _player(make(**known, **settings), space, seed, self.reference)


def _player(made: object, space: DesignSpace, seed: int, reference: str) -> Player:
    usual = make_strategy(space=space, seed=seed)
    if isinstance(made, AcquisitionFunction):
        return Strategy(space, usual.model, made, usual.stopping, seed=seed)
    if isinstance(made, ResponseModel):
        return Strategy(space, made, usual.acquisition, usual.stopping, seed=seed)
    if all(callable(getattr(made, name, None)) for name in ("ask", "tell", "estimate")):
        return made  # type: ignore[return-value] # it has what a player has
    raise ConfigError(
        f"{reference} makes nothing that can take part in a study",
        got=type(made).__name__,
        expected="a strategy (ask, tell, estimate), a model, or an acquisition function",
        remedy='See "A strategy of your own" in docs/studies.md.',
    )


def _checksum(module_name: str) -> str:
    """The CRC-32 of a module's file, or of all files of its package, whatever their line endings."""
    spec = find_spec(module_name.partition(".")[0])
    if spec is None or spec.origin is None:
        return "unknown"
    file, checksum = Path(spec.origin), 0
    for path in sorted(file.parent.rglob("*.py")) if file.name == "__init__.py" else [file]:
        checksum = zlib.crc32(path.read_bytes().replace(b"\r\n", b"\n"), checksum)
    return f"{checksum:08x}"
