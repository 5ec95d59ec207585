"""The plan of a study: strategies × cohorts × people, and the units of work that it comes to.

Every strategy meets the same people with the same trial noise. As TOML:

    strategies = ["default", { name = "nr", label = "nr9", settings = { initial = 9 } }]
    cohorts = ["recruitment", "gaussian"]
    people = 200
    seed = 10000
    trials = 40
    marks = [10, 20, 40]
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeAlias

from isiw.checks import Checked, Positive, text, whole
from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace, require_space
from isiw.errors import ConfigError, InvalidValueError
from isiw.lazy import pd
from isiw.strategy.catalogue import settings_for
from isiw.strategy.settings.common import settings_values
from isiw.studies.players import OWN, OwnCode
from isiw.studies.sessions import OWN_STRATEGY, SimulatedSession, Stopping, require_cohorts, simulate, simulate_batch
from isiw.text.toml_files import checked, read_toml

_MOST_SEED: Final = 2**62
"""Sums of seeds stay within 64 bits."""

_MOST_TRIALS: Final = 100_000

_MOST_SESSIONS: Final = 1_000_000
"""Of a study; more could not even be listed in a moment."""

Engine: TypeAlias = Literal["single", "batched"]
Stated: TypeAlias = Literal["unstated", "stated"]

_OF_THE_FOLDER: Final = frozenset({"checksum", "versions"})
"""What a folder of results says besides its study."""

_SPACES: Final[Mapping[str, DesignSpace]] = {"valve": VALVE_SPACE, "impact": IMPACT_SPACE}


@dataclass(frozen=True)
class StudyStrategy:
    """A strategy that is compared with others.

    Args:
        name: a named strategy, or one of your own as `module:function`.
        settings: its settings that differ from what the name means; of one of your own, arguments of the function.
        label: what it is called in the table; by default its name, or that of the function.
        code: the checksum of your own code; it is worked out if it is not given.
        folder: where your own module is looked for first.

    Raises:
        StrategyError: an unknown name or setting.
        ConfigError: your own function cannot be imported.
        InvalidValueError: an invalid setting, or None for one, or a label that cannot be part of a file's name.
    """

    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    label: str = ""
    code: str = ""
    folder: Path | None = field(default=None, compare=False)

    @property
    def own(self) -> OwnCode | None:
        """The code of one's own that makes it; None for a named strategy."""
        if not self.code:
            return None
        return OwnCode(self.name if ":" in self.name else "", self.folder, self.code)

    def __post_init__(self) -> None:
        if not isinstance(self.settings, Mapping):
            raise InvalidValueError(
                "settings are a mapping of names to values", got=self.settings, expected="such as {'particles': 500}"
            )
        if isinstance(self.name, str) and ":" in self.name:
            object.__setattr__(self, "code", OwnCode.named(self.name, self.folder, self.settings).checksum)
            object.__setattr__(self, "label", self.label or self.name.partition(":")[2])
        elif self.name != OWN:
            object.__setattr__(self, "code", "")
        if not self.code:
            self._check_settings()
        object.__setattr__(self, "label", self.label or self.name)
        if not re.fullmatch(r"[\w.+-]+", text("label", self.label)):
            raise InvalidValueError(
                "a label is part of a file's name", got=self.label, expected="letters, digits, and any of _ . + -"
            )

    def _check_settings(self) -> None:
        chosen = settings_values(settings_for(self.name, **self.settings))
        if unset := [key for key in self.settings if key not in chosen]:  # what a rig states could take its place
            raise InvalidValueError(
                "a setting of a study's strategy has no value",
                got=f"None for {', '.join(unset)}",
                remedy="Leave it out. To tell strategies no hit delay, use Study(hit_delay='unstated').",
            )
        kept = {key: chosen[key] for key in self.settings}
        object.__setattr__(self, "settings", kept)


@dataclass(frozen=True)
class Unit:
    """A unit of work that is run and kept as a whole: one session, or one batch of people.

    Args:
        key: its name in the study; the same whenever and wherever it runs.
        sessions: one a person.
        engine: what runs them.
    """

    key: str
    sessions: tuple[SimulatedSession, ...]
    engine: Engine = "single"


