"""Players, which propose ISIs in simulated sessions: strategies, and code of one's own.

The folder of a study keeps only the checksum of that code, so that a folder from somebody else names nothing to
import.
"""

from __future__ import annotations

import inspect
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, Protocol, TypeAlias

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.decision import StopDecision, StopKind
from isiw.design import DesignSpace
from isiw.errors import ConfigError, StudyError
from isiw.estimate import WindowEstimate
from isiw.models.protocol import ResponseModel
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.choice import Choice
from isiw.strategy.decisions import StoppingRule
from isiw.strategy.strategy import Strategy
from isiw.subjects.subject import Response
from isiw.text.named_code import named_code, require_fitting
from isiw.trials import Trial
from isiw.window import Window

OWN: Final = "own"
"""The name, in the folder of a study, of a strategy that the operator's own code makes."""

Reported: TypeAlias = WindowEstimate | Window | None


class Player(Protocol):
    """Protocol of what chooses ISIs in a simulated session: a strategy, or what a benchmark compares it with."""

    def ask(self) -> float:
        """The next ISI [ms]."""

    def tell(self, isi_ms: float | None, mep_mv: float | None = None, *, isi_sd_ms: float = 0.0) -> None:
        """Learn from one trial.

        Args:
            isi_ms: the realised ISI [ms]; None for TMS alone.
            mep_mv: amplitude of the MEP [mV].
            isi_sd_ms: SD of the realised ISI [ms].
        """

    def estimate(self) -> Reported:
        """The estimate of the window now."""


@dataclass(frozen=True)
class Alone:
    """A player with one person; a strategy has a stopping rule, and says which asks and fits failed."""

    player: Player

    @property
    def _strategy(self) -> Strategy | None:
        return self.player if isinstance(self.player, Strategy) else None

    @property
    def stopping(self) -> StoppingRule | None:
        """The rule that says when to stop; None if there is none."""
        return None if self._strategy is None else self._strategy.stopping

    def ask(self) -> list[Choice]:
        """The person's next ISI."""
        isi_ms = self.player.ask()
        return [Choice(isi_ms, None if self._strategy is None else self._strategy.fallback_reason)]

    def tell(self, responses: Sequence[Response]) -> None:
        """Learn from one trial."""
        (response,) = responses
        if self._strategy is None:
            self.player.tell(response.isi_ms, response.mep_mv, isi_sd_ms=response.isi_sd_ms)
        else:
            self._strategy.learn(Trial.of(response.isi_ms, response.mep_mv, isi_sd_ms=response.isi_sd_ms))

    def count_mistrial(self, _: int, lost: Choice) -> Choice:
        """Count a pair of stimuli that was delivered in vain, and say what is asked instead."""
        if self._strategy is None:
            return lost
        self._strategy.count_mistrial()
        return self.ask()[0]

    def estimate(self, _: int) -> Reported:
        """The estimate of the person's window."""
        return self.player.estimate()

    def decision(self, _: int) -> StopDecision:
        """The decision to stop or not."""
        return StopKind.OWN.go_on("There is no stopping rule.") if self._strategy is None else self._strategy.decision()

    def trouble(self) -> bool:
        """True if the last fit failed."""
        return self._strategy is not None and self._strategy.trouble is not None


@dataclass(frozen=True)
class OwnCode:
    """Code of a user's own that makes a strategy: a `module:function`, empty if only the checksum is known."""

    reference: str
    folder: Path | None  # where the module is looked for first; None for the installed packages
    checksum: str  # CRC-32 of the module's file, or of all of its package's

    @classmethod
    def named(cls, reference: str, folder: Path | None, settings: Mapping[str, Any]) -> OwnCode:
        """The code that a study names, which takes these settings, with the checksum that it has now."""
        _with_settings(named_code(reference, folder, "the strategy's function"), settings)
        return cls(reference, folder, _checksum(reference.partition(":")[0]))

    def player(self, space: DesignSpace, seed: int, settings: Mapping[str, Any]) -> Player:
        """The strategy before its first trial; `space` and `seed` are given to a function with such parameters."""
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
        return _player(make(**_with_settings(make, settings, space, seed)), space, seed, self.reference)


def _with_settings(
    make: Callable[..., object], settings: Mapping[str, Any], space: DesignSpace | None = None, seed: int = 0
) -> dict[str, Any]:
    """What a function is called with: the settings, and `space` and `seed` if it has such parameters."""
    parameters = inspect.signature(make).parameters
    known = {name: value for name, value in (("space", space), ("seed", seed)) if name in parameters}
    require_fitting(make, {**known, **settings}, "the strategy's settings")
    return {**known, **settings}


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
