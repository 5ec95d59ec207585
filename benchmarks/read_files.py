"""What it takes to read large files: a recording of an hour, and a table of many people.

    python -m benchmarks.read_files > benchmarks/results/read_files.md

A recording of 8 channels at 5,000 Hz is written in a temporary folder, in pieces, in several formats, with a tap and a
pulse every 6 s. Another process reads its trials, one for each format, by one of its own: the time of the processor is
that of both, and so is the memory, the most of each added up, the imports of Python and of the format's library
included; of the table, until nothing is left but to estimate. Needs the extras import, import-nwb and test, and about
4 GB of disk.
"""

from __future__ import annotations

import argparse
import json
import resource
import struct
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.provenance import command_of, made_with
from benchmarks.quick import understood

RATE_HZ, CHANNELS, EVERY_S = 5000, 8, 6
NAMES = ["EMG FCR", *(f"EEG {number}" for number in range(2, CHANNELS + 1))]


def stimuli(seconds: int) -> list[tuple[float, str]]:
    """When taps and pulses come [s], in whole samples."""
    isis_ms = np.random.default_rng(1).integers(20, 200, seconds // EVERY_S - 1)
    taps_s = [float(EVERY_S * (number + 1)) for number in range(len(isis_ms))]
    pairs = zip(taps_s, isis_ms.tolist(), strict=True)
    return [event for tap_s, isi_ms in pairs for event in ((tap_s, "tap"), (tap_s + isi_ms / 1e3, "TMS"))]


def seconds_of(seconds: int) -> Iterator[np.ndarray]:
    """The signals of a second each [µV], shape (rate, channels): noise, and an MEP of 1 mV after each pulse."""
    rng, wave = np.random.default_rng(2), 500 * np.sin(np.linspace(0, 2 * np.pi, 60))
    begins = {round((at_s + 0.02) * RATE_HZ) for at_s, name in stimuli(seconds) if name == "TMS"}
    by_second = {begin // RATE_HZ: begin % RATE_HZ for begin in begins}
    noise = rng.normal(0, 2, (RATE_HZ, CHANNELS))
    for second in range(seconds):
        values = np.roll(noise, second % RATE_HZ, axis=0)
        if (at := by_second.get(second)) is not None:
            values[at : at + 60, 0] += wave[: RATE_HZ - at]
        yield values


def as_edf(folder: Path, seconds: int) -> Path:
    """EDF+, in whole numbers of .1 µV; a record a second, which has its annotations."""
    size = 128
    labels = [*NAMES, "EDF Annotations"]
    columns = [
        (labels, 16), ([""] * 9, 80), (["uV"] * 8 + [""], 8), (["-3276.8"] * 8 + ["-1"], 8),
        (["3276.7"] * 8 + ["1"], 8), (["-32768"] * 9, 8), (["32767"] * 9, 8), ([""] * 9, 80),
        ([str(RATE_HZ)] * 8 + [str(size // 2)], 8), ([""] * 9, 32),
    ]  # fmt: skip
    heads = [("0", 8), ("X X X X", 80), ("Startdate 31-JAN-2026 X X X", 80), ("31.01.26", 8), ("09.00.00", 8),
             (str(256 * 10), 8), ("EDF+C", 44), (str(seconds), 8), ("1", 8), ("9", 4)]  # fmt: skip
    head = "".join(text.ljust(width) for text, width in heads)
    head += "".join(text.ljust(width) for texts, width in columns for text in texts)
    events = stimuli(seconds)
    with (folder / "P01.edf").open("wb") as file:
        file.write(head.encode("ascii"))
        for second, values in enumerate(seconds_of(seconds)):
            file.write(np.round(10 * values.T).astype("<i2").tobytes())
            noted = [f"+{at_s:.4f}\x14{name}\x14\0" for at_s, name in events if second <= at_s < second + 1]
            file.write(f"+{second}\x14\x14\0{''.join(noted)}".encode().ljust(size, b"\0"))
    return folder / "P01.edf"


def as_brainvision(folder: Path, seconds: int) -> Path:
    """BrainVision, in single precision."""
    with (folder / "P01.eeg").open("wb") as file:
        for values in seconds_of(seconds):
            file.write(values.astype("<f4").tobytes())
    marks = [
        f"Mk{number}=Comment,{name},{round(at_s * RATE_HZ) + 1},1,0"
        for number, (at_s, name) in enumerate(stimuli(seconds), 1)
    ]
    version = "Brain Vision Data Exchange {} File, Version 1.0\n"
    (folder / "P01.vmrk").write_text(
        version.format("Marker")
        + "[Common Infos]\nCodepage=UTF-8\nDataFile=P01.eeg\n[Marker Infos]\n"
        + "\n".join(marks),
        encoding="utf-8",
    )
    channels = "\n".join(f"Ch{number}={name},,1,µV" for number, name in enumerate(NAMES, 1))
    (folder / "P01.vhdr").write_text(
        f"{version.format('Header')}[Common Infos]\nCodepage=UTF-8\nDataFile=P01.eeg\nMarkerFile=P01.vmrk\n"
        f"DataFormat=BINARY\nDataOrientation=MULTIPLEXED\nNumberOfChannels={CHANNELS}\n"
        f"SamplingInterval={1e6 / RATE_HZ:g}\n[Binary Infos]\nBinaryFormat=IEEE_FLOAT_32\n"
        f"[Channel Infos]\n{channels}\n",
        encoding="utf-8",
    )
    return folder / "P01.vhdr"


def as_fif(folder: Path, seconds: int) -> Path:
    """FIF, in single precision."""
    import mne  # noqa: PLC0415 - heavy, and an extra

    path = folder / "P01_raw.fif"
    mne.io.read_raw(as_brainvision(folder, seconds), verbose="ERROR").save(path, overwrite=True, verbose="ERROR")
    return path


def as_nwb(folder: Path, seconds: int) -> Path:
    """NWB, in whole numbers of .1 µV."""
    import datetime as dt  # noqa: PLC0415 - of this format alone

    import pynwb  # noqa: PLC0415 - heavy, and an extra

    start = dt.datetime(2026, 1, 31, tzinfo=dt.UTC)
    file = pynwb.NWBFile(session_description="made up", identifier="P01", session_start_time=start)
    data = np.concatenate([np.round(10 * values).astype(np.int16) for values in seconds_of(seconds)])
    file.add_acquisition(
        pynwb.TimeSeries(name="EMG FCR", data=data, unit="volts", conversion=1e-7, rate=float(RATE_HZ))
    )
    for word in ("tap", "TMS"):
        table = pynwb.event.EventsTable(name=word, description="when it came")
        for at_s, name in stimuli(seconds):
            if name == word:
                table.add_event(timestamp=at_s)
        file.add_events_table(table)
    with pynwb.NWBHDF5IO(folder / "P01.nwb", "w") as held:
        held.write(file)
    return folder / "P01.nwb"


def as_xdf(folder: Path, seconds: int) -> Path:
    """XDF, in single precision; a chunk a second, whose first sample has a time."""

    def chunk(tag: int, content: bytes) -> bytes:
        return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content

    def head(number: int, name: str, kind: str, count: int, form: str, rate_hz: int, more: str = "") -> bytes:
        said = f"<name>{name}</name><type>{kind}</type><channel_count>{count}</channel_count>"
        said += f"<nominal_srate>{rate_hz}</nominal_srate><channel_format>{form}</channel_format><desc>{more}</desc>"
        return chunk(2, struct.pack("<I", number) + f'<?xml version="1.0"?><info>{said}</info>'.encode())

    each = "".join(
        f"<channel><label>{name}</label><unit>microvolts</unit><type>{name[:3]}</type></channel>" for name in NAMES
    )
    with (folder / "P01.xdf").open("wb") as file:
        file.write(b"XDF:" + chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>'))
        file.write(head(1, "Amplifier", "EMG", CHANNELS, "float32", RATE_HZ, f"<channels>{each}</channels>"))
        file.write(head(2, "Markers", "Markers", 1, "string", 0))
        for second, values in enumerate(seconds_of(seconds)):
            rows = np.zeros(RATE_HZ, [("stamp", "u1"), ("values", "<f4", CHANNELS)])
            rows["values"] = values
            stamped = b"\x08" + struct.pack("<d", second) + rows.tobytes()[1:]
            file.write(chunk(3, struct.pack("<IBI", 1, 4, RATE_HZ) + stamped))
        for at_s, name in stimuli(seconds):
            text = struct.pack("<Bd", 8, at_s) + b"\x01" + bytes([len(name)]) + name.encode()
            file.write(chunk(3, struct.pack("<IBB", 2, 1, 1) + text))
    return folder / "P01.xdf"


def as_table(folder: Path, rows: int) -> Path:
    """CSV: a hundred rows of each person."""
    rng, number = np.random.default_rng(3), np.arange(rows)
    isis_ms, meps_mv = rng.integers(10, 300, rows), rng.lognormal(-1, 0.5, rows)
    lines = zip(number // 100, number % 100 + 1, isis_ms, meps_mv, strict=True)
    text = "".join(f"P{person:04d},{trial},{isi},{mep:.4f},,FCR\n" for person, trial, isi, mep in lines)
    (folder / "all.csv").write_text(f"subject,trial,isi_ms,mep_mv,exclude,muscle\n{text}", encoding="utf-8")
    return folder / "all.csv"


RECORDINGS: dict[str, Callable[[Path, int], Path]] = {
    "EDF+": as_edf, "BrainVision": as_brainvision, "FIF": as_fif, "NWB": as_nwb, "XDF": as_xdf,
}  # fmt: skip


def read(path: str) -> None:
    """Read a file as isiw analyse does, and print what that took; the whole process is measured."""
    warnings.simplefilter("ignore")
    began_s = time.perf_counter()
    import isiw  # noqa: PLC0415 - its import is measured

    channels = {} if path.endswith(".csv") else {"emg": "EMG FCR 1" if path.endswith(".nwb") else "EMG FCR"}
    layout = isiw.existing.Layout(reference="impact", channels=channels)
    people = isiw.existing.batch.read_files([path], isiw.existing.batch.Way(layout))
    used, read = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    trials = [trial for one in people for trial in one.delivered.trials]
    found = {
        "people": len(people), "trials": len(trials), "count": sum(trial.told for trial in trials),
        "cpu_s": sum(one.ru_utime + one.ru_stime for one in (used, read)), "mb": _most_mb() + read.ru_maxrss / 1024,
        "clock_s": time.perf_counter() - began_s,
        "mep_mv": float(np.median([trial.mep_mv or 0.0 for trial in trials])),
    }  # fmt: skip
    print(json.dumps(found))


def _most_mb() -> float:
    """The most memory that this process had [MB]; the usage that the system sums up begins with its parent's."""
    said = Path("/proc/self/status").read_text(encoding="ascii")
    return float(next(line for line in said.splitlines() if line.startswith("VmHWM")).split()[1]) / 1024


def measured(path: Path) -> dict[str, float]:
    """What another process took to read a file."""
    command = [sys.executable, "-m", "benchmarks.read_files", "--read", str(path)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - this script
    if ended.returncode:
        raise SystemExit(ended.stderr)
    found: dict[str, float] = json.loads(ended.stdout.splitlines()[-1])
    return found


def main() -> None:
    """Write each file, have it read, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=int, default=60)
    parser.add_argument("--rows", type=int, default=100_000)
    parser.add_argument("--formats", default=",".join(RECORDINGS))
    parser.add_argument("--read", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.read:
        read(arguments.read)
        return
    print("# Reading large files\n")
    print(f"- command: `{command_of('read_files')}`")
    print(f"- {made_with('numpy', 'mne', 'pynwb', 'pyxdf')}\n")
    size = 8 * RATE_HZ * CHANNELS * 60 * arguments.minutes / 1e9
    print(f"{arguments.minutes} min of {CHANNELS} channels at {RATE_HZ} Hz: {size:.2f} GB in double precision.\n")
    print("| file | size on disk [MB] | trials, of which count | median MEP [mV] | processor [s] | most memory [MB] |")
    print("|---|---|---|---|---|---|")
    for name in arguments.formats.split(","):
        with tempfile.TemporaryDirectory() as folder:
            path = RECORDINGS[name](Path(folder), 60 * arguments.minutes)
            data = path.with_suffix(".eeg") if name == "BrainVision" else path
            one = measured(path)
            count = f"{one['trials']:.0f}, {one['count']:.0f}"
            print(
                f"| {name} | {data.stat().st_size / 1e6:.0f} | {count} | {one['mep_mv']:.3f} | {one['cpu_s']:.1f} "
                f"| {one['mb']:.0f} |",
                flush=True,
            )
    with tempfile.TemporaryDirectory() as folder:
        one = measured(as_table(Path(folder), arguments.rows))
    print(
        f"\nA table of {arguments.rows:,} rows and {one['people']:,.0f} people: {one['cpu_s']:.1f} s of the processor, "
        f"{one['clock_s']:.1f} s by the clock of a computer that did other things besides, and {one['mb']:.0f} MB "
        "until nothing is left but to estimate, imports included."
    )


if __name__ == "__main__":
    understood("read_files", prints=True)
    main()
