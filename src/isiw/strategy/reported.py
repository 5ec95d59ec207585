"""What is odd about the outcomes that a strategy learns: their amplitudes, and their ISIs beside those asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from isiw.design import DesignSpace
from isiw.findings import IN_DOUBT, Finding
from isiw.signals.amplitudes import Counted, Doubts, odd_amplitudes
from isiw.signals.plausible import isi_far
from isiw.signals.reported import doubtful_from, is_far, unconfirmed
from isiw.strategy.outcomes import Outcome


@dataclass(frozen=True)
class Reported:
    """The outcomes so far: the pulses, by number, whose ISI was asked for, and whether the realised one was far."""

    space: DesignSpace
    asked: tuple[tuple[int, bool], ...] = ()
    confirmed: bool = False
    doubts: Doubts = field(default_factory=Doubts)

    @property
    def new(self) -> Finding | None:
        """What is odd since the last pulse."""
        return self.doubts.new

    @cached_property
    def doubted(self) -> frozenset[int]:
        """The pulses whose ISIs are in doubt."""
        first = None if self.confirmed else doubtful_from([far for _, far in self.asked])
        return frozenset() if first is None else frozenset(pulse for pulse, _ in self.asked[first:])

    def confirmed_by(self, *, confirm: bool) -> Reported:
        """The same once all ISIs are confirmed; raise if some are in doubt, and are not."""
        if not self.doubted:
            return self
        if not confirm:
            raise unconfirmed(self.doubted, self.space, "put your loop right, and begin with a new strategy")
        return replace(self, confirmed=True)

    def after(self, pulses: Sequence[Outcome], asked_ms: float | None, detection_limit_mv: float | None) -> Reported:
        """The same after one more pulse, the last of all; its ISI is as asked, or was not asked for."""
        isi_ms, isi_sd_ms = pulses[-1].isi_ms, pulses[-1].isi_sd_ms
        found, reported = isi_far(isi_ms, asked_ms, self.space), self
        if isi_ms is not None and asked_ms is not None:
            far = is_far(isi_ms - asked_ms, self.space, isi_sd_ms)
            reported = replace(self, asked=(*self.asked, (len(pulses) - 1, far)))
        of_pairs = [one for one in pulses if one.intensity_pct_rmt is None]
        told = [Counted(one.mep_mv, one.isi_ms) for one in of_pairs if one.mep_mv is not None]
        odd = (IN_DOUBT if reported.doubted else found, *odd_amplitudes(told, detection_limit_mv))
        return replace(reported, doubts=self.doubts.after(odd))
