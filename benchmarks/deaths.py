"""Sessions whose process is killed: is the device disarmed, is a trial lost, does the session resume?

    python -m benchmarks.deaths --kills 300

Each session runs in a process of its own, with the default strategy, and is killed by SIGKILL, SIGSEGV or SIGABRT while
it computes or while it delivers, at a moment that is drawn. From outside of it is seen when the device is told to
disarm. Then the session is resumed to its end, and what the device gave is compared with the log.
"""

from __future__ import annotations

import argparse
import faulthandler
import gc
import os
import resource
import signal
import tempfile
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import psutil
from rich.console import Console
from rich.progress import track
from threadpoolctl import threadpool_limits

import isiw
from benchmarks.dying_rigs import RIGS, Rig
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood

__all__ = ["MEMORY", "MOMENTS", "SIGNALS", "Death", "die"]

RESULT: Final = Path("benchmarks/results/deaths.md")
SIGNALS: Final = (signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT)
MOMENTS: Final = ("computing", "delivering")
MEMORY: Final = "memory"
TRIALS: Final = 5
MOST_S: Final = 10.0
SPACE: Final = isiw.DesignSpace(0, 100, reference="valve")
LIMITS: Final = isiw.Limits.of_space(SPACE, min_iti_s=0.0, max_pulses=40)
WITHIN_S: Final = {"computing": 0.03, "delivering": 0.12, MEMORY: 0.0}
"""The longest from the beginning of what it does to its death [s]."""


@dataclass(frozen=True)
class Death:
    """One death: the time until the device was disarmed [s], stimuli given before it, and trials known after it."""

    disarmed_s: float
    given: int
    known: int


def strategy(seed: int) -> isiw.Strategy:
    """The default strategy, which computes in compiled loops."""
    return isiw.make_strategy(space=SPACE, seed=seed, max_trials=TRIALS)


def die(name: str, how: signal.Signals, moment: str, seed: int, folder: Path) -> Death:
    """Run a session, kill it, and resume it.

    Args:
        name: the rig.
        how: the signal.
        moment: while it is computing, or delivering; or "memory", when its memory is full and it aborts.
        seed: of the strategy, and of the moment.
        folder: where the log and the files of the rig are put.
    """
    rng, log = np.random.default_rng(seed), folder / "session.mcap"
    with RIGS[name](folder) as rig:
        trial = int(rng.integers(1, TRIALS))
        killed_s, left = _killed(rig, how, moment, trial, float(rng.uniform(0, WITHIN_S[moment])), seed, log)
        disarmed_s = _until_disarmed(rig, killed_s)
        given = rig.gave()
        _until_ended(left)  # the watchdog disarms three times, which would stop a pair of the session that resumes
        resumed = isiw.resume(log, rig.device(), strategy(seed), limits=LIMITS, clock=isiw.MonotonicClock())
        known = len(resumed.trials)
        result = resumed.run(progress=False, keys=False)
        if rig.gave() > len(result.trials):
            raise AssertionError(f"{name}: {rig.gave()} stimuli given, {len(result.trials)} in the log")
        if known < given:
            raise AssertionError(f"{name}: {given} stimuli given, {known} known after the death")
        return Death(disarmed_s, given, known)


def _until_disarmed(rig: Rig, killed_s: float) -> float:
    while not rig.disarmed():
        if time.monotonic() - killed_s > MOST_S:
            raise AssertionError("the device is still armed")
        time.sleep(0.001)
    return time.monotonic() - killed_s


def _until_ended(processes: list[psutil.Process]) -> None:
    end_s = time.monotonic() + MOST_S
    while not all(map(_has_ended, processes)):
        if time.monotonic() > end_s:
            raise AssertionError(f"the watchdog does not end: {processes}")
        time.sleep(0.01)


def _has_ended(process: psutil.Process) -> bool:
    try:
        return process.status() == psutil.STATUS_ZOMBIE  # that nobody waits for it is no matter of the device
    except psutil.NoSuchProcess:
        return True


