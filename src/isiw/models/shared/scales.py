"""Scales: what a standard normal latent stands for."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from typing import Annotated, Any, Final, NamedTuple, TypeAlias, TypeVar

from isiw.errors import InvalidValueError

Number = TypeVar("Number", bound=Any)
"""A number, or an array or a tensor of numbers."""

_MOST_MEDIAN: Final = 1e5
"""In any unit that is used [ms, mV, % RMT, ratios]; no quantity of a person is as large."""

_MOST_LOG_SD: Final = 5.0
"""Of a logarithm: one person in three would have more than 150 times the median, or less than a 150th."""


class Scale(NamedTuple):
    """A latent z stands for the median plus SD z + tail z³, of the logarithm if the quantity is positive."""

    median: float
    sd: float  # of the people who were measured; of the natural logarithm of a positive quantity
    tail: float = 0.0  # the cubic tail, which reaches those whom nobody measured

    @property
    def law(self) -> tuple[float, float]:
        """Mean and SD of the quantity, tail aside."""
        return self.median, self.sd

    @property
    def log_law(self) -> tuple[float, float]:
        """Mean and SD of the natural logarithm of the positive quantity, tail aside."""
        return math.log(self.median), self.sd

    @property
    def log(self) -> Scale:
        """The scale of the natural logarithm of the positive quantity."""
        return Scale(math.log(self.median), self.sd, self.tail)

    def normal(self, z: Number) -> Number:
        """The quantity at some latents, same shape."""
        found: Number = z * self.sd + self.median
        if self.tail:
            found = found + self.tail * z**3
        return found


def scale(what: str, given: object, *, positive: bool = True, tailed: bool = True) -> Scale:
    """A scale, also of a tuple or a list."""
    value = tuple(given) if isinstance(given, tuple | list) else (given,)
    if not _is_scale(value, positive=positive) or (any(value[2:]) and not tailed):
        raise InvalidValueError(
            f"{what} must be a scale",
            got=value,
            expected=f"a median, an SD{', and a cubic tail' if tailed else ''}, of sizes that a person can have",
        )
    return Scale(*map(float, value))


PositiveScale: TypeAlias = Annotated[Scale, scale]
AnyScale: TypeAlias = Annotated[Scale, partial(scale, positive=False)]
PositiveLaw: TypeAlias = Annotated[Scale, partial(scale, tailed=False)]
AnyLaw: TypeAlias = Annotated[Scale, partial(scale, positive=False, tailed=False)]


def _is_scale(value: tuple[object, ...], *, positive: bool) -> bool:
    if not 2 <= len(value) <= 3 or not all(isinstance(x, int | float) and math.isfinite(x) for x in value):
        return False
    median, sd, tail = Scale(*value)  # type: ignore[arg-type] # they are numbers
    if positive:
        return 1 / _MOST_MEDIAN <= median <= _MOST_MEDIAN and 0 < sd <= _MOST_LOG_SD and 0 <= tail <= _MOST_LOG_SD
    return abs(median) <= _MOST_MEDIAN and 0 < sd <= _MOST_MEDIAN and 0 <= tail <= _MOST_MEDIAN


def require_sum_of_one(what: str, shares: Iterable[float]) -> None:
    """Raise if probabilities that exclude each other do not sum to 1."""
    if not math.isclose(total := math.fsum(shares), 1.0, abs_tol=1e-6):
        raise InvalidValueError(f"{what} must sum to 1", got=total)
