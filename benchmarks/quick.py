"""A quick look at a benchmark: what `--quick` stands for, at most two minutes of processor time.

    python -m benchmarks.people --quick
    python -m benchmarks.before_and_now run --quick

Every benchmark understands it by the same rule. `--quick` stands for the options of `QUICK`; one that the command gives
itself stays as given. What a quick run writes goes into a folder of its own, `FOLDER`, unless `--out` says otherwise,
so that no committed result is lost. Of a benchmark that writes nothing but what it prints, `--out FILE` keeps that.
"""

from __future__ import annotations

import io
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, TextIO

from threadpoolctl import threadpool_limits

__all__ = ["FOLDER", "QUICK", "expanded", "understood"]

FOLDER: Final = Path("benchmarks/results/quick")

QUICK: Final[Mapping[str, str]] = {
    "after_effects": "--people 20 --out OUT",
    "another_day": "--people 4 --earlier-trials 8 --trials 8 --out OUT",
    "arduino": "--pairs 200 --times 2 --noisy-pairs 12 --out OUT",
    "before_and_now compare": "--out OUT",
    "before_and_now run": "--cohorts gaussian --people 4 --out OUT",
    "before_and_now speed": "--laps 1",
    "before_and_now stops": "--out OUT",
    "bounds": "--sessions 20",
    "calibration": "--replications 4 --trials 5 --people 1 --out OUT",
    "compare": "--people 2 --slow-people 1 --trials 20 --rows 3 --cohorts recruitment "
    "--parts named,regressions,particles,gp,botorch,supra,parametric --out OUT",
    "core_size": "--out OUT",
    "covariates": "--labs 1 --people 1 --out OUT",
    "deaths": "--kills 9 --out OUT",
    "dissertation": "--few --out OUT",
    "fair_opponent": "--people 3 --trials 12 --out OUT",
    "first_words": "--trials 6",
    "given_pulses": "--people 2 --out OUT",
    "headline": "--people 2 --trials 6 --processes 1 --out OUT",
    "house": "",
    "impact_stream": "--sweeps 100",
    "inhibition": "--people 1 --out OUT",
    "interval": "--out OUT",
    "lab": "--labs 1 --people 2 --misfits 1 --trials 8 --out OUT",
    "latency": "--people 1 --through 20 --long-people 1 --strategies default,nr,random",
    "limits": "--cohorts late --people 2 --trials 8 --out OUT",
    "line_peer": "--sessions 20",
    "live": "--trials 20 --pairs 2 --paced 0 --drawn 5",
    "log_damage": "--cases 500",
    "log_mutations": "--cases 20",
    "long_sessions": "--most 100",
    "lsl_throughput": "--seconds 5",
    "measured_windows": "--sweeps 2",
    "mixed_intensities": "--people 1 --out OUT",
    "mutations": "--faults 3 --room window --work OUT_of_a_room --out OUT",
    "pairing_watch": "--people 1 --trials 8 --out OUT",
    "people": "--cohorts gaussian,recruitment --people 3 --trials 10 --out OUT",
    "plausibility": "--people 2 --trials 20 --rigs 5 --out OUT",
    "raw_sweeps plain": "--people 1",
    "raw_sweeps random": "--people 500",
    "raw_sweeps reflex": "--people 1",
    "raw_sweeps rigs": "--people 4",
    "raw_sweeps sizes": "",
    "read_files": "--minutes 1 --rows 2000",
    "recorded_cohort": "--people 10 --trials 10 --workers 1 --out OUT",
    "reduction.redraw": "--out OUT",
    "replayed": "--people 2 --sessions 1",
    "response_prior": "--most 2 --bootstraps 2 --out OUT",
    "rules_as_printed": "--people 20 --out OUT",
    "said": "--share 0.01 --seed 1 --folder OUT",
    "same_asks": "--sessions 1 --stimuli 10 --strategies default nr",
    "sampler record": "--people 2 --trials 20 --particles 500 --out OUT",
    "server": "--number 10",
    "signals": "",
    "silence": "--people 3 --out OUT",
    "soak": "--sessions 10",
    "steps report": "--out OUT",
    "steps run": "--people 2 --trials 10 --out OUT",
    "taps_alone": "--people 1",
    "threshold": "--n 4 --spots 1",
    "throughput": "--single 1 --batches 1 --batch 4",
    "trial_cost": "--trials 60",
    "trial_reduction": "--few --processes 1 --out OUT",
    "trial_way": "",
    "two_steps": "--people 1 --out OUT",
    "vane": "--out OUT",
    "waveform_loop": "--reference valve --people 2 --sessions 1 --trials 15",
    "zero_trials": "--people 20",
}
"""What `--quick` stands for, by benchmark and command; OUT is the benchmark's name in `FOLDER`."""


