"""The course of a window that was followed: what was known of it at each pair of an intervention."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from isiw import schedule
from isiw.pairing.agenda import Agenda
from isiw.schedule import Part
from isiw.trials import Trial


class FollowedPair(NamedTuple):
    """A pair, and what was known of the window when it was asked for."""

    number: int
    """Its number among the pairs, from 1 on."""
    block: int
    isi_ms: float
    probe: bool
    best_ms: float
    """The ISI of the largest enhancement: its median [ms], and the ends of its 90 % interval."""
    low_ms: float
    high_ms: float
    p_inside: float
    """The probability that the pair was inside the window."""


def course_of(agenda: Agenda, trials: Iterable[Trial], seed: int) -> tuple[FollowedPair, ...]:
    """What was known at each pair that was delivered, from all trials of the intervention so far."""
    before: list[Trial] = []
    pairs = []
    for trial in trials:
        slot = agenda.slot(trial.index)
        if slot is not None and slot.part is Part.PAIRS and trial.wanted_isi_ms is not None:
            followed = agenda.followed(before)
            inside = float(np.interp(trial.wanted_isi_ms, followed.isi_ms, followed.p_inside))
            probe = schedule.is_probe(agenda.plan, slot, seed)
            at = slot.place + 1, slot.block, trial.wanted_isi_ms, probe
            pairs.append(FollowedPair(*at, *followed.best_ms(), inside))
        before.append(trial)
    return tuple(pairs)
