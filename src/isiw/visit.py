"""A visit: what is noted about it, and the protocol by which its stimuli follow each other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from functools import lru_cache, partial
from typing import Annotated

from isiw.checks import Checked, Count, Natural, Positive, Text, number, share
from isiw.errors import InvalidValueError
from isiw.findings import INTERVAL_S

_FINEST_SHARE = 1000

MOST_APART_PCT_RMT = 10.0
"""Intensities of one person's visits that are further apart are not the same: MEPs grow, and windows widen, with it."""


class Control(StrEnum):
    """A control trial: one of the two stimuli without the other."""

    TMS_ALONE = "TMS alone"
    TAP_ALONE = "tap alone"


@dataclass(frozen=True)
class Visit(Checked):
    """Notes about a visit, for readers of its log.

    Args:
        day: the number of the person's visit, from 1; None if it is not noted.
        operator: who runs the session, as a code.
        muscle: whose EMG is recorded, such as "FCR".
        intensity_pct_rmt: intensity of the pulse [% of the resting motor threshold]; None if it is not noted.
        intensity_pct_mso: the same [% of the maximum stimulator output]; None if it is not noted.
        electrodes: which, and where they are.
        age_years: the person's age; None, as of the next two, if it is not noted. A lab's prior learns how windows go
            with these three.
        height_cm: the person's height [cm].
        tap_n: strength of the tap, as its peak force [N].

    Raises:
        InvalidValueError: a day below 1, an intensity that is not positive, a note that is no text, or an age, a height
            or a force that nobody has.
    """

    day: Count | None = None
    operator: Text = ""
    muscle: Text = ""
    intensity_pct_rmt: Positive | None = None
    intensity_pct_mso: Positive | None = None
    electrodes: Text = ""
    age_years: Annotated[float, partial(number, least=1, most=120)] | None = None
    height_cm: Annotated[float, partial(number, least=50, most=260)] | None = None
    tap_n: Annotated[float, partial(number, least=0.1, most=1000)] | None = None

    def unlike(self, other: Visit) -> str | None:
        """Why the window of the person's other visit is not this one's, in words; None if nothing noted says so."""
        if muscles := different_muscles((self.muscle, other.muscle)):
            return f"different muscles, {' and '.join(muscles)}"
        own, others = self.intensity_pct_rmt, other.intensity_pct_rmt
        if own is not None and others is not None and abs(own - others) > MOST_APART_PCT_RMT:
            return f"different intensities, {own:g} and {others:g} % of RMT"
        return None


def different_muscles(noted: Iterable[str]) -> list[str]:
    """The muscles that visits note, if these are more than one; else none. Capitals make no difference."""
    muscles = {muscle.strip().casefold(): muscle.strip() for muscle in noted if muscle.strip()}
    return list(muscles.values()) if len(muscles) > 1 else []


def interval_s(what: str, value: object) -> float:
    """An interval between two stimuli, no longer than anybody waits [s]."""
    plain_s = number(what, value, least=0)
    too_long = f"{what} is longer than anybody waits between two stimuli"
    INTERVAL_S.require(too_long, plain_s, f"at most {INTERVAL_S.most:g} s", got=value)
    return plain_s


def interval_ends(what: str, iti_s: object) -> tuple[float, float]:
    """The shortest and the longest interval between two stimuli [s]."""
    if not isinstance(iti_s, tuple | list) or len(iti_s) != 2:
        raise InvalidValueError(f"{what} must be the shortest and the longest interval [s]", got=iti_s)
    low_s, high_s = (interval_s(what, value) for value in iti_s)
    if low_s > high_s:
        raise InvalidValueError(f"{what} must ascend", got=(low_s, high_s))
    return low_s, high_s


@dataclass(frozen=True)
class VisitProtocol(Checked):
    """The schedule of a session's stimuli, within its limits.

    What is random depends on the seed and the trial's number alone, so that a resumed session goes on as planned.

    Args:
        iti_s: shortest and longest interval between two trials [s], drawn evenly for each; None for as soon as the
            limits allow.
        tms_alone: share of trials that are a magnetic pulse without a tap.
        alone_pct_rmt: intensity of TMS alone, such as 100 for a baseline at the threshold, on devices that set it
            [% RMT]; None for the usual one of the pairs.
        tap_alone: share of trials that are a tap without a magnetic pulse; the device must be able to.
        taps_first: how many taps alone follow on the first four trials, to learn what they do to the EMG; on devices
            that deliver them and record it. More follow if a window is found that this could explain. 0 for none.
        block_trials: a rest follows every block of so many trials; None for no rests.
        rest_s: how long a rest lasts [s].

    Raises:
        InvalidValueError: an interval whose ends do not ascend or that is in ms, a share outside 0–1, shares that
            leave no pairs, or a number that is not positive.
    """

    iti_s: Annotated[tuple[float, float], interval_ends] | None = None
    tms_alone: Annotated[float, partial(share, least=0, below=1)] = 0.0
    alone_pct_rmt: Positive | None = None
    tap_alone: Annotated[float, partial(share, least=0, below=1)] = 0.0
    taps_first: Natural = 3
    block_trials: Count | None = None
    rest_s: Positive = 120.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.control_share >= 1:
            raise InvalidValueError(
                "the control trials leave no pairs of stimuli",
                got=(self.tms_alone, self.tap_alone),
                expected="shares of TMS alone and tap alone that are below 1 together",
            )

    @property
    def control_share(self) -> Fraction:
        """The share of control trials."""
        return exact_share(self.tms_alone) + exact_share(self.tap_alone)


@lru_cache(maxsize=16)  # asked for at each of the trials that a session looks ahead to
def exact_share(share: float) -> Fraction:
    """A share as a fraction, so that no stretch gains or loses a trial by rounding."""
    return Fraction(share).limit_denominator(_FINEST_SHARE)