def understood(benchmark: str, *, prints: bool = False) -> None:
    """Put what `--quick` stands for in the place of it, before the command line is read; and keep what is printed.

    Args:
        benchmark: its module in this folder.
        prints: it has no option `--out` of its own, since all that it finds is what it prints.
    """
    given = sys.argv[1:]
    if "--help" in given:
        print(f"--quick stands for: {_meant(benchmark, given)}\n")
        if prints:
            print("--out FILE keeps what is printed in a file, too.\n")
    if "--quick" in given:
        threadpool_limits(1)  # small matrices gain nothing from several threads, which cost processor time
        sys.argv[1:] = expanded(benchmark, given)
    if prints:
        sys.argv[1:], out = without_out(sys.argv[1:])
        if out is not None:
            _keep_printed(out)


def without_out(given: Sequence[str]) -> tuple[list[str], Path | None]:
    """A command line without `--out FILE`, and the file.

    Args:
        given: the command line.

    Raises:
        SystemExit: `--out` without a file.
    """
    words = [part for word in given for part in (word.split("=", 1) if word.startswith("--out=") else [word])]
    if "--out" not in words:
        return words, None
    place = words.index("--out")
    if place + 1 == len(words):
        raise SystemExit("--out needs a file.")
    return words[:place] + words[place + 2 :], Path(words[place + 1])


class _Both(io.TextIOBase):
    """What is written to it goes to two places."""

    def __init__(self, shown: TextIO, kept: TextIO) -> None:
        self._shown, self._kept = shown, kept

    def write(self, text: str) -> int:
        self._kept.write(text)
        return self._shown.write(text)

    def flush(self) -> None:
        self._kept.flush()
        self._shown.flush()


def _keep_printed(out: Path) -> None:
    out.parent.mkdir(parents=True, exist_ok=True)
    sys.stdout = _Both(sys.stdout, out.open("w", encoding="utf-8", buffering=1))


def expanded(benchmark: str, given: Sequence[str]) -> list[str]:
    """A command line without `--quick`, and with what it stands for.

    Args:
        benchmark: its module in this folder.
        given: the command line.
    """
    kept = [word for word in given if word != "--quick"]
    if len(kept) == len(given):
        return kept
    named = {word.partition("=")[0] for word in kept}
    (Path.cwd() / FOLDER).mkdir(parents=True, exist_ok=True)
    return [*kept, *(word for option in _options(_meant(benchmark, kept)) if option[0] not in named for word in option)]


def _meant(benchmark: str, given: Sequence[str]) -> str:
    """What `--quick` stands for, of a command of the benchmark where it has several."""
    command = f"{benchmark} {given[0]}" if given else benchmark
    return QUICK.get(command, QUICK.get(benchmark, "")).replace("OUT", str(FOLDER / benchmark))


def _options(words: str) -> list[list[str]]:
    """Options with their values."""
    found: list[list[str]] = []
    for word in shlex.split(words):
        if word.startswith("--"):
            found.append([word])
        else:
            found[-1].append(word)
    return found
