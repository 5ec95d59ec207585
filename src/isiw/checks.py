"""Checks of values that come from outside: a number, a whole number, a choice, each written once.

Each returns the value as Python's own type, so that the value that was checked is the one that is kept. A frozen
dataclass that is `Checked` declares its checks: `most: Count`, `cells: Annotated[int, partial(whole, least=2)]`.
pydantic reads it from files and requests by the same checks, so that an error names the key.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import fields
from functools import cache, partial
from numbers import Integral, Real
from types import UnionType
from typing import (
    Annotated,
    Any,
    Generic,
    Literal,
    Protocol,
    TypeAlias,
    TypedDict,
    TypeGuard,
    TypeVar,
    Union,
    Unpack,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from isiw.errors import InvalidValueError, did_you_mean
from isiw.findings import AMPLITUDE_MV, DELAY_MS, INTERVAL_S, SHARE, SMALLEST_MV

_T = TypeVar("_T")

MOST_DELAY_MS = 10_000.0
"""Longer than any stimulus takes [ms]."""

MOST_MEP_MV = 1000.0
"""More than any amplifier of EMG gives [mV]: their inputs take some hundred millivolts to either side at most."""

MOST_TRIALS = 100_000
"""More than any session delivers; a record of a later trial makes no sense."""

MOST_OF_A_KIND = 100_000
"""Of trials, particles, samples or anything else that a setting counts; more would fill the memory."""


class Bounds(TypedDict, total=False):
    """The bounds of a number; those that are left out do not apply."""

    above: float
    least: float
    below: float
    most: float


def number(what: str, value: object, *, remedy: str | None = None, **bounds: Unpack[Bounds]) -> float:
    """A finite number within some bounds."""
    plain = value if type(value) is float else _float(value)
    if not (math.isfinite(plain) and _within(plain, bounds)):
        raise InvalidValueError(f"{what} must be {_described('a finite number', bounds)}", got=value, remedy=remedy)
    return plain


def _float(value: object) -> float:
    """The value as a float; NaN if it is no number, or a whole one that no float can hold."""
    with suppress(OverflowError):
        return float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    return math.nan


def amplitude(what: str, value: object) -> float:
    """The amplitude of an MEP, from 0 to what an amplifier can give [mV]."""
    plain = number(what, value, least=0)
    if plain > MOST_MEP_MV:
        raise InvalidValueError(
            f"{what} is more than any amplifier gives",
            got=value,
            expected=f"an amplitude in mV, at most {MOST_MEP_MV:g}",
            remedy=AMPLITUDE_MV.slip(plain),
        )
    return plain + 0.0  # -0.0, which is equal to it, is shown otherwise


def smallest_amplitude(what: str, value: object) -> float:
    """An amplitude below which none is measured, or none counts as a response [mV]."""
    plain = number(what, value, above=0)
    SMALLEST_MV.require(f"{what} is above most MEPs", plain, f"at most {SMALLEST_MV.most:g} mV", got=value)
    return plain


def amplitude_interval(what: str, ends_mv: object) -> tuple[float, float]:
    """An interval of amplitudes, whose upper end may be infinite [mV]."""
    if isinstance(ends_mv, tuple | list) and len(ends_mv) == 2:
        low_mv, high_mv = ends_mv
        if 0 <= number("an amplitude's lower end [mV]", low_mv) < high_mv:
            return float(low_mv), float(high_mv)
    raise InvalidValueError(
        f"{what} is no interval of amplitudes",
        got=ends_mv,
        expected="two amplitudes in mV that ascend, such as (0, 0.05)",
    )


def patience(what: str, value: object) -> float:
    """How long a device may take, no longer than anybody waits for it [s]."""
    plain_s = number(what, value, above=0)
    too_long = f"{what} is longer than anybody waits for a device"
    INTERVAL_S.require(too_long, plain_s, f"at most {INTERVAL_S.most:g} s", got=value)
    return plain_s


def deadline(what: str, value: object) -> float | None:
    """A time of at least 0 s; None and infinity mean that there is no deadline."""
    return None if value is None or (isinstance(value, Real) and value == math.inf) else number(what, value, least=0)


def whole(what: str, value: object, **bounds: Unpack[Bounds]) -> int:
    """A whole number within some bounds."""
    plain = int(value) if isinstance(value, Integral) and not isinstance(value, bool) else None
    if plain is None or not _within(plain, bounds):
        raise InvalidValueError(f"{what} must be {_described('a whole number', bounds)}", got=value)
    return plain


def mean_and_sd(what: str, value: object) -> tuple[float, float]:
    """The mean and the SD of a delay, both positive [ms]."""
    pair = tuple(value) if isinstance(value, Iterable) and getattr(value, "ndim", 1) != 0 else ()
    if len(pair) != 2:
        raise InvalidValueError(
            f"{what} must be a mean and an SD [ms]", got=value, remedy="Give both, such as (183.1, 6.0)."
        )
    mean, sd = (number(what, each, above=0, most=MOST_DELAY_MS) for each in pair)
    expected = "a mean and an SD in ms, such as (183.1, 6.0)"
    DELAY_MS.require(f"{what} is shorter than any rig's", mean, expected, got=(mean, sd))
    return mean, sd


def text(what: str, value: object) -> str:
    """A text."""
    if not isinstance(value, str):
        remedy = f'Write it in quotes: "{value}".' if isinstance(value, int | float) and abs(value) < 1e15 else None
        raise InvalidValueError(f"{what} must be a text", got=value, remedy=remedy)
    return str(value)


def code(what: str, value: object) -> str:
    """A person's code; spaces around it, which nobody sees, make nobody else of the same person."""
    return text(what, value).strip()


