"""One recording in the formats of other programs, each written by that format's own library.

Where none writes it, it is written here, from the structure that its readers know: XDF, .acq and .smr.
"""

from __future__ import annotations

import datetime as dt
import struct
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import edfio
import h5py
import mne
import numpy as np
import pandas as pd
import pybv
import pyreadstat
import pytest
import scipy.io
from bioread import headers as bh

from isiw.existing.delivered import Delivered
from isiw.existing.layout import Layout

RATE_HZ = 4000.0
ISIS_MS = (30.0, 60.0, 90.0, 120.0, 45.0)
MEPS_MV = (0.4, 0.9, 1.6, 0.25, 0.7)
NAMES = {"tap": "S  1", "pulse": "S  2"}
KNOWN = Layout(reference="impact", markers=NAMES, channels={"emg": "FCR"}, unmarked="alone")

mne.set_log_level("ERROR")


def recording(scale: float = 1.0) -> tuple[np.ndarray, list[tuple[float, str]]]:
    """EMG [mV] with an MEP of known amplitude after each pulse, and the times of taps and pulses [s]."""
    rng, seconds = np.random.default_rng(1), 2.0 * (len(ISIS_MS) + 2)
    emg_mv = 1e-3 * rng.standard_normal(round(seconds * RATE_HZ))
    events = []
    for number, (isi_ms, mep_mv) in enumerate(zip((*ISIS_MS, None), (*MEPS_MV, 0.3), strict=True)):
        tap_s = 1.0 + 2.0 * number
        pulse_s = tap_s if isi_ms is None else tap_s + isi_ms / 1e3
        events += [] if isi_ms is None else [(tap_s, NAMES["tap"])]
        events.append((pulse_s, NAMES["pulse"]))
        first = round((pulse_s + 0.018) * RATE_HZ)
        wave = np.sin(np.linspace(0.0, 2.0 * np.pi, round(0.012 * RATE_HZ)))
        emg_mv[first : first + len(wave)] += 0.5 * mep_mv * wave / np.abs(wave).max()
    return scale * emg_mv, events


def raw(scale: float = 1.0, kind: str = "emg") -> Any:
    emg_mv, events = recording(scale)
    info = mne.create_info(["FCR", "EEG 1"], RATE_HZ, [kind, "eeg"])
    made = mne.io.RawArray(np.stack([1e-3 * emg_mv, np.zeros_like(emg_mv)]), info)
    onsets, names = zip(*events, strict=True)
    return made.set_annotations(mne.Annotations(onsets, 0.0, names))


def as_brainvision(path: Path, unit: str = "µV") -> Path:
    emg_mv, events = recording()
    samples = [
        {"onset": round(at_s * RATE_HZ), "duration": 1, "description": int(name[-1]), "type": "Stimulus"}
        for at_s, name in events
    ]
    pybv.write_brainvision(
        data=1e-3 * np.stack([emg_mv, 0 * emg_mv]), sfreq=RATE_HZ, ch_names=["FCR", "EEG 1"], fname_base="P01",
        folder_out=path, events=samples, resolution=1e-3, unit="µV",
    )  # fmt: skip
    said = f",{0.001 / {'mv': 1e3, 'nV': 1e-3}.get(unit, 1.0):g},{unit}"
    header = path / "P01.vhdr"
    header.write_text(header.read_text(encoding="utf-8").replace(",0.001,µV", said), encoding="utf-8")
    return header


def as_edf(
    path: Path, dimension: str = "uV", scale: float = 1e3, *, bdf: bool = False, record_s: float | None = None
) -> Path:
    emg_mv, events = recording()
    signal: Any = edfio.BdfSignal if bdf else edfio.EdfSignal
    signals = [
        signal(
            scale * values, RATE_HZ, label=label, physical_dimension=dimension, physical_range=(-4 * scale, 4 * scale)
        )
        for label, values in (("FCR", emg_mv), ("EEG 1", 0 * emg_mv))
    ]
    notes = [edfio.EdfAnnotation(at_s, None, name) for at_s, name in events]
    kind: Any = edfio.Bdf if bdf else edfio.Edf
    made = kind(signals, annotations=notes, data_record_duration=record_s)
    target = path / f"P01.{'bdf' if bdf else 'edf'}"
    made.write(target)
    return target


