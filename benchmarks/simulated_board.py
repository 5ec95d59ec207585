"""The Arduino's machine code in simavr, cycle by cycle: compiled, run behind a pseudo-terminal, and its pins read."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import isiw
from isiw.devices.transports.line_table import crc_of

__all__ = ["HZ", "SKETCH", "Board", "Edge", "Port", "board", "compiled", "device_of_the_page", "lacking", "pairs_of"]

HZ: Final = 16_000_000
ROOT: Final = Path(__file__).parents[1]
SKETCH: Final = ROOT / "tests" / "clients" / "arduino"
_PROGRAMS: Final = ("gcc", "avr-gcc", "simavr")


def lacking() -> str:
    """The programs that are not installed, of those that this needs; empty if all are."""
    return ", ".join(program for program in _PROGRAMS if shutil.which(program) is None)


def _run(*command: str) -> None:
    subprocess.run([shutil.which(command[0]) or command[0], *command[1:]], check=True)  # noqa: S603 - our own sources


def compiled(folder: Path, name: str = "board", **constants: int) -> Path:
    """The board's program; the simulator is put beside it.

    Args:
        folder: where both are put.
        name: the program's.
        constants: what a lab sets in the sketch, such as SHORTEST_INTERVAL_MS.
    """
    made = folder / f"{name}.elf"
    set_to = [f"-D{constant}={value}" for constant, value in constants.items()]
    strict = ["-Wall", "-Wextra", "-Werror"]
    board_options = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-std=gnu++11", "-Wno-type-limits"]
    _run("avr-gcc", *board_options, *strict, *set_to, "-o", str(made), str(SKETCH / "board.cpp"))
    if not (folder / "simboard").exists():
        _run("gcc", "-O2", *strict, "-o", str(folder / "simboard"), str(SKETCH / "simavr.c"), "-ldl")
    return made


@dataclass(frozen=True)
class Edge:
    """A change of a pin or of what surrounds the board: when, in cycles of 16 MHz, which, and to what."""

    cycle: int
    what: str
    level: int

    @property
    def t_ms(self) -> float:
        """When it was, since the board was first started [ms]."""
        return 1e3 * self.cycle / HZ


@dataclass(frozen=True)
class Board:
    """A running board.

    Args:
        address: the pseudo-terminal that it is at.
        edges_file: where its pins are written down.
        process: the simulator.
    """

    address: str
    edges_file: Path
    process: subprocess.Popen[bytes]

    def order(self, letters: str) -> None:
        """Open or close the interlock (o, c), reset (r), cut the wire (j), add noise at pin 8 (n), say the time (t)."""
        if self.process.stdin is not None:
            self.process.stdin.write(letters.encode())
            self.process.stdin.flush()

    @property
    def edges(self) -> list[Edge]:
        """All that has happened, as far as it is written down."""
        whole = self.edges_file.read_text(encoding="ascii").rpartition("\n")[0]
        return [Edge(int(cycle), what, int(level)) for cycle, what, level in map(str.split, whole.splitlines())]

    @property
    def clock_ms(self) -> float:
        """The board's own time [ms]."""
        before = len(self.edges)
        self.order("t")
        return self.until(lambda edges: len(edges) > before)[-1].t_ms

    def rises(self, pin: str) -> list[Edge]:
        """The rising edges of a pin."""
        return [edge for edge in self.edges if edge.what == pin and edge.level]

    def until(self, true: Callable[[list[Edge]], object], within_s: float = 5.0) -> list[Edge]:
        """Wait until something has happened; all edges by then."""
        end_s = time.monotonic() + within_s
        while not true(edges := self.edges):
            if time.monotonic() > end_s:
                raise AssertionError(f"it did not happen: {edges[-6:]}")
            time.sleep(0.002)
        return edges


