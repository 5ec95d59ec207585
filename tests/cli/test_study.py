"""isiw study: run, replay, summary."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner, Result

import isiw
from isiw.cli import app
from isiw.studies import Failure, open_store
from isiw.studies.store import Store
from studies.tiny import TOML

SMALL = TOML.replace("people = 12", "people = 2")


def study(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["study", *map(str, arguments)])


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "tiny.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a study that is finished."""
    plan = tmp_path_factory.mktemp("finished") / "tiny.toml"
    plan.write_text(SMALL)
    assert study("run", plan, "--workers", 1).exit_code == 0
    return plan.with_name("tiny.study")


@pytest.fixture
def folder(finished: Path, tmp_path: Path) -> Path:
    """A copy of that folder."""
    return Path(shutil.copytree(finished, tmp_path / "tiny.study"))


def test_run_puts_the_results_beside_the_file_and_says_what_is_there(plan: Path) -> None:
    result = study("run", plan, "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "4/4" in result.output
    assert "4 sessions are in" in result.output
    assert "0 units are left" in result.output
    assert len(open_store(plan.with_name("tiny.study")).rows()) == 8


def test_a_study_that_is_finished_has_nothing_left_to_run(finished: Path) -> None:
    result = study("run", finished, "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "Nothing is left to run." in result.output
    assert "0/0" not in result.output


def test_run_of_a_folder_goes_on_with_it(folder: Path) -> None:
    next((folder / "parts").glob("even.gaussian.00001.*")).unlink()
    result = study("run", folder, "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "1/1" in result.output
    assert len(open_store(folder).rows()) == 8


def test_the_file_in_a_folder_of_results_means_that_folder(folder: Path) -> None:
    result = study("run", folder / "study.toml", "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "Nothing is left to run." in result.output
    assert not (folder / "study.study").exists()


@pytest.mark.parametrize("of_a_copy", [False, True])
def test_the_study_of_a_folder_can_be_changed_and_begun_in_another(folder: Path, *, of_a_copy: bool) -> None:
    kept = folder / "study.toml"
    versions = isiw.__version__, "0.0.1"
    kept.write_text(kept.read_text().replace("people = 2", "people = 1").replace(*versions))
    assert "another version" in study("run", folder).output
    source = shutil.copy(kept, folder.with_name("copy.toml")) if of_a_copy else folder
    result = study("run", source, "--out", folder.with_name("anew"), "--workers", 1)
    assert result.exit_code == 0, result.output
    assert "2 sessions are in" in result.output


def test_run_of_another_study_into_the_folder_is_refused(plan: Path, folder: Path) -> None:
    plan.write_text(TOML)
    result = study("run", plan)
    assert result.exit_code == 1
    assert "people was 2, now 12" in result.output
    assert study("run", plan, "--out", folder.with_name("other"), "--workers", 0).exit_code == 1


def test_an_option_that_would_be_ignored_is_refused(folder: Path) -> None:
    for given in (("replay", folder, 1, "--person", 3), ("run", folder, "--scheduler", "tcp://h:1", "--workers", 3)):
        result = study(*given)
        assert result.exit_code == 1
        assert f"got '{given[-2]}'. Leave these options out." in result.output


def test_replay_says_that_a_unit_is_identical(folder: Path) -> None:
    result = study("replay", folder, "even.gaussian.00001")
    assert result.exit_code == 0, result.output
    assert "even.gaussian.00001 is identical: 2 rows." in result.output


def test_replay_of_a_row_finds_its_unit_and_what_differs_is_exit_code_1(folder: Path) -> None:
    store: Store = open_store(folder)
    rows = store.rows()
    store.keep(store.unit("even.gaussian.00001"), rows[rows["unit"] == "even.gaussian.00001"].assign(f1=-1.0))
    result = study("replay", folder, 3)
    assert result.exit_code == 1
    assert "even.gaussian.00001 is not what it was: f1 differ" in result.output


@pytest.mark.slow
@pytest.mark.needs_pictures
def test_summary_prints_the_table_and_writes_it_with_a_figure(folder: Path) -> None:
    result = study("summary", folder)
    assert result.exit_code == 0, result.output
    table = pd.read_csv(folder / "summary.csv")
    assert table[["cohort", "strategy", "trial", "people"]].to_numpy().tolist() == [
        ["gaussian", "even", 2, 2],
        ["gaussian", "even", 4, 2],
        ["gaussian", "incremental", 2, 2],
        ["gaussian", "incremental", 4, 2],
    ]
    compared = pd.read_csv(folder / "differences.csv")
    assert compared[["strategy", "reference", "people"]].drop_duplicates().to_numpy().tolist() == [
        ["incremental", "even", 2]
    ]
    for shown in (f"{table['f1'].iloc[0]:.2f}", f"{compared['difference'].iloc[0]:+.2f}"):
        assert shown.replace("0.", ".", 1) in result.output
    for name in ("f1", "frontier", "coverage", "latency"):
        assert "<svg" in (folder / f"summary_{name}.svg").read_text()


@pytest.mark.slow
def test_sessions_that_failed_are_told_by_their_error(folder: Path) -> None:
    store: Store = open_store(folder)
    for unit in store.study.units()[:2]:
        next((folder / "parts").glob(f"{unit.key}.*")).unlink()
        store.keep(unit, Failure("RuntimeError: stuck"))
    result = study("summary", folder)
    assert "2 sessions failed:" in result.output
    assert "even: RuntimeError: stuck (1 sessions)" in result.output
    assert study("run", folder).exit_code == 1
    assert study("run", folder, "--retry").exit_code == 0
