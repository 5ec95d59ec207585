"""Benchmarks of the default run from end to end, with a few people."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPTS = {"limits": "--cohorts late --people 2 --trials 5", "people": "--cohorts gaussian --people 2 --trials 5"}


def run(name: str, arguments: list[str]) -> None:
    """Run a benchmark as from the command line, in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        patch.setattr(sys, "argv", [f"benchmarks/{name}.py", *arguments])
        patch.setattr(sys, "path", list(sys.path))
        patch.delitem(sys.modules, f"benchmarks.{name}", raising=False)
        with pytest.raises(SystemExit) as ended:
            runpy.run_module(f"benchmarks.{name}", run_name="__main__")
    assert ended.value.code == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", SCRIPTS)
def test_a_benchmark_writes_its_table(name: str, tmp_path: Path) -> None:
    out = tmp_path / name
    run(name, [*SCRIPTS[name].split(), "--workers", "1", "--out", str(out)])
    assert "- command: `python -m benchmarks." in out.with_suffix(".md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_two_versions_are_compared_on_the_same_people(tmp_path: Path) -> None:
    folder, out = str(tmp_path / "now"), tmp_path / "compared"
    run(
        "before_and_now",
        ["run", "--cohorts", "gaussian", "--people", "2", "--seed", "1", "--workers", "1", "--out", folder],
    )
    run("before_and_now", ["compare", folder, folder, "--out", str(out)])
    assert "gaussian" in out.with_suffix(".md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_where_two_versions_stop_is_compared_within_their_budgets(tmp_path: Path) -> None:
    folder, out = str(tmp_path / "now"), tmp_path / "stops"
    few = ["--cohorts", "weak", "--people", "2", "--seed", "1", "--workers", "1"]
    run("before_and_now", ["run", *few, "--to-stopping", "6", "--out", folder])
    run("before_and_now", ["stops", folder, folder, "--out", str(out)])
    rows = [line.split("|")[2:-1] for line in out.with_suffix(".md").read_text(encoding="utf-8").splitlines()[6:]]
    found = {what.strip(): (float(before), float(now)) for _, what, before, now, *_ in rows}
    assert found["stimuli"] == (6.0, 6.0)
    assert found["stopped_on_window"] == (0.0, 0.0)
