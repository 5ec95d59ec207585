"""The benchmarks of the default run from end to end, with a few people."""

from __future__ import annotations

from pathlib import Path

import pytest

from forked import Forked

FOLDER = Path(__file__).parents[2] / "benchmarks"
SCRIPTS = {
    "acquisition": "--cohorts gaussian --strategies default --others nr --people 2 --other-people 2 --trials 5",
    "another_day": "--people 2 --earlier-trials 4 --trials 4",
    "limits": "--cohorts late --people 2 --trials 5",
    "people": "--cohorts gaussian,nonresponder --people 2 --trials 5",
    "recorded": "--strategies default --people 1 --trials 5",
}


def script(name: str, arguments: list[str]) -> str:
    """Source text that runs a benchmark as from the command line."""
    begin = f"import runpy, sys; sys.path.insert(0, {str(FOLDER)!r}); sys.argv = {[name, *arguments]!r}"
    return f"{begin}\nrunpy.run_path({str(FOLDER / name)!r} + '.py', run_name='__main__')"


@pytest.mark.slow
@pytest.mark.parametrize("name", SCRIPTS)
def test_a_benchmark_writes_its_table(name: str, tmp_path: Path) -> None:
    out = tmp_path / name
    with Forked(script(name, [*SCRIPTS[name].split(), "--workers", "1", "--out", str(out)])) as process:
        _, said = process.stdout.read(), process.stderr.read()
        assert process.returncode == 0, said
    assert "- command: `python benchmarks/" in out.with_suffix(".md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_two_versions_are_compared_on_the_same_people(tmp_path: Path) -> None:
    folder, out = str(tmp_path / "now"), tmp_path / "compared"
    runs = [["run", "--cohorts", "gaussian", "--people", "2", "--seed", "1", "--workers", "1", "--out", folder]]
    for arguments in [*runs, ["compare", folder, folder, "--out", str(out)]]:
        with Forked(script("before_and_now", arguments)) as process:
            _, said = process.stdout.read(), process.stderr.read()
            assert process.returncode == 0, said
    assert "gaussian" in out.with_suffix(".md").read_text(encoding="utf-8")
