"""A wrapper around any device that delivers nothing beyond its limits."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable, Sequence

from isiw.devices.allowed import require_intensity, require_isi, require_left, require_state
from isiw.devices.clock import ROUNDING_S, Clock, Pacing, VirtualClock
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.devices.protocol import Answer, Device, Readiness, readiness_of, require_staged
from isiw.errors import DeviceError, LimitExceededError, NotDelivered
from isiw.trials import Stimulus
from isiw.visit import Visit

MOST_ROUNDED_PCT_MSO = 0.51
"""Stimulators set whole per cent of their output [% MSO]."""


def require_real_time(info: DeviceInfo, clock: Clock) -> None:
    """Raise if a device that may stimulate somebody would not wait between its stimuli."""
    if isinstance(clock, VirtualClock) and not info.simulated:
        raise DeviceError(
            "a virtual clock does not wait between stimuli, so it is for simulated devices only",
            got=info.name,
            remedy="Leave the clock out, or describe a device that stimulates nobody with simulated=True.",
        )


def require_within_device(info: DeviceInfo, limits: Limits) -> None:
    """Raise if limits allow what the device itself refuses."""
    if info.shortest_iti_s is not None and limits.iti_s < info.shortest_iti_s:
        raise DeviceError(
            "the device gives stimuli less often than the limits allow",
            got=f"min_iti_s = {limits.iti_s:g}",
            expected=f"at least the {info.shortest_iti_s:g} s of {info.name}",
            remedy="Raise min_iti_s under [limits], or set another interval in the device and in its info.",
        )
    if info.most_pulses is not None and limits.max_pulses > info.most_pulses:
        raise DeviceError(
            "the device gives fewer stimuli than the limits allow",
            got=f"max_pulses = {limits.max_pulses}",
            expected=f"at most the {info.most_pulses} of {info.name}",
            remedy="Lower max_pulses under [limits], or set another number in the device and in its info.",
        )


def require_set(noted: Visit, asked_pct_rmt: float | None, state: Readiness) -> None:
    """Raise LimitExceededError if a device that sets intensities reports another one than it was last asked to set.

    Args:
        noted: the usual intensity, as a share of the threshold and of the stimulator's output; without both nothing is
            compared.
        asked_pct_rmt: the intensity that it was asked to set last [% RMT]; None if none since it was staged.
        state: what it reports.
    """
    reported, usual_mso, usual_rmt = state.intensity_pct_mso, noted.intensity_pct_mso, noted.intensity_pct_rmt
    if asked_pct_rmt is None or reported is None or usual_mso is None or usual_rmt is None:
        return
    asked_mso = usual_mso * asked_pct_rmt / usual_rmt
    if abs(reported - asked_mso) > MOST_ROUNDED_PCT_MSO:
        raise LimitExceededError(
            "the device has set another intensity than it was asked for",
            got=f"{reported:g} % MSO",
            expected=f"{asked_mso:.1f} % MSO, which is {asked_pct_rmt:g} % RMT where {usual_rmt:g} % RMT is "
            f"{usual_mso:g} % MSO",
            remedy="This stimulus was not delivered, and the one before may have had that intensity: exclude it. "
            "Correct what the device sets, or the two intensities under [visit]; then resume the session.",
        )


def require_at_most(most_pct_rmt: float | None, noted: Visit, state: Readiness) -> None:
    """Raise LimitExceededError if a device that sets no intensity reports one above the highest.

    Args:
        most_pct_rmt: the highest intensity [% RMT]; None if none is stated.
        noted: the usual intensity, as in `require_set`.
        state: what it reports.
    """
    reported, usual_mso, usual_rmt = state.intensity_pct_mso, noted.intensity_pct_mso, noted.intensity_pct_rmt
    if most_pct_rmt is None or reported is None or usual_mso is None or usual_rmt is None:
        return
    most_mso = usual_mso * most_pct_rmt / usual_rmt
    if reported > most_mso + MOST_ROUNDED_PCT_MSO:
        raise LimitExceededError(
            "the device reports a higher intensity than the limits allow",
            got=f"{reported:g} % MSO",
            expected=f"at most {most_mso:.1f} % MSO, which is {most_pct_rmt:g} % RMT where {usual_rmt:g} % RMT is "
            f"{usual_mso:g} % MSO",
            remedy="This stimulus was not delivered. Set a lower intensity at the stimulator, or correct the two "
            "intensities under [visit]; then continue.",
        )


class LimitedDevice:
    """A device that refuses what exceeds its limits, before anything is delivered. Safe to use from several threads.

    A delivery that fails counts like any other, because nobody knows whether the pulse left, and the first one waits a
    whole interval, because nobody knows what came before. Nothing loosens once the device is made.
    """

    def __init__(
        self,
        device: Device,
        limits: Limits,
        clock: Clock,
        *,
        delivered: int = 0,
        earlier_s: Sequence[float] = (),
        dead_man: Callable[[], bool] | None = None,
        waits_for_nobody: bool = False,
        noted: Visit | None = None,
    ) -> None:
        info = device.describe()
        if not waits_for_nobody:
            require_real_time(info, clock)
        require_within_device(info, limits)
        self._device, self._info, self._dead_man = device, info, dead_man
        self._limits, self._noted = Limits(**dataclasses.asdict(limits)), noted or Visit()
        self._last_set_pct_rmt: float | None = None
        self._delivered = delivered
        self._pacing = Pacing(self._limits, clock, earlier_s)
        self.wait_s, self.ahead_s = self._pacing.wait_s, self._pacing.ahead_s
        self._staged = False
        self.last_readiness: Readiness | None = None
        self._one_at_a_time = threading.Lock()

    @property
    def limits(self) -> Limits:
        """The limits that hold now."""
        return self._limits

    @property
    def pulses_left(self) -> int:
        """The number of deliveries that are still allowed."""
        return max(0, self._limits.max_pulses - self._delivered)

    def check(self, stimulus: Stimulus) -> None:
        """Raise if this stimulus must not be delivered now."""
        require_left(self._limits, self._delivered)
        if stimulus.isi_ms is not None:
            require_isi(self._limits, stimulus.isi_ms)
        require_intensity(self._limits, stimulus.intensity_pct_rmt)
        self._require_given(stimulus)
        if (wait_s := self.wait_s()) > ROUNDING_S:
            raise LimitExceededError(
                "the next stimulus comes too early",
                got=f"{wait_s:.3f} s before its time",
                expected=f"at least {self._limits.iti_s:g} s between stimuli, and the rests of the limits",
                remedy="This stimulus was not delivered. Sleep for wait_s() first.",
            )
        state = self.last_readiness = readiness_of(self._device)
        if not state.ready:
            raise NotDelivered(
                f"the device is not ready: {state.reason or 'it does not say why'}",
                remedy="This stimulus was not delivered. Continue when the device is ready.",
            )
        self._bind(state)
        require_state(self._limits, state.coil_c, state.intensity_pct_mso)
        require_set(self._noted, self._last_set_pct_rmt, state)
        if not self._info.sets_intensity:  # else what it reports is not yet that of the pulse
            require_at_most(self._limits.max_intensity_pct_rmt, self._noted, state)
        if self._dead_man is not None and self._dead_man() is not True:
            raise LimitExceededError(
                "the dead man's switch is not held",
                remedy="This stimulus was not delivered. Resume the session when the switch is held.",
            )

    def _require_given(self, stimulus: Stimulus) -> None:
        """Raise if the device would have to ignore a part of a stimulus: it would then give another one."""
        for what, wanted, there in (
            ("a tap alone", stimulus.tap_alone, self._info.tap_alone),
            ("an intensity of a pulse's own", stimulus.intensity_pct_rmt is not None, self._info.sets_intensity),
        ):
            if wanted and not there:
                raise LimitExceededError(
                    f"the device does not say that it gives {what}",
                    got=self._info.name,
                    remedy="This stimulus was not delivered. Describe the device with "
                    "DeviceInfo(..., tap_alone=True, sets_intensity=True) as far as it does.",
                )

    def describe(self) -> DeviceInfo:
        """The description of the guarded device."""
        return self._info

    def stage(self) -> None:
        """Get ready and arm; the next stimulus comes a whole interval later at the earliest."""
        self._device.stage()
        self._pacing.begin_again()
        self._last_set_pct_rmt = None
        if self._binds_none:
            self._bind(readiness_of(self._device))
        self._staged = True

    @property
    def _binds_none(self) -> bool:
        return self._limits.intensity_pct_mso is None and self._limits.max_intensity_pct_rmt is None

    def _bind(self, state: Readiness) -> None:
        """Let no other intensity follow than the visit's, or else the first one that is reported, at whatever time."""
        if self._binds_none and state.intensity_pct_mso is not None:
            own = self._noted.intensity_pct_mso or state.intensity_pct_mso
            self._limits = dataclasses.replace(self._limits, intensity_pct_mso=own)

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Deliver one pair of stimuli, if the limits allow it."""
        with self._one_at_a_time:
            require_staged(self._info.name, staged=self._staged)
            self.check(stimulus)
            require_staged(self._info.name, staged=self._staged)  # the check may take long, and `stop` come meanwhile
            self._delivered += 1
            last_pct_rmt, self._last_set_pct_rmt = self._last_set_pct_rmt, None  # not known, if delivering fails
            try:
                with self._pacing.delivering():
                    answer = self._device.deliver(stimulus, timeout_s)
            except (NotDelivered, LimitExceededError):
                self._delivered -= 1
                raise
            self._last_set_pct_rmt = stimulus.intensity_pct_rmt or last_pct_rmt
            return answer

    def stop(self) -> None:
        """Disarm; from here on nothing is delivered until the next `stage`."""
        self._staged = False
        self._device.stop()

    def unstage(self) -> None:
        """Let go of the device."""
        self._staged = False
        self._device.unstage()
