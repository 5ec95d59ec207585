"""What a check for findings looks at: the last trial and its sweep, or the trials that count so far."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, TypeAlias

from isiw.findings import Finding
from isiw.signals.hum import Hum
from isiw.signals.limits import SignalLimits
from isiw.trials import Measurement, Sweep, Trial

OF_REST: Final = 8.0
"""Peak-to-peak amplitude of EMG at rest over its RMS, at most: some 6 within the window of an MEP. In 330 recorded and
simulated sweeps without an MEP it was 7.3 outside of it at most."""


class Response(NamedTuple):
    """A response outside the MEP window: its centre [ms after the pulse], and its peak-to-peak amplitude [mV]."""

    at_ms: float
    size_mv: float


@dataclass(frozen=True)
class Told:
    """A trial that counts, as the checks of several trials look at it.

    Args:
        mep_mv: its amplitude [mV]; 0 is below the detection limit.
        isi_ms: its ISI [ms]; None for TMS alone.
        rest_uv: EMG before the pulse [µV RMS]; None where not known.
        outside: the largest clear response outside the MEP window; None where there is none, or no sweep.
        cut_ms: from when to when the EMG responds [ms after the pulse], if it is larger behind the window than within.
        hum: the mains hum that was subtracted; None if there is none.
        is_tail: whether what is in the window is the end of a larger artefact before it.
        only_falls: whether what is in the window only falls, as a slow decay does and no MEP.
        repeats: whether its EMG is that of the trial before, sample by sample.
    """

    mep_mv: float
    isi_ms: float | None = None
    rest_uv: float | None = None
    outside: Response | None = None
    cut_ms: tuple[float, float] | None = None
    hum: Hum | None = None
    is_tail: bool = False
    only_falls: bool = False
    repeats: bool = False

    @property
    def stands_out(self) -> bool:
        """Whether its amplitude is above the detection limit, and larger than EMG at rest may be."""
        return self.mep_mv > OF_REST * (self.rest_uv or 0.0) / 1000


def told_of(trials: Iterable[Trial]) -> tuple[Told, ...]:
    """Those of some trials that count and have an amplitude."""
    return tuple(Told(t.mep_mv, t.isi_ms, t.background_rms_uv) for t in trials if t.told and t.mep_mv is not None)


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known after a trial; what is not known is None or empty.

    Args:
        trial: the last trial, as it was judged.
        answer: what the device answered.
        limits: what it was judged by.
        told: the trials that count so far, in order.
        detection_limit_mv: what an amplitude of 0 is known to be below [mV]; None where nobody has said.
    """

    trial: Trial | None = None
    answer: Sweep | Measurement | None = None
    limits: SignalLimits = field(default_factory=SignalLimits)
    told: Sequence[Told] = ()
    detection_limit_mv: float | None = None


Check: TypeAlias = Callable[[Evidence], Finding | None]
"""Looks for one kind of finding; None where it finds nothing, or lacks what it needs."""


def of_sweep(find: Callable[[Sweep, Trial], Finding | None]) -> Check:
    """A check that needs the last trial and its sweep."""
    return lambda e: find(e.answer, e.trial) if e.trial is not None and isinstance(e.answer, Sweep) else None


def of_trial(find: Callable[[Trial, Evidence], Finding | None]) -> Check:
    """A check that needs the last trial, be there a sweep or not."""
    return lambda e: None if e.trial is None else find(e.trial, e)


def of_told(find: Check) -> Check:
    """A check that needs the trials that count so far."""
    return lambda e: find(e) if e.told else None
