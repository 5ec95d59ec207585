"""The default of another version of isiw and of this one, on the same simulated people.

    git worktree add ../before e31d040
    PYTHONPATH=../before/src python -m benchmarks.before_and_now run --out before
    python -m benchmarks.before_and_now run --out now
    python -m benchmarks.before_and_now compare before now --out benchmarks/results/before_and_now
    PYTHONPATH=../before/src python -m benchmarks.before_and_now run --to-stopping 80 --out before
    python -m benchmarks.before_and_now run --to-stopping 80 --out now
    python -m benchmarks.before_and_now stops before now --out benchmarks/results/before_and_now_stops
    python -m benchmarks.before_and_now honest before now --out benchmarks/results/realities
    python -m benchmarks.before_and_now speed ../before/src src > benchmarks/results/before_and_now_speed.md
    python -m benchmarks.before_and_now session ../before/src src > benchmarks/results/session_speed.md
    python -m benchmarks.before_and_now first ../before/src src > benchmarks/results/first_trials.md

`run` keeps one table a cohort, and goes on where it was interrupted; `compare` pairs the people of both, `stops` where
the stopping rule of each ends, `honest` how often each is sure and wrong; `speed` and `session` have both run the same
sessions in turn, and `first` a process that ends after three trials, once with nothing compiled before. The hit delay
is stated where a version can be told it. Reported people come from seed 100,000 on; seeds below 1,000 are for work.
"""

from __future__ import annotations

import inspect
import os
import platform
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pandas as pd
import torch
import typer

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood
from isiw.studies import (
    Processes,
    Study,
    StudyStrategy,
    conduct,
    run_unit,
    summary,  # whose constants earlier versions lack
)

with suppress(ImportError):  # earlier versions have none, and compare nothing
    from isiw import summary as odds

MARKS = (5, 10, 15, 20, 25, 30, 40)
LATER = (50, 60, 80)
COHORTS = "recruitment,gaussian,nonresponder"

app = typer.Typer(help=__doc__)


@app.command()
def run(
    cohorts: Annotated[str, typer.Option(help="Cohorts, comma-separated.")] = COHORTS,
    people: Annotated[int, typer.Option(help="People a cohort.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the people.")] = 100_000,
    workers: Annotated[int, typer.Option(help="Processes.")] = 2,
    trials: Annotated[int, typer.Option(help="Trials a session.")] = 40,
    to_stopping: Annotated[int | None, typer.Option(help="So many trials, and where the rule ends.")] = None,
    out: Annotated[Path, typer.Option(help="Folder of the tables.")] = Path("now"),
) -> None:
    """Run the default of the isiw that is imported."""
    torch.set_num_threads(1)
    for name in cohorts.split(","):
        last, stopping = (trials, "ignored") if to_stopping is None else (to_stopping, "noted")
        marks = tuple(sorted({*(mark for mark in (*MARKS, *LATER) if mark <= last), last}))
        study = study_of(name, people, seed, marks, stopping)
        results = conduct(study, out / f"{name}.study", executor=Processes(workers))
        results.rows().to_parquet(out / f"{name}.parquet")


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(help="Folder of the tables of the other version.")],
    now: Annotated[Path, typer.Argument(help="Folder of the tables of this version.")],
    out: Annotated[Path, typer.Option(help="Path of the result, without suffix.")] = Path("before_and_now"),
) -> None:
    """Pair the people that both versions measured."""
    table = pd.concat([paired(before / path.name, path) for path in sorted(now.glob("*.parquet"))])
    _write(table, now, out, "the stopping rule is ignored")


@app.command()
def stops(
    before: Annotated[Path, typer.Argument(help="Folder of the tables of the other version.")],
    now: Annotated[Path, typer.Argument(help="Folder of the tables of this version.")],
    out: Annotated[Path, typer.Option(help="Path of the result, without suffix.")] = Path("before_and_now_stops"),
) -> None:
    """Compare where the stopping rules of both versions end, on the people that both measured."""
    table = pd.concat([ends(before / path.name, path) for path in sorted(now.glob("*.parquet"))])
    _write(table, now, out, "a session that has not stopped by the last trial counts as it stands there")


