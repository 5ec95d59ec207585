"""Two spellings of one code."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from isiw.errors import InvalidValueError
from isiw.log.codes import is_same_person
from isiw.log.headers import Header
from isiw.log.pulses import earlier_pulse_ages
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.writer import LogWriter
from log.test_pulses import HOUR_S, make_log
from log.written import make_header


@pytest.mark.parametrize("other", ["P07", "p07", "P-07", "p_07", " P 0 7", "\uff3007"])
def test_a_code_is_the_same_persons_whatever_its_case_spaces_hyphens_and_underscores(other: str) -> None:
    assert is_same_person("P07", other)


@pytest.mark.parametrize("other", ["P7", "P08", "", "P07a"])
def test_codes_that_differ_in_letters_or_digits_are_two_peoples(other: str) -> None:
    assert not is_same_person("P07", other)
    assert not is_same_person("", "")


def test_no_log_begins_beside_one_with_another_spelling_of_its_code(tmp_path: Path, header: Header) -> None:
    make_log(tmp_path / "a log of any name", header)
    with pytest.raises(InvalidValueError, match=r"p-07.*P07, as in .*a log of any name.*give the code P07"):
        LogWriter.create(tmp_path / "b.mcap", make_header(subject="p-07"))
    assert [file.name for file in tmp_path.iterdir()] == ["a log of any name"]
    for name, subject in (("same", "P07"), ("other", "P08"), ("folder/own", "p-07"), ("nobody", "")):
        LogWriter.create(tmp_path / name, make_header(subject=subject)).close()


def test_a_log_that_is_still_written_has_a_code_too(tmp_path: Path, header: Header) -> None:
    with LogWriter.create(tmp_path / "a.mcap", header), pytest.raises(InvalidValueError, match="only in case"):
        LogWriter.create(tmp_path / "b.mcap", make_header(subject="p07"))


def test_simulated_people_are_nobody(tmp_path: Path, header: Header) -> None:
    simulated = dataclasses.replace(header.device, simulated=True)
    make_log(tmp_path / "a.mcap", make_header(subject="P-07", device=simulated))
    make_log(tmp_path / "b.mcap", make_header(subject="p07"))
    make_log(tmp_path / "c.mcap", make_header(subject="P_07", device=simulated))


def test_a_session_of_another_spelling_goes_on(tmp_path: Path) -> None:
    for folder, subject in (("one", "P07"), ("two", "p07")):
        make_log(tmp_path / folder / f"{subject}.mcap", make_header(subject=subject))
    (tmp_path / "two/p07.mcap").rename(tmp_path / "one/p07.mcap")
    log = tmp_path / "one/p07.mcap"
    LogWriter.continuing(log, salvage(log), read_session(log).header).close()


def test_stimuli_of_another_spelling_count_for_a_period(tmp_path: Path, header: Header) -> None:
    make_log(tmp_path / "one/a.mcap", header)
    ages = earlier_pulse_ages(tmp_path, "p-07", HOUR_S, but=tmp_path / "two/mine.mcap")
    assert len(ages.ages_s) == 3
    assert ages.doubts == (
        "Earlier stimuli of P07 count for p-07, too: the codes differ only in case, spaces, hyphens or underscores.",
    )