def fields_of(kind: type, value: object) -> dict[str, Any]:
    """The fields of a dataclass, as a value has them that may be of more."""
    return {each.name: getattr(value, each.name) for each in fields(kind)}


def choice(what: str, value: Any, known: Iterable[Any]) -> Any:
    """One of some known values."""
    values = tuple(known)
    if not any(type(value) is type(each) and value == each for each in values):
        remedy = did_you_mean(value, values) or None
        raise InvalidValueError(f"{what} is unknown", got=value, expected=" or ".join(map(str, values)), remedy=remedy)
    return value


def numbers(what: str, values: Any, **bounds: Unpack[Bounds]) -> tuple[float, ...]:
    """A list of numbers; an array without a dimension says that it can be iterated, and is none."""
    if not isinstance(values, Iterable) or isinstance(values, str) or getattr(values, "ndim", 1) == 0:
        raise InvalidValueError(f"{what} must be a list of numbers", got=values)
    return tuple(number(f"each of {what}", value, **bounds) for value in values)


def ascending(what: str, values: object, **bounds: Unpack[Bounds]) -> tuple[float, ...]:
    """Numbers of which each is larger than the one before."""
    plain = numbers(what, values, **bounds)
    if any(later <= earlier for earlier, later in itertools.pairwise(plain)):
        raise InvalidValueError(f"{what} must ascend", got=plain)
    return plain


def share(what: str, value: object, **bounds: Unpack[Bounds]) -> float:
    """A probability or a share; a value in % is refused with that remedy."""
    remedy = SHARE.slip(value) if isinstance(value, int | float) and value <= 100 else None
    return number(what, value, remedy=remedy, **(bounds or {"least": 0.0, "most": 1.0}))


def flag(what: str, value: object) -> bool:
    """True or False; a word such as "false" would count as True."""
    if not isinstance(value, bool | np.bool_):
        remedy = "Write it without quotes: in a configuration true or false."
        raise InvalidValueError(f"{what} must be True or False", got=value, remedy=remedy)
    return bool(value)


Number: TypeAlias = Annotated[float, number]
Patience: TypeAlias = Annotated[float, patience]
Numbers: TypeAlias = Annotated[tuple[float, ...], numbers]
Positive: TypeAlias = Annotated[float, partial(number, above=0)]
NonNegative: TypeAlias = Annotated[float, partial(number, least=0)]
Share: TypeAlias = Annotated[float, share]
Amplitude: TypeAlias = Annotated[float, amplitude]
SmallestAmplitude: TypeAlias = Annotated[float, smallest_amplitude]
AmplitudeInterval: TypeAlias = Annotated[tuple[float, float], amplitude_interval]
MeanAndSd: TypeAlias = Annotated[tuple[float, float], mean_and_sd]
Count: TypeAlias = Annotated[int, partial(whole, least=1)]
Natural: TypeAlias = Annotated[int, partial(whole, least=0)]
Text: TypeAlias = Annotated[str, text]
Code: TypeAlias = Annotated[str, code]
Flag: TypeAlias = Annotated[bool, flag]


