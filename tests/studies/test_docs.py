"""What docs/studies.md shows works as it stands there."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

import isiw
from isiw.studies import conduct
from isiw.studies.plan import study_from

TEXT = (Path(__file__).parents[2] / "docs" / "studies.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)


@pytest.mark.slow
def test_the_study_is_valid() -> None:
    block, _ = blocks("toml")
    study = study_from(tomllib.loads(block), "docs")
    assert len(study.units()) == 3 * 2 * 100
    assert study.units()[1].key == "nr.recruitment.00000"


@pytest.mark.slow
def test_the_example_in_python_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(blocks("python")[0], "studies.md", "exec"), {"__name__": "docs"})  # noqa: S102 - the point of the test
    printed = capsys.readouterr().out
    assert "pf" in printed
    assert len(list((tmp_path / "small.study" / "parts").iterdir())) == 8


def test_the_module_of_ones_own_takes_part_as_the_study_names_it(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(blocks("python")[2], encoding="utf-8")
    values = tomllib.loads(blocks("toml")[1]) | {"people": 1, "trials": 2}
    values["strategies"] = values["strategies"][1:]
    rows = conduct(study_from(values, "docs", tmp_path), tmp_path / "own.study").rows()
    assert set(rows["strategy"]) == {"upper_end"}


def test_a_strategy_of_ones_own_meets_the_people_of_a_study(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {"__name__": "docs"}
    exec(compile(blocks("python")[3], "studies.md", "exec"), names)  # noqa: S102 - the point of the test
    assert set(names["rows"]["strategy"]) == {"straddle"}
    assert "10" in capsys.readouterr().out


def test_people_of_ones_own_meet_named_strategies(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {"__name__": "docs"}
    exec(compile(blocks("python")[4], "studies.md", "exec"), names)  # noqa: S102 - as above
    assert len(names["rows"]) == 2 * 2 * 2
    assert set(names["rows"]["cohort"]) == {"mine"}
    assert "random" in capsys.readouterr().out
    exec(compile(blocks("python")[5], "studies.md", "exec", dont_inherit=True), names)  # noqa: S102 - as above
    assert names["noisy"].window(isiw.VALVE_SPACE) is not None
    assert "mep_mv=" in capsys.readouterr().out


def test_the_true_edges_of_a_person_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(blocks("python")[1], "studies.md", "exec"), {"__name__": "docs"})  # noqa: S102 - as above
    assert re.fullmatch(r"\d+–\d+ ms \(\d+\.0, \d+\.0\)\n", capsys.readouterr().out)


@pytest.mark.slow
def test_a_model_is_shown_to_be_calibrated(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {"__name__": "docs"}
    exec(compile(blocks("python")[6], "studies.md", "exec"), names)  # noqa: S102 - as above
    assert len(names["ranks"]) > 5
    assert all(0 <= rank <= 1 for ranks in names["ranks"] for rank in ranks)
    capsys.readouterr()


def test_rows_of_several_folders_are_put_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder, name in (("a.study", "nr"), ("b.study", "pf")):
        conduct(study_from({"strategies": [name], "cohorts": ["gaussian"], "people": 2, "trials": 2}, "docs"), folder)
    names: dict[str, Any] = {"__name__": "docs"}
    exec(compile(blocks("python")[8], "studies.md", "exec"), names)  # noqa: S102 - as above
    assert names["differences"](names["rows"])["people"].tolist() == [2]
    assert "pf" in capsys.readouterr().out


@pytest.mark.slow
def test_every_column_of_a_row_is_explained(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "docs"}
    exec(compile(blocks("python")[0], "studies.md", "exec"), names)  # noqa: S102 - as above
    assert [name for name in names["rows"].columns if f"`{name}`" not in TEXT] == []
