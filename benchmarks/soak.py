"""Sessions with a device that fails in every way, run and resumed to their ends: is anything lost, or given twice?

    python -m benchmarks.soak --sessions 2000 --keep soak.json > benchmarks/results/soak.md

Each session has a device that fails at random (`faulty_device.py`), from a stage that hangs to an answer that comes
too late. What ends a session is resumed until its stimuli are used up. Then what the device has really fired is
compared with the log, pair by pair, and what was asked with what the strategy asks again when it is told the log.

It is the loop that is tried, so most sessions have a strategy that depends on all it was told and costs almost nothing.
One in ten has a named one, which is made again from the log: `default`, `random`, `even` and `nr` in turn.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import math
import sys
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import torch
from rich.console import Console
from rich.progress import track

import isiw
from benchmarks.faulty_device import Fault, FaultyDevice, check_ledger
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from benchmarks.remembering import SPACE, answer, strategy

STUCK_S = 3600.0  # by the clock, so long that a busy machine does not reach it
MOST_RUNS = 100

NAMED = {0: "default", 10: "random", 20: "even", 30: "nr"}
"""The named strategies, by the remainder of the seed and 40."""


class Soaked:
    """One session, resumed until it ends.

    Args:
        folder: where its log is.
        seed: seed of everything.
        trials: its budget.
        rate: the share of calls that fail.
    """

    def __init__(self, folder: Path, seed: int, trials: int, rate: float) -> None:
        self.log, self.seed, self.trials = folder / f"{seed}.mcap", seed, trials
        self.clock = isiw.VirtualClock()
        self.limits = isiw.Limits.of_space(SPACE, max_pulses=trials)
        self.limits = replace(self.limits, max_coil_c=40.0, max_block_pulses=12, rest_s=120.0)
        self.guards = isiw.Safeguards(
            deadlines=isiw.Deadlines(stage_s=0.3, stop_s=0.2, unstage_s=0.3, stop_attempts=4), retries=2
        )
        info = isiw.DeviceInfo("faulty", "valve", simulated=True)
        self.device = FaultyDevice(
            isiw.CallbackDevice(answer, info), seed, self.clock, rate=rate, late_s=0.3, on_fire=self.check_intent
        )
        self.runs, self.stopped = 0, False
        self.name = NAMED.get(seed % 40, "")

    def check_intent(self, stimulus: isiw.Stimulus) -> None:
        """What is about to be fired is on disk already; looked at in every tenth session, as it means reading it."""
        if self.seed % 10 == 0:
            last = isiw.read_session(self.log).intents[-1]
            assert (last.trial, last.isi_ms) == (stimulus.trial, stimulus.isi_ms)  # noqa: S101 - what is tried here

    def run(self) -> isiw.SessionRecord:
        """Run and resume until the strategy stops; the log at the end."""
        while not self.ended():
            self.runs += 1
            if self.runs > MOST_RUNS:
                sys.exit(f"session {self.seed} does not end")
            try:
                self.stopped = self.session().run().decision.stop
            except (isiw.errors.IsiwError, TypeError, ValueError):
                pass  # what the device did; the log must stand it
            finally:
                self.device.release()
            if self.device.armed:
                sys.exit(f"session {self.seed} ended armed")
        return isiw.read_session(self.log)

    def ended(self) -> bool:
        """Whether the strategy has stopped, or all stimuli are used up."""
        return self.stopped or (self.log.exists() and len(isiw.read_session(self.log).table) >= self.trials)

    def strategy(self) -> isiw.Strategy:
        """Its strategy, before the first trial."""
        if not self.name:
            return strategy(self.trials, self.seed)
        return isiw.make_strategy(self.name, SPACE, self.seed, **_to_the_end(self.name, self.trials))

    def logged_strategy(self) -> isiw.Strategy | None:
        """What is handed over to go on: none where the log holds it."""
        return None if self.name else self.strategy()

    def session(self) -> isiw.Session:
        """The session, new or resumed."""
        times = {"clock": self.clock, "timeout_s": 0.2, "safeguards": self.guards, "limits": self.limits}
        if self.log.exists():
            return isiw.resume(self.log, self.device, self.logged_strategy(), **times)
        return isiw.Session(self.device, self.strategy(), log=self.log, **times)


def _to_the_end(name: str, trials: int) -> dict[str, float]:
    """Settings with which a named strategy does not stop before all stimuli are used up."""
    if name == "nr":
        return {"max_trials": 2 * trials, "stop_last": 1000}  # the limit on pulses ends it
    small = {} if name == "default" else {"particles": 100}
    never = {"stop_width_ms": 1e-6, "stop_expected_f1": 1, "stop_gain": 0, "stop_no_window": 1}
    return {"max_trials": trials, **never, **small}


def check(soaked: Soaked, record: isiw.SessionRecord) -> None:
    """End the program where anything is lost, given twice, or asked differently."""
    if record.losses or not record.finished:
        sys.exit(f"the log of session {soaked.seed} is damaged: {record.losses}")
    check_ledger(soaked.device.ledger, record, soaked.limits)
    isiw.resume(soaked.log, soaked.device, soaked.logged_strategy())  # raises where it asks differently


class Tally:
    """What happened so far, kept in a file so that a long run can be interrupted and gone on with.

    Args:
        first: the first seed.
        path: the file; None where nothing is kept.
    """

    def __init__(self, first: int, path: Path | None) -> None:
        self.path = path
        kept = json.loads(path.read_text()) if path is not None and path.exists() else {"first": first}
        if kept["first"] != first:
            sys.exit(f"{path} is of a run from seed {kept['first']}")
        self.first, self.counts, self.faults = first, Counter(kept.get("counts")), Counter(kept.get("faults"))

    @property
    def next_seed(self) -> int:
        """The seed to go on with."""
        return self.first + self.counts["sessions"]

    def add(self, soaked: Soaked, record: isiw.SessionRecord) -> None:
        """Count one more session."""
        self.faults += soaked.device.happened
        self.counts += Counter(
            sessions=1,
            named=bool(soaked.name),
            runs=soaked.runs,
            trials=len(record.table),
            fired=len(soaked.device.ledger),
            told=len(record.table.told),
            refused=sum(event.kind == "refused" for event in record.events),
            late=sum(event.kind == "late" for event in record.events),
        )
        if self.path is not None:
            self.path.write_text(json.dumps({"first": self.first, "counts": self.counts, "faults": self.faults}))

    def report(self, trials: int) -> None:
        """Print the counts."""
        counts = self.counts
        print(f"- command: `{command_of('soak')}`")
        print(f"- {made_with('mcap', 'numpy', 'torch')}\n")
        print(
            f"{counts['sessions']:,} sessions of {trials} trials (seeds {self.first} to {self.next_seed - 1}, "
            f"{counts['named']:,} with a named strategy), run {counts['runs']:,} times in all: "
            f"{counts['fired']:,} pairs fired, {counts['trials']:,} trials logged, {counts['told']:,} of them told, "
            f"{counts['refused']:,} refusals, {counts['late']:,} late answers. No pair without an intent before it, "
            "none twice, no limit passed, none missing in a log, no log damaged, no session left armed, every ask the "
            "same again.\n"
        )
        print("| fault | times |\n|---|---|")
        for fault in Fault:
            print(f"| {fault} | {self.faults[fault]:,} |")


def main() -> None:
    """Run the sessions and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=2000)
    parser.add_argument("--trials", type=int, default=30)
    parser.add_argument("--rate", type=float, default=0.08, help="share of calls that fail")
    parser.add_argument("--seed", type=int, default=0, help="the first session's")
    parser.add_argument(
        "--minutes", type=float, default=math.inf, help="stop after so long, and say how many there were"
    )
    parser.add_argument("--keep", type=Path, help="keep the counts in this file, and go on from it where it is there")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    began_s, tally = time.monotonic(), Tally(arguments.seed, arguments.keep)
    seeds = range(tally.next_seed, arguments.seed + arguments.sessions)
    with tempfile.TemporaryDirectory() as folder:
        for seed in track(seeds, "soaking", console=Console(stderr=True)):
            if time.monotonic() - began_s > 60 * arguments.minutes:
                break
            faulthandler.dump_traceback_later(STUCK_S, exit=True)
            soaked = Soaked(Path(folder), seed, arguments.trials, arguments.rate)
            record = soaked.run()
            check(soaked, record)
            soaked.log.unlink()
            tally.add(soaked, record)
    faulthandler.cancel_dump_traceback_later()
    tally.report(arguments.trials)


if __name__ == "__main__":
    understood("soak", prints=True)
    main()
