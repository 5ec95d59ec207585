"""A wrapper around any device that keeps a deadline for each of its verbs, and disarms it whatever it does."""

from __future__ import annotations

import contextvars
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from isiw.checks import Checked, Count, Patience
from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import Answer, Device, Readiness, ReportsReadiness, info_of, readiness_of, require_staged
from isiw.errors import DeviceError, DeviceTimeoutError, StillArmedError, error_text
from isiw.trials import Stimulus

_T = TypeVar("_T")

_GLANCE_S = 0.05  # Windows lets no signal interrupt a wait, so none is longer


@dataclass(frozen=True)
class Deadlines(Checked):
    """Time limits of a device's verbs; that of a delivery is the session's `timeout_s`.

    Args:
        describe_s: `describe` [s].
        stage_s: `stage` [s].
        readiness_s: `readiness` [s].
        stop_s: each attempt at `stop` [s].
        unstage_s: `unstage` [s].
        stop_attempts: how often `stop` is tried before the device counts as still armed.

    Raises:
        InvalidValueError: a time that is not positive, or no attempt at all.
    """

    describe_s: Patience = 10.0
    stage_s: Patience = 60.0
    readiness_s: Patience = 5.0
    stop_s: Patience = 5.0
    unstage_s: Patience = 10.0
    stop_attempts: Count = 3


class _Call(Generic[_T]):
    """One verb that another thread works on."""

    def __init__(self, verb: Callable[[], _T]) -> None:
        self._verb, self._context = verb, contextvars.copy_context()
        self._began_s, self._ended_s = time.monotonic(), 0.0
        self._ended = threading.Event()
        self._result: _T
        self._error: BaseException | None = None

    def run(self) -> None:
        try:
            self._result = self._context.run(self._verb)
        except BaseException as error:  # noqa: BLE001 - handed over to whoever waits for the result
            self._error = error
        self._ended_s = time.monotonic()
        self._ended.set()

    @property
    def ended(self) -> bool:
        return self._ended.is_set()

    @property
    def age_s(self) -> float:
        return time.monotonic() - self._began_s

    def kept(self, deadline_s: float) -> bool:
        return self.ended and self._ended_s - self._began_s <= deadline_s

    def wait(self, deadline_s: float, given_up: Callable[[], bool] = lambda: False) -> None:
        """Wait until it ends, or so long after it began [s], or until nobody waits any more."""
        while not self.ended and (left_s := self._began_s + deadline_s - time.monotonic()) > 0 and not given_up():
            self._ended.wait(min(left_s, _GLANCE_S))

    def failed_with(self, error: Exception) -> bool:
        return self._error is error

    def result(self) -> _T:
        if self._error is not None:
            raise self._error
        return self._result


class _Worker:
    """A thread that works on one verb after the other; it does not keep the process from ending."""

    def __init__(self) -> None:
        self._calls: queue.SimpleQueue[_Call[Any] | None] = queue.SimpleQueue()
        self._last: _Call[Any] | None = None
        threading.Thread(target=self._work, name="isiw device", daemon=True).start()

    @property
    def idle(self) -> bool:
        return self._last is None or self._last.ended

    def begin(self, verb: Callable[[], _T]) -> _Call[_T]:
        call = self._last = _Call(verb)
        self._calls.put(call)
        return call

    def end(self) -> None:
        self._calls.put(None)

    def _work(self) -> None:
        while (call := self._calls.get()) is not None:
            call.run()


_abandoned: list[tuple[Device, str, _Call[Any]]] = []
"""Verbs of any session that were given up and may still be busy: each may yet arm what is at its address, or fire."""

_looking = threading.Lock()


def _abandoned_of(device: Device, address: str) -> list[_Call[Any]]:
    """The calls of a device that were given up and are still busy, also of another object of the same address."""
    with _looking:
        _abandoned[:] = [each for each in _abandoned if not each[2].ended]
        return [call for whose, at, call in _abandoned if whose is device or (at and at == address)]