def can(value: object, capability: Callable[..., _T]) -> TypeGuard[_T]:
    """True if a value has all that a protocol names: `isinstance`, which works properties out whenever it is asked."""
    return all(hasattr(type(value), name) or hasattr(value, name) for name in _names(capability))


@cache
def _names(capability: Any) -> frozenset[str]:
    bases = (base for base in capability.__mro__ if base not in {object, Protocol, Generic})
    return frozenset(name for base in bases for name in vars(base) if not name.startswith("_"))


class Checked:
    """A frozen dataclass whose fields are checked as their annotations say, and hold plain values."""

    def __post_init__(self) -> None:
        """Check each field that declares a check, or is a `Literal`; None passes if the annotation allows it."""
        for name, what, optional, plain in _declared(type(self)):  # type: ignore[arg-type] # a type has a hash
            value = getattr(self, name)
            if not (optional and value is None):
                object.__setattr__(self, name, plain(what, value))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: type, handler: GetCoreSchemaHandler) -> CoreSchema:
        """What pydantic makes of the dataclass, with the declared checks at its fields, and bounds in JSON schemas."""
        schema: Any = handler(source)
        plain_of = {name: partial(plain, name) for name, _, _, plain in _declared(cls)}  # type: ignore[arg-type]
        for field in schema["schema"]["fields"]:
            if (plain := plain_of.get(field["name"])) is not None:
                field["schema"] = _checking(field["schema"], plain)
        return cast("CoreSchema", schema)


def _checking(schema: Any, plain: partial[object]) -> Any:
    """What pydantic makes of a field, with its check; no number is made of a text."""
    kind = schema["type"]
    if kind in {"default", "nullable"}:
        return schema | {"schema": _checking(schema["schema"], plain)}
    if kind in {"bool", "float", "int"}:
        words = {_JSON_BOUNDS[name]: bound for name, bound in plain.keywords.items() if name in _JSON_BOUNDS}
        schema = schema | {"strict": True, "metadata": {"pydantic_js_updates": words}}
    return core_schema.no_info_after_validator_function(plain, schema)


@cache
def _declared(owner: type) -> tuple[tuple[str, str, bool, Callable[[str, object], object]], ...]:
    declared = []
    for name, hint in get_type_hints(owner, include_extras=True).items():
        kinds = get_args(hint) if get_origin(hint) in {Union, UnionType} else (hint,)
        kind = next(each for each in kinds if each is not type(None))
        plain: Callable[[str, object], object] | None = None
        if get_origin(kind) is Annotated:
            plain = kind.__metadata__[0]
        elif get_origin(kind) is Literal:
            plain = partial(choice, known=get_args(kind))
        if plain is not None:
            declared.append((name, f"{owner.__name__}.{name}", type(None) in kinds, plain))
    return tuple(declared)


def _within(plain: float, bounds: Bounds) -> bool:
    return not bounds or (
        bounds.get("above", -math.inf) < plain < bounds.get("below", math.inf)
        and bounds.get("least", -math.inf) <= plain <= bounds.get("most", math.inf)
    )


_JSON_BOUNDS = {"above": "exclusiveMinimum", "least": "minimum", "below": "exclusiveMaximum", "most": "maximum"}
_WORDS = {"above": "above", "least": "of at least", "below": "below", "most": "of at most"}


def _described(kind: str, bounds: Bounds) -> str:
    if "least" in bounds and "most" in bounds:
        return f"{kind} from {bounds['least']:g} to {bounds['most']:g}"
    said = [f"{word} {bounds[name]:g}" for name, word in _WORDS.items() if name in bounds]  # type: ignore[literal-required]
    return f"{kind} {' and '.join(said)}".strip()
