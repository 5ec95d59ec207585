"""A session's device and safeguards: driven by this session alone, limited, punctual, disarmed whatever happens."""

from __future__ import annotations

import hashlib
import math
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import IO, Annotated, Final, Never

from isiw.checks import Checked, NonNegative, choice, whole
from isiw.devices.clock import Clock, MonotonicClock, VirtualClock
from isiw.devices.deadlines import Deadlines, PunctualDevice
from isiw.devices.info import DeviceInfo
from isiw.devices.limited import LimitedDevice
from isiw.devices.limits import Limits
from isiw.devices.protocol import Answer, Device
from isiw.errors import DeviceError, InvalidValueError, StillArmedError, error_text, os_errors
from isiw.files import shared_file
from isiw.log.durable import claim
from isiw.log.schema import Event, waveform_topic
from isiw.log.writer import LogWriter
from isiw.models.protocol import profile_of
from isiw.session.pausing import Interrupts
from isiw.session.sink import Sink
from isiw.session.terminal import alarm, restore
from isiw.signals.limits import EMG_UNITS_MV
from isiw.strategy.strategy import Strategy
from isiw.types import Reference
from isiw.visit import Visit, VisitProtocol

_driven: set[int] = set()
_guard = threading.Lock()


@contextmanager
def exclusive(device: Device, info: DeviceInfo) -> Iterator[None]:
    """Within, no other session drives this device: the same object, or any of the same address on this computer."""
    with _guard:
        if id(device) in _driven:
            raise _taken(info.name)
        _driven.add(id(device))
    try:
        with _address_claimed(info) if info.address else nullcontext():
            yield
    finally:
        _driven.discard(id(device))


def lock_folder() -> Path:
    """Where the locks of devices are: one folder for all accounts of this computer, whatever their settings."""
    if sys.platform == "win32":
        return Path(os.environ.get("PROGRAMDATA", r"C:\ProgramData"))
    return Path("/tmp")  # noqa: S108 - not TMPDIR, which two terminals may set differently; nothing is read from it


def _address_claimed(info: DeviceInfo) -> IO[bytes]:
    """An open file that holds the lock of a device's address until it is closed, or its process ends."""
    digest = hashlib.sha256(info.address.encode(errors="backslashreplace")).hexdigest()[:16]
    path = lock_folder() / f"isiw-device-{digest}.lock"
    remedy = "If another account of this computer made it, let that account delete it once no session runs."
    with os_errors(DeviceError, "the device's lock cannot be taken", path, remedy):
        file = shared_file(path)
        if claim(file):
            return file
    file.close()
    raise _taken(f"{info.name} at {info.address}")


def _taken(which: str) -> DeviceError:
    return DeviceError(
        "the device is driven by another session",
        got=which,
        remedy="End that session first. Two sessions would not know of each other's stimuli.",
    )


def _function(what: str, value: object) -> object:
    """Something that can be called."""
    if not callable(value):
        raise InvalidValueError(
            f"{what} must be a function", got=value, remedy="Give the function, without calling it."
        )
    return value


@dataclass(frozen=True)
class Safeguards(Checked):
    """The means by which a session keeps a person safe besides its limits.

    Args:
        deadlines: how long each verb of the device may take.
        retries: how often a stimulus is tried again that the device refused before firing, at most 10 times.
        backoff_s: how long to wait before the first of these [s]; twice as long before each further one.
        on_pause: is called with the reason when the session has paused and the device is disarmed; True goes on, and
            arms again. Without it the operator is asked in the terminal, and where there is none the session ends.
        dead_man: is called before each stimulus; anything but True refuses it and ends the session.
        earlier_logs: a folder of logs, whose folders are looked into, too; the same subject's stimuli in it count for
            the limits' period and block. A log that cannot be read refuses the session.

    Raises:
        InvalidValueError: retries outside 0–10, a time below 0, or an `on_pause` or a `dead_man` that is no function.
    """

    deadlines: Deadlines = field(default_factory=Deadlines)
    retries: Annotated[int, partial(whole, least=0, most=10)] = 3
    backoff_s: NonNegative = 1.0
    on_pause: Annotated[Callable[[str], bool], _function] | None = None
    dead_man: Annotated[Callable[[], bool], _function] | None = None
    earlier_logs: str | Path | None = None

    @property
    def backoffs_s(self) -> tuple[float, ...]:
        """Waiting times before each retry [s]."""
        return tuple(self.backoff_s * 2**retry for retry in range(self.retries))


