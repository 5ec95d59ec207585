"""Strategies, models and acquisition functions of one's own in a study."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import tomli_w
from typer.testing import CliRunner

from isiw.cli import app
from isiw.errors import ConfigError, StudyError
from isiw.studies import DaskCluster, Processes, Study, conduct, load_study, open_store, run_unit
from studies.tiny import timeless

_NAMES = count()

MODULE = """\
import isiw


class Latest:
    needs = ()

    def __init__(self, towards):
        self.towards = towards

    def __call__(self, posterior, isi_ms):
        return -abs(isi_ms - self.towards)


def acquisition(towards=100.0):
    return Latest(towards)


def model():
    return isiw.make_strategy("default", space=isiw.DesignSpace(0, 500, reference="valve"), particles=40).model


class Player:
    def __init__(self, space, seed):
        self.space = space

    def ask(self):
        return self.space.snap(250.0)

    def tell(self, isi_ms, mep_mv=None, *, isi_sd_ms=0.0):
        pass

    def estimate(self):
        return isiw.Window(200.0, 300.0)


def nothing():
    return 3
"""


@pytest.fixture
def module(tmp_path: Path) -> Iterator[str]:
    """A module of one's own beside a study, under a name that no other test has."""
    name = f"own_code_{next(_NAMES)}"
    (tmp_path / f"{name}.py").write_text(MODULE)
    yield name
    sys.modules.pop(name, None)


def written(folder: Path, *strategies: str | dict[str, Any], **changed: Any) -> Path:
    """A STUDY.toml in a folder."""
    usual = {"cohorts": ["gaussian"], "people": 2, "trials": 3, "marks": [1, 3], "stopping": "ignored"}
    path = folder / "STUDY.toml"
    path.write_text(tomli_w.dumps({"strategies": list(strategies)} | usual | changed))
    return path


@pytest.mark.parametrize("kind", ["acquisition", "model", "Player"])
def test_a_function_of_ones_own_takes_part(tmp_path: Path, module: str, kind: str) -> None:
    rows = run_unit(load_study(written(tmp_path, f"{module}:{kind}")).units()[0])
    assert set(rows["strategy"]) == {kind}
    assert len(set(rows["code"])) == 1
    assert rows["code"].iloc[0] != ""


def test_its_settings_reach_the_function(tmp_path: Path, module: str) -> None:
    strategy = {"name": f"{module}:acquisition", "settings": {"towards": 300.0}}
    player = load_study(written(tmp_path, strategy)).units()[0].sessions[0].player()
    assert player.ask() == 300.0


def test_a_setting_that_the_function_does_not_take_is_refused_when_the_study_is_read(
    tmp_path: Path, module: str
) -> None:
    with pytest.raises(ConfigError, match="towards"):
        load_study(written(tmp_path, {"name": f"{module}:acquisition", "settings": {"twoards": 3.0}}))


def test_a_function_that_is_not_there_is_refused_when_the_study_is_read(tmp_path: Path, module: str) -> None:
    with pytest.raises(ConfigError, match="acquisition"):
        load_study(written(tmp_path, f"{module}:acquisitoin"))


def test_a_function_that_makes_something_else_is_refused(tmp_path: Path, module: str) -> None:
    with pytest.raises(ConfigError, match="int"):
        run_unit(load_study(written(tmp_path, f"{module}:nothing")).units()[0])


def test_the_folder_of_a_study_names_no_code(tmp_path: Path, module: str) -> None:
    folder = conduct(load_study(written(tmp_path, f"{module}:Player")), tmp_path / "own.study").folder
    assert module not in (folder / "study.toml").read_text()
    assert len(open_store(folder).rows()) == 4


def test_a_folder_that_names_code_runs_none(tmp_path: Path, module: str) -> None:
    study = load_study(written(tmp_path, f"{module}:Player"))
    folder = conduct(study, tmp_path / "own.study").folder
    text = (folder / "study.toml").read_text().replace('name = "own"', f'name = "{module}:Player"')
    (folder / "study.toml").write_text(text)
    sys.modules.pop(module)
    with pytest.raises(ConfigError, match="names no code"):
        open_store(folder)
    with pytest.raises(ConfigError, match="names no code"):
        load_study(folder / "study.toml")
    assert module not in sys.modules


