"""An instrument that is commanded by lines of text, over a serial port or TCP; a table has the words.

What fails before the command to fire is sent gave nothing; what fails after it may have fired. It is sent once.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from isiw.checks import text
from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import Answer, Readiness, require_staged
from isiw.devices.transports.exchange import described, from_table
from isiw.devices.transports.line_exchange import Line, LineSettings
from isiw.devices.transports.line_table import (
    LineCommands,
    LineExchange,
    has_handle,
    isi_ms_of,
    mep_mv_of,
    number_of,
    open_connection,
    require_address,
)
from isiw.errors import DeviceError, InvalidValueError, IsiwError, LimitExceededError, NotDelivered, error_text
from isiw.sweeps import Measurement
from isiw.trials import Stimulus

_SPARE_S = 0.1
_MOST_TRIES = 10


class LineDevice:
    """An instrument that exchanges lines of text. It times the ISI; nothing here does.

    Args:
        address: "COM3", "/dev/ttyUSB0" or "socket://192.168.0.20:5000"; a serial port needs the extra `isiw[serial]`.
        info: what it is, as in `isiw.DeviceInfo`: at least name and reference.
        commands: what it understands, as in `LineCommands`.
        line: how lines are exchanged, as in `LineSettings`.
        measure: returns the `Measurement` or `Sweep` of the stimulus that was just given, if the instrument measures
            no MEP; takes the stimulus, the realised ISI as the instrument says it (None for a control trial) and the
            time that is left [s].

    Raises:
        InvalidValueError: an incomplete address, a table that lacks something, or no command or two measure the MEP.
    """

    def __init__(
        self,
        address: str,
        info: Mapping[str, Any],
        commands: Mapping[str, Any] | LineCommands,
        line: Mapping[str, Any] | LineSettings | None = None,
        measure: Callable[[Stimulus, float | None, float], Answer] | None = None,
    ) -> None:
        require_address(text("address", address))
        self._commands = from_table(LineCommands, commands, "commands")
        self._settings = from_table(LineSettings, line or {}, "line")
        self._watched = self._settings.watchdog and has_handle(address)
        guard = "watchdog" if self._watched else "heartbeat" if self._commands.heartbeat is not None else None
        known = {} if guard is None else {"if_isiw_dies": guard}
        self._info = described(info, address=address, tap_alone=self._commands.tap_alone is not None, **known)
        self._measure = measure
        measuring = self._commands.measuring
        if not (all(measuring) if measure is None else not any(measuring)):
            raise InvalidValueError(
                "each MEP must be measured by the instrument or by `measure`, and by one of them only",
                expected=r"(?P<mep_mv>[\d.]+) in the answers to fire and alone, or to result; or a function `measure`",
            )
        self._line: Line | None = None
        self._busy, self._stopping = threading.Lock(), threading.Lock()
        self._since_stop = object()  # another one after each stop: what began before it sends nothing any more
        self._staged = self._may_be_armed = False

    def describe(self) -> DeviceInfo:
        """The instrument's description."""
        return self._info

    def readiness(self) -> Readiness:
        """The state that the instrument reports; ready, if the table has no status."""
        if self._commands.status is None:
            return Readiness()
        with _nothing_given():
            era, status = self._since_stop, self._commands.status
            self._connect(era, math.inf)
            said = self._ask(era, status, end_s=time.monotonic() + self._limit_s(status))
            return Readiness(coil_c=number_of(said, "coil_c"), intensity_pct_mso=number_of(said, "intensity_pct_mso"))

    def stage(self) -> None:
        """Open a connection, and have the instrument confirm that it is disarmed; each trial arms it."""
        era = self._since_stop
        self._close()
        self._connect(era, math.inf)
        if self._commands.acknowledge is not None:
            self._ask(era, self._commands.acknowledge, end_s=math.inf)
        with self._turn(era):
            self._staged = True

    def deliver(self, stimulus: Stimulus, timeout_s: float) -> Answer:
        """Set the ISI, read it back, arm, fire once, and report what came of it."""
        era, end_s = self._since_stop, time.monotonic() + timeout_s - min(_SPARE_S, 0.1 * timeout_s)
        require_staged(self._info.name, staged=self._staged)
        control = self._commands.tap_alone if stimulus.tap_alone else self._commands.alone
        if (command := self._commands.fire if stimulus.isi_ms is not None else control) is None:
            raise NotDelivered(f"{self._info.name} has no command for a tap alone")
        with _nothing_given():
            self._connect(era, end_s)
            self._prepare(era, stimulus, end_s)
        said = self._ask(era, command, stimulus, end_s=end_s)
        try:
            return self._outcome(era, stimulus, said, end_s)
        except Exception as error:
            if isinstance(error, DeviceError) and not isinstance(error, NotDelivered | LimitExceededError):
                raise
            raise DeviceError(
                "the command to fire was sent, so the stimulus may have been given; its outcome is not known: "
                f"{error_text(error)}"
            ) from error

    def die_armed(self, timeout_s: float) -> float | None:
        """The time until the instrument is disarmed if a process dies that armed it [s]; None without a watchdog."""
        if not self._watched:
            return None
        with self._turn(self._since_stop) as line:
            self._may_be_armed = True
            took_s = line.die_armed(self._commands.arm, self._commands.disarm, timeout_s)
            self._may_be_armed = False
            return took_s

    def stop(self) -> None:
        """Disarm: over the connection that there is, or over a fresh one if that one fails."""
        self._staged, self._since_stop = False, object()
        with self._stopping:
            if self._busy.acquire(timeout=self._settings.timeout_s):
                try:
                    if self._disarmed_over_this():
                        return
                finally:
                    self._busy.release()
            self._close()
            self._line = self._opened()

    def unstage(self) -> None:
        """Disarm, and close the connection."""
        try:
            self.stop()
        finally:
            self._close()

    def _prepare(self, era: object, stimulus: Stimulus, end_s: float) -> None:
        """Everything of a trial but its firing."""
        if stimulus.isi_ms is not None:
            self._ask(era, self._commands.set, stimulus, end_s=end_s)
            read_ms = isi_ms_of(self._ask(era, self._commands.read_back, stimulus, end_s=end_s))
            if read_ms is None or abs(read_ms - stimulus.isi_ms) > self._settings.isi_tolerance_ms:
                raise NotDelivered(
                    "the instrument holds another ISI than it was set to",
                    got=read_ms,
                    expected=f"{stimulus.isi_ms:g} ms",
                )
        self._ask(era, self._commands.arm, stimulus, end_s=end_s)
        if time.monotonic() >= end_s:
            raise NotDelivered("no time is left to fire", remedy="Give the session a longer timeout_s.")

    def _outcome(self, era: object, stimulus: Stimulus, said: Mapping[str, str], end_s: float) -> Answer:
        if self._commands.result is not None:
            said = {**said, **self._ask(era, self._commands.result, stimulus, end_s=end_s)}
        isi_ms, mep_mv = isi_ms_of(said), mep_mv_of(said)
        if stimulus.isi_ms is not None and isi_ms is None:
            raise DeviceError("the instrument does not say which ISI it gave", got=dict(said))
        if self._measure is not None:
            return self._measure(stimulus, isi_ms, max(0.0, end_s - time.monotonic()))
        if mep_mv is None:
            raise DeviceError("the instrument does not say which MEP it measured", got=dict(said))
        return Measurement(mep_mv, isi_ms, background_rms_uv=number_of(said, "background_rms_uv"))

    def _ask(
        self, era: object, exchange: LineExchange, stimulus: Stimulus | None = None, *, end_s: float
    ) -> dict[str, str]:
        """One exchange, unless the device was stopped since."""
        with self._turn(era) as line:
            if exchange is self._commands.arm:
                self._may_be_armed = True
            return line.ask(
                exchange,
                0 if stimulus is None else stimulus.trial,
                None if stimulus is None else stimulus.isi_ms,
                timeout_s=max(0.0, min(end_s - time.monotonic(), self._limit_s(exchange))),
                given_up=lambda: self._since_stop is not era,
                heartbeat=self._commands.heartbeat if exchange in self._commands.firing else None,
            )

    def _limit_s(self, exchange: LineExchange) -> float:
        """The longest that an answer may take [s]; commands that fire and measure have all the time that is left."""
        if exchange.timeout_s is not None:
            return exchange.timeout_s
        patient = (*self._commands.firing, self._commands.result)
        return math.inf if any(exchange is each for each in patient) else self._settings.timeout_s

    @contextmanager
    def _turn(self, era: object) -> Iterator[Line]:
        """Within, the connection is ours; nothing is sent any more that began before a stop."""
        with self._busy:
            if self._since_stop is not era:
                raise NotDelivered(f"{self._info.name} was stopped", remedy="Call stage() first.")
            if self._line is None:
                raise NotDelivered(f"{self._info.name} has no connection", remedy="Call stage() first.")
            yield self._line

    def _connect(self, era: object, end_s: float) -> None:
        """See to it that there is a connection that can be trusted, while nothing is in flight."""
        with self._busy, suppress(DeviceError):
            if self._line is not None and self._line.trusted:
                self._line.drain()  # it fails if the connection broke while nothing was in flight
                self._watch(self._line)
                return
        self._close()
        line = self._opened(end_s, lambda: self._since_stop is not era)
        self._greet(line)
        with self._busy:
            if self._since_stop is era:
                self._line = line
                return
        line.close()
        raise NotDelivered(f"{self._info.name} was stopped", remedy="Call stage() first.")

    def _greet(self, line: Line) -> None:
        """See to it that the instrument is what `info` says, and disarmed if isiw dies."""
        try:
            if self._commands.hello is not None:
                said = line.ask(self._commands.hello, timeout_s=self._limit_s(self._commands.hello))
                self._require_limits(said)
            self._watch(line)
        except IsiwError:
            line.close()
            raise

    def _require_limits(self, said: Mapping[str, str]) -> None:
        """Raise if the instrument states other limits than `info`."""
        shortest_ms = number_of(said, "shortest_iti_ms")
        stated = {
            "shortest_iti_s": None if shortest_ms is None else 1e-3 * shortest_ms,
            "most_pulses": number_of(said, "most_pulses"),
        }
        for name, value in stated.items():
            if value is not None and value != (known := getattr(self._info, name)):
                raise DeviceError(
                    f"the instrument has another {name} than its info says",
                    got=f"{value:g}",
                    expected=f"{known}",
                    remedy=f"Write {name} = {value:g} into info, or change it in the instrument.",
                )

    def _watch(self, line: Line) -> None:
        if self._watched:
            line.watch(self._commands.disarm)

    def _opened(self, end_s: float = math.inf, given_up: Callable[[], bool] = lambda: False) -> Line:
        """A fresh connection over which the instrument has confirmed that it is disarmed."""
        end_s = min(end_s, time.monotonic() + self._settings.connect_s)
        try:
            connection = open_connection(self._info.address, self._settings.baud, self._settings.timeout_s)
        except OSError as error:
            raise DeviceError(f"the instrument cannot be reached: {error}", got=self._info.address) from error
        line = Line(connection, self._settings, self._commands.refusal)
        try:
            self._disarm_until(line, end_s, given_up)
        except BaseException:
            line.close()
            raise
        self._may_be_armed = False
        return line

    def _disarm_until(self, line: Line, end_s: float, given_up: Callable[[], bool]) -> None:
        """Send disarm until it is confirmed: a board whose port has just been opened may still be starting."""
        disarm = self._commands.disarm
        for tried in range(1, _MOST_TRIES + 1):
            left_s = max(0.0, end_s - time.monotonic())
            try:
                line.ask(disarm, timeout_s=min(left_s, self._limit_s(disarm)), given_up=given_up)
            except DeviceError as error:
                if tried == _MOST_TRIES or given_up() or time.monotonic() >= end_s:
                    raise DeviceError(
                        f"the instrument does not confirm that it is disarmed: {error}",
                        remedy="It may still be armed. Switch it off or open the interlock, then check the connection.",
                    ) from error
            else:
                return

    def _disarmed_over_this(self) -> bool:
        """True if the instrument confirms over the present connection that it is disarmed, or was never reached."""
        line = self._line
        if line is None:
            return not self._may_be_armed
        is_certain = line.trusted or self._commands.disarm.numbered
        try:
            line.ask(self._commands.disarm, timeout_s=self._limit_s(self._commands.disarm))
        except DeviceError:
            return False
        self._may_be_armed = self._may_be_armed and not is_certain
        return is_certain

    def _close(self) -> None:
        line, self._line = self._line, None
        if line is not None:
            line.close()


@contextmanager
def _nothing_given() -> Iterator[None]:
    """Within, nothing has been fired yet: whatever fails, nothing was given."""
    try:
        yield
    except NotDelivered:
        raise
    except IsiwError as error:
        raise NotDelivered(f"nothing was given: {error}") from error