def as_fif(path: Path) -> Path:
    raw().save(path / "P01_raw.fif")
    return path / "P01_raw.fif"


def as_eeglab(path: Path) -> Path:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mne.export.export_raw(path / "P01.set", raw(kind="eeg"))
    return path / "P01.set"


def with_stim(codes: np.ndarray | None = None, kind: str = "stim") -> Any:
    """The recording with a channel called STI in place of annotations."""
    info = mne.create_info(["FCR", "STI"], RATE_HZ, ["emg", kind])
    return mne.io.RawArray(np.stack([1e-3 * recording()[0], pulsed(8) if codes is None else codes]), info)


def pulsed(width: int, name: str = "", high: float = 0.0) -> np.ndarray:
    """Pulses of so many samples at stimuli of a name, or at all; each is as high as its number, or as is said."""
    codes = np.zeros_like(recording()[0])
    for at_s, stimulus in recording()[1]:
        codes[round(at_s * RATE_HZ) :][:width] += (high or int(stimulus[-1])) if name in stimulus else 0.0
    return codes


def epochs(said: Any = None, **besides: Any) -> Any:
    """Epochs about the pulses, whose metadata say the ISIs and what is said besides, or something else."""
    whole = raw()
    events, _ = mne.events_from_annotations(whole, {NAMES["pulse"]: 2})
    metadata = pd.DataFrame({"isi_ms": [*ISIS_MS, np.nan], **besides} if said is None else said)
    return mne.Epochs(whole, events, tmin=-0.3, tmax=0.1, baseline=None, preload=True, metadata=metadata)


def as_epochs(path: Path, *, metadata: bool = True) -> Path:
    """Epochs in a file; without metadata their annotations say what came when."""
    made = epochs()
    made.metadata = made.metadata if metadata else None
    made.save(path / "P01-epo.fif")
    return path / "P01-epo.fif"


WORDS = {NAMES["tap"]: "tap", NAMES["pulse"]: "TMS"}


def named_events() -> list[tuple[float, str]]:
    return [(at_s, WORDS[name]) for at_s, name in sorted(recording()[1])]


def chunk(tag: int, content: bytes) -> bytes:
    return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content


def header(number: int, name: str, kind: str, form: str, rate_hz: float, channels: str = "") -> bytes:
    info = f"<info><name>{name}</name><type>{kind}</type><channel_count>1</channel_count><nominal_srate>{rate_hz:g}"
    info += f"</nominal_srate><channel_format>{form}</channel_format><hostname>rig</hostname>"
    text = f'<?xml version="1.0"?>{info}<desc>{channels}</desc></info>'
    return chunk(2, struct.pack("<I", number) + text.encode())