class PunctualDevice:
    """A device whose verbs end in time, or are given up and followed by `stop` from outside.

    All verbs run in one thread, one after the other. One that is given up may still be busy: when it ends, the device
    is disarmed once more, in case it armed it, and until then nobody arms the device.
    """

    def __init__(
        self,
        device: Device,
        deadlines: Deadlines | None = None,
        *,
        given_up: Callable[[], bool] = lambda: False,
        report: Callable[[str], None] = lambda _: None,
        still_armed: Callable[[StillArmedError], object] = lambda _: None,
    ) -> None:
        self._device, self._deadlines = device, deadlines or Deadlines()
        self._given_up, self._report, self._still_armed = given_up, report, still_armed
        self._name, self._address = type(device).__name__, ""
        self._stopping = threading.RLock()
        # Whether it was ever staged; and since the last time, whether it was stopped, and that with no other verb busy.
        self._staged = self._stopped = self._disarmed = False
        self._late: _Call[Answer] | None = None
        self._worker: _Worker | None = None
        self._owner = threading.get_ident()
        self._info = self._within("describe", partial(info_of, device), self._deadlines.describe_s)
        self._name, self._address = self._info.name, self._info.address

    def describe(self) -> DeviceInfo:
        """The description of the device, as it was at first."""
        return self._info

    def stage(self) -> None:
        """Get ready and arm."""
        for call in self._abandoned:
            call.wait(call.age_s + self._deadlines.stop_s)
        with self._stopping:  # else a `stop` that comes meanwhile would take the device for disarmed
            if self._abandoned:
                raise DeviceError(
                    "the device was not armed: an earlier call, for which isiw no longer waits, is still running and "
                    "could still fire",
                    got=self._name,
                    remedy="Check the device, try again; or end this process, and resume the session if it has a log.",
                )
            self._staged, self._stopped, self._disarmed = True, False, False
            call = self._begun(self._device.stage)
        self._awaited("stage", call, self._deadlines.stage_s)

    def readiness(self) -> Readiness:
        """The state that the device reports; ready, if it cannot report one."""
        if not isinstance(self._device, ReportsReadiness):
            return Readiness()
        return self._within("readiness", partial(readiness_of, self._device), self._deadlines.readiness_s)

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Deliver one pair of stimuli."""
        with self._stopping:
            require_staged(self._name, staged=not self._stopped)
            call = self._begun(partial(self._device.deliver, stimulus, timeout_s))
        self._late = call
        try:
            return self._awaited("deliver", call, timeout_s, self._given_up)
        except Exception as error:
            if call.failed_with(error):  # in time, and whoever waits is told
                self._late = None
            raise

    def late_answer(self, wait_s: float) -> Answer | None:
        """The answer to the last delivery that came after its deadline; None if none did."""
        late = self._late
        if late is None:
            return None
        late.wait(late.age_s + wait_s)
        try:
            return late.result() if late.ended else None
        except Exception as error:  # noqa: BLE001 - whatever a device fails with too late is reported
            self._report(f"After its deadline the delivery failed: {error_text(error)}")
            return None

    def stop(self) -> None:
        """Disarm, unless it is disarmed and no other verb is busy."""
        with self._stopping:
            if not self._disarmed:
                self._stopped, idle = True, self._idle
                self._stop()
                self._disarmed = idle

    def _stop(self) -> None:
        failure = None
        for attempt in range(1, self._deadlines.stop_attempts + 1):
            failure = self._failure_to_stop()
            if failure is None:
                return
            self._report(f"Attempt {attempt} to disarm failed: {failure}")
        raise StillArmedError(
            "the device cannot be disarmed",
            got=f"{self._name}: {failure}",
            remedy="Cut its power or open the interlock now.",
        )

    @property
    def _abandoned(self) -> list[_Call[Any]]:
        return _abandoned_of(self._device, self._address)

    @property
    def _idle(self) -> bool:
        return not self._abandoned and (self._worker is None or self._worker.idle)

    def unstage(self) -> None:
        """Let go of what `stage` took."""
        self._within("unstage", self._device.unstage, self._deadlines.unstage_s)

    def release_thread(self) -> None:
        """Let the thread end; a verb that follows gets a new one."""
        if self._worker is not None:
            self._worker.end()
            self._worker = None

    def _begun(self, verb: Callable[[], _T]) -> _Call[_T]:
        self._owner = threading.get_ident()
        self._worker = self._worker or _Worker()
        return self._worker.begin(verb)

    def _within(self, name: str, verb: Callable[[], _T], deadline_s: float) -> _T:
        return self._awaited(name, self._begun(verb), deadline_s)

    def _awaited(
        self, name: str, call: _Call[_T], deadline_s: float, given_up: Callable[[], bool] = lambda: False
    ) -> _T:
        try:
            call.wait(deadline_s, given_up)
        finally:
            if not call.ended:
                self._give_up()
        if call.kept(deadline_s):
            return call.result()
        error = DeviceTimeoutError(
            f"the device did not answer in time: {name}",
            got=self._name if name != "describe" else None,
            expected=f"an answer within {deadline_s:g} s",
            remedy="The device was disarmed. Check it, then start again; if the session has a log, resume it."
            if name != "describe"
            else "Nothing was armed by this session. Check the device, then start again.",
        )
        if name != "describe":
            try:
                self.stop()
            except StillArmedError as armed:
                raise armed from error
        raise error

    def _give_up(self) -> None:
        """Leave the thread to the verb it is busy with; when that ends it disarms the device once more, and ends."""
        if self._worker is not None:
            late = self._worker.begin(self._stop_late)
            with _looking:
                _abandoned.append((self._device, self._address, late))
        self.release_thread()

    def _stop_late(self) -> None:
        try:
            with self._stopping:
                self._stop()
        except StillArmedError as error:
            if self._staged:  # else nobody has armed it, and `stop` may fail because it was never reached
                self._still_armed(error)

    def _failure_to_stop(self) -> str | None:
        """Why an attempt to disarm failed; None if it did not."""
        own = self._idle and self._owner == threading.get_ident()
        outside = None if own else _Worker()
        call = self._begun(self._device.stop) if outside is None else outside.begin(self._device.stop)
        if outside is not None:
            outside.end()
        call.wait(self._deadlines.stop_s)
        if not call.ended:
            if own:
                self._give_up()
            return f"no return within {self._deadlines.stop_s:g} s"
        try:
            call.result()
        except BaseException as error:  # noqa: BLE001 - whatever it is, the device may still be armed
            return error_text(error)
        return None