@app.command()
def honest(
    before: Annotated[Path, typer.Argument(help="Folder of the tables of the other version.")],
    now: Annotated[Path, typer.Argument(help="Folder of the tables of this version.")],
    out: Annotated[Path, typer.Option(help="Path of the result, without suffix.")] = Path("realities"),
) -> None:
    """Compare how often each version is sure and wrong, on the people that both measured."""
    tables = [honesty(before / path.name, path) for path in sorted(now.glob("*.parquet"))]
    sure_f1, wrong_f1 = summary.SURE_F1, summary.WRONG_F1
    how = f"sure and wrong: an expected F1 of at least {sure_f1:g}, and at least {wrong_f1:g} above the actual one"
    _write(pd.concat(tables), now, out, how)


def honesty(before: Path, now: Path) -> pd.DataFrame:
    """Expected and actual F1, who is sure and wrong, coverage, and windows of people without one, by trial.

    Args:
        before: rows of the other version.
        now: rows of this version.
    """
    keys = ["cohort", "person", "trial"]
    both = pd.read_parquet(before).merge(pd.read_parquet(now), on=keys, suffixes=("_before", "_now"))
    both = both[both["trial"].isin((20, 40, 60))]
    there = both["true_window_now"].astype(bool)
    rows = {"people": both["f1_now"].notna().astype(int), "f1_more": both["f1_now"] - both["f1_before"]}
    rows["f1_more_with_window"] = rows["f1_more"].where(there)
    for which in ("before", "now"):
        f1, expected = both[f"f1_{which}"], both[f"expected_f1_{which}"]
        rows[f"f1_{which}"], rows[f"expected_{which}"] = f1, expected
        rows[f"sure_and_wrong_{which}"] = summary.sure_and_wrong(expected, f1)
        # How often it itself expects that what it is sure of is wrong altogether.
        window_told, probability = both[f"reported_window_{which}"].astype(bool), both[f"probability_{which}"]
        doubt = (1.0 - probability).where(window_told, probability)
        rows[f"own_doubt_{which}"] = doubt.where(expected >= summary.SURE_F1, 0.0)
        rows[f"start_{which}"], rows[f"end_{which}"] = both[f"start_covered_{which}"], both[f"end_covered_{which}"]
        rows[f"false_window_{which}"] = both[f"reported_window_{which}"].astype(float).mask(there)
        rows[f"false_sure_{which}"] = (both[f"probability_{which}"] >= 0.9).astype(float).mask(there)
    factor = both["bayes_factor_now" if "bayes_factor_now" in both else "bayes_factor"]  # which earlier versions lack
    unclear = both["reported_window_now"].astype(bool) & (factor < odds.LEAST_FACTOR)
    undecided = unclear & (both["probability_now"] < odds.SURE)
    rows["undecided_now"] = undecided.astype(float)
    left_open = ~both["reported_window_now"].astype(bool) & (1.0 - both["probability_now"] < odds.SURE)
    rows["said_and_wrong_now"] = rows["sure_and_wrong_now"].where(~(undecided | left_open), 0.0)
    rows["false_stated_now"] = (both["reported_window_now"].astype(bool) & ~undecided).astype(float).mask(there)
    groups = pd.DataFrame(rows).groupby([both["cohort"], both["trial"]])
    table = groups.mean().assign(people=groups["people"].sum())
    for name in ("f1_more", "f1_more_with_window"):
        table.insert(table.columns.get_loc(name) + 1, f"{name}_se", groups[name].sem())
    return table.reset_index()


