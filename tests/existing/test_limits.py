"""The limits of what is read, without a process of its own for each."""

from __future__ import annotations

import os
import time
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from isiw.devices.transports.exchange import read_number
from isiw.errors import InvalidValueError
from isiw.existing import Delivered, Layout, ReadingLimits, doubts, read_people
from isiw.existing.apart import Answer, read_answer, write_answer, write_error
from isiw.existing.child import Gate, require_no_links
from isiw.existing.layout import letters
from isiw.existing.limits import LARGEST_FACTOR, require_file, seconds_for
from isiw.existing.quantities import Columns, unit_said
from isiw.sweeps import Channel
from isiw.text.parsing import DoubledKeyError, once_each
from isiw.trials import Status, Trial, TrialTable
from isiw.visit import Visit

IMPACT = Layout(reference="impact")
HEAD = "isi_ms,mep_mv\n"
ROWS = "".join(f"{isi},{0.2 + isi / 1000}\n" for isi in range(10, 110, 10))
SMALL = ReadingLimits(
    file_mb=1.0, unpacked_mb=1.0, lines=1000, rows=900, columns=50, cells=2000, visits=5, trials=100, name_length=40,
    cell_length=100,
)  # fmt: skip


def wide(columns: int) -> str:
    names = ",".join(f"c{number}" for number in range(columns))
    return f"isi_ms,mep_mv,{names}\n" + f"10,0.2,{','.join('1' * columns)}\n" * 3


def beside(name: str, cells: Iterable[object]) -> str:
    return f"isi_ms,mep_mv,{name}\n" + "".join(f"10,0.2,{cell}\n" for cell in cells)


TRIALS = "has too many trials of one person and day; got 150; expected at most 100"
VISITS = "has too many people and days; got 10; expected at most 5"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEAD + ROWS + "x" * 1_100_000, "is too large; got '1 MB'; expected at most 1 MB"),
        (HEAD + ROWS + "\n" * 2000, "has too many lines; got 2011; expected at most 1000"),
        (HEAD + ROWS + "\r" * 2000, "has too many lines"),
        (wide(60), "has too many columns; got 62; expected at most 50"),
        (wide(30) + f"10,0.2,{','.join('1' * 30)}\n" * 200, "has too many cells; got 6496; expected at most 2000"),
        (HEAD + "10,0.2\n" * 950, "has too many rows; got 950; expected at most 900"),
        (HEAD + "10,0.2\n" * 150, TRIALS),
        (beside("date", ["2026-01-31"] * 150), TRIALS),
        (beside("subject", range(10)), VISITS),
        (beside("day", range(1, 11)), VISITS),
        (beside("date", [f"2026-01-{number}" for number in range(11, 21)]), VISITS),
        ("a" * 1000, "has too long a line for its cells; got '1000 bytes'; expected at most 400 bytes"),
        ("a " * 100, "has too many columns; got 51; expected at most 50"),
        (f"isi_ms,mep_mv,{'n' * 50}\n10,0.2,1\n", "too long a name of a column; got '50 characters'"),
        (f"isi_ms,mep_mv,note\n10,0.2,{'n' * 200}\n", "too long a text in the column 'note'; got '200 characters'"),
    ],
)
def test_each_limit_of_a_table_is_in_its_message_with_the_option_that_raises_it(
    text: str, said: str, tmp_path: Path
) -> None:
    (tmp_path / "P01.csv").write_text(text, newline="")
    with pytest.raises(InvalidValueError, match="say --larger 2") as caught:
        read_people(tmp_path / "P01.csv", IMPACT, limits=SMALL)
    assert said in str(caught.value)


def test_names_of_columns_that_nobody_reads_are_handed_back_once_for_all_people(tmp_path: Path) -> None:
    table = TrialTable((Trial(0, Status.ACCEPTED, 10.0, isi_ms=10.0, mep_mv=0.3),))
    unused = tuple(f"{number}{'n' * 1000}" for number in range(20))
    people = [Delivered(table, "impact", subject=f"P{number}", unused=unused) for number in range(50)]
    write_answer(tmp_path, Answer(people, {}), {})
    assert (tmp_path / "answer.json").stat().st_size < 100_000
    read = read_answer(tmp_path)
    assert isinstance(read, Answer)
    assert [one.unused for one in read.people] == [unused] * 50


def test_a_row_without_isi_and_amplitude_is_no_trial_for_the_limits(tmp_path: Path) -> None:
    (tmp_path / "P01.csv").write_text(HEAD + ROWS + ",\n" * 150)
    (person,) = read_people(tmp_path / "P01.csv", IMPACT, limits=SMALL)
    assert len(person.trials) == 10


