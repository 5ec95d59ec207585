"""A rig that records the EMG of a person in whom the tap alone may evoke a response, too."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.signals import judge
from isiw.signals.tap import TapResponses
from isiw.subjects.changes import TapResponse
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus, Trial

IMPACT = DesignSpace(0, 320, reference="impact")


class TapRig:
    """A device whose sweeps hold an MEP, and whatever the tap evokes; each is the same whenever it is recorded."""

    def __init__(
        self,
        tap: TapResponse | None = None,
        seed: int = 0,
        mep_mv: Callable[[float | None, np.random.Generator], float] = lambda _, __: 0.15,
        *,
        tap_alone: bool = True,
    ) -> None:
        self.tap, self.seed, self.mep_mv, self.tap_alone = tap, seed, mep_mv, tap_alone
        self.taps, self.delivered = TapResponses(), list[Stimulus]()

    def describe(self) -> DeviceInfo:
        return DeviceInfo("own", "impact", channels={"emg": "mV"}, simulated=True, tap_alone=self.tap_alone)

    def stage(self) -> None: ...
    def stop(self) -> None: ...
    def unstage(self) -> None: ...

    def deliver(self, stimulus: Stimulus, timeout_s: float = 1.0) -> Sweep:  # noqa: ARG002 - answers at once
        self.delivered.append(stimulus)
        rng = np.random.default_rng([self.seed, stimulus.trial])
        times_ms, isi_ms = np.arange(-500.0, 200.0, 0.2), 150.0 if stimulus.tap_alone else stimulus.isi_ms
        emg = 0.002 * rng.standard_normal(times_ms.size)
        if not stimulus.tap_alone:
            since_ms, mep_mv = times_ms - 21.0, self.mep_mv(isi_ms, rng)
            emg += mep_mv / 2 * np.where((since_ms > 0) & (since_ms < 8), np.sin(np.pi * since_ms / 4), 0)
        if self.tap is not None and isi_ms is not None:
            emg += self.tap.sample_mv(rng) * self.tap.course(times_ms + isi_ms)
        channels = {"emg": Channel(emg, 5000.0, "mV", t0_ms=-500.0)}
        return Sweep(channels, None, None if stimulus.tap_alone else 0.0, None if isi_ms is None else -isi_ms)

    def trial(self, isi_ms: float | None, mep_mv: float = 0.15, *, pulse: bool = True) -> Trial:
        """The next trial, measured by what is known then."""
        stimulus = Stimulus(len(self.delivered), isi_ms if pulse else None, tap_alone=not pulse)
        self.mep_mv = lambda _, __: mep_mv
        sweep = self.deliver(stimulus)
        judged = judge(sweep, stimulus, IMPACT)
        self.taps = self.taps.after(judged, sweep)
        return self.taps.measured(judged)

    def trials(self, isis_ms: Iterable[float]) -> list[Trial]:
        return [self.trial(isi_ms) for isi_ms in isis_ms]


def reflex(median_mv: float, log_sd: float = 0.5, start_ms: float = 30.0) -> TapResponse:
    """What a tap evokes for 30 ms."""
    return TapResponse(start_ms, 30.0, median_mv, log_sd)