def _write(table: pd.DataFrame, now: Path, out: Path, how: str) -> None:
    command = command_of("before_and_now")
    known = {seed for path in now.glob("*.parquet") for seed in pd.read_parquet(path)["seed"]}
    seeds = ", ".join(f"{seed:,}" for seed in sorted(known))
    lines = [
        f"- command: `{command}`, after `run` with both versions; seed of the people {seeds}",
        f"- {made_with('torch')}",
        f"- the hit delay is stated where it can be; {how}",
    ]
    text = table.to_markdown(index=False, floatfmt=".3f")
    out.with_suffix(".md").write_text("\n".join([*lines, "", text, ""]), encoding="utf-8")
    print(text)


@app.command()
def speed(
    before: Annotated[Path, typer.Argument(help="Folder src of the other version.")],
    now: Annotated[Path, typer.Argument(help="Folder src of this version.")],
    laps: Annotated[int, typer.Option(help="How often each runs 50 sessions of 30 trials.")] = 4,
) -> None:
    """Print the processor time of both versions, each lap first as often as second; the stopping rule is ignored."""
    rows = []
    for number in range(laps):
        order = (before, now) if number % 2 == 0 else (now, before)
        spent = {source: _of_lap(source, "lap", number)[0] for source in order}
        rows.append((number, spent[before], spent[now], spent[before] / spent[now]))
    print(f"- command: `{command_of('before_and_now')}`")
    print(f"- {made_with('torch')}; {platform.machine()}, one thread")
    print("- processor time of 50 sessions of `recruitment` side by side, 30 trials each\n")
    headings = ["seed", "before_s", "now_s", "ratio"]
    print(pd.DataFrame(rows, columns=headings).to_markdown(index=False, floatfmt=(".0f", ".2f", ".2f", ".2f")))


def _of_lap(source: Path, lap: str, seed: int) -> list[float]:
    """The numbers that a lap with the isiw in a folder prints."""
    return _printed(source, "-m", "benchmarks.before_and_now", lap, str(seed))


def _printed(source: Path, *arguments: str, **more: str) -> list[float]:
    """The numbers that Python prints with the isiw in a folder, with more in its environment."""
    environment = os.environ | {"PYTHONPATH": str(source.resolve()), "OMP_NUM_THREADS": "1"} | more
    command = [sys.executable, *arguments]
    ended = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)  # noqa: S603 - this file
    return [float(number) for number in ended.stdout.split()]


@app.command()
def session(
    before: Annotated[Path, typer.Argument(help="Folder src of the other version.")],
    now: Annotated[Path, typer.Argument(help="Folder src of this version.")],
    laps: Annotated[int, typer.Option(help="How often each runs a session of 200 trials.")] = 4,
) -> None:
    """Print the processor time of one person's session with a decision after each trial, each version in turn."""
    rows = []
    for number in range(laps):
        order = (before, now) if number % 2 == 0 else (now, before)
        spent = {source: _of_lap(source, "session-lap", number) for source in order}
        for what, old, new in zip(("60 trials [s]", "99th percentile [ms]"), spent[before], spent[now], strict=True):
            rows.append({"": what, "seed": number, "before": old, "now": new, "ratio": old / new})
    print(f"- command: `{command_of('before_and_now')}`")
    print(f"- {made_with('torch')}; {platform.machine()}, one thread")
    print(
        "- processor time of a person of `recruitment`, in a process that has run ten trials before: 60 trials with a"
    )
    print("  decision after each, and the 99th percentile of ask + tell in 200 trials\n")
    print(pd.DataFrame(rows).sort_values(["", "seed"]).to_markdown(index=False, floatfmt=".2f"))


FIRST = r"""
import isiw, re, time
strategy = isiw.make_strategy("default", isiw.VALVE_SPACE, int({seed}))
for mep_mv in (0.02, 0.3, 0.05):
    strategy.tell(strategy.ask(), mep_mv)
    strategy.decision()
(held_kb,) = re.findall(r"VmHWM:\s+(\d+)", open("/proc/self/status").read())
print(time.process_time(), int(held_kb) / 1024)
"""
"""Three trials of a new process under Linux: its processor time [s], and the most memory that it held [MB].

The maximum that `getrusage` has may be the memory of the process that began this one."""


