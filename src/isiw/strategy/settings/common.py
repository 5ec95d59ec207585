"""The settings of a named strategy: the fields of its model, its asking and its stopping, each under a key of its own.

The keys are the fields' names, so that no setting is written down twice. A field with `metadata={"spread": True}` gives
its own fields keys in its place; what a rig or a lab knows, `KNOWN`, has short keys.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from functools import cache, partial
from numbers import Integral
from typing import Annotated, Any, Final, Protocol, TypeAlias, get_args, get_origin, get_type_hints

import docstring_parser
import numpy as np

from isiw.acquisition.protocol import AcquisitionFunction
from isiw.acquisition.registry import ACQUISITIONS, acquisition_named
from isiw.checks import MOST_OF_A_KIND, Checked, Count, Flag, Natural, Numbers, Positive, Share, choice, share, whole
from isiw.design import DesignSpace
from isiw.errors import ConfigError, StrategyError, did_you_mean
from isiw.models.protocol import ResponseModel
from isiw.strategy.decisions import StoppingRule
from isiw.strategy.stopping import AnyOf, Budget, CredibleWidth, ExpectedF1, NoWindow, SmallGain
from isiw.text.toml_files import checked

KNOWN: Final = {
    "hit_delay_ms": (
        ("model", "prior", "profile", "start", "hit_delay_ms"),
        ("model", "prior", "start", "hit_delay_ms"),
        ("model", "process", "windows", "start", "hit_delay_ms"),
    ),
    "muscle": (("model", "prior", "muscle"),),
    "intensity_pct_rmt": (("model", "prior", "intensity_pct_rmt"),),
    "conditioning": (("model", "prior", "profile", "conditioning"),),
}
"""Short keys of what is known of the rig and the person; they stand for fields deep in a model's prior."""


class AskingPart(Protocol):
    """The choice of ISIs: the second part of a strategy's settings."""

    def function(self, seed: int) -> AcquisitionFunction:
        """The acquisition function."""

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:
        """The ISIs to ask for first [ms]."""


class StoppingPart(Protocol):
    """When to stop: the third part of a strategy's settings."""

    def rule(self, initial: int) -> StoppingRule:
        """The stopping rule, after so many initial trials."""


@dataclass(frozen=True)
class Settings:
    """Settings of a strategy: three parts, frozen dataclasses whose fields are TOML values."""

    model: ResponseModel
    asking: AskingPart
    stopping: StoppingPart


AcquisitionName: TypeAlias = Annotated[str, lambda _, name: choice("the acquisition function", name, ACQUISITIONS)]


@dataclass(frozen=True)
class Choosing(Checked):
    """The choice of ISIs by a strategy with a posterior of the window.

    Args:
        acquisition: what chooses the next ISI, one of `isiw.acquisition.registry.ACQUISITIONS`.
        initial_trials: how many evenly spaced ISIs to ask for first.
        intensities_pct_rmt: the intensities that pairs may have, if they are to have several [% RMT].
        chooses_intensity: whether the acquisition function chooses among them; else pairs have them in turn.

    Raises:
        InvalidValueError: an unknown acquisition function, or an invalid number.
    """

    acquisition: AcquisitionName = "alternating"
    initial_trials: Natural = 0
    intensities_pct_rmt: Numbers = ()
    chooses_intensity: Flag = False

    def function(self, seed: int) -> AcquisitionFunction:
        """The acquisition function."""
        return acquisition_named(self.acquisition, seed)

    def initial_ms(self, space: DesignSpace) -> tuple[float, ...]:
        """The middles of equal parts of the range [ms]."""
        part_ms = (space.high_ms - space.low_ms) / max(1, self.initial_trials)
        return tuple(space.low_ms + (part + 0.5) * part_ms for part in range(self.initial_trials))


