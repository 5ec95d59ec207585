#!/usr/bin/env bash
# lsl-xdf-reader exports streams of one recording under the name of the next, and of two streams of one name the last only.
#
# Expected: parse_xdf(folder) writes one table for each stream of each XDF file, named after the file and the stream.
# Seen: the table of streams is kept from file to file and written again for each: the second recording's folder holds the
#   EMG of the first if the second has none of that name. Within a file streams are kept by "name - type", so that of two
#   devices of one name (two amplifiers, two participants) the last one only is written. Both are reported as "DONE!".
# Hurts: one person's EMG is analysed as another's, or a participant is missing from a recording of two.
# (Its dialogue is for a screen: tkinter is replaced. The files are written by the script.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check lsl-xdf-reader==0.1 pyxdf==1.17.5 numpy==2.4.6
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import csv
import importlib.metadata as meta
import struct
import sys
from pathlib import Path
from unittest.mock import MagicMock

for name in ("tkinter", "tkinter.filedialog"):
    sys.modules[name] = MagicMock()
from lsl_xdf_reader import parse_xdf


def chunk(tag, content):
    return struct.pack("<BIH", 4, len(content) + 2, tag) + content


def write(path, streams):
    with open(path, "wb") as file:
        file.write(b"XDF:" + chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>"))
        for number, (name, value) in enumerate(streams, 1):
            head = (
                f"<?xml version='1.0'?><info><name>{name}</name><type>EMG</type><channel_count>1</channel_count><hostname>lab</hostname>"
                "<nominal_srate>100</nominal_srate><channel_format>double64</channel_format><created_at>1</created_at><desc><channels><channel>"
                "<label>FDI</label><unit>mV</unit></channel></channels></desc></info>"
            )
            body = b"".join(struct.pack("<Bdd", 8, 100 + at / 100, value) for at in range(200))
            foot = (
                "<?xml version='1.0'?><info><first_timestamp>100</first_timestamp><last_timestamp>101.99</last_timestamp>"
                "<sample_count>200</sample_count></info>"
            )
            stream = struct.pack("<I", number)
            file.write(chunk(2, stream + head.encode()) + chunk(3, stream + struct.pack("<BI", 4, 200) + body))
            file.write(b"".join(chunk(4, stream + struct.pack("<dd", 100 + time, 0)) for time in (0, 2)) + chunk(6, stream + foot.encode()))


def read(folder):
    found = {}
    for path in sorted(Path(folder).glob("*/*_allExp.csv")):
        with open(path) as file:
            rows = list(csv.reader(file, quotechar="|"))
        found.setdefault(path.parent.name.split("_")[0], []).append((path.name.split(" - ")[0], float(rows[1][1])))
    return found


Path("persons").mkdir()
for person, value in (("anna", 1.0), ("bert", 2.0)):
    write(f"persons/{person}.xdf", [(f"EMG{person}", value)])
parse_xdf("persons")
persons = read("persons")
print("anna has EMGanna (1.0), bert has EMGbert (2.0); exported:", persons)
Path("pair").mkdir()
write("pair/pair.xdf", [("Amplifier", 1.0), ("Amplifier", 2.0)])
parse_xdf("pair")
pair = read("pair")
print("a recording with two streams named Amplifier, 1.0 and 2.0; exported:", pair)
print("lsl-xdf-reader", meta.version("lsl-xdf-reader"), "pyxdf", meta.version("pyxdf"))
mixed = sorted(len(streams) for streams in persons.values())
still = mixed == [1, 2] and pair == {"pair": [("Amplifier", 2.0)]}
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
