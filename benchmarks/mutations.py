"""Which faults in the core do the tests find? Faults drawn at random, each made in a copy and judged by quick tests.

    python -m benchmarks.mutations --faults 200 --seed 10000 --out benchmarks/results/mutations

A place of the core (`benchmarks.core_size`) is drawn, then one of the faults of `benchmarks.faults` there. It meets the
quick tests that execute its statement, those of its module first; where it is executed on import, those that execute
anything of its module or import it. What was drawn and judged is kept in `--work`; `--again` judges some once more, by
the tests as they are now. It needs `isiw[benchmarks,test]`.
"""

from __future__ import annotations

import importlib
import json
import os
import shutil
import signal
import sys
import time
import traceback
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Final

import grimp
import pandas as pd
import pytest
import typer
from scipy.stats import binomtest

import isiw
from benchmarks.core_size import PARTS, drawn_in
from benchmarks.faults import Fault, drawn, statement
from benchmarks.provenance import facts_of
from benchmarks.quick import FOLDER, understood
from benchmarks.tables import write_tables

ROOT: Final = Path(isiw.__file__).parents[2]
CORE: Final = next(modules for name, modules in PARTS.items() if name.startswith("the core"))
TESTS: Final = (
    "acquisition", "log", "models/particles", "models/shared", "models/test_randomness.py", "models/test_windows.py",
    "native", "session", "signals", "strategy", "text", "devices/test_clock.py", "devices/test_limits.py",
    "devices/test_protocol.py", "testing", "test_checks.py", "test_design.py", "test_errors.py", "test_files.py",
    "test_trials.py", "test_visit.py", "test_window.py",
)  # fmt: skip
"""Whose tests judge."""
HEAVY: Final = "botorch hypothesis matplotlib.pyplot mcap.reader mcap.writer pyro.distributions rich sklearn.mixture"
"""What is imported once for all faults."""
EARLY: Final = "ignore::pytest.PytestAssertRewriteWarning"
"""What is imported before pytest is none of the tests."""
MOST, MOST_S = 400, 30.0
"""So many tests, of as many seconds, a fault meets at most, and once more of other modules; again any number."""


class Tests:
    """A plugin of pytest: tests in a given order; what each takes, which lines it executes, and which failed."""

    def __init__(self, chosen: Sequence[str] = (), known: Sequence[str] = (), tracer: Any = None) -> None:
        self.chosen, self.known, self.tracer = {test: n for n, test in enumerate(chosen)}, set(known), tracer
        self.seconds, self.failed = dict[str, float](), list[str]()

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Tests that are not known were written since; they come first."""
        if self.known:
            items[:] = [each for each in items if each.nodeid in self.chosen or each.nodeid not in self.known]
            items.sort(key=lambda item: self.chosen.get(item.nodeid, -1))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """The lines that are executed from here on are this test's."""
        begin_s = time.monotonic()
        if self.tracer:
            self.tracer.switch_context(item.nodeid)
        result = yield
        self.seconds[item.nodeid] = time.monotonic() - begin_s
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """A test that fails finds the fault."""
        self.failed += [report.nodeid] if report.failed else []


def run_tests(paths: Sequence[str], tests: Tests, *more: str) -> dict[str, Any]:
    """Run tests in this process."""
    code = pytest.main(["-q", "-n", "0", "-p", "no:cacheprovider", "-W", EARLY, *more, *paths], plugins=[tests])
    return {"code": int(code), "failed": tests.failed, "seconds": tests.seconds}


def traced(work: Path, files: Sequence[str], paths: Sequence[str]) -> dict[str, Any]:
    """Run tests, and keep which lines each executes."""
    coverage = importlib.import_module("coverage")  # tests import this module without the extra
    tracer = coverage.Coverage(data_file=str(work / "lines"), include=list(files), config_file=False)
    with tracer.collect():
        found = run_tests(paths, Tests(tracer=tracer))
    tracer.save()
    return found