def _killed(
    rig: Rig, how: signal.Signals, moment: str, trial: int, after_s: float, seed: int, log: Path
) -> tuple[float, list[psutil.Process]]:
    """Run the session in a process, and kill it; when that was [s], and the processes that it had started."""
    (heard, tells), (waits, goes) = os.pipe(), os.pipe()
    gc.freeze()
    child = os.fork()
    if child == 0:
        _live(rig, moment, trial, seed, log, tells, waits)
    gc.unfreeze()
    os.close(tells)
    os.close(waits)
    if os.read(heard, 1) != b"!":
        raise AssertionError(f"the session ended before trial {trial}: {os.waitpid(child, 0)[1]}")
    if moment == "delivering":
        rig.slow(seed)
    left = psutil.Process(child).children(recursive=True)
    os.write(goes, b"!")
    time.sleep(after_s)
    rig.dead()
    killed_s = time.monotonic()
    if moment != MEMORY:
        os.kill(child, how)
    _, status = os.waitpid(child, 0)
    os.close(heard)
    os.close(goes)
    if not os.WIFSIGNALED(status):
        raise AssertionError(f"the session was not killed: {status}")
    return killed_s, left


def _live(rig: Rig, moment: str, trial: int, seed: int, log: Path, tells: int, waits: int) -> None:
    """A session that says when it comes to a moment; the process ends here."""
    try:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        faulthandler.disable()  # a test's would write where the process is
        device, own = rig.device(), strategy(seed)
        ask, deliver = own.ask, device.deliver
        asks: list[float] = []

        def come(now: bool) -> None:  # noqa: FBT001 - it is all that is said
            if now:
                os.write(tells, b"!")
                os.read(waits, 1)
                if moment == MEMORY:
                    _fill_memory()

        def asked(*arguments: float | None) -> float:
            asks.append(ask(*arguments))
            here = moment != "delivering" and len(asks) == trial + 1
            come(here)
            while here:  # until it is killed
                own.model.update(own.posterior, isiw.models.Observation.of([asks[-1]], [0.1]))
            return asks[-1]

        def delivered(stimulus: isiw.Stimulus, timeout_s: float) -> object:
            come(moment == "delivering" and stimulus.trial == trial)
            answer = deliver(stimulus, timeout_s)
            if moment == "delivering" and stimulus.trial == trial:
                time.sleep(MOST_S)
            return answer

        own.ask, device.deliver = asked, delivered  # type: ignore[method-assign, assignment]
        isiw.Session(device, own, log=log, limits=LIMITS, clock=isiw.MonotonicClock()).run(progress=False, keys=False)
    except BaseException:  # noqa: BLE001 - whatever it is, it ends this process alone
        traceback.print_exc()
    finally:
        os._exit(1)


def _fill_memory() -> None:
    """Take all the memory that a process may have, and abort where there is none left, as C code does."""
    resource.setrlimit(resource.RLIMIT_AS, (_size() + 2**26, resource.RLIM_INFINITY))
    taken = []
    try:
        while True:
            taken.append(bytearray(2**20))
    except MemoryError:
        os.abort()


def _size() -> int:
    """The process's address space [bytes]."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()


def tried(kills: int, seed: int) -> Iterator[tuple[str, str, str, Death]]:
    """Deaths in turn: each signal, each moment, each rig."""
    with tempfile.TemporaryDirectory() as folder:
        for number in track(range(kills), "dying", console=Console(stderr=True)):
            how, name = SIGNALS[number % 3], tuple(RIGS)[number // 3 % 3]
            moment, place = MOMENTS[number // 9 % 2], Path(folder) / str(number)
            place.mkdir()
            yield how.name, name, moment, die(name, how, moment, seed + number, place)


def main() -> None:
    """Kill, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0, help="the first death's")
    parser.add_argument("--out", type=Path, default=RESULT)
    arguments = parser.parse_args()
    began_s = time.monotonic()
    with threadpool_limits(1):
        deaths = list(tried(arguments.kills, arguments.seed))
    last = arguments.seed + arguments.kills - 1
    lines = [
        "# Deaths",
        "",
        f"- command: `{command_of('deaths')}`",
        f"- {made_with('mcap', 'numpy')}",
        f"- seeds {arguments.seed} to {last}, {(time.monotonic() - began_s) / 60:.1f} minutes",
        "",
        "Every device was disarmed, every stimulus that it gave is in the log, every session was resumed to its end.",
        "",
        "| signal | rig | while | deaths | disarmed after, median [ms] | at most [ms] | stimuli given | trials known |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind in sorted({death[:3] for death in deaths}):
        of = [death for *what, death in deaths if tuple(what) == kind]
        times_ms = 1e3 * np.array([death.disarmed_s for death in of])
        given, known = sum(death.given for death in of), sum(death.known for death in of)
        figures = f"{len(of)} | {np.median(times_ms):.0f} | {times_ms.max():.0f} | {given} | {known}"
        lines.append(f"| {' | '.join(kind)} | {figures} |")
    arguments.out.with_suffix(".md").write_text("\n".join([*lines, ""]), encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    understood("deaths")
    main()