@dataclass(frozen=True)
class Stopping(Checked):
    """When a strategy with a posterior of the window stops.

    Args:
        max_trials: stop after this many stimuli; mistrials count, control trials do not.
        stop_width_ms: stop when a window is 90 % probable and the 90 % credible intervals of both edges are at most
            this wide [ms], under every kind of noise that is still probable if the model weighs more than one.
        stop_expected_f1: stop when the expected F1 of the reported window is at least this; never at 1.
        stop_gain: from 35 pairs on, or fewer by .3 for each pulse over the recruitment curve given first, stop when a
            window is probable (.97), and the last ten stimuli added less than this to the expected F1; never at 0.
        stop_no_window: stop when "there is no window" is at least this probable.
    """

    max_trials: Count = 60
    stop_width_ms: Positive = 30.0
    stop_expected_f1: Share = 0.92
    stop_gain: Share = 0.02
    stop_no_window: Annotated[float, partial(share, above=0, most=1)] = 0.95

    def rule(self, initial: int) -> StoppingRule:  # noqa: ARG002 - the budget counts from the first stimulus
        """Known well enough, nothing left to gain, no window, or the budget used up."""
        known = CredibleWidth(self.stop_width_ms), ExpectedF1(self.stop_expected_f1), SmallGain(self.stop_gain)
        return AnyOf((*known, NoWindow(self.stop_no_window), Budget(self.max_trials)))


@dataclass(frozen=True)
class Setting:
    """One thing that can be set: the fields that lead to it from the settings on, the last one's class, its type."""

    path: tuple[str, ...]
    owner: type
    kind: Any
    value: Any


def settings_keys(settings: Settings) -> dict[str, Setting]:
    """The settings of a strategy, by key."""
    parts = ((part.name, getattr(settings, part.name)) for part in fields(settings))
    keys = {setting.path[-1]: setting for name, part in parts for setting in _settings_of(part, (name,))}
    known = ((key, _setting_at(settings, path)) for key, paths in KNOWN.items() for path in paths)
    return keys | {key: setting for key, setting in known if setting is not None}


def _setting_at(owner: Any, path: tuple[str, ...]) -> Setting | None:
    """The field at the end of a path; None if there is none."""
    for name in path[:-1]:
        owner = getattr(owner, name, None)
    if owner is None or not hasattr(owner, path[-1]):
        return None
    return Setting(path, type(owner), _hints(type(owner))[path[-1]], getattr(owner, path[-1]))


def _settings_of(part: Any, path: tuple[str, ...]) -> Iterator[Setting]:
    kinds = _hints(type(part))
    for f in fields(part):
        value = getattr(part, f.name)
        if f.metadata.get("spread"):
            yield from _settings_of(value, (*path, f.name))
        else:
            yield Setting((*path, f.name), type(part), kinds[f.name], value)


_hints: Final[Callable[[type], dict[str, Any]]] = cache(get_type_hints)
"""The types of a class's fields, worked out once."""


def settings_values(settings: Settings) -> dict[str, Any]:
    """All settings by key, as TOML values; those of `KNOWN` if they are given."""
    keys = settings_keys(settings).items()
    return {key: as_toml(setting.value) for key, setting in keys if setting.value is not None}  # TOML has no None


def settings_from(usual: Settings, values: Mapping[str, Any], name: str) -> Settings:
    """Settings by key; what is not given is as usual."""
    known = settings_keys(usual)
    for key in values:
        if key not in known:
            raise StrategyError(
                f"the strategy {name!r} has no setting {key!r}",
                expected=", ".join(known),
                remedy=f"{did_you_mean(key, known)} Correct it or remove it.".lstrip(),
            )
    settings = usual
    # What is deep in a part goes into the part that was given.
    for key, value in sorted(values.items(), key=lambda item: len(known[item[0]].path)):
        _require_modest(value, f"the setting {key} of {name}")
        settings = _with(settings, known[key].path, _converted(known[key], value, f"the setting {key} of {name}"))
    return settings


def _require_modest(value: Any, source: str) -> None:
    """Raise if a number of trials, particles or the like would fill the memory before anything else could."""
    if is_dataclass(value) and not isinstance(value, type):
        value = {f.name: getattr(value, f.name) for f in fields(value)}
    if isinstance(value, Mapping):
        for key, inner in value.items():
            _require_modest(inner, f"{source}: {key}")
    elif isinstance(value, Integral) and not isinstance(value, bool):
        whole(source, int(value), most=MOST_OF_A_KIND)


