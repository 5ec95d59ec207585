"""Every format is read back to the ISIs and amplitudes that were written, whatever it says of time, unit and scale."""

from __future__ import annotations

import gzip
import json
import struct
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mne
import numpy as np
import pytest
import pyxdf
import scipy.io

from existing.writers import (
    ISIS_MS,
    KNOWN,
    MEPS_MV,
    NAMES,
    RATE_HZ,
    RECORDINGS,
    WORDS,
    as_edf,
    as_matlab_73,
    as_nwb,
    as_smr,
    as_statistics,
    as_xdf,
    chunk,
    header,
    named_events,
    pulsed,
    recording,
    require_as_written,
    without_records,
)
from isiw.errors import IsiwError
from isiw.existing.delivered import Delivered
from isiw.existing.formats import xdf
from isiw.existing.formats.contents import clocked
from isiw.existing.layout import Layout
from isiw.existing.reading import read_people

NAMED = Layout(reference="impact", channels={"emg": "FCR"}, unmarked="alone")
WORDED = {"XDF", "AcqKnowledge", "Spike2", "NWB"}  # their files have words that are known instead of `NAMES`


def read(path: Path, layout: Layout = NAMED) -> Delivered:
    return read_people(path, layout)[0]


@pytest.mark.parametrize("kind", RECORDINGS)
def test_a_recording_of_each_format_is_read_back(kind: str, tmp_path: Path) -> None:
    layout = NAMED if kind.split(maxsplit=1)[0] in WORDED else KNOWN
    if kind.startswith("NWB"):
        layout = layout.saying(channels={"emg": "EMG FCR"})
    require_as_written(read(RECORDINGS[kind](tmp_path), layout))


@pytest.mark.parametrize("write", [as_xdf, as_nwb])
def test_triggers_that_are_numbers_at_times_of_their_own_are_events(write: Any, tmp_path: Path) -> None:
    channels = {"emg": "FCR" if write is as_xdf else "EMG FCR"}
    layout = Layout(reference="impact", channels=channels, markers={"tap": "1", "pulse": "2"}, unmarked="alone")
    require_as_written(read(write(tmp_path, codes=True), layout))


def require_without(person: Delivered, lost: set[int]) -> None:
    """All are right but some, of which nothing was recorded."""
    for number, trial in enumerate(person.trials):
        if number in lost:
            assert not trial.told
        else:
            assert trial.mep_mv == pytest.approx((*MEPS_MV, 0.3)[number], rel=0.01)
            assert trial.isi_ms == pytest.approx((*ISIS_MS, None)[number], abs=1000 / RATE_HZ)


def test_a_pause_in_an_edf_or_bdf_file_is_a_gap_and_what_follows_stays_at_its_time(tmp_path: Path) -> None:
    for bdf in (False, True):
        require_as_written(read(without_records(as_edf(tmp_path, bdf=bdf), 2, 4, 6, 8), KNOWN))


def test_an_edf_file_of_triggered_sweeps_has_all_of_them(tmp_path: Path) -> None:
    halves = {half for half in range(28) if half % 4 not in {1, 2}}  # stimuli come at 1, 3, 5 s …
    require_as_written(read(without_records(as_edf(tmp_path, record_s=0.5), *halves), KNOWN))


def test_a_stream_of_xdf_that_had_just_begun_keeps_nothing_from_being_read(tmp_path: Path) -> None:
    path = as_xdf(tmp_path)
    begun = chunk(3, struct.pack("<IBB", 3, 1, 2) + struct.pack("<BdfBf", 8, 1013.9, 1.0, 0, 1.0))
    path.write_bytes(path.read_bytes() + header(3, "Force", "Force", "float32", 100.0) + begun)
    require_as_written(read(path, NAMED))


