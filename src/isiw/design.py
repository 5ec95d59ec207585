"""The design space: which ISIs may be asked, and from which event they are counted."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, cast

import numpy as np
from pydantic import GetJsonSchemaHandler
from pydantic_core import CoreSchema

from isiw.checks import Checked, NonNegative, Number, Positive, number, numbers
from isiw.errors import InvalidValueError, OutOfSpaceError
from isiw.text.stimuli import TAP, StimulusWords
from isiw.types import FloatArray, Reference

MOST_ISIS = 10_001
"""Of a design space: a second in steps of 0.1 ms."""

MOST_MS: Final = 60_000.0
"""Of an ISI, before or after its reference: two stimuli a minute from each other are no pair."""

_MOST_LISTED: Final = 12
"""ISIs of a list that are written one by one."""

_UNSAID: Final = cast("Reference", "")
"""No reference; it is the default so that its absence is refused in words, and not as a missing argument."""


@dataclass(frozen=True)
class DesignSpace(Checked):
    """The ISIs that may be asked: a grid from `low_ms` to `high_ms`, both included, or a list; see `of`.

    Args:
        low_ms: first ISI [ms], by default 0.
        high_ms: last ISI [ms], by default 500.
        step_ms: distance between two ISIs [ms], by default 1; the range must hold a whole number of steps.
        reference: the event that an ISI is counted from, the `"impact"` of the hammer or the `"valve"` command; it has
            no default, as the same number is another ISI in the other one.
        tolerance_ms: how far a *realised* ISI may lie beyond the range before it is an error, and from the commanded
            one before it is a mistrial [ms]; by default 10.
        isis_ms: the ISIs of a list [ms], ascending; by default there is a grid. `of` makes the other fields fit.

    Raises:
        InvalidValueError: a bound that is not finite or beyond a minute, an empty range, a step that does not fit, too
            many ISIs, an unknown reference, or none.
    """

    low_ms: Number = 0.0
    high_ms: Number = 500.0
    step_ms: Positive = 1.0
    reference: Reference = _UNSAID
    tolerance_ms: NonNegative = 10.0
    isis_ms: tuple[float, ...] = ()

    @classmethod
    def of(cls, isis_ms: Iterable[float], *, reference: Reference = _UNSAID, tolerance_ms: float = 10.0) -> DesignSpace:
        """The space of a list of ISIs, for stimulators with fixed ones; windows begin and end at one of them.

        Args:
            isis_ms: the ISIs [ms], in any order; at least two.
            reference: the event that an ISI is counted from.
            tolerance_ms: as for a grid [ms].

        Raises:
            InvalidValueError: fewer than two ISIs, one that is not finite or beyond a minute, too many of them, or no
                reference.
        """
        return cls(reference=reference, tolerance_ms=tolerance_ms, **range_of(isis_ms))

    def __post_init__(self) -> None:
        if not self.reference:
            raise missing_reference()
        super().__post_init__()
        if self.high_ms <= self.low_ms:
            raise InvalidValueError(
                "the design space is empty", got=(self.low_ms, self.high_ms), expected="low_ms < high_ms"
            )
        if self.high_ms - self.low_ms < 0.5 * self.step_ms:
            raise InvalidValueError(
                "the design space is narrower than a step",
                got=(self.low_ms, self.high_ms),
                expected=f"a range in ms of at least {self.step_ms:g} ms",
                remedy=f"In seconds? Then low_ms={1e3 * self.low_ms:g}, high_ms={1e3 * self.high_ms:g}.",
            )
        object.__setattr__(self, "isis_ms", tuple(self.isis_ms))
        listed, ends_ms = self.isis_ms, (self.low_ms, self.high_ms, self.step_ms)
        steps = len(listed) - 1 if listed else (self.high_ms - self.low_ms) / self.step_ms
        if steps >= MOST_ISIS:
            raise InvalidValueError(
                "the design space has too many ISIs",
                got=len(listed) or steps,
                expected=f"at most {MOST_ISIS}",
                remedy="Choose a narrower range, or a larger step_ms.",
            )
        far = {name: value for name, value in self._extents_ms.items() if abs(value) > MOST_MS}
        if far:
            raise InvalidValueError(
                "no ISI of a design space is so long",
                got=far,
                expected=f"{-MOST_MS:g} to {MOST_MS:g} ms",
                remedy="In microseconds? Divide by 1000.",
            )
        if listed and (listed != tuple(sorted(set(listed))) or ends_ms != (listed[0], listed[-1], _widest_ms(listed))):
            raise InvalidValueError(
                "the range of a list of ISIs is not that of the list",
                got=(*ends_ms, listed),
                remedy="Make it with DesignSpace.of([10, 15, 20], reference=...).",
            )
        if abs(steps - round(steps)) > 1e-6:
            raise InvalidValueError(
                "the range is not a whole number of steps",
                got=steps,
                remedy="Choose high_ms = low_ms + k * step_ms with a whole k.",
            )

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Its JSON schema, in which the reference has no default."""
        described = handler.resolve_ref_schema(handler(schema))
        described["properties"]["reference"].pop("default")
        return described | {"required": ["reference"]}

    @property
    def _extents_ms(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in ("low_ms", "high_ms", "step_ms", "tolerance_ms")}

    def __str__(self) -> str:
        return self.in_words(TAP)

    def in_words(self, first: StimulusWords) -> str:
        """The ISIs in words, with those for the conditioning stimulus."""
        counted = first.origin(self.reference)
        if self.isis_ms:
            *before, last = (f"{isi_ms:g}" for isi_ms in self.isis_ms)
            shown = [*before[:_MOST_LISTED], "…"] if len(before) > _MOST_LISTED else before
            return f"{', '.join(shown)} and {last} ms after the {counted}"
        return f"{self.low_ms:g}–{self.high_ms:g} ms after the {counted}, every {self.step_ms:g} ms"

    @cached_property
    def grid_ms(self) -> FloatArray:
        """All ISIs that may be asked [ms], shape (t,)."""
        if self.isis_ms:
            grid: FloatArray = np.array(self.isis_ms)
        else:
            grid = self.low_ms + self.step_ms * np.arange(round((self.high_ms - self.low_ms) / self.step_ms) + 1.0)
            grid[-1] = self.high_ms  # rounding may have put it a little beyond, where limits refuse it
        grid.setflags(write=False)
        return grid

    def snap(self, isi_ms: float) -> float:
        """The nearest ISI on the grid [ms].

        Raises:
            InvalidValueError: not a finite number.
        """
        inside = min(max(number("an ISI [ms]", isi_ms), self.low_ms), self.high_ms)
        if self.isis_ms:
            return float(self.grid_ms[np.abs(self.grid_ms - inside).argmin()])
        steps = round((inside - self.low_ms) / self.step_ms)
        return float(self.grid_ms[steps])

    def admits(self, isi_ms: float) -> bool:
        """True if a realised ISI [ms] can have come from this space."""
        return self.low_ms - self.tolerance_ms <= isi_ms <= self.high_ms + self.tolerance_ms

    def check_realised(self, isi_ms: float) -> float:
        """Return a realised ISI [ms] if it can have come from this space.

        Raises:
            InvalidValueError: not a finite number.
            OutOfSpaceError: more than `tolerance_ms` beyond the range.
        """
        realised_ms = number("a realised ISI [ms]", isi_ms)
        if not self.admits(realised_ms):
            raise OutOfSpaceError(
                "the realised ISI is beyond the design space",
                got=isi_ms,
                expected=f"{self.low_ms:g} to {self.high_ms:g} ms, give or take {self.tolerance_ms:g} ms",
                remedy=f"ISIs count from the {self.reference}; check the reference, or log the trial as a mistrial.",
            )
        return realised_ms