def as_xdf(
    path: Path, *, gap_s: float = 0.0, jitter_s: float = 0.0, offset_s: float = 0.0, codes: bool = False
) -> Path:
    """A stream of EMG in chunks of 32 samples, and one of markers, whose clock is behind by an offset.

    Args:
        path: the folder.
        gap_s: how much was not recorded, from 3.2 s on.
        jitter_s: SD of the time of a chunk.
        offset_s: of the clock of the markers.
        codes: whether these are numbers, in a stream of triggers.
    """
    (emg_mv, _), rng = recording(), np.random.default_rng(2)
    labels = "<channels><channel><label>FCR</label><unit>microvolts</unit><type>EMG</type></channel></channels>"
    parts = [b"XDF:", chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>")]
    parts.append(header(1, "Amplifier", "EMG", "float32", RATE_HZ, labels))
    parts.append(header(2, "Box", "TTL", "int16", 0.0) if codes else header(2, "Markers", "Markers", "string", 0.0))
    times_s = 1000.0 + np.arange(len(emg_mv)) / RATE_HZ
    for first in range(0, len(emg_mv), 32):
        kept = [n for n in range(first, min(first + 32, len(emg_mv))) if not 0 <= times_s[n] - 1003.2 < gap_s]
        if kept:  # the first sample has a time, and the others follow it at the rate of the stream
            late_s = jitter_s * rng.standard_normal()
            values = np.zeros(len(kept) - 1, [("stamp", "u1"), ("value", "<f4")])
            values["value"] = 1e3 * emg_mv[kept[1:]]
            samples = b"\x08" + struct.pack("<df", times_s[kept[0]] + late_s, 1e3 * emg_mv[kept[0]]) + values.tobytes()
            parts.append(chunk(3, struct.pack("<IBI", 1, 4, len(kept)) + samples))
    for at_s, name in named_events():
        said = struct.pack("<h", 1 + (name == "TMS")) if codes else b"\x01" + bytes([len(name)]) + name.encode()
        content = struct.pack("<Bd", 8, 1000.0 - offset_s + at_s) + said
        parts.append(chunk(3, struct.pack("<IBB", 2, 1, 1) + content))
    for number, behind_s in ((1, 0.0), (2, offset_s)):
        parts += [chunk(4, struct.pack("<Idd", number, at_s, behind_s)) for at_s in np.linspace(1000, 1014, 8)]
        parts.append(chunk(6, struct.pack("<I", number) + b"<?xml version='1.0'?><info></info>"))
    (path / "P01.xdf").write_bytes(b"".join(parts))
    return path / "P01.xdf"


def filled(kind: Any, revision: int = 38, **values: Any) -> bytes:
    """A header of AcqKnowledge 3.7."""
    held = kind.for_revision(revision, "<")._struct_class()  # noqa: SLF001 - bioread writes no files
    for key, value in values.items():
        setattr(held, key, value)
    return bytes(held)


def as_acq(path: Path, *, before: int = 0) -> Path:
    """EMG in whole numbers with a scale and an offset, an empty channel, and event markers, from some samples on."""
    digital = np.round((1e3 * recording()[0] - 7.0) / 0.05).astype("<i2")  # µV
    marks, items = [(0.0, "Segment 1"), (2.0, "Segment 2"), *named_events()], b""  # at 2 s it was stopped, and appended
    for at_s, name in marks:
        text = name.encode() + b"\0"
        items += filled(bh.MarkerItemHeader, lSample=round(at_s * RATE_HZ) - before, nTextLength=len(text) - 1) + text
    size = {"lChanHeaderLen": len(filled(bh.ChannelHeader)), "nVarSampleDivider": 1, "lBufLength": len(digital)}
    graph = {"lVersion": 38, "lExtItemHeaderLen": len(filled(bh.GraphHeader)), "nChannels": 2}
    parts = [
        filled(bh.GraphHeader, dSampleTime=1000 / RATE_HZ, **graph),
        filled(bh.ChannelHeader, szCommentText=b"FCR", szUnitsText=b"uV", dAmplScale=0.05, dAmplOffset=7.0, **size),
        filled(bh.ChannelHeader, szCommentText=b"ECG", szUnitsText=b"mV", dAmplScale=1.0, **size),
        filled(bh.ForeignHeader, nLength=4),
        2 * filled(bh.ChannelDTypeHeader, nSize=2, nType=2),
        np.stack([digital, 0 * digital], axis=1).tobytes(),
        filled(bh.MarkerHeader, lLength=len(items) + 8, lMarkers=len(marks)) + items,
        filled(bh.JournalHeader, tag=(0x44, 0x33, 0x22, 0x11)),
    ]
    (path / "P01.acq").write_bytes(b"".join(parts))
    return path / "P01.acq"


def as_smr(path: Path, *, paused: bool = False) -> Path:
    """A waveform in blocks of whole numbers, a level of the tap, and events of the pulse; ticks are 10 µs."""
    from neo.rawio import spike2rawio  # noqa: PLC0415 - a second, for each worker that only collects

    digital = np.round(1e3 * recording()[0] / (1.25 / 6553.6 * 1e3) - 0.5).astype("<i2")
    ticks = {word: [round(1e5 * at_s) for at_s, name in named_events() if name == word] for word in WORDS.values()}
    wave = [(25 * first, digital[first : first + 8000]) for first in range(0, len(digital), 8000)]
    wave = [
        each for number, each in enumerate(wave) if not (paused and number == 1)
    ]  # from 2 to 4 s, no stimulus but one
    level = np.array([[at, at + 500] for at in ticks["tap"]], "<i4").ravel()  # rises, and falls after 5 ms
    channels = {
        ("FCR", 1): [(at, at + 25 * (len(values) - 1), values) for at, values in wave],
        ("tap", 4): [(level[0], level[-1], level)],
        ("TMS", 3): [(ticks["TMS"][0], ticks["TMS"][-1], np.array(ticks["TMS"], "<i4"))],
    }
    content, heads = bytearray(512 * 4), b""
    for number, ((title, kind), blocks) in enumerate(channels.items()):
        first = len(content) // 512
        for place, (begin, end, values) in enumerate(blocks):
            length = -(-(20 + values.nbytes) // 512)
            after = len(content) // 512 + length if place + 1 < len(blocks) else -1
            block = struct.pack("<iiiihh", -1, after, begin, end, number + 1, len(values)) + values.tobytes()
            content += block.ljust(512 * length, b"\0")
        said = {"firstblock": first, "lastblock": -1, "blocks": len(blocks), "l_chan_dvd": 25, "kind": kind,
                "title": bytes([len(title)]) + title.encode()}  # fmt: skip
        head = np.zeros(1, np.dtype(spike2rawio.channelHeaderDesciption1))
        for key, value in said.items():
            head[key] = value
        more = struct.pack("<ff6sh", 1.25, 0.000095, b"\x02mV", 0) if kind == 1 else struct.pack("<BB", 1, 0)
        heads += (head.tobytes() + more).ljust(140, b"\0")
    top = np.zeros(1, np.dtype(spike2rawio.headerDescription))
    for key, value in {"system_id": 9, "us_per_time": 10, "channels": 3, "dtime_base": 1e-6}.items():
        top[key] = value
    content[: 512 + len(heads)] = top.tobytes().ljust(512, b"\0") + heads
    (path / "P01.smr").write_bytes(content)
    return path / "P01.smr"


def as_nwb(path: Path, *, stamped: bool = False, codes: bool = False) -> Path:
    """A series in µV that is stored in another scale, an annotation for each stimulus, and a series beside it."""
    import pynwb  # noqa: PLC0415 - a second, for each worker that only collects

    file = pynwb.NWBFile(
        session_description="paired stimulation",
        identifier="P01",
        session_start_time=dt.datetime(2026, 1, 31, tzinfo=dt.UTC),
    )
    emg_mv, _ = recording()
    times: Any = (
        {"timestamps": 5.0 + np.arange(len(emg_mv)) / RATE_HZ} if stamped else {"rate": RATE_HZ, "starting_time": 5.0}
    )
    data = np.round((emg_mv - 0.01) * 5e3).astype(np.int16)
    file.add_acquisition(
        pynwb.TimeSeries(name="EMG FCR", data=data, unit="volts", conversion=2e-7, offset=1e-5, **times)
    )
    file.add_acquisition(pynwb.TimeSeries(name="force", data=0 * data, unit="N", rate=RATE_HZ))
    if codes:
        held: Any = {"data": [1 + (name == "TMS") for _, name in named_events()], "unit": "n/a"}
        file.add_acquisition(
            pynwb.TimeSeries(name="TTL", timestamps=[5.0 + at_s for at_s, _ in named_events()], **held)
        )
    for word in () if codes else WORDS.values():
        table = pynwb.event.EventsTable(name=word, description="when it came")
        for at_s, name in named_events():
            if name == word:
                table.add_event(timestamp=5.0 + at_s)
        file.add_events_table(table)
    with pynwb.NWBHDF5IO(path / "P01.nwb", "w") as target:
        target.write(file)
    return path / "P01.nwb"


def as_eeglab_epochs(path: Path) -> Path:
    """Epochs about the pulse in EEGLAB's structure, each with the events within it."""
    emg_mv, stimuli = recording()
    firsts = [round((at_s - 0.3) * RATE_HZ) for at_s, name in stimuli if name == NAMES["pulse"]]
    length = round(0.4 * RATE_HZ)
    within = [
        {"type": name, "latency": n * length + round(at_s * RATE_HZ) - first + 1.0, "epoch": n + 1.0}
        for n, first in enumerate(firsts)
        for at_s, name in stimuli
        if 0 <= at_s * RATE_HZ - first < length
    ]
    data = 1e3 * np.stack([emg_mv[first : first + length] for first in firsts], axis=1)[None]
    eeg = {"data": np.concatenate([0 * data, data]), "srate": RATE_HZ, "nbchan": 2.0, "pnts": float(length),
           "xmin": -0.3, "trials": float(len(firsts)), "event": within,
           "chanlocs": [{"labels": "Cz"}, {"labels": "FCR"}]}  # fmt: skip
    scipy.io.savemat(path / "P01.set", {"EEG": eeg})
    return path / "P01.set"


def without_records(path: Path, *left_out: int) -> Path:
    """An EDF+ file of which some records were not recorded, as EDF+D has it."""
    content = path.read_bytes()
    bdf = content[:1] == b"\xff"
    head, records = int(content[184:192]), int(content[236:244])
    size = (len(content) - head) // records
    kept = b"".join(content[head + n * size :][:size] for n in range(records) if n not in left_out)
    said = b"BDF+D" if bdf else b"EDF+D"
    count = str(records - len(left_out)).ljust(8).encode()
    path.write_bytes(content[:192] + said + content[197:236] + count + content[244:head] + kept)
    return path


RECORDINGS: Mapping[str, Callable[[Path], Path]] = {
    "XDF": as_xdf,
    "XDF with jitter": lambda path: as_xdf(path, jitter_s=0.004),
    "XDF with two clocks": lambda path: as_xdf(path, offset_s=2.5),
    "AcqKnowledge": as_acq,
    "AcqKnowledge whose numbers of samples begin below 0": lambda path: as_acq(path, before=34304),
    "Spike2": as_smr,
    "NWB": as_nwb,
    "NWB with timestamps": lambda path: as_nwb(path, stamped=True),
    "epochs of EEGLAB": as_eeglab_epochs,
    "epochs of FIF": as_epochs,
    "epochs of FIF without metadata": lambda path: as_epochs(path, metadata=False),
    "FIF": as_fif,
    "EEGLAB": as_eeglab,
    "BrainVision": as_brainvision,
    **{f"BrainVision in {unit}": partial(as_brainvision, unit=unit) for unit in ("mv", "microV", "nV")},
    "EDF": as_edf,
    "BDF": lambda path: as_edf(path, bdf=True),
    "EDF in mv": lambda path: as_edf(path, "mv", 1.0),
    "EDF in microV": lambda path: as_edf(path, "microV", 1e3),
    "EDF in nV": lambda path: as_edf(path, "nV", 1e6),
    "BDF in uv": lambda path: as_edf(path, "uv", 1e3, bdf=True),
}


def as_matlab_73(path: Path, **arrays: Any) -> Path:
    """Arrays as MATLAB 7.3 has them: HDF5 behind 512 bytes, with each dimension's order turned round."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, array in arrays.items():
            held = file.create_dataset(name, data=np.atleast_2d(np.asarray(array, dtype=float)).T)
            held.attrs["MATLAB_class"] = np.bytes_("double")
    content = bytearray(path.read_bytes())
    content[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(content)
    return path


def as_statistics(path: Path, label: str = "Peak to peak (µV)", of_isis: Mapping[int, str] = {-1: "single"}) -> Path:
    """A table with labels of columns, which have the units, and of values among the ISIs."""
    frame = pd.DataFrame({"isi": [*ISIS_MS, -1.0], "mep": [1e3 * mep for mep in (*MEPS_MV, 0.3)]})
    labels = {float(isi) if path.suffix == ".sav" else isi: text for isi, text in of_isis.items()}
    said: dict[str, Any] = {"column_labels": ["Interval (ms)", label], "variable_value_labels": {"isi": labels}}
    if path.suffix == ".dta":
        frame["isi"] = frame["isi"].astype(int)
        pyreadstat.write_dta(frame, str(path), **said)
    else:
        pyreadstat.write_sav(frame, str(path), **said)
    return path


def require_as_written(person: Delivered) -> None:
    pairs = [trial for trial in person.trials if trial.isi_ms is not None]
    assert [trial.isi_ms for trial in pairs] == pytest.approx(ISIS_MS, abs=1000 / RATE_HZ)
    assert [trial.mep_mv for trial in pairs] == pytest.approx(MEPS_MV, rel=0.01)
    assert [trial.is_control for trial in person.trials] == [False] * 5 + [True]
    assert all(trial.told for trial in person.trials)
