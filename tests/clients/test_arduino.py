"""The sketch of the Arduino timer, compiled for this computer and driven by `LineDevice` over a pseudo-terminal.

Its own code runs, on stand-ins for the board's registers; it is not tried on a board here.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import pytest

import isiw
from isiw.errors import DeviceError, NotDelivered
from isiw.testing import check_device
from isiw.trials import Measurement, Stimulus

ROOT = Path(__file__).parents[2]
SPACE = isiw.DesignSpace(0, 120, reference="valve")

pytestmark = pytest.mark.skipif(
    shutil.which("g++") is None or sys.platform == "win32", reason="needs g++ and pseudo-terminals"
)


@dataclass(frozen=True)
class Board:
    """A running sketch: where it is reached, and what happens to its pins."""

    address: str
    edges_file: Path
    interlock_file: Path
    process: subprocess.Popen[bytes]

    @property
    def edges(self) -> list[tuple[str, bool, float]]:
        """Pin, level and time since the timer's start [µs]; negative for a level that was forced."""
        text = self.edges_file.read_text() if self.edges_file.exists() else ""
        return [(pin, level == "1", float(us)) for pin, level, us in map(str.split, text.splitlines())]

    @property
    def rises(self) -> list[tuple[str, float]]:
        return [(pin, us) for pin, high, us in self.edges if high]


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("sketch") / "timer"
    source = ROOT / "tests" / "clients" / "arduino" / "main.cpp"
    command = [str(shutil.which("g++")), "-std=c++17", "-Wall", "-Wextra", "-Werror", "-o", str(made), str(source)]
    subprocess.run(command, check=True)  # noqa: S603 - our own source
    return made


@pytest.fixture
def board(program: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Board]:
    import pty  # noqa: PLC0415 - not on Windows
    import tty  # noqa: PLC0415 - same

    edges, interlock = tmp_path / "edges", tmp_path / "interlock is open"
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    environment = {"EDGES": str(edges), "INTERLOCK": str(interlock), **getattr(request, "param", {})}
    with subprocess.Popen([program], stdin=ours, stdout=ours, env=environment) as process:  # noqa: S603 - our own
        yield Board(os.ttyname(theirs), edges, interlock, process)
        process.kill()
    os.close(ours)
    os.close(theirs)


