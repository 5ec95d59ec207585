"""Rigs for `benchmarks/deaths.py`: what is driven, and how somebody outside of isiw sees whether it is armed."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import isiw
from benchmarks.pulse_peer import PEER_COMMANDS, Lie, PulsePeer
from benchmarks.recording_device import RecordingDevice
from benchmarks.simulated_board import SKETCH, device_of_the_page

__all__ = ["RIGS", "Rig", "compiled_sketch"]

_INFO = {"name": "peer", "reference": "valve"}


@dataclass(frozen=True)
class Rig:
    """One thing that can be armed.

    Args:
        device: makes isiw's side of it.
        slow: lets its next delivery hang while it is armed or has just fired, if the rig can.
        disarmed: whether it was told to disarm since `dead` was called, and is not armed.
        dead: is called when the process is killed.
        fired: the trials that it gave, as far as it knows them by number.
        gave: how many stimuli it gave.
    """

    device: Callable[[], isiw.Device]
    slow: Callable[[int], None]
    dead: Callable[[], None]
    disarmed: Callable[[], bool]
    gave: Callable[[], int]


@contextmanager
def recording(folder: Path) -> Iterator[Rig]:
    """A device that writes what it is told."""
    device, told = RecordingDevice(folder / "record", takes_s=0.03), [0]

    def dead() -> None:
        told[0] = len(device.told)

    yield Rig(
        lambda: device,
        lambda _: None,
        dead,
        lambda: "disarm" in device.told[told[0] - 1 :] and not device.is_armed,
        lambda: sum(line.startswith("fire") for line in device.told),
    )


@contextmanager
def line(folder: Path) -> Iterator[Rig]:
    """A peer over TCP, in this process, that does not answer the command at which the other one dies."""
    del folder
    peer, heard = PulsePeer(), [0]

    def slow(number: int) -> None:
        peer.lie("ARM" if number % 2 else "FIRE", Lie.SILENT_AFTER)

    def dead() -> None:
        heard[0] = len(peer.heard)

    with peer.over_tcp() as address:
        yield Rig(
            lambda: isiw.LineDevice(address, _INFO, PEER_COMMANDS),
            slow,
            dead,
            lambda: any("DISARM" in said for said in peer.heard[heard[0] :]) and not peer.armed,
            lambda: len(peer.ledger),
        )


def compiled_sketch(folder: Path) -> Path:
    """The Arduino's sketch, compiled for this computer with stand-ins for the board's registers."""
    made = folder / "timer"
    source = SKETCH / "main.cpp"
    compiler = shutil.which("g++") or "g++"
    options = ["-std=c++17", "-DSHORTEST_INTERVAL_MS=0", f"-I{source.parent}"]
    subprocess.run([compiler, *options, "-o", str(made), str(source)], check=True)  # noqa: S603 - our own source
    return made


@contextmanager
def arduino(folder: Path) -> Iterator[Rig]:
    """The sketch over a pseudo-terminal, driven by the device of the page; the terminal is read once isiw is dead."""
    import pty  # noqa: PLC0415 - not on Windows
    import tty  # noqa: PLC0415 - same

    program = folder.parent / "timer"
    if not program.exists():
        compiled_sketch(folder.parent)
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    os.set_blocking(theirs, False)
    edges, said = folder / "edges", [b""]

    def disarmed() -> bool:
        try:
            said[0] += os.read(theirs, 4096)
        except BlockingIOError:
            return False
        return b"DISARMED" in said[0]

    environment = {"EDGES": str(edges), "INTERLOCK": str(folder / "open")}
    with subprocess.Popen([program], stdin=ours, stdout=ours, env=environment) as process:  # noqa: S603 - our own
        try:
            yield Rig(
                lambda: device_of_the_page(os.ttyname(theirs), shortest_iti_s=0.0),
                lambda _: None,
                lambda: None,
                disarmed,
                lambda: _triggers(edges),
            )
        finally:
            process.kill()
            os.close(ours)
            os.close(theirs)


def _triggers(edges: Path) -> int:
    lines = edges.read_text(encoding="ascii").splitlines() if edges.exists() else []
    return sum(each.startswith("trigger 1") for each in lines)


RIGS = {"recording device": recording, "line device": line, "Arduino's stand-in": arduino}
"""The rigs by name."""
