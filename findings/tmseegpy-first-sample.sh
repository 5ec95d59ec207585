#!/usr/bin/env bash
# tmseegpy leaves the TMS pulse in a cropped recording, and replaces clean data elsewhere.
#
# Expected: docstring of fix_tms_artifact: it removes the artefact about each event of an MNE events array (or of
#   mne.find_events, if none is given). MNE's documentation of events: their samples count from the start of the acquisition,
#   that is from first_samp, which is not zero after a crop and in most files of a MEG system.
# Seen: the numbers are taken for indices into the data. In a recording cropped by 4.5 s every pulse stays as it was, and
#   7 ms of good data 4.5 s after each are replaced by those before, in all channels; without a crop all pulses are
#   removed. detect_tms_artifacts returns events "in MNE format" that count from the crop.
# Hurts: a recording of which the preparation was cut off: pulses of millivolts go on to ICA and filters, which smear them
#   over the evoked potential. Nothing is raised or warned.
# (tmseegpy is installed without its windows and classifiers, which this module does not need.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    mne==1.13.2 mne-faster==1.2.2 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2 scikit-learn==1.9.1 tensorly==0.10.0 \
    tqdm==4.70.1 pandas==3.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps tmseegpy==0.2.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import importlib.util
import sys
import types

import mne
import numpy as np

mne.set_log_level("error")
package = types.ModuleType("tmseegpy")  # its own __init__ opens the windows' libraries
package.__path__ = list(importlib.util.find_spec("tmseegpy").submodule_search_locations)
sys.modules["tmseegpy"] = package
from tmseegpy.preproc import TMSEEGPreprocessor, detect_tms_artifacts

RATE = 1000
eeg = np.random.default_rng(1).normal(0, 1e-6, (2, 20 * RATE))
stim = np.zeros((1, 20 * RATE))
for second in range(2, 20, 3):
    eeg[:, second * RATE : second * RATE + 3] += 5e-3
    stim[0, second * RATE : second * RATE + 5] = 1
info = mne.create_info(["Cz", "Pz", "STI 014"], RATE, ["eeg", "eeg", "stim"])
seen = {}
for crop_s in (0, 4.5):
    raw = mne.io.RawArray(np.vstack([eeg, stim]), info.copy()).crop(tmin=crop_s)
    events = mne.find_events(raw)
    before = raw.get_data("eeg")[0]
    cleaner = TMSEEGPreprocessor(raw)
    cleaner.fix_tms_artifact(events=events, verbose=False)
    after = cleaner.raw.get_data("eeg")[0]
    left = int(np.sum(after > 1e-3)) // 3
    good_changed = int(np.sum((before != after) & (before < 1e-3)))
    moved = events[:, 0] - detect_tms_artifacts(raw.pick("eeg"), threshold_std=5)[:, 0]
    seen[crop_s] = (len(events), left, sorted(set(moved.tolist())))
    print(f"cropped by {crop_s} s: {len(events)} pulses, {left} left, {good_changed} good samples changed")
print("tmseegpy", meta.version("tmseegpy"), "mne", mne.__version__)
still = seen == {0: (6, 0, [0]), 4.5: (5, 5, [4500])}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