@pytest.mark.parametrize("suffix", [".xdf", ".xdfz"])
def test_samples_of_xdf_are_those_of_pyxdf_whichever_of_them_have_a_time(suffix: str, tmp_path: Path) -> None:
    rng, number = np.random.default_rng(3), 0
    parts = [b"XDF:", header(1, "Amplifier", "EMG", "int16", 100.0)]
    for stamped in ({0}, {*range(20)}, set(), {0, 7, 8}, {5}, {0}):
        samples = b""
        for place in range(20):
            time = struct.pack("<Bd", 8, 50.0 + (number + place) / 100) if place in stamped else b"\0"
            samples += time + struct.pack("<h", int(rng.integers(-9999, 9999)))
        parts.append(chunk(3, struct.pack("<IBB", 1, 1, 20) + samples))
        parts.append(chunk(3, struct.pack("<IBB", 1, 1, 0)))
        number += 20
    whole = b"".join([*parts[:-4], b"\x05" * 9, chunk(5, xdf.BOUNDARY), *parts[-4:]])  # damaged in between
    path = tmp_path / f"P01{suffix}"
    path.write_bytes(gzip.compress(whole[:-30]) if suffix == ".xdfz" else whole[:-30])  # and cut off
    (stream,), _ = pyxdf.load_xdf(path, dejitter_timestamps=False)
    (track,) = xdf.read(path, Layout()).tracks
    values = stream["time_series"][:, 0]
    assert track.read(0, len(values)).tolist() == values.tolist()
    assert track.read(33, 58).tolist() == values[33:58].tolist()
    assert (track.stretches[0].samples, len(values)) == (100, 100)


@pytest.mark.slow
@pytest.mark.parametrize("gap_s", [0.02, 0.3, 0.9])
def test_a_gap_in_a_stream_is_not_smeared_over_it(gap_s: float, tmp_path: Path) -> None:
    require_as_written(read(as_xdf(tmp_path, gap_s=gap_s, jitter_s=0.001)))


def test_a_pause_of_spike2_is_a_gap(tmp_path: Path) -> None:
    require_without(read(as_smr(tmp_path, paused=True)), {1})


def test_samples_that_come_late_for_good_come_after_a_gap_and_jitter_is_none() -> None:
    rng = np.random.default_rng(1)
    times_s = np.arange(20_000, dtype=np.float64) * (1 / 1000 + 2e-8) + np.repeat(rng.normal(0.0, 0.003, 625), 32)
    rate_hz, stretches, _ = clocked(times_s, 1000.0, "a stream")
    assert len(stretches) == 1
    assert rate_hz == pytest.approx(1 / (1 / 1000 + 2e-8), rel=5e-5)
    _, stretches, _ = clocked(times_s + 0.05 * (np.arange(20_000) >= 9_000), 1000.0, "a stream")
    assert [stretch.first for stretch in stretches] == [0, 9_000]
    assert stretches[1].start_s == pytest.approx(9_000 * (1 / 1000 + 2e-8) + 0.05, abs=5e-4)
    with pytest.raises(IsiwError, match="do not ascend"):
        clocked(np.zeros(10), 1000.0, "a stream")


@pytest.mark.slow
def test_what_pyxdf_says_of_clocks_is_said(tmp_path: Path) -> None:
    assert any("scatter" in note for note in read(as_xdf(tmp_path, jitter_s=0.004)).notes)
    assert read(as_xdf(tmp_path)).notes == ()


def test_a_table_of_matlab_is_read_and_sweeps_of_version_73_too(tmp_path: Path) -> None:
    path, vectors = tmp_path / "P01.mat", {"isi_ms": ISIS_MS, "mep_mv": MEPS_MV}
    scipy.io.savemat(path, {**vectors, "rate": 4000.0})
    for written in (path, as_matlab_73(tmp_path / "P02.mat", **vectors)):
        found = [(trial.isi_ms, trial.mep_mv) for trial in read(written, Layout(reference="impact")).trials]
        assert found == list(zip(ISIS_MS, MEPS_MV, strict=True))
    firsts = [round((at_s - 0.4) * RATE_HZ) for at_s, name in named_events() if name == "TMS"]
    sweeps = np.array([recording()[0][first : first + 2400] for first in firsts])
    path = as_matlab_73(path, emg=sweeps, isi_ms=[*ISIS_MS, np.nan], fs=4000.0)
    said: dict[str, Any] = {"rate_hz": 4000.0, "pulse_at_ms": 400.0, "units": ("mV",), "alone": ""}
    require_as_written(read(path, Layout(reference="impact", channels={"emg": "emg"}, **said)))


