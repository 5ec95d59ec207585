"""Configuration files: read and checked.

Every key may be left out. Example:

    seed = 7
    [subject]
    kind = "recorded"
    data = "recordings/uef"
    [strategy]
    settings = { max_trials = 40 }
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Self, get_args

from pydantic import Field, model_validator

from isiw.config.sections import (
    TIMEOUT_S,
    DeviceConfig,
    PlannedIntervention,
    PlannedVisit,
    RobotConfig,
    Section,
    Space,
    StrategyConfig,
    SubjectConfig,
    require_together,
    require_units,
    robot_for,
)
from isiw.design import VALVE_SPACE, DesignSpace, missing_reference
from isiw.devices.limits import USUAL_ITI_S, Limits, PulseLimits
from isiw.errors import ConfigError, did_you_mean
from isiw.session.stated import require_limits, require_protocol, require_visit
from isiw.signals.limits import SignalLimits
from isiw.text.toml_files import checked, read_toml
from isiw.visit import Visit, VisitProtocol

_OPTIONS: Final[Mapping[str, tuple[str, str]]] = {
    "subject": ("subject", "kind"),
    "data": ("subject", "data"),
    "strategy": ("strategy", "name"),
    "day": ("visit", "day"),
    "operator": ("visit", "operator"),
}
"""Sections and keys that options of the command line stand for; any other one is a key itself."""


class RunConfig(Section):
    """The whole configuration of `isiw run`; with a rig of one's own nobody is simulated, and a space is needed.

    Args:
        seed: of the simulated person, the trials and the strategy.
        log: the file of the log; by default a new one in `isiw-sessions`.
        prior: a lab's prior, as `isiw prior learn` writes it.
        after: logs of earlier sessions of the same person, earliest first, and of searches for the threshold just
            before, whose pulses teach the recruitment curve. With the strategy `supra-threshold`, sessions below the
            threshold, in whose window it looks.
        earlier: logs of earlier trials of this visit, or tables (.csv) of pulses of TMS alone with the columns
            `intensity_pct_rmt` and `mep_mv`, which are learnt before the first ISI.
    """

    seed: int = Field(default=0, ge=0, strict=True)
    log: Path | None = None
    prior: Path | None = None
    after: tuple[Path, ...] = ()
    earlier: tuple[Path, ...] = ()
    device: DeviceConfig | None = None
    visit: PlannedVisit = PlannedVisit()
    subject: SubjectConfig = SubjectConfig()
    space: Space = VALVE_SPACE
    strategy: StrategyConfig = StrategyConfig()
    limits: PulseLimits = PulseLimits()
    protocol: VisitProtocol = VisitProtocol()
    signals: SignalLimits = SignalLimits()
    intervention: PlannedIntervention | None = None

    @model_validator(mode="after")
    def _one_person(self) -> Self:
        if self.own_rig and "subject" in self.model_fields_set:
            raise ConfigError(
                "device and subject exclude each other",
                expected="a device of your own, or a simulated subject",
                remedy="To stimulate, remove [subject] and leave out --subject and --data; the person's code is "
                "visit.subject. To simulate, remove [device].",
            )
        if self.robot is not None:
            robot_for(self.robot, self.seed, self.subject, self.space)
        return self

    @property
    def own_rig(self) -> bool:
        """True if the device is the lab's own."""
        return self.device is not None and self.robot is None

    @property
    def robot(self) -> RobotConfig | None:
        """The simulated robot; None if there is none."""
        return None if self.device is None else self.device.robot

    @property
    def space_named(self) -> bool:
        """True if the design space was given."""
        return "space" in self.model_fields_set

    def design(self) -> DesignSpace:
        """The design space of a new session; raise if the event from which a device's ISIs count is not stated."""
        if self.own_rig and not self.space_named:
            missing = missing_reference()
            raise ConfigError(
                "a device of your own needs a section [space]: " + missing.what,
                expected=missing.expected,
                remedy="Add [space] with low_ms, high_ms and the reference that the device counts from.",
            )
        return self.space

    @property
    def timeout_s(self) -> float:
        """Longest time that the device may take for one delivery [s]."""
        return self.device.timeout_s if self.device else TIMEOUT_S

    def with_overrides(self, **said: Any) -> RunConfig:
        """The same, with what was given on the command line; another strategy keeps the settings that were given.

        Args:
            **said: keys of the configuration, or options of the command line that stand for one in a section; None or
                nothing leaves it as it is.
        """
        _require_simulation(said.get("subject"))
        values = {name: getattr(self, name) for name in self.model_fields_set}  # nobody else's are known to be wanted
        for option, value in said.items():
            if value in (None, [], ()):
                continue
            section, key = _OPTIONS.get(option, (None, option))
            if section is None:
                values[key] = value
            else:
                values[section] = _stated(values.get(section)) | {key: value}
        return checked(RunConfig, values, "the command line")


def _stated(section: Section | Visit | dict[str, Any] | None) -> dict[str, Any]:
    """What a section states, by its keys."""
    if isinstance(section, Section):
        return section.model_dump(exclude_unset=True)
    return dict(vars(section)) if isinstance(section, Visit) else section or {}


def _require_simulation(kind: str | None) -> None:
    """Raise if a person's code is where the kind of a simulated person should be."""
    kinds = get_args(SubjectConfig.model_fields["kind"].annotation)
    if kind is not None and kind not in kinds:
        code = f'A person\'s code goes into the configuration: under [visit] write subject = "{kind}".'
        raise ConfigError(
            "the command line: --subject (subject.kind) says how a person is simulated, not who is examined",
            got=kind,
            expected=" or ".join(kinds),
            remedy=did_you_mean(kind, kinds) or code,
        )


def load_config(path: str | Path | None = None) -> RunConfig:
    """Read a configuration file; without one, the defaults.

    Files that it names to be read (a prior, earlier logs, recordings) are looked for from its own folder on; a log is
    written from where the command is given.

    Args:
        path: a TOML file.

    Raises:
        ConfigError: it cannot be read, or has an unknown key or a bad value; the message names file, key and value.
        InvalidValueError: a rest or a period that limits nothing, or an interval in ms.
    """
    if path is None:
        return checked(RunConfig, {}, "the defaults")
    values, folder = read_toml(path), Path(path).resolve().parent
    device = values.get("device")
    if isinstance(device, dict) and "factory" in device:  # a module of the user's own usually lies beside the file
        values["device"] = {"folder": folder} | device
    config = _read_from(folder, checked(RunConfig, values, str(path)))
    require_units(values)
    require_visit(config.visit.noted())
    require_together(values)
    require_limits(limits_for(config))
    require_protocol(config.protocol, config.limits.iti_s)
    return config


def _read_from(folder: Path, config: RunConfig) -> RunConfig:
    """A configuration whose files that are read, but for modules, lie where they do as seen from its own folder."""
    logs = {"after": config.after, "earlier": config.earlier}
    found: dict[str, Any] = {
        key: tuple((folder / log).resolve() for log in named) for key, named in logs.items() if named
    }
    if config.prior is not None:
        found["prior"] = (folder / config.prior).resolve()
    if config.subject.data is not None:
        found["subject"] = config.subject.model_copy(update={"data": (folder / config.subject.data).resolve()})
    return config.model_copy(update=found)


def limits_for(config: RunConfig) -> Limits:
    """The limits of a session: the ISIs of the space, within the section on limits."""
    return config.limits.within(config.space).stated(USUAL_ITI_S)
