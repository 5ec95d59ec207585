"""The protocol of a device in terms familiar from instrument control, and a device of functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, TypeAlias, runtime_checkable

from isiw.checks import Checked, Flag, NonNegative, Number
from isiw.devices.info import DeviceInfo
from isiw.errors import DeviceError, NotDelivered
from isiw.sweeps import Measurement, Sweep
from isiw.trials import Stimulus

Answer: TypeAlias = Sweep | Measurement
"""What came of a stimulus: waveforms, or the MEP as the device measured it."""

VERBS: Final = ("describe", "stage", "deliver", "stop", "unstage")
"""The methods of a device."""


@runtime_checkable
class Device(Protocol):
    """Delivers pairs of stimuli and reports what came of them.

    A session calls all verbs in one thread, which is not the one that made the device. Only `stop` may come from
    another one while `deliver` or `stage` is still busy.
    """

    def describe(self) -> DeviceInfo:
        """The device's description; may be called at any time and delivers nothing."""

    def stage(self) -> None:
        """Get ready and arm. Delivers nothing."""

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Deliver one pair of stimuli and report what came of it.

        Args:
            stimulus: what to deliver; an ISI of None is TMS alone, or a tap alone if `stimulus.tap_alone` says so,
                which only a device gets whose `DeviceInfo` says that it can.
            timeout_s: the longest the call may take [s].

        Raises:
            NotDelivered: refused before firing; nothing was given, and the session tries again.
            DeviceTimeoutError: no answer in time.
            DeviceError: not staged, or anything else went wrong; whether the pulse was given is not known.
        """

    def stop(self) -> None:
        """Disarm, whatever state the device is in, also while it delivers; calling it again is harmless."""

    def unstage(self) -> None:
        """Let go of what `stage` took; calling it again is harmless."""


@dataclass(frozen=True)
class Readiness(Checked):
    """A device's state before a stimulus, as it reports it.

    Args:
        ready: whether it could fire now.
        reason: why it is not ready.
        coil_c: temperature of the coil [°C]; None if it is not measured.
        intensity_pct_mso: intensity that is set [% of the maximum stimulator output]; None if it is not known.

    Raises:
        InvalidValueError: `ready` that is neither True nor False, a value that is not finite, or an intensity below 0.
    """

    ready: Flag = True
    reason: str = ""
    coil_c: Number | None = None
    intensity_pct_mso: NonNegative | None = None


@runtime_checkable
class ReportsReadiness(Protocol):
    """Capability: a device that says before each stimulus whether it is ready, and what is set."""

    def readiness(self) -> Readiness:
        """The device's state now. Delivers nothing."""


@runtime_checkable
class DiesArmed(Protocol):
    """Capability: a device that can show that it is disarmed if isiw dies."""

    def die_armed(self, timeout_s: float) -> float | None:
        """Have a process of its own arm the staged device and die. Delivers nothing.

        Args:
            timeout_s: the longest that disarming may take [s].

        Returns:
            The time until it was disarmed [s]; None if that cannot be tried here.

        Raises:
            DeviceError: it is not known to be disarmed.
        """


@runtime_checkable
class HasMemory(Protocol):
    """Capability: a device whose answers depend on the stimuli before, as simulated and replayed ones do."""

    def resume_after(self, stimuli: Sequence[Stimulus]) -> None:
        """Come into the state of having delivered these stimuli since the session's beginning."""


def info_of(device: Device) -> DeviceInfo:
    """A device's description of itself."""
    info: object = device.describe()
    if not isinstance(info, DeviceInfo):
        raise DeviceError(
            "describe() did not return an isiw.DeviceInfo",
            got=info,
            remedy='Return DeviceInfo("what it is", "impact"), or "valve", the event that its ISIs count from.',
        )
    return info


def readiness_of(device: Device) -> Readiness:
    """The state that a device reports; ready, if it cannot report one."""
    state: object = device.readiness() if isinstance(device, ReportsReadiness) else Readiness()
    if not isinstance(state, Readiness):
        raise DeviceError(
            "readiness() did not return an isiw.Readiness",
            got=state,
            remedy='Return Readiness(), or Readiness(ready=False, reason="...").',
        )
    return state


def require_staged(name: str, *, staged: bool) -> None:
    """Raise NotDelivered if a device is to deliver without being armed."""
    if not staged:
        raise NotDelivered(f"{name} is not staged, so it delivers nothing", remedy="Call stage() first.")


NOT_PROTECTED: Final = "not protected if isiw dies"


def unprotected(info: DeviceInfo) -> str | None:
    """A sentence for whoever arms a device that stays armed if isiw dies; None for any other."""
    if info.simulated or info.if_isiw_dies is not None:
        return None
    return f"{info.name} is {NOT_PROTECTED}: what is armed then stays armed. Keep the switch of the stimulator at hand."


class CallbackDevice:
    """Calls your functions.

    Args:
        fire: delivers one pair of stimuli and returns a `Measurement` or a `Sweep`; takes the stimulus and the time
            allowed [s]. The ISI must be timed by hardware, never by Python.
        info: what the device is.
        arm: called by `stage`.
        disarm: called by `stop` and `unstage`; must work in any state.
    """

    def __init__(
        self,
        fire: Callable[[Stimulus, float], Answer],
        info: DeviceInfo,
        arm: Callable[[], None] = lambda: None,
        disarm: Callable[[], None] = lambda: None,
    ) -> None:
        self._fire, self._info, self._arm, self._disarm = fire, info, arm, disarm
        self._staged = False

    def describe(self) -> DeviceInfo:
        """The description of the device."""
        return self._info

    def stage(self) -> None:
        """Arm."""
        self._arm()
        self._staged = True

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Fire."""
        require_staged(self._info.name, staged=self._staged)
        return self._fire(stimulus, timeout_s)

    def stop(self) -> None:
        """Disarm."""
        self._staged = False
        self._disarm()

    def unstage(self) -> None:
        """Disarm."""
        self.stop()
