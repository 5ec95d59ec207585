"""Files are read by a process of its own: what it opens, what it may take, and that nothing ends isiw."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import mne
import numpy as np
import pandas as pd
import pytest
import scipy.io

from existing import writers
from existing.writers import KNOWN, RECORDINGS, as_brainvision, as_eeglab, require_as_written
from isiw.errors import InvalidValueError
from isiw.existing import Layout, ReadingLimits, read_people
from isiw.existing.batch import Way, read_files

IMPACT = Layout(reference="impact")
HEAD = "isi_ms,mep_mv\n"
ROWS = "".join(f"{isi},{0.2 + isi / 1000}\n" for isi in range(10, 110, 10))


@pytest.fixture(autouse=True)
def read_here() -> None:
    """Here files are read as they always are: apart."""


@pytest.mark.slow
def test_a_table_is_read_by_another_process_and_known_by_its_content(tmp_path: Path) -> None:
    (tmp_path / "numpy.py").write_text("raise SystemExit('code beside the data was run')")
    (tmp_path / "P01.csv").write_text(HEAD + ROWS)
    (person,) = read_people(tmp_path / "P01.csv", IMPACT)
    assert [trial.isi_ms for trial in person.trials] == list(range(10, 110, 10))
    assert list(person.files) == ["P01.csv"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["BrainVision", "EDF", "EEGLAB", "epochs of FIF"])
def test_recordings_are_read_apart_as_they_are_here(kind: str, tmp_path: Path) -> None:
    (person,) = read_people(RECORDINGS[kind](tmp_path), KNOWN)
    require_as_written(person)


@pytest.mark.slow
def test_what_libraries_ask_of_the_system_is_no_file_elsewhere(tmp_path: Path) -> None:
    path = writers.as_edf(tmp_path).rename(tmp_path / "sub-01_emg.edf")
    rows = pd.DataFrame(sorted(writers.recording()[1]), columns=["onset", "trial_type"]).assign(duration=0.0)
    rows.to_csv(tmp_path / "sub-01_events.tsv", sep="\t", index=False)
    require_as_written(read_people(path, KNOWN)[0])
    path = writers.as_matlab_73(tmp_path / "P01.mat", isi_ms=[10.0, 20.0, 40.0], mep_mv=[0.1, 0.5, 0.2])
    assert len(read_people(path, IMPACT)[0].trials) == 3


@pytest.mark.slow
@pytest.mark.parametrize("way", ["absolute", "upwards", "link", "markers"])
def test_a_header_that_names_a_file_elsewhere_is_refused_unless_the_file_is_named(way: str, tmp_path: Path) -> None:
    own, other = tmp_path / "own", tmp_path / "other"
    own.mkdir()
    other.mkdir()
    header, name = as_brainvision(own), "P01.vmrk" if way == "markers" else "P01.eeg"
    (own / name).rename(other / name)
    names = {"absolute": str(other / name), "upwards": f"../other/{name}", "markers": f"../other/{name}", "link": name}
    if way == "link":
        (own / name).symlink_to(other / name)
    header.write_text(header.read_text().replace(f"File={name}", f"File={names[way]}"))
    with pytest.raises(InvalidValueError, match=r"P01\.vhdr refers to a file elsewhere.*--also FILE"):
        read_people(header, KNOWN)
    if way in {"upwards", "link"}:
        (person,) = read_people(header, KNOWN, also=[other / name])
        require_as_written(person)
        assert sorted(person.files) == ["P01.eeg", "P01.vhdr", "P01.vmrk"]


@pytest.mark.slow
def test_data_of_eeglab_elsewhere_are_refused(tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.mkdir()
    (tmp_path / "secret.fdt").write_bytes(bytes(400_000))
    path = as_eeglab(own)
    fields = {name: value for name, value in scipy.io.loadmat(path).items() if not name.startswith("__")}
    scipy.io.savemat(path, {"EEG": {**fields, "data": "../secret.fdt"}})
    with pytest.raises(InvalidValueError, match=r"P01\.set refers to a file elsewhere"):
        read_people(path, KNOWN)


@pytest.mark.slow
def test_a_part_of_a_fif_elsewhere_is_refused(tmp_path: Path) -> None:
    own = tmp_path / "own"
    own.mkdir()
    made = mne.io.RawArray(np.zeros((8, 200_000)), mne.create_info(8, 4000.0, "emg"))
    made.save(own / "P01_raw.fif", split_size="2MB", verbose="ERROR")
    first, second = own / "P01_raw.fif", own / "P01_raw-1.fif"
    second.rename(tmp_path / "_raw-1.fif")
    assert first.read_bytes().count(b"P01_raw-1.fif") == 1
    first.write_bytes(first.read_bytes().replace(b"P01_raw-1.fif", b"../_raw-1.fif"))
    with pytest.raises(InvalidValueError, match=r"P01_raw\.fif refers to a file elsewhere"):
        read_people(first, KNOWN)


@pytest.mark.slow
def test_a_recording_whose_emg_was_exported_anew_is_not_the_same_file(tmp_path: Path) -> None:
    header = as_brainvision(tmp_path)
    (before,) = read_files([header], Way(KNOWN))
    data = tmp_path / "P01.eeg"
    data.write_bytes(data.read_bytes()[:-4] + bytes(4))
    (after,) = read_files([header], Way(KNOWN))
    assert before.made_of["sha256"] == after.made_of["sha256"]
    assert before.made_of != after.made_of
    assert sorted(before.made_of["beside"]) == ["P01.eeg", "P01.vmrk"]


def edf(samples: int, records: int) -> bytes:
    """The header of a recording that says to be larger than it is."""
    head = b"0       " + b"X".ljust(160) + b"01.01.2001.01.01" + b"512".ljust(8) + b" " * 44
    head += str(records).encode().ljust(8) + b"1".ljust(8) + b"1".ljust(4)
    for value, width in ((b"EMG", 16), (b"", 80), (b"uV", 8), (b"-1", 8), (b"1", 8), (b"-9", 8), (b"9", 8), (b"", 80),
                         (str(samples).encode(), 8), (b"", 32)):  # fmt: skip
        head += value.ljust(width)
    return head + bytes(2000)


MATLAB = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
SHEET = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>%s</sheetData></worksheet>'
ROW = b"<row><c><v>10</v></c><c><v>0.2</v></c></row>"


def workbook(path: Path, rows: bytes) -> Path:
    """A workbook whose sheet has these rows."""
    pd.DataFrame({"isi_ms": [10], "mep_mv": 0.3}).to_excel(path.with_name("plain.xlsx"), index=False)
    with (
        zipfile.ZipFile(path.with_name("plain.xlsx")) as plain,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made,
    ):
        for name in plain.namelist():
            made.writestr(name, SHEET % rows if name.endswith("sheet1.xml") else plain.read(name))
    return path


BIG = {
    "a giant count in MATLAB": ("P.mat", MATLAB + struct.pack("<14I", 14, 48, 6, 8, 6, 0, 5, 8, 2**31 - 1, 2**31 - 1,
                                                              1, 1, 97, 9), "the file is no table"),
    "a giant count in EDF": ("P.edf", edf(99_999_999, 99_999_999), "P.edf|the file has no records of signals"),
    "quotes that do not end": ("P.csv", (HEAD + '"' + ROWS * 200).encode(), "P.csv"),
    "random bytes": ("P.fif", bytes(range(256)) * 40, "the file cannot be read as FIF"),
    "an empty file": ("P.xlsx", b"", "this is no workbook"),
    "half a workbook": ("P.xlsx", b"PK\x03\x04" + bytes(200), "the file is no table"),
    "NUL": ("P.csv", HEAD.encode() + bytes(2000), "the file is no text"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("kind", BIG)
def test_a_hostile_file_ends_in_a_sentence_within_ten_seconds_of_processor_time(kind: str, tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    name, content, said = BIG[kind]
    (tmp_path / name).write_bytes(content)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with pytest.raises(InvalidValueError, match=said):
        read_people(tmp_path / name, Layout(reference="impact", units=("uV",)))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 10.0


@pytest.mark.slow
def test_memory_and_time_of_the_process_end_in_the_limit_and_the_option(tmp_path: Path) -> None:
    pytest.importorskip("resource")
    far = workbook(tmp_path / "far.xlsx", b'<row r="1048576"><c r="XFD1048576"><v>1</v></c></row>')
    with pytest.raises(InvalidValueError, match=r"too much memory to read; expected at most 300 MB.*--larger 2"):
        read_people(far, IMPACT, limits=ReadingLimits(memory_mb=300, seconds=60))
    long = workbook(tmp_path / "long.xlsx", ROW * 200_000)
    with pytest.raises(InvalidValueError, match=r"too long to read; expected at most .* s of processor time.*--larger"):
        read_people(long, IMPACT, limits=ReadingLimits(seconds=1e-3, memory_mb=3000))