def device_of_the_page(address: str) -> Any:
    """What the example of the page makes."""
    page = (ROOT / "docs" / "lab" / "arduino.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(example, "arduino.md", "exec"), names)  # noqa: S102 - the point of the test
    return names["make"](address)


@pytest.fixture
def device(board: Board) -> Iterator[Any]:
    device = device_of_the_page(board.address)
    device.stage()
    yield device
    device.unstage()


def test_the_example_of_the_page_conforms_on_the_sketch(board: Board) -> None:
    check_device(lambda: device_of_the_page(board.address), SPACE, timeout_s=2.0, iti_s=0.0, say=lambda _: None)
    assert [pin for pin, _ in board.rises] == ["valve", "trigger"] + ["trigger"] + ["valve", "trigger"] * 2 + ["valve"]


@pytest.mark.parametrize("isi_ms", [0.0, 10.0, 47.0, 100.0])
def test_the_trigger_comes_the_isi_after_the_valve_to_half_a_tick(device: Any, board: Board, isi_ms: float) -> None:
    answer = device.deliver(Stimulus(0, isi_ms), 2.0)
    (_, valve_us), (_, trigger_us) = sorted(board.rises, key=lambda rise: rise[0] == "trigger")
    assert abs(trigger_us - valve_us - 1e3 * isi_ms) <= 8
    assert isinstance(answer, Measurement)
    assert answer.isi_ms is not None
    assert abs(1e3 * answer.isi_ms - (trigger_us - valve_us)) < 1e-3


def test_both_outputs_are_low_again_after_their_time(device: Any, board: Board) -> None:
    device.deliver(Stimulus(0, 20.0), 2.0)
    ends = {pin: us for pin, high, us in board.edges if not high}
    starts = dict(board.rises)
    assert ends["valve"] - starts["valve"] == pytest.approx(60_000, abs=32)
    assert ends["trigger"] - starts["trigger"] == pytest.approx(1_008, abs=32)


def test_an_open_interlock_refuses_before_firing(device: Any, board: Board) -> None:
    board.interlock_file.touch()
    with pytest.raises(NotDelivered, match="interlock is open"):
        device.deliver(Stimulus(0, 20.0), 2.0)
    assert board.edges == []


def test_disarming_on_the_way_gives_no_trigger_any_more_and_the_next_stimulus_begins_low(
    device: Any, board: Board
) -> None:
    with open_port(board) as port:
        port.write(b"1 SET 1000000\n2 ARM\n3 FIRE\n")
        until(lambda: ("valve", True) in [(pin, high) for pin, high, _ in board.edges])
        port.write(b"4 DISARM\n")
        until(lambda: b"4 DISARMED" in seen(port))
    assert [pin for pin, _ in board.rises] == ["valve"]
    assert board.edges[-1] == ("valve", False, -16)
    device.stage()
    device.deliver(Stimulus(1, 20.0), 2.0)
    assert [pin for pin, _ in board.rises] == ["valve", "valve", "trigger"]
    assert min(us for _, us in board.rises) > 1000


@pytest.mark.parametrize("board", [{"NO_JUMPER": "1"}], indirect=True)
def test_a_trigger_that_is_not_heard_is_no_success(device: Any) -> None:
    with pytest.raises(DeviceError, match="no trigger at pin 8"):
        device.deliver(Stimulus(0, 20.0), 2.0)


@pytest.mark.parametrize(
    ("said", "answer"),
    [
        (b"7 FIRE\n", b"7 ERR not armed"),
        (b"7 GET\n", b"7 ERR no ISI is set"),
        (b"7 SET 1000001\n", b"7 ERR too long"),
        (b"7 SET -5\n", b"7 ERR no time"),
        (b"7 SET 5x\n", b"7 ERR no time"),
        (b"7 SET\n", b"7 ERR no time"),
        (b"7 DANCE\n", b"7 ERR unknown command"),
        (b"7\n", b"7 ERR no command"),
        (b"9" * 5000 + b"\n7 DISARM\r\n", b"7 DISARMED"),
        (b"1 ARM\n2 SET 5000\n7 FIRE\n", b"7 ERR not armed"),
    ],
)
def test_the_sketch_refuses_what_it_cannot_do(board: Board, said: bytes, answer: bytes) -> None:
    with open_port(board) as port:
        port.write(said)
        until(lambda: answer in seen(port))
    assert board.edges == []


@pytest.mark.slow
def test_arming_is_for_two_seconds_and_for_one_stimulus(board: Board) -> None:
    with open_port(board) as port:
        port.write(b"1 ARM\n")
        time.sleep(2.05)
        port.write(b"2 ALONE\n")
        until(lambda: b"2 ERR not armed" in seen(port))
        port.write(b"3 ARM\n4 ALONE\n")
        until(lambda: b"4 FIRED" in seen(port))
        port.write(b"5 ALONE\n")
        until(lambda: b"5 ERR not armed" in seen(port))
    assert board.rises == [("trigger", 1040.0)]


class Port:
    """The board's port, and all that was read from it."""

    def __init__(self, address: str) -> None:
        self.handle = os.open(address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self.seen = b""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self.handle)

    def write(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self.handle, data) :]
            except BlockingIOError:
                time.sleep(0.001)


def open_port(board: Board) -> Port:
    return Port(board.address)


def seen(port: Port) -> bytes:
    with suppress(BlockingIOError):
        port.seen += os.read(port.handle, 4096)
    return port.seen


def until(true: Any, within_s: float = 3.0) -> None:
    end_s = time.monotonic() + within_s
    while not true():
        assert time.monotonic() < end_s
        time.sleep(0.002)