@contextmanager
def board(program: Path, folder: Path, speed: float = 1.0) -> Iterator[Board]:
    """Within, the board runs.

    Args:
        program: its program.
        folder: where its edges are written to.
        speed: how much faster than real time it may run; 0 for as fast as it can.
    """
    import pty  # noqa: PLC0415 - not on Windows
    import tty  # noqa: PLC0415 - same

    ours, theirs = pty.openpty()  # what the board writes into its end is read at the other one, whose name isiw gets
    tty.setraw(theirs)
    edges = folder / f"edges-{time.monotonic_ns()}"
    command = [str(program.parent / "simboard"), str(program), str(ours), str(edges), str(speed)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, pass_fds=(ours,)) as process:  # noqa: S603 - our own
        running = Board(os.ttyname(theirs), edges, process)
        try:
            while not edges.exists():
                time.sleep(0.002)
            yield running
        finally:
            with suppress(OSError):
                running.order("q")
            with suppress(subprocess.TimeoutExpired):
                process.wait(2.0)
            process.kill()
            os.close(ours)
            os.close(theirs)


def pairs_of(edges: list[Edge]) -> list[tuple[Edge, Edge]]:
    """Valve and trigger of each pair: a trigger's rise, and the last rise of the valve before it, of the same start."""
    pairs, valve = [], None
    for edge in edges:
        if edge.what in {"reset", "watchdog"}:
            valve = None
        elif edge.what == "valve" and edge.level:
            valve = edge
        elif edge.what == "trigger" and edge.level and valve is not None:
            pairs.append((valve, edge))
            valve = None
    return pairs


def device_of_the_page(address: str, shortest_iti_s: float = 2.0, most_pulses: int = 1000) -> Any:
    """The device that the example of the page makes; its amplifier measures another MEP in each trial.

    Args:
        address: where the board is.
        shortest_iti_s: the board's shortest interval [s], if it was not built as the page says.
        most_pulses: the most stimuli that it gives.
    """
    page = (ROOT / "docs" / "lab" / "arduino.md").read_text(encoding="utf-8")
    example = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)[0]
    for stated, here in (
        ('"shortest_iti_s": 2.0', f'"shortest_iti_s": {shortest_iti_s}'),
        ('"most_pulses": 1000', f'"most_pulses": {most_pulses}'),
    ):
        if stated not in example:
            raise AssertionError(f"the example of the page lacks {stated}")
        example = example.replace(stated, here)
    names: dict[str, Any] = {}
    exec(compile(example, "arduino.md", "exec"), names)  # noqa: S102 - our own page
    names["measure"] = _measure
    return names["make"](address)


def _measure(stimulus: isiw.Stimulus, isi_ms: float | None, timeout_s: float) -> isiw.Measurement:
    del timeout_s
    return isiw.Measurement(0.05 + 0.01 * (stimulus.trial % 7), isi_ms)


class Port:
    """A board's port without isiw, for what isiw never says.

    Args:
        address: where the board is.
    """

    def __init__(self, address: str) -> None:
        self._handle = os.open(address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self.seen = b""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._handle)

    def write(self, data: bytes) -> None:
        """Send bytes as they are."""
        while data:
            try:
                data = data[os.write(self._handle, data) :]
            except BlockingIOError:
                time.sleep(0.001)

    def say(self, *commands: str) -> None:
        """Send lines with their checksums."""
        self.write(b"".join(sealed(command) for command in commands))

    def hear(self, answer: str, within_s: float = 5.0) -> None:
        """Wait for a line with its checksum."""
        wanted, end_s = sealed(answer).rstrip(), time.monotonic() + within_s
        while wanted not in self.seen:
            with suppress(BlockingIOError):
                self.seen += os.read(self._handle, 4096)
            if time.monotonic() > end_s:
                raise AssertionError(f"{answer} was not said: {self.seen[-200:]!r}")
            time.sleep(0.002)

    def ask(self, command: str, answer: str) -> None:
        """Send a line, and wait for its answer."""
        self.say(command)
        self.hear(answer)


def sealed(text: str) -> bytes:
    """A line with its checksum and its end."""
    return f"{text}*{crc_of(text)}\n".encode("ascii")
