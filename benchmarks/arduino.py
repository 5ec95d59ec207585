"""The Arduino's machine code in simavr: how exact it is, how soon it disarms, and whether a session loses a pair.

    python -m benchmarks.arduino

The sketch is compiled by avr-gcc and run by simavr behind a pseudo-terminal, with isiw's own line device at the other
end; the pins are read by cycle (`tests/clients/arduino/simavr.c`). No board is part of it.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.console import Console
from rich.progress import track

import isiw
from benchmarks.noisy_line import NoisyLine
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from benchmarks.remembering import SPACE, strategy
from benchmarks.simulated_board import (
    HZ,
    Board,
    Edge,
    Port,
    board,
    compiled,
    device_of_the_page,
    lacking,
    pairs_of,
    sealed,
)
from isiw.log.places import log_exists
from isiw.trials import Status

__all__ = ["NoisySession", "killed_while_delivering", "session_with_noise"]

RESULT: Final = Path("benchmarks/results/arduino.md")
TICK: Final = 256
LEAST_MS: Final = 200
TIMEOUT_S: Final = 5.0
MOST_LEGS: Final = 200
GUARDS: Final = isiw.Safeguards(retries=3, backoff_s=0.3)


@dataclass(frozen=True)
class NoisySession:
    """A session over a noisy line: pairs at the pins, those that the log does not know, and the shortest interval."""

    pairs: int
    trials: int
    unlogged: int
    wrong: int
    shortest_ms: float
    least_ms: float
    resets: int
    runs: int
    damaged: int


def exactness(folder: Path, pairs: int, seed: int) -> list[str]:
    """Rows about pairs in a row, of a board that opens the valve for 2 ms, so that they take less time."""
    program = compiled(folder, "quick", SHORTEST_INTERVAL_MS=0, MOST_STIMULI=60_000, VALVE_MS=2)
    wanted = np.round(np.random.default_rng(seed).uniform(0, 20, pairs), 3)
    with board(program, folder, speed=0) as running:
        device = device_of_the_page(running.address, 0.0, 60_000)
        device.stage()
        heard = [
            device.deliver(isiw.Stimulus(trial, float(wanted[trial])), TIMEOUT_S).isi_ms
            for trial in track(range(pairs), "pairs", console=Console(stderr=True))
        ]
        device.unstage()
        edges = running.edges
    given = np.array([trigger.cycle - valve.cycle for valve, trigger in pairs_of(edges)]) / HZ * 1e3
    if len(given) != pairs or len([edge for edge in edges if edge.what == "trigger" and edge.level]) != pairs:
        raise AssertionError(f"{pairs} pairs asked for, {len(given)} given")
    widths_ms = {pin: widths(edges, pin) for pin in ("valve", "trigger")}
    error_us, heard_us = 1e3 * np.abs(given - wanted), 1e3 * np.abs(np.array(heard) - given)
    return [
        f"| pairs given of {pairs:,} asked for | {len(given):,} |",
        f"| ISI less the wanted one, at most | {error_us.max():.2f} µs |",
        f"| ISI less that of its ticks, at most | {off_ticks(given):.3f} µs |",
        f"| ISI as reported less that at the pins, at most | {heard_us.max():.2f} µs |",
        *(
            f"| {pin} high, shortest and longest | {low:.3f} and {high:.3f} ms |"
            for pin, (low, high) in widths_ms.items()
        ),
    ]


def off_ticks(given_ms: np.ndarray[Any, Any]) -> float:
    """How far ISIs are from whole ticks at most [µs]."""
    ticks = given_ms * 1e-3 * HZ / TICK
    return float(np.abs(ticks - np.round(ticks)).max() * TICK / HZ * 1e6)


def widths(edges: list[Edge], pin: str) -> tuple[float, float]:
    """The shortest and the longest time for which a pin was high [ms]."""
    of = [edge for edge in edges if edge.what == pin]
    high = [down.t_ms - up.t_ms for up, down in zip(of[::2], of[1::2], strict=True)]
    return min(high), max(high)


DISARM: Final = sealed("9 DISARM")
ENDINGS: Final[dict[str, Callable[[Board, Port], None]]] = {
    "DISARM": lambda _, port: port.write(DISARM),
    "DISARM with a flipped bit": lambda _, port: port.write(DISARM.replace(b"S", b"R")),
    "half a line, then DISARM after an end of line": lambda _, port: port.write(b"9 FI\n" + DISARM),
    "40 bytes of noise without an end of line": lambda _, port: port.write(bytes(range(100, 140))),
    "the interlock opens": lambda running, _: running.order("o"),
    "the board is reset": lambda running, _: running.order("r"),
    "the computer is silent": lambda *_: None,
    "the program is stuck": lambda _, port: port.write(b"\x07"),
}
"""What ends a stimulus that is under way."""


def endings(folder: Path, times: int) -> list[str]:
    """Rows about how soon both outputs are low, and whether a trigger was given all the same."""
    program, rows = compiled(folder, SHORTEST_INTERVAL_MS=0, VALVE_MS=900), []
    for name, end in ENDINGS.items():
        took = []
        for _ in track(range(times), name, console=Console(stderr=True)):
            with board(program, folder) as running, Port(running.address) as port:
                took.append(ended_ms(running, partial(end, running, port), under_way(running, port)))
        rows.append(f"| {name} | {times} | {np.median(took):.1f} | {max(took):.1f} |")
    took = []
    for _ in track(range(times), "isiw is killed", console=Console(stderr=True)):
        with board(program, folder) as running:
            took.append(killed_while_delivering(running, signal.SIGKILL))
    return [*rows, f"| isiw is killed, and its watchdog disarms | {times} | {np.median(took):.1f} | {max(took):.1f} |"]


def under_way(running: Board, port: Port) -> Callable[[], None]:
    """Begin a stimulus whose trigger would come after 1 s; what waits until its valve is open."""
    port.ask("1 SET 1000000", "1 OK")
    port.ask("2 ARM", "2 ARMED")
    port.say("3 FIRE")
    return lambda: valve_open(running)


def valve_open(running: Board) -> None:
    """Wait until the valve is open."""
    running.until(lambda edges: any(edge.what == "valve" for edge in edges))


def ended_ms(running: Board, end: Callable[[], object], begun: Callable[[], None]) -> float:
    """How long after `end` both outputs are low for good [ms]; an AssertionError if a trigger came."""
    begun()
    marked = len(running.edges)
    running.order("t")
    end()
    running.until(lambda edges: len(edges) > marked)
    end_s = time.monotonic() + 20
    while running.clock_ms < running.edges[marked].t_ms + 1200:  # by when a trigger would have come
        if time.monotonic() > end_s:
            raise AssertionError("the board does not run")
    edges = running.edges
    if any(edge.what == "trigger" and edge.level for edge in edges):
        raise AssertionError("a trigger was given all the same")
    low = [edge for edge in edges if edge.what == "valve" and not edge.level][-1]
    return max(0.0, low.t_ms - edges[marked].t_ms)


def killed_while_delivering(running: Board, how: signal.Signals) -> float:
    """Kill isiw while a stimulus is under way; the time from then until both outputs are low [ms]."""
    child = os.fork()
    if child == 0:
        with suppress(BaseException):
            device = device_of_the_page(running.address, 0.0)
            device.stage()
            device.deliver(isiw.Stimulus(0, 1000.0), TIMEOUT_S)
        os._exit(1)

    def end() -> None:
        os.kill(child, how)
        os.waitpid(child, 0)

    return ended_ms(running, end, lambda: valve_open(running))


def session_with_noise(folder: Path, place: Path, pairs: int, seed: int) -> NoisySession:
    """Run a session over a line that damages bytes, reset the board twice, and kill isiw once.

    Args:
        folder: where programs are put.
        place: where log and edges are put.
        pairs: how many trials it has.
        seed: of the noise, of the strategy, and of when it dies.
    """
    program, log = compiled(folder, "session", SHORTEST_INTERVAL_MS=LEAST_MS, VALVE_MS=5), place / "session.mcap"
    rng, runs = np.random.default_rng(seed), 0
    troubles = [(int(at), what) for at, what in zip(sorted(rng.integers(1, pairs - 1, 3)), "rkr", strict=True)]
    with board(program, place) as running, NoisyLine(running.address, seed) as line:
        while known(log) < pairs:
            runs += 1
            if runs > MOST_LEGS:
                raise AssertionError("the session does not end")
            run_once(running, line.address, log, pairs, seed, troubles)
        edges, damaged = running.edges, line.damaged
    record = isiw.read_session(log)
    unlogged, wrong = compared(pairs_of(edges), list(record.table))
    begun = stimuli(edges)
    gaps = [later - earlier for earlier, later in pairwise(begun)]
    resets = sum(edge.what == "reset" for edge in edges)
    return NoisySession(
        len(pairs_of(edges)), len(record.table), unlogged, wrong, min(gaps), LEAST_MS, resets, runs, damaged
    )


def known(log: Path) -> int:
    """How many trials a log has."""
    return len(isiw.read_session(log).table) if log_exists(log) else 0


def run_once(running: Board, address: str, log: Path, pairs: int, seed: int, troubles: list[tuple[int, str]]) -> None:
    """Run or resume the session in a process of its own, until something ends it; trouble comes when it is due."""
    child = os.fork()
    if child == 0:
        with suppress(BaseException):
            session(address, log, pairs, seed).run(progress=False, keys=False)
        os._exit(0)
    while os.waitpid(child, os.WNOHANG)[0] == 0:
        time.sleep(0.02)
        if troubles and len(running.rises("trigger")) > troubles[0][0]:
            _, what = troubles.pop(0)
            if what == "r":
                running.order("r")
            else:
                os.kill(child, signal.SIGKILL)
    time.sleep(0.4)  # until the watchdog has let go of the port


def session(address: str, log: Path, pairs: int, seed: int) -> isiw.Session:
    """The session, new or resumed."""
    device = device_of_the_page(address, LEAST_MS / 1e3)
    limits = isiw.Limits.of_space(SPACE, min_iti_s=1.2e-3 * LEAST_MS, max_pulses=pairs)
    options: dict[str, Any] = {"limits": limits, "timeout_s": TIMEOUT_S, "safeguards": GUARDS}
    if log_exists(log):
        resumed: isiw.Session = isiw.resume(log, device, strategy(pairs, seed), **options)
        return resumed
    return isiw.Session(device, strategy(pairs, seed), log=log, **options)


def stimuli(edges: list[Edge]) -> list[float]:
    """When each stimulus began [ms]: its valve, or its trigger if it had none."""
    valves = [edge.t_ms for edge in edges if edge.what == "valve" and edge.level]
    paired = {trigger.cycle for _, trigger in pairs_of(edges)}
    alone = [edge.t_ms for edge in edges if edge.what == "trigger" and edge.level and edge.cycle not in paired]
    return sorted([*valves, *alone])


def compared(pairs: list[tuple[Edge, Edge]], trials: list[isiw.Trial]) -> tuple[int, int]:
    """How many pairs the log does not know, and how many of its accepted trials were not given at the pins.

    Both are in the order of time. A trial whose outcome is not known may have been given or not, and is asked for again
    at the same ISI, so that of all ways to put them side by side the one with the fewest faults is taken.
    """
    given = [1e3 * (trigger.cycle - valve.cycle) / HZ for valve, trigger in pairs]
    after = [(left, 0) for left in range(len(given), -1, -1)]  # faults from each pair on, once no trial is left
    for trial in reversed(trials):
        asked_ms, skipped = trial.commanded_isi_ms, int(trial.status is Status.ACCEPTED)
        here = [(0, 0)] * len(after)
        for first in range(len(given), -1, -1):
            ways = [(after[first][0], after[first][1] + skipped)]
            if first < len(given):
                ways.append((here[first + 1][0] + 1, here[first + 1][1]))
                if asked_ms is not None and abs(given[first] - asked_ms) < 0.01:
                    ways.append(after[first + 1])
            here[first] = min(ways, key=sum)
        after = here
    return after[0]


def report(arguments: argparse.Namespace) -> Iterator[str]:
    """The lines of the result."""
    with tempfile.TemporaryDirectory() as name:
        folder, began_s = Path(name), time.monotonic()
        noisy = session_with_noise(folder, folder, arguments.noisy_pairs, arguments.seed)
        ended = endings(folder, arguments.times)
        exact = exactness(folder, arguments.pairs, arguments.seed)
        spent_s = time.monotonic() - began_s
    yield from ("# The Arduino's machine code in simavr", "", f"- command: `{command_of('arduino')}`")
    yield f"- {made_with('numpy', 'pyserial')}; avr-gcc and simavr of Debian"
    yield f"- seed {arguments.seed}, {spent_s / 60:.1f} minutes"
    yield from ("", "Measured by cycle, one of which takes 62.5 ns, in a simulator; no board.", "")
    yield from ("| pairs in a row (valve of 2 ms) | |", "|---|---|", *exact, "")
    yield from (
        "A stimulus is under way (ISI 1 s, valve of 0.9 s), its valve is open, and then. No trigger was given.",
        "",
    )
    yield from ("| what happens | times | both outputs low after, median [ms] | at most [ms] |", "|---|---|---|---|")
    yield from (*ended, "")
    yield (
        f"A session of {noisy.trials} trials over a line that damaged {noisy.damaged} bytes, with {noisy.resets} "
        f"resets of the board and one SIGKILL of isiw, run {noisy.runs} times in all: {noisy.pairs} pairs at the pins, "
        f"{noisy.unlogged} of them without a trial in the log, {noisy.wrong} accepted trials without their pair at the "
        f"pins; the shortest interval between two stimuli was {noisy.shortest_ms:.1f} ms, where the board was built "
        f"for {noisy.least_ms:g} ms."
    )


def main() -> None:
    """Measure, and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=10_000)
    parser.add_argument("--times", type=int, default=20, help="how often each ending is tried")
    parser.add_argument("--noisy-pairs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=RESULT)
    arguments = parser.parse_args()
    if missing := lacking():
        sys.exit(f"This needs {missing}, which Debian has in gcc-avr, avr-libc, simavr and gcc.")
    text = "\n".join(report(arguments))
    arguments.out.with_suffix(".md").write_text(f"{text}\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    understood("arduino")
    main()
