"""The names of logs of several people: who would have a file of another one, on any computer, has none."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError, LogError
from isiw.existing.analysis import analyse
from isiw.existing.batch import Person, Way, analyse_person, read_files
from isiw.existing.layout import Layout


def read_people_of(codes: list[str], folder: Path) -> list[Person]:
    rows = [(code, isi_ms, 0.1 + isi_ms / 1000) for code in codes for isi_ms in (10, 20, 30, 40)]
    pd.DataFrame(rows, columns=["subject", "isi_ms", "mep_mv"]).to_csv(folder / "people.csv", index=False)
    return read_files([folder / "people.csv"], Way(Layout(reference="impact")), folder / "logs")


@pytest.mark.parametrize(
    "codes", [["P07", "p07"], ["Mu\u0308ller", "M\u00fcller"], ["MÜLLER", "müller"], ["Straße", "STRASSE"]]
)
def test_two_codes_that_are_one_file_on_other_systems_are_refused(codes: list[str], tmp_path: Path) -> None:
    people = read_people_of([*codes, "P99"], tmp_path)
    assert [f"{person.refused}".startswith("two of the people or days would have one log") for person in people] == [
        True, True, False
    ]  # fmt: skip


def test_two_spellings_of_one_code_are_not_analysed_as_two_people_also_of_those_that_are_wanted(tmp_path: Path) -> None:
    read_people_of(["P07", "p-07", "P08"], tmp_path)
    for only, refused in ((None, [True, True, False]), ("P07", [True]), ("P08", [False])):
        people = read_files([tmp_path / "people.csv"], Way(Layout(reference="impact")), only=only)
        assert [person.refused is not None for person in people] == refused
    with pytest.raises(InvalidValueError, match=r"P07 differs .* only in case, spaces.*'p-07'"):
        analyse_person(read_files([tmp_path / "people.csv"], Way(Layout(reference="impact")))[0], Way())


def test_an_output_that_is_neither_a_log_nor_a_folder_is_refused(tmp_path: Path) -> None:
    read_people_of(["P07"], tmp_path)
    files, way = [tmp_path / "people.csv"], Way(Layout(reference="impact"))
    with pytest.raises(InvalidValueError, match="neither a log nor a folder"):
        read_files(files, way, tmp_path / "z.csv")
    (tmp_path / "2026.day").mkdir()
    (person,) = read_files(files, way, tmp_path / "2026.day")
    assert person.log == tmp_path / "2026.day" / "P07.mcap"


@pytest.mark.parametrize("code", ["CON", "aux.1", "lpt1"])
def test_a_code_that_windows_keeps_for_itself_is_refused(code: str, tmp_path: Path) -> None:
    first, second = read_people_of(["P07", code], tmp_path)
    assert first.refused is None
    assert f"{second.refused}".startswith("Windows keeps")


def test_codes_that_differ_everywhere_have_a_log_each(tmp_path: Path) -> None:
    logs = [person.log.name for person in read_people_of(["P07", "P08", "Ärzte"], tmp_path) if person.log is not None]
    assert logs == ["P07.mcap", "P08.mcap", "Ärzte.mcap"]


def test_the_log_of_an_analysis_is_refused_by_the_name_that_was_given(tmp_path: Path) -> None:
    space = DesignSpace(0, 100, reference="impact")
    analysis = analyse([10, 20, 30, 40], [0.1, 0.2, 0.1, 0.3], space=space, strategy="even")
    for name, says in (
        ("s" * 300 + ".mcap", "too long.*sss"),
        ("nul.mcap", "Windows keeps"),
        ("p07.mcap", "same file"),
    ):
        (tmp_path / "P07.mcap").write_bytes(b"theirs")
        if name == "p07.mcap" and (tmp_path / name).exists():
            continue  # the disk itself takes them for one
        with pytest.raises(LogError, match=says):
            analysis.to_log(tmp_path / name)
        assert [path.name for path in tmp_path.iterdir()] == ["P07.mcap"]
