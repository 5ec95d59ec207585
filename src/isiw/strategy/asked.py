"""The ISIs that were asked for and not learnt yet: the next one, and the rest of a batch, told in any order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from isiw.design import DesignSpace
from isiw.signals.limits import off_by
from isiw.strategy.course import Choice


@dataclass(frozen=True)
class Asked:
    """The ISIs that were asked for and not learnt yet: the next one, and the rest of a batch [ms]."""

    choice: Choice | None = None
    fallback: str | None = None
    batch_ms: tuple[float, ...] = ()

    def noting(self, choice: Choice) -> Asked:
        """The same with the reason of a choice, if it is the first that has one."""
        return replace(self, fallback=self.fallback or choice.fallback)

    def again(self) -> Asked:
        """The same before the next ISI is chosen once more."""
        return Asked(batch_ms=self.batch_ms)

    def meant_ms(self, isi_ms: float, mep_mv: float | None, space: DesignSpace) -> float | None:
        """The ISI that a trial is of [ms], be it given in seconds or swapped; None if none was asked."""
        asked_ms = self.batch_ms if self.choice is None else (self.choice.isi_ms, *self.batch_ms)
        if not asked_ms:
            return None
        told = (isi_ms, isi_ms if mep_mv is None else max(isi_ms, mep_mv), 1000 * isi_ms)
        near_ms = [_nearest(asked_ms, value) for value in told]
        meant = (near for near, value in zip(near_ms, told, strict=True) if not off_by(value, near, space))
        return next(meant, near_ms[0])

    def after(self, isi_ms: float | None) -> Asked:
        """The same after a trial; nothing is left of the batch if the ISI is one that was asked since."""
        if isi_ms is None or not self.batch_ms:
            return self.again()
        told_ms = _nearest(self.batch_ms, isi_ms)
        if self.choice is not None and _nearest((told_ms, self.choice.isi_ms), isi_ms) != told_ms:
            return Asked()
        index = self.batch_ms.index(told_ms)
        return Asked(batch_ms=(*self.batch_ms[:index], *self.batch_ms[index + 1 :]))


def _nearest(asked_ms: Sequence[float], value: float) -> float:
    return min(asked_ms, key=lambda isi_ms: abs(isi_ms - value))
