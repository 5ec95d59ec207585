"""The plan of an intervention, which uses a window to change a person: pulses before, pairs, and pulses after.

Every stimulus has its place in the plan by its number, mistrials included, so that a resumed session delivers neither
one more nor one less. The arm is drawn, and sealed: what is logged of it is a digest (docs/decisions/0050).
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, Final

import numpy as np

from isiw.checks import Checked, Count, Flag, NonNegative, Positive, Text, ascending, choice, number, share, whole
from isiw.errors import InvalidValueError
from isiw.findings import require_percent
from isiw.text.sanitize import command
from isiw.visit import Control, interval_ends

LEAST_PAIRS, MOST_PAIRS = 50, 300
"""What a plan may have: fewer pairs change nobody, and more are not foreseen."""

LEAST_INTERVAL_S: Final = 1.0
"""Pulses that come faster are repetitive TMS above 1 Hz, whose trains have limits of their own [Rossi2009]."""

_SEPARATE: Final = ":"


class Arm(StrEnum):
    """What a person gets between the pulses before and those after."""

    WINDOW = "window"
    OUTSIDE = "outside"
    TMS_ALONE = "tms-alone"
    TAP_ALONE = "tap-alone"

    @property
    def words(self) -> str:
        """The arm in words."""
        return _WORDS[self]

    @property
    def control(self) -> Control | None:
        """The control trial that stands in the place of each pair; None where pairs are given."""
        return {Arm.TMS_ALONE: Control.TMS_ALONE, Arm.TAP_ALONE: Control.TAP_ALONE}.get(self)


_WORDS: Final = {
    Arm.WINDOW: "pairs in the window",
    Arm.OUTSIDE: "pairs outside the window",
    Arm.TMS_ALONE: "TMS alone",
    Arm.TAP_ALONE: "taps alone",
}


def _arms(what: str, arms: object) -> tuple[Arm, ...]:
    if not isinstance(arms, tuple | list) or not arms or len(set(arms)) < len(arms):
        raise InvalidValueError(f"{what} must be different arms", got=arms, expected=f"some of {', '.join(Arm)}")
    return tuple(Arm(choice(what, str(arm), [known.value for known in Arm])) for arm in arms)


def _interval_ends(what: str, ends_s: object) -> tuple[float, float]:
    low_s, high_s = interval_ends(what, ends_s)
    if low_s < LEAST_INTERVAL_S:
        raise InvalidValueError(
            f"{what} must be at least {LEAST_INTERVAL_S:g} s",
            got=(low_s, high_s),
            remedy="Faster pulses are repetitive TMS above 1 Hz, for which isiw has no limits.",
        )
    return low_s, high_s


def _range(what: str, ends_ms: object) -> tuple[float, float]:
    if not isinstance(ends_ms, tuple | list) or len(ends_ms) != 2:
        raise InvalidValueError(f"{what} must be the shortest and the longest ISI [ms]", got=ends_ms)
    low_ms, high_ms = (number(what, end) for end in ends_ms)
    if low_ms > high_ms:
        raise InvalidValueError(f"{what} must ascend", got=(low_ms, high_ms))
    return low_ms, high_ms


@dataclass(frozen=True)
class Plan(Checked):
    """The plan of an intervention.

    Args:
        protocol_code: the code of the approved protocol that it follows.
        arms: what may be given; one is drawn for the person.
        before: how many pulses of TMS alone come before, at each intensity.
        intensities_pct_rmt: intensities of the pulses before and after [% RMT], ascending; empty for that of the visit.
            The operator sets each, and the plan waits for that.
        pairs: how many pairs, 50 to 300.
        over_window: whether they spread over the window, and do not all have the ISI of the largest enhancement.
        iti_s: shortest and longest interval between two pairs [s], drawn evenly for each; twice the same is a fixed
            rate.
        block_pairs: a rest follows every block of so many pairs.
        rest_s: how long it lasts [s].
        after_min: when each block of pulses after the pairs is due [min after the last pair], ascending.
        after: how many pulses each of these blocks has, at each intensity.
        test_iti_s: as `iti_s`, of the pulses before and after [s].
        probes: share of the pairs that are chosen to notice that the window moves or the enhancement fades.
        follow_ms: by how much the ISI may follow the window from one block of pairs to the next [ms].
        range_ms: shortest and longest ISI that pairs may have [ms]; None for those of the design space.

    Raises:
        InvalidValueError: no code, a value out of range, or blocks after the pairs that overlap.
    """

    protocol_code: Text
    arms: Annotated[tuple[Arm, ...], _arms] = (Arm.WINDOW,)
    before: Count = 20
    intensities_pct_rmt: Annotated[tuple[float, ...], partial(ascending, above=0)] = ()
    pairs: Annotated[int, partial(whole, least=LEAST_PAIRS, most=MOST_PAIRS)] = 100
    over_window: Flag = False
    iti_s: Annotated[tuple[float, float], _interval_ends] = (5.0, 5.0)
    block_pairs: Count = 25
    rest_s: Positive = 60.0
    after_min: Annotated[tuple[float, ...], partial(ascending, least=0)] = (0.0, 15.0, 30.0, 60.0)
    after: Count = 20
    test_iti_s: Annotated[tuple[float, float], _interval_ends] = (5.0, 7.0)
    probes: Annotated[float, partial(share, least=0, most=0.5)] = 0.1
    follow_ms: NonNegative = 10.0
    range_ms: Annotated[tuple[float, float], _range] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.protocol_code.strip():
            raise InvalidValueError(
                "an intervention needs the code of the protocol that it follows",
                got=self.protocol_code,
                remedy='Write the code of your ethics approval, such as protocol_code = "2026-17".',
            )
        for pct_rmt in self.intensities_pct_rmt:
            require_percent("intensities_pct_rmt", pct_rmt)
        if self.rest_s <= self.iti_s[1]:
            raise InvalidValueError(
                "the rest between two blocks of pairs is no longer than the interval between two pairs",
                got=f"rest_s {self.rest_s:g}, longest interval {self.iti_s[1]:g}",
                expected=f"rest_s above {self.iti_s[1]:g}",
            )

    @property
    def tests(self) -> tuple[float | None, ...]:
        """The intensities of a block before or after [% RMT]; None is that of the visit."""
        return self.intensities_pct_rmt or (None,)

    @property
    def last_pair(self) -> int:
        """The number of the trial of the last pair, from which the clock counts."""
        return self.before * len(self.tests) + self.pairs - 1


@dataclass(frozen=True)
class Intervention(Checked):
    """An intervention as its log has it.

    Args:
        plan: the plan.
        sealed: the digest of the arm that was drawn, as `sealed` makes it.

    Raises:
        InvalidValueError: a digest of none of the plan's arms.
    """

    plan: Plan
    sealed: Text

    def __post_init__(self) -> None:
        super().__post_init__()
        opened(self.sealed, self.plan.arms)

    @classmethod
    def drawn(cls, plan: Plan, subject: str, seed: int | None = None) -> Intervention:
        """An intervention with the arm that a seed draws for a person; without a seed nobody can draw it again.

        Raises:
            InvalidValueError: there are arms to draw by a seed, and the person has no code: all would have one arm.
        """
        if seed is not None and len(plan.arms) > 1 and not subject:
            raise InvalidValueError(
                "a seed draws each person's arm by their code, and this person has none",
                got=f"seed = {seed} under [intervention], and no subject",
                remedy="Write subject under [visit], or leave the seed out: then each arm is drawn by chance.",
            )
        return cls(plan, sealed(drawn_arm(plan.arms, subject, seed)))

    @property
    def arm(self) -> Arm:
        """The arm, for limits, safety and delivery; nothing that an operator sees may be made of it while concealed."""
        return opened(self.sealed, self.plan.arms)

    @property
    def conceals(self) -> bool:
        """True if there was more than one arm to draw, so that nobody is to know which it is."""
        return len(self.plan.arms) > 1

    def hides(self, trial: int) -> bool:
        """True of a trial that would show the arm: one between the pulses before and those after."""
        return self.conceals and self.plan.last_pair - self.plan.pairs < trial <= self.plan.last_pair


def drawn_arm(arms: Sequence[Arm], subject: str, seed: int | None = None) -> Arm:
    """The arm that a seed draws for a person."""
    if seed is None:
        return secrets.choice(tuple(arms))
    digest = hashlib.sha256(f"{seed}{_SEPARATE}{subject}".encode()).digest()
    return tuple(arms)[int(np.random.default_rng(list(digest)).integers(len(arms)))]


def sealed(arm: Arm, salt: str | None = None) -> str:
    """A digest of an arm, with a salt, so that the same arm looks different in each log."""
    salt = secrets.token_hex(16) if salt is None else salt
    return f"{salt}{_SEPARATE}{hashlib.sha256(f'{salt}{_SEPARATE}{arm}'.encode()).hexdigest()}"


def opened(digest: str, arms: Sequence[Arm]) -> Arm:
    """The arm that a digest is of: the one of these that has it."""
    salt = digest.partition(_SEPARATE)[0]
    for arm in arms:
        if sealed(arm, salt) == digest:
            return arm
    raise InvalidValueError("the sealed arm is none of the plan's", got=digest, expected=f"one of {', '.join(arms)}")


def concealed(log: Path) -> str:
    """That the arm of an intervention is concealed, and how it is opened."""
    return f"The arm is concealed. Open it when nobody has to be blind: {command('pair', '--open', log)}"