@pytest.mark.parametrize("sign", ["\x0b", "\x85", "\u2028"])
def test_a_cell_may_hold_what_other_programs_take_for_the_end_of_a_line(sign: str, tmp_path: Path) -> None:
    rows = "".join(f"{isi},0.3,a{sign}b\n" for isi in range(10, 110, 10))
    (tmp_path / "P01.csv").write_text(f"isi_ms,mep_mv,note\n{rows}", encoding="utf-8", newline="")
    (person,) = read_people(tmp_path / "P01.csv", IMPACT)
    assert len(person.trials) == 10


def test_blanks_without_end_are_looked_through_once(tmp_path: Path) -> None:
    (tmp_path / "P01.txt").write_text(" " * 5_000_000)
    begun = time.process_time()
    with pytest.raises(InvalidValueError, match="too long a line"):
        require_file(ReadingLimits(), tmp_path / "P01.txt", text=True)
    assert time.process_time() - begun < 2


def test_a_workbook_that_unpacks_to_too_much_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "P01.xlsx", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("xl/worksheets/sheet1.xml", bytes(3_000_000))
    with pytest.raises(InvalidValueError, match="unpacks to too much; got '3 MB'; expected at most 1 MB"):
        read_people(tmp_path / "P01.xlsx", IMPACT, limits=SMALL)


def test_larger_limits_multiply_all_and_let_the_same_table_be_read(tmp_path: Path) -> None:
    (tmp_path / "P01.csv").write_text(HEAD + ROWS + "\n" * 2000)
    (person,) = read_people(tmp_path / "P01.csv", IMPACT, limits=SMALL.larger(3))
    assert len(person.trials) == 10
    assert SMALL.larger(2.5).lines == 2500
    for factor in (0.5, np.nan, 10 * LARGEST_FACTOR):
        with pytest.raises(InvalidValueError, match="larger"):
            SMALL.larger(factor)


def test_a_whole_number_of_400_digits_in_a_workbook_is_refused_by_its_row_and_column(tmp_path: Path) -> None:
    path, changed = tmp_path / "plain.xlsx", tmp_path / "P01.xlsx"
    pd.DataFrame({"isi_ms": [10, 777, 30], "mep_mv": 0.3}).to_excel(path, index=False)
    with zipfile.ZipFile(path) as packed, zipfile.ZipFile(changed, "w") as other:
        for name in packed.namelist():
            other.writestr(name, packed.read(name).replace(b"<v>777</v>", b"<v>" + b"9" * 400 + b"</v>"))
    with pytest.raises(InvalidValueError, match=r"row 2 of the column 'isi_ms' of P01\.xlsx is no number"):
        read_people(changed, IMPACT)


def refused_number() -> None:
    with pytest.raises(ValueError, match="no number"):
        read_number("1" * 60_000 + "x")


def doubled_key() -> None:
    with pytest.raises(DoubledKeyError):
        once_each([*((str(number), 0) for number in range(30_000)), ("29999", 0)])


def refused_cell() -> None:
    with pytest.raises(InvalidValueError, match="is no number"):
        read_people(pd.DataFrame({"isi_ms": ["1" * 30_000 + "x"] * 2, "mep_mv": [0.3, 0.3]}), IMPACT)


def numbered_rows() -> None:
    table = pd.DataFrame({"isi_ms": 10, "mep_mv": 0.3, "trial": range(40_000)})
    doubts._require_ascending(Columns.found(table, IMPACT, "P01.csv"))  # noqa: SLF001 - this part alone


@pytest.mark.slow
@pytest.mark.parametrize(
    "read",
    [
        lambda: letters("isi" + "(" * 30_000),
        lambda: unit_said("isi" + "[" * 30_000, {"ms": 1.0}),
        refused_number,
        doubled_key,
        refused_cell,
        numbered_rows,
    ],
)
def test_time_grows_with_the_length_of_a_text_and_not_with_its_square(read: Callable[[], object]) -> None:
    begun = time.process_time()
    read()
    assert time.process_time() - begun < 2.0


def test_what_the_process_hands_back_is_what_was_read(tmp_path: Path) -> None:
    trials = (
        Trial(0, Status.ACCEPTED, 30.0, isi_ms=30.1, mep_interval_mv=(0.1, np.inf)),
        Trial(1, Status.ACCEPTED, None, mep_mv=0.25, excluded=True),
    )
    channel = Channel(np.array([0.1, np.nan, -2.0]), 4000.0, "mV", -5.0)
    one = Delivered(TrialTable(trials), "impact", subject="é/1", visit=Visit(day=2), sweeps={1: {"emg": channel}},
                    blocks={1: "b"}, unused=("note",))  # fmt: skip
    write_answer(tmp_path, Answer([one, one], {"lines": ["a channel"]}), {"P01.csv": "0" * 64})
    answer = read_answer(tmp_path)
    assert isinstance(answer, Answer)
    assert answer.said == {"lines": ["a channel"]}
    for read in answer.people:
        assert (read.trials, read.subject, read.visit, read.blocks, read.unused) == (
            one.trials, one.subject, one.visit, one.blocks, one.unused,
        )  # fmt: skip
        assert read.files == {"P01.csv": "0" * 64}
        np.testing.assert_array_equal(read.sweeps[1]["emg"].values, channel.values)
        assert (read.sweeps[1]["emg"].rate_hz, read.sweeps[1]["emg"].t0_ms) == (4000.0, -5.0)


