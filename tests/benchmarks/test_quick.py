"""What `--quick` stands for."""

from __future__ import annotations

import importlib
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from benchmarks.quick import FOLDER, QUICK, expanded, without_out

ROOT = Path(__file__).parents[2]
BENCHMARKS = {
    match[1]: path
    for path in sorted((ROOT / "benchmarks").rglob("*.py"))
    if (
        match := re.search(
            r'^    understood\("(.+?)"(?:, prints=True)?\)$', path.read_text(encoding="utf-8"), re.MULTILINE
        )
    )
}
MODULES = sorted(path for path in (ROOT / "benchmarks").rglob("*.py") if not path.name.startswith("__"))
MOST_S = 120.0
NOT_HERE = {"before_and_now compare", "before_and_now stops", "before_and_now speed", "steps report"}
"""They compare with another version, or read what another command wrote."""


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_every_benchmark_that_can_be_run_understands_quick() -> None:
    run = {path for path in (ROOT / "benchmarks").rglob("*.py") if "\nif __name__ ==" in path.read_text("utf-8")}
    assert set(BENCHMARKS.values()) == run - {ROOT / "benchmarks" / "server_strangers.py"}  # which `server` starts
    assert set(BENCHMARKS) == {command.partition(" ")[0] for command in QUICK}


def test_every_benchmark_finds_what_it_imports() -> None:
    names = [f"benchmarks.{'.'.join(path.relative_to(ROOT / 'benchmarks').with_suffix('').parts)}" for path in MODULES]
    for name in names:
        importlib.import_module(name)


def test_quick_stands_for_small_sizes_and_a_folder_of_its_own() -> None:
    assert expanded("people", ["--quick"]) == [
        *("--cohorts", "gaussian,recruitment", "--people", "3", "--trials", "10", "--out", str(FOLDER / "people"))
    ]


def test_options_that_are_given_stay_as_given() -> None:
    words = expanded("zero_trials", ["--quick", "--people=7"])
    assert words == ["--people=7"]
    assert expanded("vane", ["--quick", "--out", "here"]) == ["--out", "here"]


def test_a_command_of_several_has_its_own_sizes() -> None:
    assert expanded("before_and_now", ["speed", "a", "b", "--quick"]) == ["speed", "a", "b", "--laps", "1"]


def test_without_quick_a_command_line_stays_as_it_is() -> None:
    assert expanded("people", ["--people", "2"]) == ["--people", "2"]


@pytest.mark.parametrize("name", sorted(BENCHMARKS))
def test_every_benchmark_takes_out(name: str) -> None:
    source = BENCHMARKS[name].read_text(encoding="utf-8")
    own = re.search(r'"--out"|\bout: (Annotated|Path)', source, re.MULTILINE)
    assert (own is None) == ("prints=True" in source)


def test_a_benchmark_that_only_prints_says_so_and_keeps_what_it_prints_in_out() -> None:
    script = (
        "import sys; sys.path.insert(0, {!r}); from benchmarks.quick import understood\n"
        "understood('zero_trials', prints=True)\nprint(sys.argv[1:])"
    )
    run = [sys.executable, "-c", script.format(str(ROOT))]
    for words in (["--people", "3", "--out", "new/found.md"], ["--out=new/found.md", "--people", "3"]):
        ended = subprocess.run([*run, *words], capture_output=True, text=True, check=True)  # noqa: S603 - as above
        assert ended.stdout == Path("new/found.md").read_text(encoding="utf-8") == "['--people', '3']\n"
    helped = subprocess.run([*run, "--help"], capture_output=True, text=True, check=True)  # noqa: S603 - as above
    assert "--out FILE" in helped.stdout


def test_out_without_a_file_is_refused() -> None:
    with pytest.raises(SystemExit, match="needs a file"):
        without_out(["--people", "3", "--out"])


@pytest.mark.long
@pytest.mark.parametrize("command", sorted(set(QUICK) - NOT_HERE))
def test_a_quick_run_takes_two_minutes_at_most_and_changes_no_committed_file(command: str) -> None:
    name, *rest = command.split()
    words = [sys.executable, "-m", f"benchmarks.{name}", *rest, "--quick"]
    if name == "waveform_loop":
        words += ["--reference", "impact"]
    before = _changed()
    began_s = _spent_s()
    ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)  # noqa: S603 - a script of this repository
    assert ended.returncode == 0, ended.stderr[-3000:]
    assert _spent_s() - began_s < MOST_S
    assert _changed() == before


def _spent_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _changed() -> str:
    return subprocess.run(["git", "diff", "--stat"], cwd=ROOT, capture_output=True, text=True, check=True).stdout  # noqa: S607