def range_of(isis_ms: Iterable[float]) -> dict[str, Any]:
    """The fields of a design space that a list of ISIs [ms] stands for."""
    listed = tuple(sorted({*numbers("the ISIs of the design space [ms]", isis_ms)}))
    if len(listed) < 2:
        raise InvalidValueError("a list of ISIs needs at least two", got=listed)
    return {"low_ms": listed[0], "high_ms": listed[-1], "step_ms": _widest_ms(listed), "isis_ms": listed}


def _widest_ms(listed_ms: tuple[float, ...]) -> float:
    """The largest distance from one ISI of a list to the next [ms]."""
    return max(after - before for before, after in itertools.pairwise(listed_ms))


def missing_reference() -> InvalidValueError:
    """The error to raise if nobody says which event the ISIs of a design space count from."""
    return InvalidValueError(
        "a design space needs its reference, the event that its ISIs count from",
        expected='reference="impact", the impact of the hammer or the electrical pulse, or reference="valve", the '
        "command that opens the valve",
        remedy="Name the one that your rig counts from: the same number of milliseconds is another ISI in the other.",
    )


def require_space(space: object) -> None:
    """Raise if something else is given for a design space."""
    if not isinstance(space, DesignSpace):
        raise InvalidValueError("a design space is needed", got=space, expected="an isiw.DesignSpace")


VALVE_SPACE = DesignSpace(0, 500, reference="valve")
"""500 ms after the valve command: what can be searched without an accelerometer [Kim2020, 4.2]."""

IMPACT_SPACE = DesignSpace(0, 320, reference="impact")
"""From the impact on: what can be searched with an accelerometer [Kim2020, 4.2]."""
