"""Which stimulus comes when, by the protocol of a visit or the plan of an intervention.

What is random depends on the seed and the trial's number alone, so that a resumed session goes on as planned.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from fractions import Fraction
from functools import cache

import numpy as np

from isiw.intervention import Plan
from isiw.visit import Control, VisitProtocol, exact_share

_ITI_DRAWS, _CONTROL_DRAWS = 1, 2
"""What is drawn, so that the two never share their draws."""


def rests_before(protocol: VisitProtocol, trial: int) -> bool:
    """True if a rest comes before this trial."""
    return protocol.block_trials is not None and trial > 0 and trial % protocol.block_trials == 0


def interval_s(protocol: VisitProtocol, trial: int, seed: int) -> float:
    """Shortest interval between the trial before and this one [s].

    Args:
        protocol: the visit's.
        trial: its number.
        seed: the session's.
    """
    rest_s = protocol.rest_s if rests_before(protocol, trial) else 0.0
    if protocol.iti_s is None:
        return rest_s
    return max(rest_s, float(_draws(seed, trial, _ITI_DRAWS).uniform(*protocol.iti_s)))


def stimuli_for(protocol: VisitProtocol, pairs: int) -> int:
    """The number of stimuli that so many pairs take at most, their control trials among them."""
    return math.ceil((pairs + 1) / (1 - protocol.control_share)) if protocol.control_share else pairs


def control(protocol: VisitProtocol, trial: int, seed: int) -> Control | None:
    """Which control trial this is; None for a pair of stimuli.

    The trials are cut into stretches with one control each, at a random place, so that controls are spread over the
    session and nobody can predict them. Their kinds alternate as their shares say.

    Args:
        protocol: the visit's.
        trial: its number.
        seed: the session's.
    """
    share = protocol.control_share
    if not share:
        return None
    stretch = math.floor(trial * share)
    first, behind = (math.ceil(number / share) for number in (stretch, stretch + 1))
    if trial != _draws(seed, stretch, _CONTROL_DRAWS).integers(first, behind):
        return None
    before, after = (
        math.floor(number * exact_share(protocol.tms_alone) / share + Fraction(1, 2))
        for number in (stretch, stretch + 1)
    )
    return Control.TMS_ALONE if after > before else Control.TAP_ALONE


def _draws(seed: int, number: int, kind: int) -> np.random.Generator:
    return np.random.default_rng([abs(seed), number, kind])


class Part(StrEnum):
    """The parts of an intervention, in their order."""

    BEFORE = "before"
    PAIRS = "pairs"
    AFTER = "after"


@dataclass(frozen=True)
class Slot:
    """The place of one stimulus in a plan.

    Args:
        number: the number of its trial, from 0.
        part: the part of the plan.
        block: the number of its block within the part, from 0.
        place: its number within the part, from 0.
        first: whether a block begins with it.
        last: whether a block ends with it.
        intensity_pct_rmt: intensity of a pulse of TMS alone [% RMT]; None for that of the visit.
        due_s: when its block is due, after the last pair [s]; None before that.
    """

    number: int
    part: Part
    block: int
    place: int
    first: bool
    last: bool
    intensity_pct_rmt: float | None = None
    due_s: float | None = None

    @property
    def name(self) -> str:
        """The name of its block."""
        return f"after {self.due_s / 60:g} min" if self.due_s is not None else str(self.part)


@cache
def slots(plan: Plan) -> tuple[Slot, ...]:
    """The places of all stimuli, in order."""
    parts = [Slot(0, Part.BEFORE, *rest) for rest in _tests(plan, plan.before)]
    for place in range(plan.pairs):
        block, within = divmod(place, plan.block_pairs)
        last = within == plan.block_pairs - 1 or place == plan.pairs - 1
        parts.append(Slot(0, Part.PAIRS, block, place, within == 0, last))
    for block, minutes in enumerate(plan.after_min):
        parts += [
            Slot(0, Part.AFTER, block, place, first, last, intensity, 60.0 * minutes)
            for _, place, first, last, intensity in _tests(plan, plan.after)
        ]
    return tuple(replace(slot, number=number) for number, slot in enumerate(parts))


def _tests(plan: Plan, each: int) -> Iterator[tuple[int, int, bool, bool, float | None]]:
    """Block, place, whether first and last, and intensity of each pulse of a block."""
    all_of_them = [intensity for intensity in plan.tests for _ in range(each)]
    for place, intensity in enumerate(all_of_them):
        yield 0, place, place == 0, place == len(all_of_them) - 1, intensity


def is_probe(plan: Plan, slot: Slot, seed: int) -> bool:
    """True if a pair is one that watches the window: one at a random place in each stretch of them."""
    probes = VisitProtocol(tms_alone=plan.probes)
    return slot.part is Part.PAIRS and control(probes, slot.place, seed) is not None


def slot_interval_s(plan: Plan, slot: Slot, seed: int) -> float:
    """Shortest interval between the stimulus before and this one [s]."""
    ends_s = plan.iti_s if slot.part is Part.PAIRS else plan.test_iti_s
    drawn_s = interval_s(VisitProtocol(iti_s=ends_s), slot.number, seed)
    return max(drawn_s, plan.rest_s) if rests_before_slot(slot) else drawn_s


def rests_before_slot(slot: Slot) -> bool:
    """True if a rest comes before a stimulus: between two blocks of pairs."""
    return slot.part is Part.PAIRS and slot.first and slot.block > 0
