"""An operator at a real terminal: keys, Ctrl-C, and a terminal that is always given back as it was."""

from __future__ import annotations

import os
import select
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Self

import pytest

from forked import run_and_end
from isiw.log.record import SessionRecord, read_session
from isiw.session.resuming import resume
from known import known
from scripted import ScriptedDevice, scripted_strategy

if os.name == "nt":
    pytest.skip("a POSIX terminal", allow_module_level=True)

import pty
import termios

TESTS = Path(__file__).parents[1]
PATIENCE_S = 60.0
TRIALS = 6
CTRL_C, CTRL_S, CTRL_Q, CTRL_Z = "\x03", "\x13", "\x11", "\x1a"

OPERATED = """
import sys
sys.path[:0] = [{tests!r}, {room!r}]
import signal
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from pathlib import Path
from isiw.devices.limits import Limits
from isiw.session.loop import Session
from isiw.sweeps import Measurement
from scripted import ScriptedDevice, scripted_strategy

folder = Path({folder!r})

class Rig(ScriptedDevice):
    def deliver(self, stimulus, timeout_s):
        loud = 50.0 if stimulus.trial == 1 else 1.0
        return Measurement(0.01 + stimulus.isi_ms / 1e4, stimulus.isi_ms, background_rms_uv=loud)

    def stage(self):
        (folder / "armed").touch()

    def stop(self):
        (folder / "armed").unlink(missing_ok=True)
        with (folder / "stopped").open("a") as file:
            file.write("stop\\n")

class Clock:
    "Real, but for an interval after each trial that lasts until the test lets the next one come."
    time_s = 0.0
    def now_s(self):
        return self.time_s
    def sleep_s(self, duration_s):
        import time
        if (folder / f"go{{len(session.trials)}}").exists():
            self.time_s += duration_s
        else:
            time.sleep(0.01)

session = Session(
    Rig(simulated=False), scripted_strategy({trials}), log=folder / "s.mcap", clock=Clock(),
    limits=Limits.of_space(scripted_strategy().space, min_iti_s=5.0),
)
print(session.run().decision.reason)
"""