STILL_ARMED: Final = 4
"""The exit code where a device could not be disarmed."""

INTERRUPTED: Final = 130
"""The exit code where a session did not react to Ctrl-C: what shells report for it."""

_PATIENCE_S, _GLANCE_S = 2.0, 0.01


def end_process(reason: str, log: LogWriter | None, code: int) -> Never:
    """End the process at once, whatever its threads are busy with."""
    ends = f"{reason} The process ends."
    end_s = time.monotonic() + _PATIENCE_S

    def show() -> None:
        restore()
        alarm(f"\n{ends}" if log is None else f"\n{ends}\nThe log is safe; resume with {log.path}.")

    def write() -> None:
        if log is not None:
            log.append(Event(kind="fault", text=ends))
            log.sync()

    # Each in a thread of its own: a terminal or a disk that holds one up, or is gone, holds up nothing else.
    steps = [threading.Thread(target=step, daemon=True) for step in (show, write)]
    try:
        for step in steps:
            step.start()
        while any(step.is_alive() for step in steps) and time.monotonic() < end_s:
            with suppress(KeyboardInterrupt):  # Ctrl-C pressed again; the process is ending already
                time.sleep(_GLANCE_S)
    finally:
        os._exit(code)


class Rig:
    """A device as a session drives it."""

    def __init__(
        self,
        device: Device,
        limits: Limits,
        clock: Clock | None,
        safeguards: Safeguards,
        sink: Sink,
        *,
        away: Callable[[], AbstractContextManager[None]] = nullcontext,
        waits_for_nobody: bool = False,
        noted: Visit | None = None,
    ) -> None:
        stuck = "The session does not react. The device is disarmed."
        self.interrupts = Interrupts(self.disarm, lambda: end_process(stuck, sink.writer, INTERRUPTED), away)
        self.staged_once = self.is_armed = False
        self._raw, self._limits, self._safeguards, self._sink = device, limits, safeguards, sink
        self._waits_for_nobody, self._noted = waits_for_nobody, noted
        self._punctual = PunctualDevice(
            device,
            safeguards.deadlines,
            given_up=lambda: self.interrupts.insisted,
            report=sink.faults.append,
            still_armed=self._end_armed,
        )
        self.clock = clock or (VirtualClock() if self.info.simulated else MonotonicClock())
        self.begin(0, ())
        self._punctual.release_thread()

    def begin(self, delivered: int, earlier_s: Sequence[float]) -> None:
        """Count what was delivered before, for the limits."""
        self.limited = LimitedDevice(
            self._punctual,
            self._limits,
            self.clock,
            delivered=delivered,
            earlier_s=earlier_s,
            dead_man=self._safeguards.dead_man,
            waits_for_nobody=self._waits_for_nobody,
            noted=self._noted,
        )

    @property
    def info(self) -> DeviceInfo:
        """The device's description."""
        return self._punctual.describe()

    @contextmanager
    def exclusive(self) -> Iterator[None]:
        """Within, no other session drives the device, and every signal disarms it."""
        with exclusive(self._raw, self.info), self.interrupts:
            yield

    @contextmanager
    def armed(self, *, at_once: bool = True) -> Iterator[None]:
        """Within, the device is staged, or may be later; behind it, it is disarmed and let go of, whatever happened."""
        try:
            if at_once:
                self.stage()
            yield
        except BaseException as error:
            self._release(error)
            raise
        self._release(None)

    def stage(self) -> None:
        """Get ready and arm."""
        self.is_armed = True  # before it is, so that nobody takes it for disarmed who looks meanwhile
        with self.interrupts.allowed():
            self.limited.stage()
            self.staged_once = True

    def disarm(self) -> None:
        """Disarm, from any thread; if that cannot be done, the process ends."""
        try:
            self.limited.stop()
        except StillArmedError as error:
            self._end_armed(error)
        self.is_armed = False

    def late_answer(self) -> Answer | None:
        """The answer to a delivery after its deadline; None if nothing comes as long as `stop` may take."""
        return self._punctual.late_answer(self._safeguards.deadlines.stop_s)

    def _release(self, error: BaseException | None) -> None:
        """Disarm and let go; what fails besides an error is told with it."""
        self.disarm()
        try:
            self.limited.unstage()
        except Exception as another:
            if error is None:
                raise
            failed = f"unstage failed, too: {error_text(another)}"
            self._sink.faults.append(failed)
            error.add_note(failed)
        finally:
            self._punctual.release_thread()

    def _end_armed(self, error: StillArmedError) -> Never:
        end_process(error_text(error), self._sink.writer, STILL_ARMED)