@app.command()
def first(
    before: Annotated[Path, typer.Argument(help="Folder src of the other version.")],
    now: Annotated[Path, typer.Argument(help="Folder src of this version.")],
    laps: Annotated[int, typer.Option(help="How often each begins with nothing compiled, and again.")] = 4,
) -> None:
    """Print what the first three trials of a new process take, each version in turn."""
    rows = []
    for number in range(laps):
        order = (before, now) if number % 2 == 0 else (now, before)
        spent = {source: _first_trials(source, number) for source in order}
        for what, old, new in zip(("first use [s]", "warm [s]", "memory [MB]"), spent[before], spent[now], strict=True):
            rows.append({"": what, "seed": number, "before": old, "now": new, "ratio": old / new})
    print(f"- command: `{command_of('before_and_now')}`")
    print(f"- {made_with('torch', 'numba')}; {platform.machine()}, one thread")
    print("- processor time of a process that imports isiw, runs three trials with a decision after each, and ends;")
    print("  on first use nothing was compiled before; the most memory that it held when warm\n")
    print(pd.DataFrame(rows).sort_values(["", "seed"]).to_markdown(index=False, floatfmt=".2f"))


def _first_trials(source: Path, seed: int) -> list[float]:
    """Processor time on first use and then [s], and the memory then [MB], with the isiw in a folder."""
    with tempfile.TemporaryDirectory() as empty:
        unused, warm = (_printed(source, "-c", FIRST.format(seed=seed), NUMBA_CACHE_DIR=empty) for _ in range(2))
    return [unused[0], *warm]


@app.command(hidden=True)
def session_lap(seed: int) -> None:
    """Print what `session` measures with the isiw that is imported: 60 trials [s], and ask + tell [ms]."""
    torch.set_num_threads(1)
    _spent_s(seed, 10)
    spent_s = _spent_s(seed, 200)
    print(spent_s[:60].sum(), 1e3 * np.percentile(spent_s[:, 0], 99))


def _spent_s(seed: int, trials: int) -> np.ndarray:
    """Processor time of ask and tell, and of the decision, by trial [s], shape (n, 2)."""
    responder, strategy = isiw.subjects.cohort("recruitment", 1, seed)[0].begin(seed), isiw.make_strategy(seed=seed)
    spent_s = []
    for _ in range(trials):
        began_s = time.process_time()
        isi_ms = strategy.ask()
        asked_s = time.process_time()
        response = responder.respond(isi_ms, "valve")
        answered_s = time.process_time()
        strategy.tell(response.isi_ms, response.mep_mv)
        told_s = time.process_time()
        strategy.decision()
        spent_s.append((asked_s - began_s + told_s - answered_s, time.process_time() - told_s))
    return np.array(spent_s)


@app.command(hidden=True)
def lap(seed: int) -> None:
    """Print the processor time of 50 sessions with the isiw that is imported [s]."""
    torch.set_num_threads(1)
    (first,) = study_of("recruitment", 2, seed, (4,), batch=2).units()
    run_unit(first)  # loads everything
    (unit,) = study_of("recruitment", 50, seed, (10, 20, 30), batch=50).units()
    began_s = time.process_time()
    run_unit(unit)
    print(time.process_time() - began_s)