@pytest.mark.parametrize("suffix", [".sav", ".zsav", ".dta"])
def test_a_table_of_spss_or_stata_has_the_units_and_words_of_its_labels(suffix: str, tmp_path: Path) -> None:
    layout, written = Layout(reference="impact"), suffix.replace("z", "")
    require_as_written(read(as_statistics(tmp_path / f"P01{written}").rename(tmp_path / f"P01{suffix}"), layout))
    as_statistics(tmp_path / f"P02{written}", "Peak to peak (% of control)")
    with pytest.raises(IsiwError, match="relative to others"):
        read(tmp_path / f"P02{written}", layout.saying(units=("uV",)))
    as_statistics(tmp_path / f"P03{written}", of_isis={30: "15"})
    with pytest.raises(IsiwError, match=r"numbers as labels, and others have no label; got '15'"):
        read(tmp_path / f"P03{written}", layout)


@pytest.mark.parametrize(("name", "program"), [("a.smrx", "Spike2"), ("a.adicht", "LabChart"), ("a.cfs", "Signal")])
def test_a_format_without_a_reader_says_which_export_to_make(
    name: str, program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / name).write_bytes(b"x")
    says = f"In {program}: File, Export"
    monkeypatch.setitem(sys.modules, "biosig", None)
    with pytest.raises(IsiwError, match=says):
        read(tmp_path / name)
    if name != "a.cfs":
        monkeypatch.setattr(sys, "platform", "win32")
        with pytest.raises(IsiwError, match=rf"pip install .*{says}"):
            read(tmp_path / name)


def cut(before_s: float = 0.4, after_s: float = 0.2) -> tuple[list[np.ndarray], list[list[tuple[float, str]]]]:
    """Sweeps about the pulses [µV], and the events in each [s]."""
    emg_mv, _ = recording()
    pulses = [at_s for at_s, name in named_events() if name == "TMS"]
    length, firsts = round((before_s + after_s) * RATE_HZ), [round((at_s - before_s) * RATE_HZ) for at_s in pulses]
    return [1e3 * emg_mv[first:][:length] for first in firsts], [
        [(at - pulse + before_s, name) for at, name in named_events() if -before_s <= at - pulse < after_s]
        for pulse in pulses
    ]


def test_frames_of_signal_are_read_by_biosig_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweeps, events = cut()
    first_s = np.cumsum([0.0, *(len(sweep) / RATE_HZ for sweep in sweeps)])
    said = [{"TYP": "0x7ffe", "POS": float(at)} for at in first_s[:-1]]
    said += [{"TYP": "0x0001", "POS": float(begin + at), "Description": name}
             for begin, each in zip(first_s, events, strict=False) for at, name in each]  # fmt: skip
    header = {"Samplingrate": RATE_HZ, "CHANNEL": [{"Label": "FCR", "PhysicalUnit": "uV"}], "EVENT": said}
    module = SimpleNamespace(header=lambda _: json.dumps(header), data=lambda _: np.concatenate(sweeps)[:, None])
    monkeypatch.setitem(sys.modules, "biosig", module)
    (tmp_path / "P01.cfs").write_bytes(b"x")
    require_as_written(read(tmp_path / "P01.cfs"))


def test_labchart_is_read_by_adi_reader_on_windows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sweeps, events = cut()
    channel = SimpleNamespace(name="FCR", n_records=len(sweeps), units=["uV"] * 6, fs=[RATE_HZ] * 6,
                              get_data=lambda record: sweeps[record - 1])  # fmt: skip
    records = [SimpleNamespace(comments=[SimpleNamespace(text=name, time=at) for at, name in each]) for each in events]
    held = SimpleNamespace(channels=[channel], records=records)
    monkeypatch.setitem(sys.modules, "adi", SimpleNamespace(read_file=lambda _: held))
    monkeypatch.setattr(sys, "platform", "win32")
    (tmp_path / "P01.adicht").write_bytes(b"x")
    require_as_written(read(tmp_path / "P01.adicht"))