def run_unit(unit: Unit) -> pd.DataFrame:
    """The rows of a unit, with the :doc:`columns </studies>` of a study, its key and one's own code's checksum too."""
    rows = simulate_batch(unit.sessions) if unit.engine == "batched" else simulate(*unit.sessions)
    own = unit.sessions[0].own
    return rows.assign(unit=unit.key, code="" if own is None else own.checksum)


@dataclass(frozen=True)
class Study(Checked):
    """A study.

    Args:
        strategies: what is compared; a name is the strategy as it comes.
        cohorts: named cohorts.
        people: how many people of each.
        seed: seed of the people, their trial noise and the strategies; 0–999 are for development.
        trials: how many trials a session has at most.
        marks: after which trials the estimate is recorded, 0 being before any; by default each fifth and the last.
            Trials that were learnt count, no mistrials.
        space: the design space; `"valve"` and `"impact"` are those of all benchmarks.
        stopping: whether a strategy's stopping rule is `"ignored"`, or it is `"noted"` when it fires (an estimate
            after each trial), or `"ends"` the session.
        engine: `"single"`, one session at a time, or `"batched"`, people side by side.
        batch: how many people side by side.
        amplitude: factor on all amplitudes of the people.
        hit_delay: strategies that can use it get the hit delay as the rig states it (`"stated"`), or `"unstated"`.
        intensity: the same of the intensity, as the visit states it.

    Raises:
        InvalidValueError: an invalid number or choice, a label given twice, or no name of a cohort or strategy.
    """

    strategies: tuple[StudyStrategy, ...]
    cohorts: tuple[str, ...]
    people: Annotated[int, partial(whole, least=1, most=_MOST_SESSIONS)] = 20
    seed: Annotated[int, partial(whole, least=0, most=_MOST_SEED)] = 0
    trials: Annotated[int, partial(whole, least=1, most=_MOST_TRIALS)] = 40
    marks: tuple[int, ...] = ()
    space: DesignSpace = VALVE_SPACE
    stopping: Stopping = "noted"
    engine: Engine = "single"
    batch: Annotated[int, partial(whole, least=1, most=_MOST_SESSIONS)] = 50
    amplitude: Positive = 1.0
    hit_delay: Stated = "unstated"
    intensity: Stated = "unstated"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "strategies", tuple(map(_named, _several(self.strategies))))
        object.__setattr__(self, "cohorts", _several(self.cohorts))
        object.__setattr__(self, "marks", tuple(whole("a mark", mark, least=0) for mark in _several(self.marks)))
        if not self.marks:
            object.__setattr__(self, "marks", (*range(5, self.trials, 5), self.trials))
        if isinstance(self.space, str) and self.space in _SPACES:
            object.__setattr__(self, "space", _SPACES[self.space])
        require_space(self.space)
        if list(self.marks) != sorted(set(self.marks)) or not 0 <= self.marks[0] <= self.marks[-1] <= self.trials:
            raise InvalidValueError("marks ascend from 0 to the number of trials", got=self.marks)
        require_cohorts(self.cohorts)
        labels = [strategy.label for strategy in self.strategies]
        if not all(names and len(set(names)) == len(names) for names in (labels, self.cohorts)):
            raise InvalidValueError(
                "a study needs strategies and cohorts, each once",
                got=(labels, list(self.cohorts)),
                remedy="Give the same strategy with other settings another label.",
            )

        if (sessions := self.people * len(self.cohorts) * len(labels)) > _MOST_SESSIONS:
            raise InvalidValueError("a study has too many sessions", got=sessions, expected=f"at most {_MOST_SESSIONS}")

    def units(self) -> list[Unit]:
        """All of its work; the first people of each strategy and cohort come first, so that all grow together."""
        size = self.batch if self.engine == "batched" else 1
        units = []
        for first, cohort, strategy in product(range(0, self.people, size), self.cohorts, self.strategies):
            people = range(first, min(first + size, self.people))
            sessions = [self._session(strategy, cohort, person) for person in people]
            settings = [repr(session.settings) for session in sessions]  # those of equal ones come side by side
            for own in sorted(set(settings)):
                alike = (session for session, theirs in zip(sessions, settings, strict=True) if theirs == own)
                units.append(self._unit(tuple(alike)))
        return units

    def _session(self, strategy: StudyStrategy, cohort: str, person: int) -> SimulatedSession:
        session = SimulatedSession(
            strategy.name,
            cohort,
            person,
            self.seed,
            self.trials,
            self.marks,
            self.space,
            settings=tuple(strategy.settings.items()),
            label=strategy.label,
            stopping=self.stopping,
            amplitude=self.amplitude,
            own=strategy.own,
        )
        session = session if self.hit_delay == "unstated" else session.as_the_rig_states()
        return session if self.intensity == "unstated" else session.as_the_visit_states()

    def _unit(self, sessions: tuple[SimulatedSession, ...]) -> Unit:
        first, last = sessions[0], f"-{sessions[-1].person:05d}" if self.engine == "batched" else ""
        return Unit(f"{first.label}.{first.cohort}.{first.person:05d}{last}", sessions, self.engine)


