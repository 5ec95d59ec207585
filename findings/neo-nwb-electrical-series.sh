#!/usr/bin/env bash
# neo refuses every NWB file that holds an ElectricalSeries, the type that the NWB schema has for electrophysiology.
#
# Expected: NWBIO is neo's reader of "Neurodata Without Borders 2" (its documentation), and ElectricalSeries is
#   the acquisition type of the NWB core schema (nwb.ecephys) for voltages from electrodes.
# Seen: neo copies each field of the series into annotations and its `electrodes` field (a DynamicTableRegion) is no type
#   that an annotation may have: ValueError "Invalid annotation". The same numbers in a plain TimeSeries are read.
# Hurts: EMG or EEG that was saved with pynwb as the schema wants it cannot be opened with neo at all,
#   nor can a file of which one of many series is an ElectricalSeries: the other series are lost with it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check neo==0.14.6 pynwb==4.2.0 hdmf==6.2.0 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import datetime as dt
import importlib.metadata as meta
import sys

import neo
import numpy as np
import pynwb
from pynwb.ecephys import ElectricalSeries


def write(path, as_electrical):
    nwb = pynwb.NWBFile("a session", path, dt.datetime(2026, 1, 1, tzinfo=dt.timezone.utc))
    emg = np.ones((100, 1))
    if as_electrical:
        group = nwb.create_electrode_group("surface", "EMG", "hand", nwb.create_device("amplifier"))
        nwb.add_electrode(group=group, location="FDI")
        region = nwb.create_electrode_table_region([0], "the muscle")
        nwb.add_acquisition(ElectricalSeries(name="emg", data=emg, electrodes=region, rate=1000.0))
    else:
        nwb.add_acquisition(pynwb.TimeSeries(name="emg", data=emg, unit="volts", rate=1000.0))
    with pynwb.NWBHDF5IO(path, "w") as io:
        io.write(nwb)
    problems = pynwb.validate(path=path)
    print(path, "pynwb's validator finds", len(problems), "problems")
    return not problems


def read(path):
    try:
        blocks = neo.io.NWBIO(path, "r").read_all_blocks()
    except ValueError as error:
        return f"ValueError: {error}"
    return [signal.shape for block in blocks for segment in block.segments for signal in segment.analogsignals]


valid = write("electrical.nwb", True) and write("plain.nwb", False)
electrical, plain = read("electrical.nwb"), read("plain.nwb")
print("ElectricalSeries:", electrical, "\nTimeSeries:", plain)
print("neo", meta.version("neo"), "pynwb", meta.version("pynwb"), "hdmf", meta.version("hdmf"))
still = valid and "Invalid annotation" in str(electrical) and plain == [(100, 1)]
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