def test_a_study_of_ones_own_code_is_continued_by_the_file_that_names_it(tmp_path: Path, module: str) -> None:
    plan, folder = written(tmp_path, f"{module}:Player"), tmp_path / "own.study"
    conduct(load_study(plan), folder)
    next((folder / "parts").iterdir()).unlink()
    with pytest.raises(StudyError, match="does not name"):
        conduct(open_store(folder).study, folder)
    assert len(conduct(load_study(plan), folder).rows()) == 4
    finished = CliRunner().invoke(app, ["study", "run", str(folder)])  # nothing is left, so no code is needed
    assert (finished.exit_code, "Nothing is left to run." in finished.output) == (0, True), finished.output


def test_rows_of_changed_code_do_not_join_those_that_are_there(tmp_path: Path, module: str) -> None:
    plan, folder = written(tmp_path, f"{module}:Player"), tmp_path / "own.study"
    conduct(load_study(plan), folder)
    (tmp_path / f"{module}.py").write_text(MODULE.replace("200.0", "210.0"))
    with pytest.raises(StudyError, match="changed"):
        conduct(load_study(plan), folder)


def test_a_unit_of_ones_own_code_is_replayed_with_the_study_that_names_it(tmp_path: Path, module: str) -> None:
    plan, folder = written(tmp_path, f"{module}:Player"), tmp_path / "own.study"
    key = conduct(load_study(plan), folder).study.units()[0].key
    replayed = CliRunner().invoke(app, ["study", "replay", str(folder), key, "--study", str(plan)])
    assert "identical" in replayed.output


def test_people_side_by_side_need_a_model_with_an_acquisition_function(tmp_path: Path, module: str) -> None:
    study = load_study(written(tmp_path, f"{module}:Player", engine="batched"))
    with pytest.raises(StudyError, match="single"):
        run_unit(study.units()[0])


@pytest.mark.slow
def test_processes_run_code_of_ones_own(tmp_path: Path, module: str) -> None:
    study = load_study(written(tmp_path, f"{module}:Player"))
    apart = conduct(study, tmp_path / "apart.study", Processes(2)).rows()
    pd.testing.assert_frame_equal(timeless(apart), timeless(conduct(study, tmp_path / "here.study").rows()))


@pytest.mark.slow
def test_an_own_acquisition_function_on_a_cluster_interrupted_and_continued(tmp_path: Path, module: str) -> None:
    even = {"name": "even", "settings": {"particles": 40}}
    plan, folder = written(tmp_path, even, f"{module}:acquisition", people=4), tmp_path / "own.study"
    study: Study = load_study(plan)
    from distributed import Client, LocalCluster  # noqa: PLC0415 - it takes half a second, which others need not spend

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        with pytest.raises(KeyboardInterrupt):
            conduct(study, folder, DaskCluster(client), on_done=interrupt_after(3))
        kept = len(open_store(folder).left())
        assert 0 < kept < 8
        conduct(study, folder, DaskCluster(client))
    result = CliRunner().invoke(app, ["study", "summary", str(folder), "--reference", "even"])
    assert result.exit_code == 0, result.output
    assert "minus even" in result.output
    assert (folder / "differences.csv").is_file()
    assert (folder / "summary_f1.svg").is_file()
    here = conduct(study, tmp_path / "here.study").rows()
    pd.testing.assert_frame_equal(timeless(open_store(folder).rows()), timeless(here))


def interrupt_after(units: int) -> Callable[[object, object], None]:
    """An `on_done` that interrupts the study as Ctrl-C does."""
    done = count(1)

    def on_done(_unit: object, _result: object) -> None:
        if next(done) == units:
            raise KeyboardInterrupt

    return on_done


def test_the_folder_of_a_study_names_no_code_even_for_a_run_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text('strategies = ["subprocess:getoutput"]\ncohorts = ["gaussian"]\n')
    with pytest.raises(ConfigError, match="names no code"):
        load_study(tmp_path)