class Operator:
    """Somebody at a terminal in which a session runs."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.seen = folder, ""
        self._status: int | None = None
        script = OPERATED.format(tests=str(TESTS), room=str(TESTS.parent / "src"), folder=str(folder), trials=TRIALS)
        self.process, self._terminal = pty.fork()
        if self.process == 0:
            run_and_end(script)
        self.settings = termios.tcgetattr(self._terminal)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._status is None:
            os.kill(self.process, signal.SIGKILL)
            os.waitpid(self.process, 0)
        os.close(self._terminal)

    @property
    def log(self) -> Path:
        return self.folder / "s.mcap"

    @property
    def record(self) -> SessionRecord:
        return read_session(self.log)

    @property
    def armed(self) -> bool:
        return (self.folder / "armed").exists()

    def let(self, *trials: int) -> None:
        """Let these trials come, and wait until the last one has."""
        for trial in trials:
            (self.folder / f"go{trial}").touch()
        self.sees(f"\n{trials[-1]} ")

    def press(self, keys: str) -> None:
        os.write(self._terminal, keys.encode())

    def sees(self, text: str) -> None:
        """Wait until a text is shown, behind what was seen before."""
        self.waits(lambda: text in self.seen, text)
        self.seen = self.seen.partition(text)[2]

    def waits(self, holds: Callable[[], bool], what: str) -> None:
        """Wait until something holds, reading what is shown."""
        end_s = time.monotonic() + PATIENCE_S
        while not holds():
            assert time.monotonic() < end_s, f"{what!r} did not come; shown since: {self.seen!r}"
            self._read()

    def ends(self) -> int:
        """Wait until the process has ended; its exit code."""

        def ended() -> bool:
            pid, status = os.waitpid(self.process, os.WNOHANG)
            self._status = status if pid else None
            return pid != 0

        self.waits(ended, "the end")
        self._read()
        return os.waitstatus_to_exitcode(known(self._status))

    def _read(self) -> None:
        ready, _, _ = select.select([self._terminal], [], [], 0.02)
        if ready:
            try:
                read = os.read(self._terminal, 65536).decode(errors="ignore").replace("\r", "")
                self.seen = (self.seen + read).replace("\x1b[K", "\n")  # a line that is written over
            except OSError:  # how a terminal ends whose process has
                time.sleep(0.02)

    @property
    def keeps_its_settings(self) -> bool:
        return termios.tcgetattr(self._terminal) == self.settings


@pytest.fixture
def operator(tmp_path: Path) -> Iterator[Operator]:
    with Operator(tmp_path) as somebody:
        yield somebody


def events(operator: Operator) -> list[tuple[str, int | None]]:
    return [(event.kind, event.trial) for event in operator.record.events]


@pytest.mark.slow
def test_every_key_is_an_event_and_a_killed_and_resumed_session_has_them_all(operator: Operator) -> None:
    operator.sees("Keys: p pause")
    operator.let(0, 1)
    operator.press("a")
    operator.sees("Trial 1 counts.")
    operator.let(2)
    operator.press("x")
    operator.sees("Trial 2 is excluded; u undoes it.")
    operator.press("u")
    operator.sees("Trial 2 counts again.")
    operator.press("j")
    operator.sees("Trial 2 is rejected and does not count.")
    operator.press("ncoil moved\n")
    operator.sees("The note is in the log.")
    operator.press("p")
    operator.sees("r continues")
    assert not operator.armed
    operator.press("r")
    operator.waits(lambda: operator.armed, "arming")
    operator.let(3)
    verdicts = [("acceptance", 1), ("exclusion", 2), ("inclusion", 2), ("exclusion", 2)]
    assert events(operator) == [*verdicts, ("note", 2), ("pause", 2), ("pause", 2)]
    os.kill(operator.process, signal.SIGKILL)
    assert operator.ends() == -signal.SIGKILL
    session = resume(operator.log, ScriptedDevice(simulated=False), scripted_strategy(TRIALS))
    assert [trial.told for trial in session.trials] == [True, True, False, True]


@pytest.mark.slow
def test_to_the_end_with_the_terminal_given_back(operator: Operator) -> None:
    operator.sees("Keys: p pause")
    assert not operator.keeps_its_settings
    operator.let(*range(TRIALS))
    operator.sees("The budget of 6 stimuli is used up.")
    operator.waits(lambda: operator.keeps_its_settings, "the settings")
    assert operator.ends() == 0


@pytest.mark.slow
def test_q_ends_a_paused_session_which_can_be_resumed(operator: Operator) -> None:
    operator.let(0)
    operator.press("p")
    operator.sees("q ends the session")
    operator.press("q")
    operator.sees("The session is paused: Paused by the operator.")
    operator.waits(lambda: operator.keeps_its_settings, "the settings")
    assert operator.ends() == 0
    assert len(resume(operator.log, ScriptedDevice(simulated=False), scripted_strategy(TRIALS)).trials) == 1


UP, F2, F3, ALT_R = "\x1b[A", "\x1bOQ", "\x1bOR", "\x1br"


@pytest.mark.slow
def test_arrows_and_function_keys_decide_nothing(operator: Operator) -> None:
    operator.let(0, 1)
    operator.press("p")
    operator.sees("q ends the session")
    for key in (F3, F2, UP, ALT_R):
        operator.press(key)
    operator.press("?")
    operator.sees("Keys: p pause")
    assert not operator.armed
    assert events(operator) == [("pause", 1)]
    operator.press("r")
    operator.waits(lambda: operator.armed, "arming")


@pytest.mark.slow
def test_ctrl_c_disarms_pauses_and_asks_and_twice_ends(operator: Operator) -> None:
    operator.let(0)
    operator.press(CTRL_C)
    operator.sees("Interrupted by the operator. The device is disarmed. r continues")
    assert not operator.armed
    operator.press("r")
    operator.waits(lambda: operator.armed, "arming")
    operator.let(1)
    operator.press(CTRL_C)
    operator.sees("r continues")
    operator.press(CTRL_C)
    operator.waits(lambda: operator.keeps_its_settings, "the settings")
    assert operator.ends() != 0
    assert not operator.armed
    assert operator.record.finished
    assert [kind for kind, _ in events(operator)] == ["pause"] * 4


@pytest.mark.slow
@pytest.mark.parametrize("key", ["p", CTRL_C])
def test_a_terminal_that_takes_no_output_delays_no_disarming(operator: Operator, key: str) -> None:
    operator.let(0)
    operator.press(CTRL_S)
    operator.press("?" * 300)  # more than any terminal keeps, were somebody to wait for it
    operator.press(key)
    stopped = operator.folder / "stopped"
    operator.waits(lambda: not operator.armed and stopped.exists() and stopped.read_text() == "stop\n", "disarming")
    operator.press(CTRL_Q)
    operator.sees("r continues")


def test_a_request_to_end_gives_the_terminal_back(operator: Operator) -> None:
    operator.let(0)
    os.kill(operator.process, signal.SIGTERM)
    operator.waits(lambda: operator.keeps_its_settings, "the settings")
    assert operator.ends() != 0
    assert operator.record.finished


def test_while_suspended_the_terminal_is_as_it_was_and_the_device_disarmed(operator: Operator) -> None:
    operator.let(0)
    operator.press(CTRL_Z)
    operator.waits(lambda: os.waitpid(operator.process, os.WNOHANG | os.WUNTRACED)[0] != 0, "being suspended")
    assert operator.keeps_its_settings
    assert not operator.armed
    os.kill(operator.process, signal.SIGCONT)
    operator.sees("r continues")
    operator.press("r")
    operator.waits(lambda: operator.armed, "arming")
    operator.let(1)
