#!/usr/bin/env bash
# neo reads only NWB files whose conversion is a power of ten with a name: the example of the NWB schema is refused.
#
# Expected: NWB core schema, TimeSeries.data: `conversion` is any scalar by which stored numbers are multiplied to come to
#   the unit. The schema's own example is a 16-bit converter of ±2.5 V behind a gain of 8000, about 9.5367e-9.
# Seen: neo looks for an SI prefix of exactly that size (1e-3, 1e-6, ...) instead of multiplying. If there is none, the
#   whole file is refused: ValueError "Can't handle this conversion factor", the other series with it.
# Hurts: raw integers of an amplifier, stored with the scale of its ADC, as the schema recommends, cannot be read
#   with neo; only files whose writer had converted to volts or whole prefixes beforehand can.
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


def outcome(conversion):
    nwb = pynwb.NWBFile("a session", str(conversion), dt.datetime(2026, 1, 1, tzinfo=dt.timezone.utc))
    stored = np.arange(100, dtype=np.int16)[:, None]
    nwb.add_acquisition(pynwb.TimeSeries(name="emg", data=stored, unit="volts", conversion=conversion, rate=5000.0))
    path = f"{conversion:.5g}.nwb"
    with pynwb.NWBHDF5IO(path, "w") as io:
        io.write(nwb)
    problems = len(pynwb.validate(path=path))
    try:
        signal = neo.io.NWBIO(path, "r").read_all_blocks()[0].segments[0].analogsignals[0]
        answer = f"last value {float(signal.rescale('V').magnitude.ravel()[-1]):.3e} V"
    except ValueError as error:
        answer = f"ValueError: {error}"
    print(f"conversion {conversion:.5g}: {problems} problems found by pynwb's validator; neo: {answer}")
    return answer


refused = [outcome(value) for value in (2.5 / 32768 / 8000, 0.5e-6)]
read = outcome(1e-6)
print("neo", meta.version("neo"), "pynwb", meta.version("pynwb"))
still = all("conversion factor" in answer for answer in refused) and read == "last value 9.900e-05 V"
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
