"""The sketch of the Arduino timer, compiled for this computer and driven by `LineDevice` over a pseudo-terminal.

Its own code runs, on stand-ins for the board's registers; `test_machine_code.py` tries the machine code of the board.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from benchmarks.dying_rigs import compiled_sketch
from benchmarks.simulated_board import Port, device_of_the_page

import isiw
from isiw.errors import DeviceError, NotDelivered
from isiw.sweeps import Measurement
from isiw.testing import check_device
from isiw.trials import Stimulus
from waiting import until

SPACE = isiw.DesignSpace(0, 120, reference="valve")

pytestmark = [
    pytest.mark.slow,  # the sketch is compiled for each board
    pytest.mark.skipif(shutil.which("g++") is None or sys.platform == "win32", reason="needs g++ and pseudo-terminals"),
]


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
    return compiled_sketch(tmp_path_factory.mktemp("sketch"))


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


@pytest.fixture
def device(board: Board) -> Iterator[Any]:
    device = device_of_the_page(board.address, 0.0)
    device.stage()
    yield device
    device.unstage()


def test_the_example_of_the_page_conforms_on_the_sketch(board: Board) -> None:
    check_device(lambda: device_of_the_page(board.address, 0.0), SPACE, timeout_s=2.0, iti_s=0.0, say=lambda _: None)
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
    with Port(board.address) as port:
        port.say("1 SET 1000000", "2 ARM", "3 FIRE")
        until(lambda: ("valve", True) in [(pin, high) for pin, high, _ in board.edges])
        port.ask("4 DISARM", "4 DISARMED")
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
        ("7 FIRE", "7 ERR not armed"),
        ("7 GET", "7 ERR no ISI is set"),
        ("7 SET 1000001", "7 ERR too long"),
        ("7 SET -5", "7 ERR no time"),
        ("7 SET 5x", "7 ERR no time"),
        ("7 SET", "7 ERR no time"),
        ("7 DANCE", "7 ERR unknown command"),
        ("7 ", "7 ERR no command"),
        ("7", "0 ERR no number"),
    ],
)
def test_the_sketch_refuses_what_it_cannot_do(board: Board, said: str, answer: str) -> None:
    with Port(board.address) as port:
        port.ask("1 ARM", "1 ARMED")
        if "FIRE" in said:
            port.ask("2 DISARM", "2 DISARMED")
        port.ask(said, answer)
        port.ask("8 ALONE", "8 ERR not armed" if "GET" not in said else "8 FIRED")
    assert [pin for pin, _ in board.rises] == (["trigger"] if "GET" in said else [])


def test_a_line_without_end_is_no_line(board: Board) -> None:
    with Port(board.address) as port:
        port.write(b"9" * 5000 + b"\n")
        port.ask("7 DISARM", "7 DISARMED")


def test_arming_is_for_two_seconds_at_most_and_for_one_stimulus(board: Board) -> None:
    with Port(board.address) as port:
        port.ask("1 ARM", "1 ARMED")
        for _ in range(7):
            time.sleep(0.3)
            port.say("2 BEAT")
        port.ask("2 ALONE", "2 ERR not armed")
        port.ask("3 ARM", "3 ARMED")
        port.ask("4 ALONE", "4 FIRED")
        port.ask("5 ALONE", "5 ERR not armed")
    assert board.rises == [("trigger", 1040.0)]