def study_of(
    cohort: str,
    people: int,
    seed: int,
    marks: tuple[int, ...],
    stopping: str = "ignored",
    batch: int = 25,
    settings: dict[str, Any] | None = None,
) -> Study:
    """The default on a cohort; the hit delay is stated where a version can be told it.

    Args:
        cohort: name of the cohort.
        people: how many.
        seed: of the people.
        marks: trials after which there is an estimate; the last is the last.
        stopping: what a study makes of the stopping rule.
        batch: how many sessions are side by side.
        settings: of the default.
    """
    told: dict[str, Any] = {"hit_delay": "stated"} if "hit_delay" in inspect.signature(Study).parameters else {}
    default = (StudyStrategy("default", settings or {}),)
    plan: dict[str, Any] = {"engine": "batched", "batch": batch, "stopping": stopping}
    return Study(default, (cohort,), people, seed, marks[-1], marks, **plan, **told)


def paired(before: Path, now: Path) -> pd.DataFrame:
    """F1 of both, their mean difference on the people of both, shares told "no window", and coverage, by trial.

    Args:
        before: rows of the other version.
        now: rows of this version.
    """
    keys = ["cohort", "person", "trial"]
    new, old = pd.read_parquet(now), pd.read_parquet(before)
    both = new.merge(old, on=keys, suffixes=("_now", "_before"))
    both["difference"] = both["f1_now"] - both["f1_before"]
    edges = ("start_covered", "end_covered")
    for edge in edges:  # NaN for people without a window
        both[edge] = both[f"{edge}_now"] - both[f"{edge}_before"]
    for which in ("now", "before"):
        both[f"none_{which}"] = ~both[f"reported_window_{which}"].astype(bool)
    groups = both.groupby(["cohort", "trial"])
    table = groups[["f1_before", "f1_now", "difference", "none_before", "none_now"]].mean()
    table.insert(0, "people", groups.size())
    table.insert(4, "difference_se", groups["difference"].sem())
    for edge in edges:
        table[f"{edge}_now"], table[f"{edge}_more"] = groups[f"{edge}_now"].mean(), groups[edge].mean()
        table[f"{edge}_more_se"] = groups[edge].sem()
    return table.reset_index()


def ends(before: Path, now: Path) -> pd.DataFrame:
    """How sessions of both end: stimuli, F1, and who is told a window, by cohort; differences on the same people.

    Args:
        before: rows of the other version.
        now: rows of this version.
    """
    keys = ["cohort", "person"]
    both = _ends(now).merge(_ends(before), on=keys, suffixes=("_now", "_before"))
    rows = []
    for cohort, people in both.groupby("cohort"):
        for what in ("stimuli", "f1", "stopped_on_window", "stopped_on_none", "told_window", "told_window_at_the_end"):
            difference = people[f"{what}_now"].astype(float) - people[f"{what}_before"].astype(float)
            means = {which: people[f"{what}_{which}"].mean() for which in ("before", "now")}
            change = {"difference": difference.mean(), "difference_se": difference.sem()}
            rows.append({"cohort": cohort, "people": len(people), "": what, **means, **change})
    return pd.DataFrame(rows)


def _ends(path: Path) -> pd.DataFrame:
    """The end of each session; one that its budget ends, or that goes on, is told what is reported by then."""
    rows, who = pd.read_parquet(path).sort_values("trial"), ["cohort", "person"]
    last = rows.groupby(who).tail(1).set_index(who)
    stimuli = last["stop_trial"].fillna(last["trial"])
    by_then = rows[rows["trial"] >= rows.set_index(who).index.map(stimuli)].groupby(who).head(1).set_index(who)
    decided = last["converged"] == 1.0
    told = by_then["reported_window"].reindex(last.index).fillna(last["reported_window"]).astype(bool)
    none = decided & ~told
    ends = last[[]].assign(
        stimuli=stimuli,
        f1=last["stop_f1"].fillna(last["f1"]),
        stopped_on_window=decided & ~none,
        stopped_on_none=none,
        told_window=(decided & ~none) | (~decided & told),
        told_window_at_the_end=last["reported_window"].astype(bool),
    )
    return ends.reset_index()


if __name__ == "__main__":
    understood("before_and_now")
    app()