def in_child(work: Path, most_s: float, run: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What something finds in a process of its own, in the copy; nothing where that is late, or dies."""
    (result := work / "result.json").unlink(missing_ok=True)
    if not (child := os.fork()):
        os.setsid()
        for name in [name for name in sys.modules if name.partition(".")[0] in {"isiw", "benchmarks"}]:
            del sys.modules[name]
        os.chdir(work / "tree")
        sys.path[:0] = [str(work / "tree" / "src"), str(work / "tree")]
        os.environ["PYTHONPATH"] = os.pathsep.join(sys.path[:2])
        printed = os.open(work / "printed.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(printed, 1)
        os.dup2(printed, 2)
        try:
            result.write_text(json.dumps(run()))
        except BaseException:  # noqa: BLE001 - it is said where pytest writes
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(0)
    end_s = time.monotonic() + most_s
    while not (ended := os.waitpid(child, os.WNOHANG)[0]) and time.monotonic() < end_s:
        time.sleep(0.05)
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if not ended:
        os.waitpid(child, 0)
    return json.loads(result.read_text()) if result.exists() else {"code": "died" if ended else "late", "failed": []}


class Judge:
    """The copy of the tree, and which tests execute what."""

    def __init__(self, work: Path, files: dict[str, Path], paths: Sequence[str], most: int) -> None:
        self.work, self.files, self.most, kept = work, files, most, work / "seconds.json"
        shutil.rmtree(work / "tree", ignore_errors=True)
        left_out = shutil.ignore_patterns(".git", "__pycache__", ".hypothesis", "dist", FOLDER.name)
        shutil.copytree(ROOT, work / "tree", ignore=left_out)
        for name in HEAVY.split():
            importlib.import_module(name)
        if not kept.exists():
            run = partial(traced, work, [str(self.at(module)) for module in files], paths)
            kept.write_text(json.dumps(in_child(work, 7200, run)))
        known = json.loads(kept.read_text())
        self.seconds, self.failed = known["seconds"], set(known["failed"])
        self.lines = importlib.import_module("coverage").CoverageData(str(work / "lines"))
        self.lines.read()
        since = [
            path for path in (work / "tree/tests").rglob("test_*.py") if path.stat().st_mtime > kept.stat().st_mtime
        ]
        self.written_since = [str(path.relative_to(work / "tree")) for path in since]

    def at(self, module: str) -> Path:
        """The file of a module in the copy."""
        return self.work / "tree" / self.files[module].relative_to(ROOT)

    def tests_of(self, fault: Fault, source: str) -> Iterator[list[str]]:
        """The tests of its module that execute its statement, then others, each quickest first for half a minute."""
        tests = self.lines.contexts_by_lineno(str(self.at(fault.module)))
        found = {test for line in statement(source, fault.line) for test in tests.get(line, ())}
        if found == {""}:  # on import, as a field is
            found = {test for each in tests.values() for test in each} | self.importing(fault.module)
        found -= {"", *self.failed}
        parts = fault.module.split(".")[1:]
        mirror = "/".join(["tests", *parts[:-1], f"test_{parts[-1]}.py"])
        for mine in (True, False):
            quickest = sorted((each for each in found if each.startswith(mirror) is mine), key=self.seconds.__getitem__)
            files, left_s = defaultdict[str, list[str]](list), MOST_S
            for test in quickest[: self.most]:
                if (left_s := left_s - self.seconds[test]) > 0:
                    files[test.partition("::")[0]].append(test)
            if files or (self.written_since and mine):
                yield [test for each in files.values() for test in each]

    def importing(self, module: str) -> set[str]:
        """The tests of files that import a module by its name."""
        files = {test.partition("::")[0] for test in self.seconds}
        files = {file for file in files if f"from {module} import" in (self.work / "tree" / file).read_text("utf-8")}
        return {test for test in self.seconds if test.partition("::")[0] in files}

    def verdict(self, fault: Fault) -> dict[str, Any]:
        """Whether the tests find a fault, and which does."""
        path, begin_s, met = self.at(fault.module), time.monotonic(), 0
        source, stat = path.read_text(encoding="utf-8"), path.stat()
        is_there = "\n".join(fault.before) in source
        found = ("not found" if is_there else "gone", "")
        for tests in self.tests_of(fault, source) if is_there else ():
            shutil.rmtree(self.work / "tree" / ".hypothesis", ignore_errors=True)
            path.write_text(fault.made_in(source), encoding="utf-8")
            os.utime(path, (begin_s, begin_s))  # or its compiled file would be taken for that of the original
            files = list(dict.fromkeys([*self.written_since, *(test.partition("::")[0] for test in tests)]))
            ended = in_child(self.work, 3 * MOST_S + 30, partial(run_tests, files, Tests(tests, self.seconds), "-x"))
            path.write_text(source, encoding="utf-8")
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
            if ended["code"]:
                by = [*ended["failed"], str(ended["code"])][0]
                found = "timed out" if ended["code"] == "late" else "found", by
                break
            met += len(ended["seconds"])
        return {
            **fault._asdict(),
            "verdict": found[0],
            "by": found[1],
            "tests": met,
            "seconds": time.monotonic() - begin_s,
        }


def report(rows: pd.DataFrame, facts: dict[str, object], out: Path) -> None:
    """Write how many were found, by room, and what was not."""
    rows["room"] = rows["module"].str.split(".").str[1]
    tables = {}
    for title, keep in (("As drawn", "first"), ("By the tests as they are now", "last")):
        each = rows[~rows["number"].duplicated(keep=keep) & (rows["verdict"] != "gone")]
        counts = pd.crosstab(each["room"], each["verdict"], margins=True, margins_name="all")
        found = binomtest(int((each["verdict"] != "not found").sum()), len(each))
        low, high = found.proportion_ci(method="wilson")
        share = f"{found.statistic:.3f} found (95 % by Wilson: {low:.3f} to {high:.3f})"
        tables[f"{title}: {share}"] = counts.reset_index()
    left = each[each["verdict"] == "not found"].copy()
    left["where"] = left["module"].str.removeprefix("isiw.") + ":" + left["line"].astype(str)
    for side in ("before", "after"):
        left[side] = [f"`{' '.join(' '.join(lines).split())}`".replace("|", "\\|") for lines in left[side]]
    write_tables({**tables, "Not found": left[["where", "before", "after", "tests"]]}, facts, out)


def main(
    out: Annotated[Path, typer.Option(help="Path of the results, without suffix.")] = Path("mutations"),
    work: Annotated[Path, typer.Option(help="Where the copy lies, and what was judged.")] = FOLDER / "mutations_work",
    faults: Annotated[int, typer.Option(help="How many.")] = 200,
    seed: Annotated[int, typer.Option(help="Of the draw.")] = 10_000,
    room: Annotated[str, typer.Option(help="A room, or a module of the core above all rooms, alone.")] = "",
    again: Annotated[str, typer.Option(help="The numbers of faults to be judged once more: 3,10.")] = "",
) -> None:
    """Draw faults, make and judge them."""
    work.mkdir(parents=True, exist_ok=True)
    core = drawn_in(grimp.build_graph("isiw", exclude_type_checking_imports=True), CORE)
    files = {
        module: Path(str(find_spec(module).origin))
        for module in sorted(core)
        if f"{module}.".startswith(f"isiw.{room}")
    }
    paths = [f"tests/{each}" for each in TESTS if room in each and (ROOT / "tests" / each).exists()]
    places, kept = work / f"drawn_{faults}_{seed}.json", work / f"judged_{seed}.jsonl"
    if not places.exists():
        sources = {module: path.read_text(encoding="utf-8") for module, path in files.items()}
        places.write_text(json.dumps(drawn(sources, faults, seed)), encoding="utf-8")
    kept.touch()
    judge = Judge(work.resolve(), files, paths, most=4000 if again else MOST)
    rows = [json.loads(line) for line in kept.read_text().splitlines()]
    judged = {row["number"] for row in rows}
    for number, fault in enumerate(map(Fault._make, json.loads(places.read_text())), 1):
        if number not in judged or f"{number}" in again.split(","):
            rows.append({"number": number, **judge.verdict(fault)})
            with kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
            print(*rows[-1].values(), flush=True)
    report(pd.DataFrame(rows), facts_of("mutations", "cosmic-ray", "coverage", "pytest", seed=seed), out)


if __name__ == "__main__":
    understood("mutations")
    typer.run(main)
