#!/usr/bin/env bash
# mvnx takes values by their place in a frame, not by their name: if one kind was not exported, each later one has the next one's.
#
# Expected: README: an MVNX file of Xsens' MVN is read, and each modality (position, velocity, jointAngle ...) is an attribute. In
#   the file each kind is a named element, and which of them are there is chosen when it is exported and differs by version.
# Seen: the fourth element of each frame is called the acceleration, whatever it is. In a file without accelerations the angular
#   velocity is read as acceleration, and the joint angles in the other order of axes as joint angles. Names are never looked at.
# Hurts: kinematics from smaller exports: a knee angle of 60 degrees is 5, and an acceleration is a velocity, without a warning.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps mvnx==0.2
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys

import mvnx

kinds = {  # in the order of MVN's files, with one value that tells them apart
    "orientation": 1, "position": 2, "velocity": 3, "acceleration": 4, "angularVelocity": 0.7, "angularAcceleration": 0.8,
    "footContacts": 0, "sensorFreeAcceleration": 9, "sensorMagneticField": 0.5, "sensorOrientation": 1, "jointAngle": 60,
    "jointAngleXZY": 5, "jointAngleErgo": 30, "centerOfMass": 0.9,
}  # fmt: skip


def write(name, left_out):
    """Two frames after the three poses that each file begins with."""
    values = "".join(f"<{kind}>{value} 0 0</{kind}>" for kind, value in kinds.items() if kind not in left_out)
    pose = '<frame time="0" index="" tc="" ms="0" type="tpose"><orientation>1 0 0 0</orientation><position>0 0 0</position></frame>'
    frame = '<frame time="{0}" index="{0}" tc="" ms="{0}" type="normal">' + values + "</frame>"
    with open(name, "w") as file:
        file.write(
            '<mvnx version="4"><mvn version="2018" build="1"/><comment/><subject label="P01" frameRate="240" segmentCount="1" '
            'recDate="" configuration="FullBody" userScenario="single"><comment/><segments><segment id="1" label="Pelvis"/></segments>'
            "<sensors/><joints/><ergonomicJointAngles/><footContactDefinition/><frames>"
            + pose * 3 + frame.format(0) + frame.format(4) + '</frames></subject><securityCode code="x"/></mvnx>'
        )  # fmt: skip
    return mvnx.load(name)


seen = {}
for name, left_out in (("everything", ()), ("no acceleration", ("acceleration",)), ("no sensors' values", ("sensorMagneticField",))):
    data = write("one.mvnx", left_out)
    read = {kind: getattr(data, kind) for kind in ("velocity", "acceleration", "jointAngle", "centerOfMass")}
    seen[name] = {kind: float(one[0, 0]) if len(one) else None for kind, one in read.items()}
    print(f"exported with {name}: {seen[name]}; in the file {({kind: kinds[kind] for kind in read if kind not in left_out})}")
print("mvnx", meta.version("mvnx"))
still = seen["everything"] == {"velocity": 3, "acceleration": 4, "jointAngle": 60, "centerOfMass": 0.9}
still &= seen["no acceleration"] == {"velocity": 3, "acceleration": 0.7, "jointAngle": 5, "centerOfMass": None}
still &= seen["no sensors' values"]["jointAngle"] == 5
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
