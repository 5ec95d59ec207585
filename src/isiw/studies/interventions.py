"""Simulated interventions: what pairs do to a simulated person, and what TMS alone shows of it.

So one can ask what wrong ISIs, a window that moves, or too few pulses do to an intervention.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from isiw.checks import Checked, Count, NonNegative, Positive, whole
from isiw.errors import InvalidValueError
from isiw.pairing.pulses import Delivered, TestPulse
from isiw.subjects.responses import RecruitmentResponse
from isiw.subjects.subject import Responder, SimulatedSubject
from isiw.types import Reference

_MINUTE_S: Final = 60.0


@dataclass(frozen=True)
class InterventionPlan(Checked):
    """How many pulses there are before, between and after, and when.

    Args:
        before: pulses of TMS alone before the first pair.
        pairs: how many pairs.
        after: pulses of TMS alone in each block after the last pair.
        after_min: when each of these blocks begins [min from the last pair].
        tests_pct_rmt: intensities of TMS alone [% RMT], which take turns.
        test_iti_s: time between pulses of TMS alone [s].
        pair_iti_s: time between pairs [s].
    """

    before: Count = 30
    pairs: Count = 150
    after: Count = 20
    after_min: tuple[float, ...] = (0.0, 15.0, 30.0, 60.0)
    tests_pct_rmt: tuple[float, ...] = (120.0,)
    test_iti_s: Positive = 5.0
    pair_iti_s: NonNegative = 10.0


@dataclass(frozen=True)
class Intervened:
    """A simulated intervention.

    Args:
        pulses: of TMS alone, in the order of delivery.
        delivered: the pairs.
        inside: share of the pairs that were inside the window at the time.
        changes: by which factor the gain had really changed in each block after it, on average.
    """

    pulses: tuple[TestPulse, ...]
    delivered: tuple[Delivered, ...]
    inside: float
    changes: tuple[float, ...]

    @property
    def change(self) -> float:
        """The mean of these changes, of their logarithms."""
        return math.exp(sum(map(math.log, self.changes)) / len(self.changes))


def intervene(
    subject: SimulatedSubject,
    isi_ms: float | Callable[[int], float],
    reference: Reference,
    plan: InterventionPlan | None = None,
    *,
    seed: int = 0,
) -> Intervened:
    """Simulate an intervention in one person.

    Args:
        subject: the person, with a recruitment curve.
        isi_ms: the ISI of all pairs [ms], or of each by its number from 0 on.
        reference: the event that ISIs count from.
        plan: how many pulses, and when.
        seed: of the trial noise, a whole number from 0 on.

    Raises:
        InvalidValueError: a person without a recruitment curve, or an ISI that is not finite.
    """
    if not isinstance(subject.response, RecruitmentResponse):
        raise InvalidValueError(
            "TMS alone evokes nothing in this person, so no change of it can be measured",
            got=type(subject.response).__name__,
            expected=RecruitmentResponse.__name__,
        )
    plan, responder = plan or InterventionPlan(), subject.begin(whole("seed", seed, least=0))
    first_s = -plan.pairs * plan.pair_iti_s - plan.before * plan.test_iti_s
    pulses = _tests(responder, reference, plan, plan.before, first_s, "before")
    delivered, inside = _pairs(responder, isi_ms if callable(isi_ms) else lambda _: isi_ms, reference, plan)
    changes, now_min = [], 0.0
    for at_min in plan.after_min:
        responder.wait(max(0.0, at_min - now_min))
        since = responder.after_effect
        pulses += _tests(responder, reference, plan, plan.after, at_min * _MINUTE_S, f"after {at_min:g} min")
        changes.append(math.exp((since + responder.after_effect) / 2.0))
        now_min = max(now_min, at_min) + plan.after * plan.test_iti_s / _MINUTE_S
    return Intervened(tuple(pulses), tuple(delivered), inside, tuple(changes))


def _tests(
    responder: Responder, reference: Reference, plan: InterventionPlan, number: int, first_s: float, block: str
) -> list[TestPulse]:
    pulses = []
    for place in range(number):
        pct = plan.tests_pct_rmt[place % len(plan.tests_pct_rmt)]
        mep_mv = responder.respond(None, reference, intensity_pct_rmt=pct).mep_mv
        pulses.append(TestPulse(mep_mv, pct, first_s + place * plan.test_iti_s, block))
        responder.wait(plan.test_iti_s / _MINUTE_S)
    return pulses


def _pairs(
    responder: Responder, isi_ms: Callable[[int], float], reference: Reference, plan: InterventionPlan
) -> tuple[Sequence[Delivered], float]:
    delivered, inside = [], 0
    for place in range(plan.pairs):
        wanted_ms = isi_ms(place)
        inside += responder.is_inside(wanted_ms, reference)
        response = responder.respond(wanted_ms, reference)
        delivered.append(Delivered(wanted_ms, place * plan.pair_iti_s, response.mep_mv, probe=False))
        responder.wait(plan.pair_iti_s / _MINUTE_S)
    return delivered, inside / plan.pairs
