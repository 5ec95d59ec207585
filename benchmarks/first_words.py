"""How much processor time each command takes until its first words, and how long it is silent at most.

    python -m benchmarks.first_words > benchmarks/results/first_words.md

Every command is a process of its own whose output is a pipe. Whenever it prints something, the processor time that it
and its threads have taken so far is read, so that other work on the machine hardly matters. Linux only.
"""

from __future__ import annotations

import argparse
import itertools
import os
import re
import select
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood

MOST_S = 2.0
COLUMNS = 60
TICKS_S = 1 / os.sysconf("SC_CLK_TCK")

CONFIG = """
[strategy.settings]
max_trials = {trials}
stop_width_ms = 0.001
stop_expected_f1 = 1.0
stop_gain = 0.0
"""
MORE = "[limits]\nmax_pulses = {pulses}\n"
STUDY = """
people = 2
trials = 3
marks = [0, 3]
cohorts = ["gaussian"]
strategies = ["random"]
"""

COMMANDS = (
    "--version",
    "--help",
    "strategies",
    "strategies default",
    "run a.toml --log a.mcap",
    "run --log b.mcap --seed 1 --strategy nr",
    "run robot.toml --log robot.mcap",
    "show a.mcap",
    "plot a.mcap -o picture.png",
    "report a.mcap -o a.html",
    "exclude a.mcap 3 --reason cough",
    "estimate a.mcap",
    "include a.mcap 3",
    "resume a.mcap",
    "compare a.mcap robot.mcap",
    "compare a.mcap robot.mcap -o c.html",
    "export a.mcap tables",
    "export a.mcap bids --to bids",
    "export robot.mcap robot --to bids",
    "timing robot.mcap",
    "timing subject1",
    "timing vane",
    "threshold t.mcap",
    "threshold t.mcap --show",
    "new rig mine",
    "check mine/session.toml --yes",
    "run mine/session.toml --log mine.mcap",
    "prior learn a.mcap robot.mcap -o lab.toml --again",
    "prior show lab.toml -o lab.png",
    "analyse data.csv --reference impact -o data.mcap",
    "replay data.csv --reference impact --seeds 1 --trials 6",
    "study run study.toml --workers 1",
    "study summary study.study",
    "study replay study.study 0",
    "serve served --port 0",
)
"""In an order in which each has what it needs."""


@dataclass(frozen=True)
class Heard:
    """What a command was heard to say.

    Args:
        first_s: processor time until its first words [s].
        words: these words.
        silent_s: the most processor time between two things that it printed, the start and the end among them [s].
        all_s: its whole processor time [s].
        code: its exit code; None for a server, which was ended when it was ready.
    """

    first_s: float
    words: str
    silent_s: float
    all_s: float
    code: int | None


def spent_s(process: int) -> float:
    """The processor time of a process and its threads [s]."""
    fields = Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()
    return TICKS_S * (int(fields[11]) + int(fields[12]))


def heard(command: str, folder: Path) -> Heard:
    """Run a command, and listen."""
    words = [sys.executable, "-m", "isiw", *command.split()]
    with subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:  # noqa: S603
        if process.stdout is None:
            raise RuntimeError("a pipe was asked for")
        text, times_s = b"", [0.0]
        while True:
            select.select([process.stdout], [], [])
            data = os.read(process.stdout.fileno(), 1 << 16)
            times_s.append(spent_s(process.pid))  # of a process that has ended, too, until it is waited for
            if not data:
                break
            text += data
            if command.startswith("serve") and b"Ready" in text:
                process.terminate()
        first = next((line for line in text.decode(errors="replace").splitlines() if line.strip()), "")
        silent_s = max(after - before for before, after in itertools.pairwise(times_s))
        code = process.wait()
        ended = None if command.startswith("serve") else code
        return Heard(times_s[1], first.strip(), silent_s, times_s[-1], ended)


def prepared(folder: Path, trials: int) -> None:
    """Write what the commands read."""
    (folder / "a.toml").write_text(CONFIG.format(trials=trials))
    robot = f'[device]\nkind = "tapper"\n[subject]\ncohort = "gaussian"\n{CONFIG.format(trials=trials // 3)}'
    (folder / "robot.toml").write_text(robot)
    (folder / "study.toml").write_text(STUDY)
    rows = [f"{isi_ms},{0.3 if 80 <= isi_ms <= 160 else 0.02}" for isi_ms in range(0, 200, 10)]
    (folder / "data.csv").write_text("\n".join(["isi_ms,mep_mv", *rows]))


def row(command: str, found: Heard) -> str:
    """A row of the table."""
    words = re.sub(r"\s+", " ", found.words).replace("|", "\\|")
    shown = words if len(words) <= COLUMNS else f"{words[: COLUMNS - 1]}…"
    mark = "" if found.silent_s <= MOST_S else " **"
    failed = "" if found.code in {None, 0} else f" (exit code {found.code})"
    return f"| `{command}`{failed} | {found.first_s:.1f} | {shown} | {found.silent_s:.1f}{mark} | {found.all_s:.1f} |"


def main() -> None:
    """Run all commands, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=36, help="of the session that is looked at and resumed")
    parser.add_argument("--only", nargs="*", default=None, help="begin of the commands to list; all are run")
    chosen = parser.parse_args()
    print("# Processor time until a command's first words\n")
    print(f"`{command_of('first_words')}`; {made_with('torch')}; a session of {chosen.trials} pairs.")
    print(f"In seconds of processor time; ** marks what is silent for more than {MOST_S:g} s.\n")
    print("| command | until the first words | these | longest silence | in all |\n|---|---|---|---|---|")
    folder = Path(tempfile.mkdtemp())
    try:
        prepared(folder, chosen.trials)
        for command in COMMANDS:
            found = heard(command, folder)
            if listed(command, chosen.only):
                print(row(command, found), flush=True)
    finally:
        shutil.rmtree(folder)


def listed(command: str, only: Sequence[str] | None) -> bool:
    """Whether a command is in the table."""
    return not only or any(command.startswith(begin) for begin in only)


if __name__ == "__main__":
    understood("first_words", prints=True)
    main()
