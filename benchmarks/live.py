"""The live page: what looking on costs a session's loop, and how soon a trial is seen.

    python -m benchmarks.live > benchmarks/results/live.md

Sessions of the default at the simulated tapping robot, with raw sweeps. Each is run with and without the page, in turn
and with the same seed; two viewers in processes of their own take all that the page is sent. Needs the test extra, and
Chromium for what a browser draws.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from mcap.reader import make_reader
from playwright.sync_api import sync_playwright

import isiw
from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood

SPACE = isiw.DesignSpace(0, 320, reference="impact")

VIEWER = """
import http.client, json, sys, time
from urllib.parse import urlsplit
url, _, token = sys.argv[1].partition("#")
connection = http.client.HTTPConnection(urlsplit(url).netloc)
connection.request("GET", "/updates", headers={"Authorization": f"Bearer {token}"})
answer, seen = connection.getresponse(), {}
print("ready", flush=True)
for line in answer:
    if line.startswith(b"data: "):
        trials = json.loads(line[6:])["drawn"]["trials"]
        for trial in trials:
            seen.setdefault(trial["number"], time.time_ns())
print(json.dumps(seen), flush=True)
"""

DRAWN = """() => {
  window.seen = { words: {}, trial: {} };
  const note = (part, number) => { window.seen[part][number] ??= Date.now(); };
  const painted = (part, number) => requestAnimationFrame(() => setTimeout(() => note(part, number)));
  const title = document.getElementById("sweep-title");
  new MutationObserver(() => painted("words", Number(title.textContent.match(/\\d+/))))
    .observe(title, { childList: true });
  const react = Plotly.react;
  Plotly.react = (figure, traces, ...more) => {
    const done = react(figure, traces, ...more);
    if (figure === "belief") {
      const numbers = traces.flatMap((trace) => trace.customdata ?? []);
      painted("trial", Math.max(...numbers));
    }
    return done;
  };
}"""
"""Notes when the words about a trial were painted, and when the trial itself was, among the others by ISI."""


@dataclass
class Run:
    """One session, and when its trials were seen [ms after they were logged]."""

    wall_s: float = 0.0
    cpu_s: float = 0.0
    isis_ms: tuple[float | None, ...] = ()
    seen_ms: list[float] = field(default_factory=list)


def session_of(folder: Path, seed: int, trials: int, iti_s: float) -> isiw.Session:
    """A session of so many trials; in real time where there is an interval between them."""
    person = isiw.subjects.cohort("recruitment", 1, seed=seed)[0].begin(seed=seed)
    device = isiw.SimulatedDevice(isiw.Tapper(lambda isi_ms: person.respond(isi_ms, "impact"), seed=seed))
    strategy = isiw.make_strategy(space=SPACE, seed=seed, max_trials=trials, stop_width_ms=0.01, stop_expected_f1=1.0)
    return isiw.Session(
        device, strategy, log=folder / "s.mcap", limits=isiw.Limits.of_space(SPACE, min_iti_s=iti_s),
        clock=isiw.MonotonicClock() if iti_s else None,
    )  # fmt: skip


def logged_ns(log: Path) -> dict[int, int]:
    """When each trial was logged [ns]."""
    with log.open("rb") as file:
        return {
            json.loads(message.data)["index"]: message.log_time
            for _, _, message in make_reader(file).iter_messages(topics=["/trial"])
        }


@contextmanager
def viewers(url: str, many: int, seen_ns: list[dict[int, int]]) -> Iterator[None]:
    """Within, so many processes look on; what they saw is put into a list."""
    command = [sys.executable, "-c", VIEWER, url]
    with ExitStack() as stack:
        processes = [
            stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))  # noqa: S603 - our own
            for _ in range(many)
        ]
        outputs = [process.stdout for process in processes if process.stdout is not None]
        for output in outputs:
            output.readline()
        yield
        seen_ns += [{int(number): at for number, at in json.loads(output.readline()).items()} for output in outputs]


def timed(session: isiw.Session) -> Run:
    """Run a session."""
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    result = session.run()
    return Run(
        time.perf_counter() - wall_s,
        time.process_time() - cpu_s,
        tuple(trial.commanded_isi_ms for trial in result.trials),
    )


def ran(seed: int, trials: int, iti_s: float, many: int) -> Run:
    """A session that so many look at; none of them, and there is no page."""
    with tempfile.TemporaryDirectory() as folder:
        session = session_of(Path(folder), seed, trials, iti_s)
        if not many:
            return timed(session)
        seen_ns: list[dict[int, int]] = []
        with isiw.watch(session) as page, viewers(page.url, many, seen_ns):
            run = timed(session)
        logged = logged_ns(session.log_path)
        run.seen_ms = [(seen[number] - at) / 1e6 for seen in seen_ns for number, at in logged.items()]
        return run


def drawn_ms(seed: int, trials: int, iti_s: float) -> dict[str, list[float]]:
    """How long after it was logged Chromium has painted each trial [ms]."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        session = session_of(Path(folder), seed, trials, iti_s)
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        with isiw.watch(session) as page:
            shown = browser.new_page()
            shown.goto(page.url)
            shown.get_by_text("The session has not begun.").wait_for()
            shown.evaluate(DRAWN)
            session.run()
            shown.get_by_text("The session has ended.").wait_for()
            seen = shown.evaluate("() => window.seen")
        browser.close()
        logged = logged_ns(session.log_path)
    words = {"words": "its number above its sweep", "trial": "its mark in the picture of the window"}
    return {
        name: [seen[part][str(number)] - at / 1e6 for number, at in logged.items() if str(number) in seen[part]]
        for part, name in words.items()
    }