def test_spike2_8_is_read_by_sonpy_on_windows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    emg_uv = 1e3 * recording()[0]
    ticks = {word: [round(1e5 * at) for at, name in named_events() if name == word] for word in WORDS.values()}
    titles, kinds = ["FCR", "tap", "TMS"], [1, 3, 3]
    held = SimpleNamespace(
        GetTimeBase=lambda: 1e-5,
        MaxTime=lambda: 25 * len(emg_uv),
        MaxChannels=lambda: 3,
        ChannelType=kinds.__getitem__,
        GetChannelTitle=titles.__getitem__,
        ChannelDivide=lambda _: 25,
        GetChannelUnits=lambda _: "uV",
        FirstTime=lambda _, at, end: at if at < end else -1,
        ReadEvents=lambda channel, *_: ticks[titles[channel]],
        ReadFloats=lambda _, _most, at: emg_uv[at // 25 :][:8000],
    )
    module = SimpleNamespace(SonFile=lambda _, bReadOnly: held)  # noqa: ARG005, N803 - as sonpy calls it
    monkeypatch.setitem(sys.modules, "sonpy", module)
    monkeypatch.setattr(sys, "platform", "win32")
    (tmp_path / "P01.smrx").write_bytes(b"x")
    require_as_written(read(tmp_path / "P01.smrx"))


FORMATS = [".xdf", ".acq", ".smr", ".nwb", ".sav", ".dta", ".set", ".edf", ".bdf", ".vhdr", "_raw.fif", ".mat", ".doc",
           ".xlsx", ".parquet"]  # fmt: skip


@pytest.mark.parametrize("content", [b"", b"none of this format, and long enough to be something else" * 20])
@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_that_is_none_of_its_format_is_refused_in_words(suffix: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / f"P01{suffix}").write_bytes(content)
    with pytest.raises(IsiwError, match=r"cannot be read|no data of EEGLAB|without a password") as refused:
        read(tmp_path / f"P01{suffix}")
    assert "\n" not in str(refused.value)


def test_a_file_that_does_not_say_where_and_when_its_samples_are_is_asked_about(tmp_path: Path) -> None:
    path = as_xdf(tmp_path)
    path.write_bytes(path.read_bytes().replace(b"srate>4000<", b"srate>0000<"))
    scipy.io.savemat(tmp_path / "P02.mat", {"data": ISIS_MS, "datastart": [1], "dataend": [5], "titles": ["EMG"]})
    (tmp_path / "P03.txt").write_text("Interval=\t0.00025 s\nChannelTitle=\tEMG\tTMS\n0\t1\t2\n")
    for name, says in (("P01.xdf", "at a rate"), ("P02.mat", "LabChart's channels"), ("P03.txt", "in a layout")):
        with pytest.raises(IsiwError, match=says):
            read(tmp_path / name, Layout("impact"))


def test_of_a_folder_the_files_in_it_are_to_be_named(tmp_path: Path) -> None:
    with pytest.raises(IsiwError, match=r"Name its files.*\*\.csv"):
        read(tmp_path)


@pytest.mark.parametrize("inverted", [False, True])
def test_a_trigger_in_a_channel_is_a_marker_in_any_format(inverted: bool) -> None:  # noqa: FBT001
    rows = [1e-3 * recording()[0], *(pulsed(40, name, 5.0) for name in NAMES.values())]
    rows[1] = 5.0 - rows[1] if inverted else rows[1]
    held = mne.io.RawArray(np.array(rows), mne.create_info(["FCR", "hammer", "stimulator"], RATE_HZ, "emg"))
    channels = {"emg": "FCR", "tap": "hammer", "pulse": "stimulator"}
    (person,) = read_people(held, Layout(reference="impact", channels=channels, unmarked="alone"))
    require_as_written(person)
    with pytest.raises(IsiwError, match=r"no such channel.* one of FCR, hammer, stimulator"):
        read_people(held, Layout(reference="impact", channels={**channels, "tap": "valve"}))
