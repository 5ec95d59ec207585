"""What reading makes of a damaged log: cut at every byte, and with one random bit of every byte flipped.

    python -m benchmarks.log_damage > benchmarks/results/log_damage.md     every byte, both ways
    python -m benchmarks.log_damage --cases 2000                           so many of these cases, evenly drawn

A case fails where reading raises anything but a `LogError`, takes longer than two seconds, has a trial that was never
given or one with other values, or has lost something without saying so.
"""

from __future__ import annotations

import argparse
import collections
import tempfile
import time
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood

TRIALS = 20
ALLOWED_S = 2.0


class Wrong(StrEnum):
    """What reading can do wrong."""

    HANGS = "takes longer than two seconds"
    RAISES = "raises another error than a LogError"
    INVENTS = "has a trial that was never given"
    HIDES = "lost something without saying so"


class Fault(NamedTuple):
    """What reading did wrong in one case."""

    case: Case
    wrong: Wrong
    detail: str = ""


class Case(NamedTuple):
    """One way in which a log is damaged: cut at a byte, or with a bit flipped in it."""

    byte: int
    bit: int | None = None

    def applied(self, content: bytes) -> bytes:
        """The damaged content."""
        if self.bit is None:
            return content[: self.byte]
        return content[: self.byte] + bytes([content[self.byte] ^ 1 << self.bit]) + content[self.byte + 1 :]


def write_log(path: Path) -> bytes:
    """Run a session of twenty trials without waveforms; its log."""
    space = isiw.DesignSpace(0, 100, 5, reference="valve")
    person = isiw.subjects.cohort("recruitment", 1, 7)[0].begin(7)
    device = isiw.SimulatedDevice(isiw.SimulatedPerson(lambda isi_ms: person.respond(isi_ms, "valve"), "valve"))
    strategy = isiw.make_strategy("even", space, particles=100, max_trials=TRIALS, stop_width_ms=1e-3, stop_no_window=1)
    isiw.Session(device, strategy, log=path).run()
    return path.read_bytes()


def all_cases(size: int) -> list[Case]:
    """A cut at every byte of a log of some size, and a random bit of every byte."""
    bits = np.random.default_rng(0).integers(0, 8, size).tolist()
    return [*map(Case, range(size)), *(Case(byte, bit) for byte, bit in enumerate(bits))]


def drawn_cases(size: int, cases: int) -> list[Case]:
    """So many of all cases."""
    every = all_cases(size)
    chosen = np.random.default_rng(1).choice(len(every), min(cases, len(every)), replace=False)
    return [every[index] for index in sorted(chosen.tolist())]


def faults(path: Path, content: bytes, cases: list[Case]) -> Iterator[Fault]:
    """What went wrong in which case.

    Args:
        path: the log, which is damaged again and again.
        content: what it held.
        cases: how it is damaged.
    """
    path.write_bytes(content)
    original = isiw.read_session(path)
    for case in cases:
        path.write_bytes(case.applied(content))
        begin_s = time.process_time()
        yield from _faults(case, path, original)
        spent_s = time.process_time() - begin_s
        if spent_s > ALLOWED_S:
            yield Fault(case, Wrong.HANGS, f"{spent_s:.1f} s")
    path.write_bytes(content)


def _faults(case: Case, path: Path, original: isiw.SessionRecord) -> Iterator[Fault]:
    try:
        record = isiw.read_session(path)
        trials, unknown = list(record.table), record.unknown
    except isiw.errors.LogError:
        return
    except Exception as error:  # noqa: BLE001 - which is what is looked for
        yield Fault(case, Wrong.RAISES, f"{type(error).__name__}: {error}")
        return
    if not set(trials) <= set(original.table) or not {u.trial for u in unknown} <= {t.index for t in original.table}:
        yield Fault(case, Wrong.INVENTS)
    if not record.losses and (record.history, record.header) != (original.history, original.header):
        yield Fault(case, Wrong.HIDES)


def main() -> None:
    """Damage a log in many ways, and say what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, help="how many of all cases (default: all)")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s.mcap"
        content = write_log(path)
        cases = all_cases(len(content)) if chosen.cases is None else drawn_cases(len(content), chosen.cases)
        found = list(faults(path, content, cases))
    ways = collections.Counter("cut" if case.bit is None else "flipped" for case in cases)
    wrong = collections.Counter(fault.wrong for fault in found)
    print(f"- command: `{command_of('log_damage')}`")
    print(f"- {made_with('mcap')}, seeds 0 (bits) and 7\n")
    print(
        f"A log of {TRIALS} trials without waveforms, {len(content):,} bytes: cut at {ways['cut']:,} of them, and with "
        f"one random bit flipped in {ways['flipped']:,}.\n"
    )
    print("| reading | cases |\n|---|---|")
    for each in Wrong:
        print(f"| {each} | {wrong[each]:,} |")
    for fault in found[:20]:
        print(f"\n{fault}")


if __name__ == "__main__":
    understood("log_damage", prints=True)
    main()
