#!/usr/bin/env bash
# pupyC3D reads the integers of a C3D file without their sign: a marker at -100 mm is at +6454 mm, an EMG of -300 is 65236.
#
# Expected: its documentation: "Full C3D support". In a C3D file whose scale factor is positive, coordinates and analog samples are signed
#   16-bit integers (ANALOG:FORMAT is SIGNED unless it says UNSIGNED); the package c3d writes and reads them so.
# Seen: coordinates, analog samples and 16-bit parameters (among them ANALOG:OFFSET, which may be negative) are read as unsigned ones. All
#   negative values are 65536 units too large; positive values, and files of floats, are right.
# Hurts: integer files are the usual ones of older systems. A marker jumps by 6.5 m where it crosses an axis; of EMG and forces
#   one half is wrong.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps pupyC3D==0.1.3 c3d==0.6.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import c3d
import numpy as np
from pupyC3D import C3DFile

seen = {}
for what, scale in (("integers", 0.1), ("floats", -0.1)):
    writer = c3d.Writer(point_rate=100.0, analog_rate=200.0, point_scale=scale)
    writer.add_frames([(np.array([[-100.0, 50, 10, 0, 0], [200, 50, 10, 0, 0]]), np.array([[-300.0, 300]]))] * 10)
    writer.set_point_labels(["C7", "TOE"])
    writer.set_analog_labels(["FDI"])
    writer.set_analog_general_scale(1.0)
    writer.set_analog_scales([1.0])
    writer.set_analog_offsets([0])
    with open("trial.c3d", "wb") as file:
        writer.write(file)
    with open("trial.c3d", "rb") as file:
        _, points, analog = next(c3d.Reader(file).read_frames())
    read = C3DFile("trial.c3d").data
    seen[what] = [float(value) for value in (points[0, 0], analog[0, 0], read["POINTS"]["C7"][0, 0], read["ANALOGS"]["FDI"][0, 0])]
    print(f"{what}: by c3d x {seen[what][0]:.0f} mm and EMG {seen[what][1]:.0f}, by pupyC3D {seen[what][2]:.0f} mm and {seen[what][3]:.0f}")
print("pupyC3D", meta.version("pupyC3D"), "c3d", meta.version("c3d"))
by_c3d, found = np.array(seen["integers"][:2]), np.array(seen["integers"][2:])
still = np.allclose(by_c3d, [-100, -300], atol=0.2) and np.allclose(found - by_c3d, [6553.6, 65536])
still &= np.allclose(seen["floats"], [-100, -300, -100, -300], atol=0.2)
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
