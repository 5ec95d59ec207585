"""What comes next in an intervention: from its plan, its arm, and what is known of the window; and how that went."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np

from isiw import schedule
from isiw.acquisition.protocol import golden_index
from isiw.decision import StopDecision, StopKind
from isiw.errors import InvalidValueError
from isiw.intervention import Arm, Intervention
from isiw.pairing.following import Followed
from isiw.schedule import Part, Slot
from isiw.strategy.strategy import Strategy
from isiw.trials import Trial
from isiw.types import FloatArray
from isiw.visit import Control
from isiw.window import Window

INSIDE: Final = 0.5
"""An ISI that is in the window with this probability is one of the window."""

OUTSIDE: Final = 0.1
"""An ISI is outside the window if it is in it with no more probability than this."""


class Agenda:
    """The agenda of one intervention. What comes next depends on plan, seed, and the trials before it alone.

    The strategy knows the window from the trials before; the session's seed draws intervals and the places of probes.

    Raises:
        InvalidValueError: no window was found, or the plan's range holds none of its ISIs.
        StrategyError: a strategy whose posterior samples neither profiles nor windows.
    """

    def __init__(self, intervention: Intervention, strategy: Strategy, seed: int) -> None:
        self.plan, self._arm, self._seed = intervention.plan, intervention.arm, seed
        self._slots = schedule.slots(self.plan)
        self._begun = Followed.begin(strategy.posterior, strategy.space, strategy.earlier)
        self._space, self._window = strategy.space, _window_of(strategy)
        allowed = self._begun.isi_ms
        if self.plan.range_ms is not None:
            low_ms, high_ms = self.plan.range_ms
            allowed = allowed[(allowed >= low_ms) & (allowed <= high_ms)]
        self._allowed_ms = allowed
        if Arm.WINDOW in self.plan.arms and self.plan.range_ms is not None and not self._window.mask(allowed).any():
            raise InvalidValueError(
                "the range of the plan holds no ISI of the window",
                got=self.plan.range_ms,
                expected=f"ISIs of the window that was found, {self._window}",
                remedy="Write another range_ms under [intervention], or leave it out.",
            )
        outside = self._begun.isi_ms[self._begun.p_inside <= OUTSIDE]
        self._outside_ms = outside[np.isin(outside, allowed)]  # the range holds for every pair
        if Arm.OUTSIDE in self.plan.arms and not self._outside_ms.size:
            raise InvalidValueError(
                "no ISI of the design space is outside the window, so there are no control pairs",
                got=f"{self._window}",
                expected=f"an ISI with a probability of at most {OUTSIDE:g} to be in it",
                remedy=f'Use a wider [space] or range_ms, or leave "{Arm.OUTSIDE}" out of the arms.',
            )
        self._restart()

    def _restart(self) -> None:
        self._followed = self._begun
        self._learnt: tuple[Trial, ...] = ()
        self._centre_ms = _centre(self._wanted(self._followed))

    def slot(self, number: int) -> Slot | None:
        """The place of a trial in the plan; None behind its end."""
        return self._slots[number] if number < len(self._slots) else None

    def decision(self, delivered: int) -> StopDecision:
        """Whether the plan is over after so many stimuli."""
        if delivered >= len(self._slots):
            return StopKind.PLAN.stop("The plan of the intervention is complete.")
        return StopKind.PLAN.go_on(f"{len(self._slots) - delivered} stimuli of the plan are left.")

    def left(self, delivered: int) -> int:
        """The number of stimuli that the plan still has after so many."""
        return len(self._slots) - delivered

    def control(self, number: int) -> Control | None:
        """Which control trial this is; None for a pair."""
        slot = self.slot(number)
        return Control.TMS_ALONE if slot is None or slot.part is not Part.PAIRS else self._arm.control

    def interval_s(self, number: int) -> float:
        """Shortest interval between the trial before and this one [s]."""
        slot = self.slot(number)
        return 0.0 if slot is None else schedule.slot_interval_s(self.plan, slot, self._seed)

    def rests_before(self, number: int) -> bool:
        """True if a rest comes before this trial."""
        slot = self.slot(number)
        return slot is not None and schedule.rests_before_slot(slot)

    def isi_ms(self, trials: Iterable[Trial]) -> float:
        """The ISI of the next pair [ms], after all trials before it as they count now; the same for the same trials."""
        trials = tuple(trials)
        slot = self._slots[len(trials)]
        if self.plan.probes or self.plan.follow_ms:
            self._learn(trials)
        if self._arm is Arm.OUTSIDE:
            return _turn(self._outside_ms, slot.place)
        if schedule.is_probe(self.plan, slot, self._seed):
            return self._followed.news(self._allowed_ms)
        return self._space.snap(_turn(self._used_ms(), slot.place))

    def followed(self, trials: Iterable[Trial]) -> Followed:
        """What is known of the window after all trials so far, as they count now."""
        self._learn(tuple(trials))
        return self._followed

    def _learn(self, trials: Sequence[Trial]) -> None:
        """Follow the window through the trials that are not learnt yet; through all of them where one was judged."""
        if tuple(trials[: len(self._learnt)]) != self._learnt:
            self._restart()
        for trial in trials[len(self._learnt) :]:
            slot = self._slots[trial.index]
            if slot.part is Part.PAIRS and slot.last:  # what the next block may follow from
                self._centre_ms = _centre(self._used_ms())
            if slot.part is not Part.AFTER and slot.intensity_pct_rmt is None:
                self._followed = self._followed.after(trial)
            self._learnt = (*self._learnt, trial)

    def _used_ms(self) -> FloatArray:
        """ISIs of pairs now [ms]: those that are wanted, as far as a block may follow them."""
        if not self.plan.follow_ms:
            return self._wanted(self._begun)
        wanted = self._wanted(self._followed)
        centre = _centre(wanted)
        near = min(max(centre, self._centre_ms - self.plan.follow_ms), self._centre_ms + self.plan.follow_ms)
        moved: FloatArray = np.clip(wanted + (near - centre), self._allowed_ms[0], self._allowed_ms[-1])
        return moved

    def _wanted(self, followed: Followed) -> FloatArray:
        """ISIs of pairs, were there no bound [ms]: that of the largest enhancement, or those of the window."""
        allowed = np.isin(followed.isi_ms, self._allowed_ms)
        best = int(np.argmax(np.where(allowed, followed.enhancement_mv, -np.inf)))
        inside = followed.isi_ms[allowed & (followed.p_inside >= INSIDE)]
        return inside if self.plan.over_window and inside.size else followed.isi_ms[[best]]


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


def _turn(isis_ms: FloatArray, place: int) -> float:
    """The ISI whose turn it is, in an order that fills them evenly."""
    return float(isis_ms[golden_index(place, len(isis_ms))])


def _centre(isis_ms: FloatArray) -> float:
    return float(isis_ms.mean())


def _window_of(strategy: Strategy) -> Window:
    """The window that is used."""
    estimate = strategy.estimate()
    if estimate.window is None:
        raise InvalidValueError(
            "no window was found, so there is none to use",
            got=f"a probability of a window of {estimate.probability:.2f}"
            if estimate.probability is not None
            else None,
            expected="at least 0.5",
            remedy="Continue the search for it, or examine another muscle.",
        )
    return estimate.window