def load_study(path: str | Path) -> Study:
    """Read a study from a TOML file; that of a folder of results will do, too, but names no code.

    Args:
        path: the file, or such a folder.

    Raises:
        ConfigError: it cannot be read, or has an unknown key or a bad value; the message names file, key and value.
    """
    whole = Path(path).is_dir()
    path = Path(path) / "study.toml" if whole else path
    values = read_toml(path)
    if whole or _OF_THE_FOLDER & values.keys():
        return begun_study(values, str(path))
    return study_from(values, str(path), Path(path).resolve().parent)


def begun_study(values: Mapping[str, Any], source: str) -> Study:
    """The study of a folder of results; a table of its space without a reference once counted from the impact."""
    plain = {key: value for key, value in values.items() if key not in _OF_THE_FOLDER}
    if isinstance(plain.get("space"), dict):
        plain["space"] = {"reference": "impact", **plain["space"]}
    return study_from(plain, source)


def _several(values: Any) -> tuple[Any, ...]:
    return tuple(values) if isinstance(values, Iterable) and not isinstance(values, str) else (values,)


def _named(strategy: Any) -> StudyStrategy:
    """A strategy of a study, which may be its name alone."""
    if isinstance(strategy, StudyStrategy):
        return strategy
    if isinstance(strategy, str):
        return StudyStrategy(strategy)
    raise InvalidValueError(
        "a study knows strategies by their names",
        got=type(strategy).__name__,
        expected="a name, or a StudyStrategy",
        remedy=OWN_STRATEGY,
    )


def study_from(values: Mapping[str, Any], source: str, folder: Path | None = None) -> Study:
    """A study from TOML values, in which a strategy may be its name alone, and a space `"valve"` or `"impact"`."""
    plain = dict(values)
    if isinstance(plain.get("strategies"), list):
        plain["strategies"] = [_strategy_values(strategy, source, folder) for strategy in plain["strategies"]]
    if isinstance(plain.get("space"), str):
        if plain["space"] not in _SPACES:
            names = ", ".join(f'"{name}"' for name in _SPACES)
            what = f"{source}: the value of space cannot be used"
            raise ConfigError(what, got=plain["space"], expected=f"{names} or a table of keys and values")
        plain["space"] = _SPACES[plain["space"]]
    return checked(Study, plain, source)


def _strategy_values(strategy: Any, source: str, folder: Path | None) -> Any:
    values = {"name": strategy} if isinstance(strategy, str) else strategy
    if not isinstance(values, Mapping) or ":" not in str(values.get("name", "")):
        return values
    if folder is None:
        raise ConfigError(
            f"{source}: the folder of a study names no code",
            got=values["name"],
            remedy="Run the STUDY.toml of your own that names it.",
        )
    return {**values, "folder": folder}


def study_values(study: Study) -> dict[str, Any]:
    """A study as TOML values, for its folder: code of one's own by its checksum alone."""
    values = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(study).items()}
    values["strategies"] = [
        {"name": OWN if one["code"] else one["name"], "settings": one["settings"], "label": one["label"]}
        | ({"code": one["code"]} if one["code"] else {})
        for one in values["strategies"]
    ]
    return values
