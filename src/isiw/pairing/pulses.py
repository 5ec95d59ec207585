"""What an intervention delivered: pulses of TMS alone before and after it, and its pairs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from isiw import schedule
from isiw.checks import Amplitude, Checked, Number, Positive, Text
from isiw.intervention import Arm, Plan
from isiw.log.kinds import LogKind, kind_of, of_another_kind
from isiw.log.record import SessionRecord
from isiw.schedule import Part
from isiw.types import FloatArray

USUAL_PCT_RMT: Final = 110.0
"""The intensity of a visit that nobody has stated [% RMT]."""


@dataclass(frozen=True)
class TestPulse(Checked):
    """A pulse of TMS alone that measures excitability before or after an intervention.

    Args:
        mep_mv: peak-to-peak amplitude [mV]; 0 where there is no MEP.
        intensity_pct_rmt: its intensity, as given [% RMT].
        after_last_pair_s: time since the last pair was delivered [s]; negative before the intervention.
        block: its block: "before", "after 0 min", "after 15 min".

    Raises:
        InvalidValueError: an amplitude below 0, or a value that is not finite.
    """

    __test__ = False  # for pytest, which takes the name for that of a test

    mep_mv: Amplitude
    intensity_pct_rmt: Positive
    after_last_pair_s: Number
    block: Text


def meps_mv(pulses: Iterable[TestPulse], pct_rmt: float) -> FloatArray:
    """The amplitudes of the pulses of one intensity [mV], in their order."""
    return np.array([pulse.mep_mv for pulse in pulses if pulse.intensity_pct_rmt == pct_rmt])


@dataclass(frozen=True)
class Delivered(Checked):
    """A pair of the intervention.

    Args:
        isi_ms: its ISI [ms].
        at_s: when it was delivered, since the first pair [s].
        mep_mv: peak-to-peak amplitude [mV]; None if it was lost.
        probe: whether it was a probe of the window, and no pair at the best ISI.

    Raises:
        InvalidValueError: a value that is not finite, or an amplitude below 0.
    """

    isi_ms: Number
    at_s: Number
    mep_mv: Amplitude | None
    probe: bool


class Pairing(NamedTuple):
    """What an intervention delivered, and its plan.

    `tests` are in the order of delivery, those that count; `pairs` are all pairs of its arm, none where there were taps
    or pulses alone.
    """

    tests: tuple[TestPulse, ...]
    pairs: tuple[Delivered, ...]
    plan: Plan


def pairing_of(record: SessionRecord) -> Pairing:
    """What the log of an intervention says was delivered; times are right across restarts and a clock that was set.

    Args:
        record: the log; its arm may still be concealed, so show nobody the pairs of one that is.

    Raises:
        LogError: the log is of no intervention.
    """
    intervention = record.header.intervention
    if intervention is None:
        raise of_another_kind(record.path, kind_of(record.header), LogKind.INTERVENTION)
    plan, onsets = intervention.plan, record.onsets
    planned = schedule.slots(plan)
    slots = {trial.index: planned[trial.index] for trial in record.table if trial.index < len(planned)}
    given = [number for number, slot in slots.items() if slot.part is Part.PAIRS and number in onsets]
    first_s = onsets[given[0]].onset_s if given else 0.0
    last_s = onsets[given[-1]].onset_s if given else max((onset.onset_s for onset in onsets.values()), default=0.0)
    usual_pct, begun = _usual_pct(record), _begun(record, plan)
    tests, pairs = [], []
    for trial in record.table:
        slot, onset = slots.get(trial.index), onsets.get(trial.index)
        if slot is None or onset is None:
            continue
        if slot.part is Part.PAIRS:
            if trial.wanted_isi_ms is not None and not trial.tap_alone:
                mep_mv = trial.mep_mv if trial.counts else None
                at_s = onset.onset_s - first_s
                probe = intervention.arm is Arm.WINDOW and schedule.is_probe(plan, slot, record.header.seed)
                pairs.append(Delivered(trial.wanted_isi_ms, at_s, mep_mv, probe))
        elif trial.told and trial.mep_mv is not None:
            pct = slot.intensity_pct_rmt or usual_pct
            first, since_s = begun.get(slot.name, (trial.index, onset.onset_s - last_s))
            tests.append(TestPulse(trial.mep_mv, pct, since_s + onset.onset_s - onsets[first].onset_s, slot.name))
    return Pairing(tuple(tests), tuple(pairs), plan)


def _begun(record: SessionRecord, plan: Plan) -> dict[str, tuple[int, float]]:
    """The first trial of each block after the pairs, and its time since the last pair [s] as it was measured."""
    begun = {}
    for event in record.events:
        number = -1 if event.trial is None else event.trial + 1
        if event.kind == "block" and event.late_s is not None and number in record.onsets:
            slot = schedule.slots(plan)[number]
            begun[slot.name] = number, (slot.due_s or 0.0) + event.late_s
    return begun


def _usual_pct(record: SessionRecord) -> float:
    """The intensity of the visit [% RMT], as it is stated or the strategy assumes it."""
    stated = record.header.visit.intensity_pct_rmt or record.header.strategy.settings.get("intensity_pct_rmt")
    return float(stated or USUAL_PCT_RMT)