def own_reference(reference: Reference) -> str:
    """The remedy if a device counts ISIs from another event than the design space."""
    return (
        f'If the device is right, set reference = "{reference}" under [space], or '
        f'DesignSpace(low_ms, high_ms, reference="{reference}"), and count low_ms and high_ms from there. If not, '
        "correct what the device's describe() returns."
    )


def require_matching(info: DeviceInfo, strategy: Strategy, protocol: VisitProtocol) -> None:
    """Raise if the strategy would misread the device's answers, or the device cannot do what the protocol asks."""
    if info.reference != strategy.space.reference:
        raise DeviceError(
            "the device and the design space count ISIs from different events",
            got=f"{info.reference} from the device, {strategy.space.reference} in the space",
            expected="the same one",
            remedy=own_reference(info.reference),
        )
    assumed = getattr(profile_of(strategy.model), "stimulus", info.conditioning)
    if info.conditioning not in {"tap", assumed}:  # a tap is also what a device says that states nothing
        raise DeviceError(
            "the device's conditioning stimulus is not the one that the strategy expects, so windows would be missed",
            got=info.conditioning,
            expected=assumed,
            remedy=f'Make the strategy with the device\'s: make_strategy(..., conditioning="{info.conditioning}").',
        )
    if protocol.tap_alone and not info.tap_alone:
        raise DeviceError(
            "the protocol has trials with a tap alone, and the device does not deliver these",
            got=info.name,
            remedy="Set the protocol's tap_alone to 0. Or let the device's deliver leave out the pulse where "
            "stimulus.tap_alone is True, and describe it with DeviceInfo(..., tap_alone=True).",
        )
    if (strategy.intensities or protocol.alone_pct_rmt is not None) and not info.sets_intensity:
        raise DeviceError(
            "the session has pulses of several intensities, and the device sets none",
            got=info.name,
            remedy="Leave out intensities_pct_rmt and alone_pct_rmt. Or let the device's deliver set "
            "stimulus.intensity_pct_rmt before the pulse, and describe it with DeviceInfo(..., sets_intensity=True).",
        )
    for name in info.channels:
        waveform_topic(name)
    if "emg" in info.channels:  # an acceleration is not read where the device itself knows the time of the hit
        choice("the unit of the channel emg", info.channels["emg"], EMG_UNITS_MV)
    limit_mv, assumed_mv = info.detection_limit_mv, strategy.detection_limit_mv
    if limit_mv is not None and assumed_mv is not None and not math.isclose(limit_mv, assumed_mv):
        raise DeviceError(
            "the device and the strategy have different detection limits, so an MEP of 0 would be misunderstood",
            got=f"{limit_mv:g} mV from the device",
            expected=f"{assumed_mv:g} mV, as the strategy assumes",
            remedy=f"Make the strategy with the device's: make_strategy(..., detection_limit_mv={limit_mv:g}).",
        )