def _with(owner: Any, path: tuple[str, ...], value: Any) -> Any:
    first, *rest = path
    inner = _with(getattr(owner, first), tuple(rest), value) if rest else value
    return replace(owner, **{first: inner})


def _converted(setting: Setting, value: Any, source: str) -> Any:
    """The value as the field's type; nested ones are made from what is given and, for the rest, the default."""
    kinds: tuple[Any, ...] = (setting.kind, *get_args(setting.kind))
    kind = next((k for k in kinds if isinstance(k, type) and is_dataclass(k)), None)
    if kind is not None and is_dataclass(value) and not isinstance(value, kind):
        raise StrategyError(
            f"{source} is of another kind of model",
            got=type(value).__module__,
            expected=kind.__module__,
            remedy="A lab's prior is given as its .joined()." if hasattr(value, "joined") else None,
        )
    taken = (Mapping, *(each for each in kinds if isinstance(each, type)))
    if kind is not None and get_origin(setting.kind) is not tuple and not isinstance(value, taken):
        raise ConfigError(
            f"{source} is neither such an object nor a table",
            got=value,
            expected=f"a {kind.__name__}, or a table of its fields",
            remedy="A lab's prior is read with isiw.priors.load(path).",
        )
    if kind is None or not isinstance(value, Mapping):
        return value.item() if isinstance(value, np.generic) else value
    return checked(kind, value if setting.value is None else _merged(setting.value, value), source)


def _merged(default: Any, given: Mapping[str, Any]) -> dict[str, Any]:
    """The default's fields, nested ones merged, with what is given; of shares, which sum to 1, the others are 0."""
    merged, inner = asdict(default), {f.name: getattr(default, f.name) for f in fields(default)}
    shares = {f.name for f in fields(default) if f.metadata.get("shares")}
    for key, value in given.items():
        nested = isinstance(value, Mapping) and is_dataclass(inner.get(key))
        if nested and key in shares:
            merged[key] = dict.fromkeys(merged[key], 0.0) | dict(value)
        else:
            merged[key] = _merged(inner[key], value) if nested else value
    return merged


def as_toml(value: Any) -> Any:
    """A value as TOML has it: tables, lists, and plain values; what is None is left out."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, Mapping):
        return {key: as_toml(inner) for key, inner in value.items() if inner is not None}
    return [as_toml(inner) for inner in value] if isinstance(value, list | tuple) else value


_UNITS: Final = {"ms": "ms", "ms2": "ms²", "mv": "mV", "uv": "µV", "s": "s", "hz": "Hz"}


@dataclass(frozen=True)
class DescribedSetting:
    """A setting, or a group, whose members' keys follow its own after a dot, or after brackets in a list of tables."""

    key: str
    value: Any
    unit: str
    meaning: str
    group: bool

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the numbers of the value, if it has several."""
        return getattr(self.value, "_fields", ())


def described(settings: Settings) -> tuple[DescribedSetting, ...]:
    """All that can be set about a strategy, groups before their members."""
    return tuple(
        entry
        for key, setting in settings_keys(settings).items()
        for entry in _entries(key, setting.value, _meanings(setting.owner)[key])
    )


def _entries(key: str, value: Any, meaning: str) -> Iterator[DescribedSetting]:
    unit = _UNITS.get(key.rpartition("_")[2], "")
    plain = re.sub(rf"\s*\[{re.escape(unit)}\]", "", meaning) if unit else meaning
    if isinstance(value, tuple) and any(is_dataclass(each) for each in value):
        yield DescribedSetting(key, tuple(asdict(each) for each in value), unit, plain, group=False)
        for name, said in _meanings(type(value[0])).items():
            yield DescribedSetting(f"{key}[].{name}", None, "", said, group=True)
        return
    group = is_dataclass(value)
    yield DescribedSetting(key, None if group else value, unit, plain, group)
    if group:
        meanings = _meanings(type(value))
        for f in fields(value):
            yield from _entries(f"{key}.{f.name}", getattr(value, f.name), meanings[f.name])


def _meanings(owner: type) -> dict[str, str]:
    """The description of each argument in the docstring of a class, on one line."""
    documented = docstring_parser.parse(owner.__doc__ or "").params
    return {param.arg_name: " ".join((param.description or "").split()) for param in documented}