def main() -> None:
    """Measure, and print the report."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--pairs", type=int, default=5, help="of sessions without waits")
    parser.add_argument("--paced", type=int, default=1, help="pairs of sessions in real time")
    parser.add_argument("--paced-trials", type=int, default=60)
    parser.add_argument("--iti", type=float, default=1.0, help="between the stimuli of these [s]")
    parser.add_argument("--drawn", type=int, default=60, help="trials that Chromium draws")
    parser.add_argument("--seed", type=int, default=10_000)
    options = parser.parse_args()
    load = os.getloadavg()[1]
    _say_how(load)
    print("## What two viewers cost the loop\n")
    print("Wall time and CPU time of the session's process, page and all its threads included; the same seed with and")
    print("without, each first as often as the other. Medians, and in brackets the range of the ratios.\n")
    print("| session | pairs | without [s] | with [s] | wall ratio | CPU ratio | seen after [ms], median and largest |")
    print("|---|---|---|---|---|---|---|", flush=True)
    _compare(options.seed, options.paced_trials, options.iti, options.paced)
    _compare(options.seed, options.trials, 0.0, options.pairs)
    if load > (os.cpu_count() or 1):
        print("\nOn a machine so busy the wall times say nothing.")
    print("\nWithout waits is faster than any rig: there updates are made as often as one per cent of the time allows,")
    print("and what is seen late is the last of several trials.\n")
    print("## When Chromium has drawn it\n")
    late_ms = drawn_ms(options.seed, options.drawn, options.iti)
    for part, late in late_ms.items():
        print(f"- {part}: {statistics.median(late):.0f} ms (median), {max(late):.0f} ms (largest)")
    print(f"\nOf {options.drawn} trials, one every {options.iti:g} s or slower, after their log record.")


def _compare(seed: int, trials: int, iti_s: float, pairs: int) -> None:
    if not pairs:
        return
    without, watched = list[Run](), list[Run]()
    for pair in range(pairs):
        for many in (0, 2) if pair % 2 == 0 else (2, 0):
            (watched if many else without).append(ran(seed + pair, trials, iti_s, many))
    assert all(one.isis_ms == other.isis_ms for one, other in zip(without, watched, strict=True))  # noqa: S101
    wall = [after.wall_s / before.wall_s for before, after in zip(without, watched, strict=True)]
    cpu = [after.cpu_s / before.cpu_s for before, after in zip(without, watched, strict=True)]
    seen_ms = [late_ms for run in watched for late_ms in run.seen_ms]
    name = f"{trials} trials, {iti_s:g} s apart or more" if iti_s else f"{trials} trials without waits"
    times = " | ".join(f"{statistics.median(run.wall_s for run in runs):.1f}" for runs in (without, watched))
    seen = f"{statistics.median(seen_ms):.0f}, {max(seen_ms):.0f}"
    print(f"| {name} | {pairs} | {times} | {_ratio(wall)} | {_ratio(cpu)} | {seen} |", flush=True)


def _ratio(ratios: list[float]) -> str:
    spread = f" ({min(ratios):.3f} to {max(ratios):.3f})" if len(ratios) > 1 else ""
    return f"{statistics.median(ratios):.3f}{spread}"


def _say_how(load: float) -> None:
    print("# The live page\n")
    print(f"- command: `{command_of('live')}`")
    print(f"- {made_with('fastapi', 'uvicorn')}, one thread")
    print(f"- {os.cpu_count()} cores that other programs shared; load average {load:.0f} before\n")


if __name__ == "__main__":
    understood("live", prints=True)
    main()
