"""The blocks of an intervention while it runs: when each is due, what the operator hears of it, and how late it began.

Times count from the last pair. They are those of the session's clock, or longer ones where the computer has slept, and
go on across a restart, whatever the computer's clock was set to meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from isiw.devices.clock import ROUNDING_S, Clock
from isiw.log.moments import Moment
from isiw.log.schema import Event
from isiw.pairing.agenda import Agenda
from isiw.schedule import Part, Slot

AHEAD_S: Final = 30.0
"""So long before it is due a block is announced, so that it begins in time [s]."""

_LATE_S: Final = 1.0
"""What is later than this is said [s]."""


class Blocks:
    """Knows the time since the last pair, and which blocks were announced."""

    def __init__(self, agenda: Agenda, clock: Clock, attended: Callable[[], bool]) -> None:
        self.agenda, self._clock, self._attended = agenda, clock, attended
        self._last: tuple[float, Moment, float] | None = None
        self._set_here = False  # whether the stimulator stands as the trial before needed it
        self._announced: set[int] = set()

    def came(self, trial: int, ago_s: float = 0.0) -> None:
        """A stimulus was about to be delivered, so long ago [s]; from the last pair on the time counts."""
        self._set_here |= not ago_s
        if trial == self.agenda.plan.last_pair:
            self._last = self._clock.now_s(), Moment.now(), ago_s

    @property
    def since_s(self) -> float | None:
        """The time since the last pair [s]; None before it, and where no log says when it was."""
        if self._last is None:
            return None
        clock_s, moment, ago_s = self._last
        return ago_s + max(self._clock.now_s() - clock_s, Moment.now().since_s(moment) or 0.0)

    def left_s(self, trial: int, ahead_s: float = 0.0) -> float:
        """The time until a trial's block is due, less some [s]; 0 where it is, or is none of those after the pairs."""
        slot, since_s = self.agenda.slot(trial), self.since_s
        if slot is None or slot.due_s is None or since_s is None or not slot.first:
            return 0.0
        left_s = slot.due_s - since_s - ahead_s
        return left_s if left_s > ROUNDING_S else 0.0

    def announcement(self, trial: int) -> str | None:
        """What the operator has to know, or to do, before a trial; None where nothing is, or it was said."""
        slot = self.agenda.slot(trial)
        if slot is None or trial in self._announced:
            return None
        said = " ".join(filter(None, (self._due(slot), self._set(slot))))
        return said if said and self._attended() else None

    def said(self, trial: int) -> None:
        """A trial's announcement was made."""
        self._announced.add(trial)

    def _due(self, slot: Slot) -> str:
        if slot.due_s is None or not slot.first:
            return ""
        left_s = self.left_s(slot.number)
        when = f"is due in {left_s:.0f} s" if left_s else "is due"
        pulses = self.agenda.plan.after * len(self.agenda.plan.tests)
        return f"The block {slot.name} {when}: {pulses} pulses of TMS alone. Continue when you are ready."

    def _set(self, slot: Slot) -> str:
        before = self.agenda.slot(slot.number - 1) if slot.number else None
        was = None if before is None else before.intensity_pct_rmt
        unknown = bool(slot.number and self.agenda.plan.intensities_pct_rmt) and not self._set_here
        if slot.intensity_pct_rmt == was and not unknown:
            return ""
        at = "that of the pairs" if slot.intensity_pct_rmt is None else f"{slot.intensity_pct_rmt:g} % RMT"
        return f"Set the intensity of the stimulator to {at}."

    def begun(self, trial: int) -> Event | None:
        """That a block begins with a trial, and how late; None of any other trial."""
        slot = self.agenda.slot(trial)
        if slot is None or not slot.first:
            return None
        late_s = None if slot.due_s is None or self.since_s is None else max(0.0, self.since_s - slot.due_s)
        late = f", {late_s:.0f} s late" if late_s is not None and late_s > _LATE_S else ""
        return Event(
            kind="block",
            trial=trial - 1 if trial else None,
            text=f"{self._named(slot)} begins{late}.",
            late_s=None if late_s is None else round(late_s, 3),
        )

    def _named(self, slot: Slot) -> str:
        plan = self.agenda.plan
        if slot.part is Part.PAIRS:
            blocks = -(-plan.pairs // plan.block_pairs)
            return f"Block {slot.block + 1} of {blocks} of the intervention"
        return f"The block {slot.name}"