def test_an_error_of_the_process_says_the_same_here(tmp_path: Path) -> None:
    error = InvalidValueError("it is wrong", got={"a": 1}, expected="right", remedy="Correct it.")
    write_error(tmp_path, error)
    with pytest.raises(InvalidValueError) as caught:
        read_answer(tmp_path)
    assert str(caught.value) == str(error)
    write_error(tmp_path, PermissionError(13, "Permission denied", "P01.csv"))
    with pytest.raises(PermissionError, match=r"Permission denied: 'P01\.csv'"):
        read_answer(tmp_path)


def test_only_files_of_the_own_folder_may_be_opened_and_all_of_them_are_hashed(tmp_path: Path) -> None:
    own, other = tmp_path / "own", tmp_path / "other"
    for folder in (own, own / "below", other):
        folder.mkdir()
        (folder / "P.eeg").write_bytes(b"\0")
    (own / "P.vhdr").write_text("x")
    (own / "link.eeg").symlink_to(other / "P.eeg")
    gate = Gate(own / "P.vhdr")
    gate("open", (str(own / "P.eeg"), "rb", os.O_RDONLY))
    gate("open", (str(own / "missing"), "rb", os.O_RDONLY))
    gate("open", (os.__file__, "rb", os.O_RDONLY))  # Python's own
    gate.require_nothing_refused()
    assert sorted(gate.hashes()) == ["P.eeg", "P.vhdr"]
    for path in (other / "P.eeg", own / ".." / "other" / "P.eeg", own / "link.eeg", own / "below" / "P.eeg"):
        with pytest.raises(InvalidValueError, match="refers to a file elsewhere"):
            gate("open", (str(path), "rb", os.O_RDONLY))
        with pytest.raises(InvalidValueError, match="refers to a file elsewhere"):
            gate.require_nothing_refused()  # though a library may have taken it for a missing file
    named = Gate(own / "P.vhdr", [other / "P.eeg"])
    named("open", (str(own / "link.eeg"), "rb", os.O_RDONLY))
    assert len(named.hashes()) == 2
    settings = Gate(own / "P.vhdr", own=[other / "P.eeg"])  # of a library, and nothing of the recording
    settings("open", (str(other / "P.eeg"), "rb", os.O_RDONLY))
    assert list(settings.hashes()) == ["P.vhdr"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with a name")
def test_a_pipe_in_the_own_folder_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "P.eeg")
    with pytest.raises(InvalidValueError, match="no regular file"):
        Gate(tmp_path / "P.vhdr")("open", (str(tmp_path / "P.eeg"), "rb", os.O_RDONLY))


@pytest.mark.parametrize("kind", ["a link", "samples", "a view"])
def test_a_file_of_hdf5_with_parts_in_other_files_is_refused(kind: str, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "P.set", "w") as file:
        file["plain"] = [1.0]
    require_no_links(tmp_path / "P.set")
    with h5py.File(tmp_path / "P.set", "a") as file:
        if kind == "a link":
            file["EEG"] = h5py.ExternalLink("/elsewhere.h5", "/data")
        elif kind == "samples":
            file.create_dataset("EEG", (4,), "u1", external=[("/etc/hostname", 0, 4)])
        else:
            view = h5py.VirtualLayout((4,), "f8")
            view[:] = h5py.VirtualSource("/elsewhere.h5", "data", (4,))
            file.create_virtual_dataset("EEG", view)
    with pytest.raises(InvalidValueError, match=r"P\.set refers to other files.*EEG"):
        require_no_links(tmp_path / "P.set")


def test_samples_beside_a_header_count_for_how_long_it_may_take(tmp_path: Path) -> None:
    header, samples = tmp_path / "P01.vhdr", tmp_path / "P01.eeg"
    header.write_bytes(b"Brain Vision")
    alone_s = seconds_for(ReadingLimits(), header, table=False)
    samples.write_bytes(bytes(8_000_000))
    assert seconds_for(ReadingLimits(), header, table=False) == pytest.approx(alone_s + 2.0)
