"""Analyse recorded EMG sweeps from beginning to end, and put what is said into docs/your-data.md.

    python docs/analyse_recorded.py RECORDINGS DIR

makes `P01_raw.fif` in a new folder DIR: recorded sweeps of MEPFeatX, which lie in the folder RECORDINGS, with the MEPs
of a simulated person in them, one behind the other, with events. Then it analyses the file as `isiw analyse` does.
Needs the extra import.
"""

from __future__ import annotations

import sys
from pathlib import Path

import mne
import numpy as np

import isiw
from isiw.devices.simulated import load_recordings
from isiw.existing import Layout, read_people

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "your-data.md"
SPACE = isiw.DesignSpace(0, 200, 5, reference="impact")
MARKS = ("<!-- analysis: begin. Made by: python docs/analyse_recorded.py -->\n", "<!-- analysis: end -->")


def written(recordings_folder: Path, folder: Path, trials: int = 60, seed: int = 2) -> Path:
    """A recording of sweeps, half a second apart."""
    responder = isiw.subjects.cohort("recruitment", 1, seed)[0].begin(seed)
    recordings = load_recordings(recordings_folder)
    device = isiw.RecordedPerson(lambda isi_ms: responder.respond(isi_ms, "impact"), "impact", recordings, seed)
    order = np.random.default_rng(seed).permutation(np.resize(SPACE.grid_ms, trials)).tolist()
    pieces, events, at_s = [], [], 0.0
    for number, isi_ms in enumerate(order):
        sweep = device.answer(isiw.Stimulus(number, isi_ms))
        emg, rate_hz = sweep.channels["emg"], sweep.channels["emg"].rate_hz
        pulse_s = at_s + (sweep.t_tms_ms - emg.t0_ms) / 1e3
        events += [(pulse_s - isi_ms / 1e3, "tap"), (pulse_s, "tms")]
        pieces += [emg.values, np.full(round(0.5 * rate_hz), emg.values[-1])]
        at_s += (len(pieces[-2]) + len(pieces[-1])) / rate_hz
    info = mne.create_info(["ECR"], rate_hz, ["emg"])
    raw = mne.io.RawArray(1e-3 * np.concatenate(pieces)[None], info, verbose="ERROR")
    onsets, names = zip(*sorted(events), strict=True)
    raw.set_annotations(mne.Annotations(onsets, 0.0, names))
    raw.save(folder / "P01_raw.fif", verbose="ERROR")
    return folder / "P01_raw.fif"


def main() -> None:
    """Write the recording, log and page into the folder that is named, and what is said into the page of the docs."""
    recordings_folder, folder = map(Path, sys.argv[1:])
    folder.mkdir(parents=True)
    (person,) = read_people(written(recordings_folder, folder), Layout(reference="impact"), subject="P01")
    analysis = isiw.existing.analysed(person, isiw.make_strategy(space=SPACE, seed=2))
    analysis.to_log(folder / "P01.mcap")
    analysis.plot(folder / "P01.png")
    analysis.report(folder / "P01.html")
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    truth = isiw.subjects.cohort("recruitment", 1, 2)[0].window(SPACE)
    said = "\n>\n".join(f"> {line}" for line in f"{analysis}".splitlines())
    said += f"\n\nThe made-up window is {truth}.\n"
    PAGE.write_text(f"{before}{MARKS[0]}{said}{MARKS[1]}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
