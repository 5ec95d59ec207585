"""Text and MATLAB files laid out as Signal, Spike2, LabChart, Brainsight and AcqKnowledge export them.

The files are made here: what is known of the layouts is in programs of others that read such exports.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from existing.writers import ISIS_MS, MEPS_MV, NAMES, RATE_HZ, recording, require_as_written
from isiw.errors import IsiwError
from isiw.existing.delivered import Delivered
from isiw.existing.layout import read_layout
from isiw.existing.reading import read_people

LABCHART = (
    "Interval=\t0.00025 s\nExcelDateTime=\t4.3749e+04\t10/11/19 11:08:37.485584\nTimeFormat=\tStartOfBlock\n"
    "DateFormat=\t\nChannelTitle=\tEMG\tHammer\tTMS\nRange=\t5.000 mV\t10.000 V\t10.000 V\nUnitName=\tmV\tV\tV\n"
    "TopValue=\t*\t*\t*\nBottomValue=\t*\t*\t*\n"
)
BIOPAC = "P01.acq\n0.25 msec/sample\n3 channels\nEMG\nmV\nHammer\nVolts\nTMS\nVolts\nsec\tCH1\tCH2\tCH3\n\t9\t9\t9\n"
BRAINSIGHT = (
    "# Version: 13\n# Created by: Brainsight 2.4\n# Units: millimetres, degrees, milliseconds, and microvolts\n"
    "# Target Name\tLoc. X\tLoc. Y\nM1\t1\t2\n"
    "# Sample Name\tSession Name\tIndex\tComment\tEMG Peak-to-peak 1\tEMG Data 1\n"
)
TRIGGERS = 'emg = "EMG"\ntap = "Hammer"\npulse = "TMS"\n'
COLUMNS = 'separator = "\\t"\nnames = ["time", "EMG", "Hammer", "TMS"]\nunits = ["mV"]\n'

EMG_MV, EVENTS = recording()


def trigger(name: str, low: float = 0.0, high: float = 5.0) -> np.ndarray:
    values = np.full(len(EMG_MV), low)
    for at_s, event in EVENTS:
        if event == NAMES[name]:
            values[round(at_s * RATE_HZ) :][:20] = high
    return values


def lines(*columns: Any, first: int = 0, last: int | None = None) -> str:
    chosen = [column[first:last] for column in columns]
    time = np.arange(len(chosen[0])) / RATE_HZ
    return "".join(
        f"{at:.5f}\t{cells[0]:.9f}" + "".join(f"\t{cell}" for cell in cells[1:]) + "\n"
        for at, *cells in zip(time, *chosen, strict=True)
    )


def read(path: Path, content: str, layout: str) -> Delivered:
    (path / "P01.txt").write_text(content)
    unmarked = 'unmarked = "alone"\n' if "[channels]" in layout else ""
    (path / "layout.toml").write_text(f'reference = "impact"\n{unmarked}{layout}')
    (person,) = read_people(path / "P01.txt", read_layout(path / "layout.toml"))
    return person


@pytest.mark.slow
def test_columns_of_samples_with_triggers_are_a_recording(tmp_path: Path) -> None:
    samples = lines(EMG_MV, trigger("tap"), trigger("pulse", 5.0, 0.0))  # which of the levels is rest does not matter
    for head in (LABCHART, BIOPAC):
        skipped = f"rate_hz = 4000\nskip_lines = {head.count(chr(10))}\n"
        require_as_written(read(tmp_path, head + samples, f"{skipped}{COLUMNS}[channels]\n{TRIGGERS}"))
    head = '"Time"\t"EMG"\t"Hammer"\t"TMS"\n'  # of Spike2
    layout = f'rate_hz = 4000\nunits = ["mV"]\n[channels]\n{TRIGGERS}'
    require_as_written(read(tmp_path, head + samples, layout))
    require_as_written(read(tmp_path, head + samples.replace(".", ","), layout))


@pytest.mark.slow
def test_comments_beside_samples_are_events(tmp_path: Path) -> None:
    comments = np.full(len(EMG_MV), "", dtype=object)
    for at_s, name in EVENTS:
        comments[round(at_s * RATE_HZ)] = "#* tap" if name == NAMES["tap"] else "#* TMS"
    content = re.sub(r"\t\n", "\n", LABCHART + lines(EMG_MV, comments))
    layout = 'rate_hz = 4000\nskip_lines = 9\nseparator = "\\t"\nnames = ["time", "EMG", "comment"]\nunits = ["mV"]\n'
    require_as_written(read(tmp_path, content, f'{layout}[channels]\nemg = "EMG"\nevents = "comment"\n'))


@pytest.mark.slow
def test_blocks_are_sweeps(tmp_path: Path) -> None:
    tap, pulse, content = trigger("tap"), trigger("pulse"), ""
    for at_s in (at_s for at_s, name in EVENTS if name == NAMES["pulse"]):
        first = round((at_s - 0.4) * RATE_HZ)
        content += LABCHART + lines(EMG_MV, tap, pulse, first=first, last=first + 2400)
    person = read(tmp_path, content, f"rate_hz = 4000\n{COLUMNS}[channels]\n{TRIGGERS}")
    require_as_written(person)
    assert {len(sweep["emg"].values) for sweep in person.sweeps.values()} == {2400}
    bare = content.replace(LABCHART, "")  # whose times begin again
    require_as_written(read(tmp_path, bare, f"rate_hz = 4000\n{COLUMNS}[channels]\n{TRIGGERS}"))
    with pytest.raises(IsiwError, match=r"'time' of P01\.txt says; got '2000 Hz'; expected 4000 Hz"):
        read(tmp_path, bare, f"rate_hz = 2000\n{COLUMNS}[channels]\n{TRIGGERS}")
    slower = "".join(lines(EMG_MV, tap, pulse, last=2400).splitlines(keepends=True)[::2])  # a block of 2 kHz
    with pytest.raises(IsiwError, match=r"'time' of P01\.txt says; got '4000 Hz'; expected 2000 Hz"):
        read(tmp_path, content + LABCHART + slower, f"rate_hz = 4000\n{COLUMNS}[channels]\n{TRIGGERS}")


def test_a_part_of_a_file_is_a_table_with_names_of_its_own(tmp_path: Path) -> None:
    rows = "".join(
        f"Sample {n}\tSession 1\t{n}\t{isi}\t{1000 * mep}\t1.0;2.0\n"
        for n, (isi, mep) in enumerate(zip((*ISIS_MS, "(null)"), (*MEPS_MV, 0.3), strict=True))
    )
    content = BRAINSIGHT + rows + "# Planned Landmark Name\tLoc. X\nNasion\t1\n"
    layout = 'units = ["ms", "uV"]\nalone = ""\n[columns]\nisi = "Comment"\nmep = "EMG Peak-to-peak 1"\n'
    require_as_written(read(tmp_path, content, layout))


def matrix(path: Path, said: str, *, turned: bool = False) -> Delivered:
    firsts = [round((at_s - 0.4) * RATE_HZ) for at_s, name in EVENTS if name == NAMES["pulse"]]
    emg = np.array([EMG_MV[first : first + 2400] for first in firsts])
    content = {"data": {"emg": emg.T if turned else emg, "isi_ms": [*ISIS_MS, np.nan]}, "fs": 4000.0}
    scipy.io.savemat(path / "P01.mat", content)
    (path / "layout.toml").write_text(f'reference = "impact"\n{said}[channels]\nemg = "emg"\n')
    (person,) = read_people(path / "P01.mat", read_layout(path / "layout.toml"))
    return person


SAID = {
    "rate_hz": "rate_hz = 4000\n",
    "pulse_at_ms": "pulse_at_ms = 400\n",
    "--unit": 'units = ["mV"]\n',
    "--alone": 'alone = ""\n',
}


def test_sweeps_of_matlab_are_read(tmp_path: Path) -> None:
    for turned in (False, True):
        require_as_written(matrix(tmp_path, "".join(SAID.values()), turned=turned))


@pytest.mark.parametrize("missing", SAID)
def test_what_arrays_do_not_tell_is_asked_for(missing: str, tmp_path: Path) -> None:
    with pytest.raises(IsiwError, match=missing):
        matrix(tmp_path, "".join(line for key, line in SAID.items() if key != missing))


@pytest.mark.parametrize(
    ("content", "channels", "expected"),
    [
        ("time\temg\n0.0\t0.1\n", TRIGGERS, "no such column"),
        ("time\tEMG\n0.0\t0.1\n0.1\t0.2\n", 'emg = "EMG"\n', "no event was found"),
        ("time\tEMG\tTMS\n0.0\t0.1\t0\n0.1\tnone\t5\n", 'emg = "EMG"\npulse = "TMS"\n', "is no number"),
        ("time\tEMG\tTMS\n0.0\t0.1\t0\n0.1\t0.2\t0\n", 'emg = "EMG"\npulse = "TMS"\n', "no event was found"),
    ],
)
def test_a_broken_recording_in_text_ends_in_a_sentence(
    content: str, channels: str, expected: str, tmp_path: Path
) -> None:
    with pytest.raises(IsiwError, match=expected) as refused:
        read(tmp_path, content, f'rate_hz = 4000\nunits = ["mV"]\n[channels]\n{channels}')
    assert "\n" not in str(refused.value)
