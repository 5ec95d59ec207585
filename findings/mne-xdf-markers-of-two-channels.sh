#!/usr/bin/env bash
# mne-xdf leaves out marker streams of two channels, even one that is asked for.
#
# Expected: docstring of read_raw_xdf: a marker stream is one with a nominal sampling frequency of 0 Hz; marker_ids is a list of
#   the marker streams to load, or None for all of them. XDF's streams of texts may have several channels.
# Seen: a stream of markers that says both the stimulus and its condition, each in a channel of its own, makes no annotation.
#   With marker_ids of this stream there is none either. Nothing is raised or warned. One channel makes four annotations.
# Hurts: a recording looks as if nobody had been stimulated; beside another stream of markers, such as of a keyboard, one
#   kind of event is missing and no one sees it.
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne-xdf==0.3.0 pyxdf==1.17.5 mne==1.13.2 numpy==2.4.6 scipy==1.17.1
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import importlib.metadata as meta
import struct
import sys
import warnings

import mne_xdf
import pyxdf

TIMES = [2.0, 4.0, 6.0, 8.0]


def chunk(tag, content):
    return struct.pack("<BIH", 4, len(content) + 2, tag) + content


def stream(number, name, rate, form, samples, channels=1):
    head = (
        f"<?xml version='1.0'?><info><name>{name}</name><type>x</type><channel_count>{channels}</channel_count>"
        f"<nominal_srate>{rate}</nominal_srate><channel_format>{form}</channel_format></info>"
    )
    body = b"".join(struct.pack("<Bd", 8, 100 + time) + value for time, value in samples)
    clock = b"".join(chunk(4, struct.pack("<Idd", number, 100 + time, 0)) for time in (0, 5, 10))
    count = struct.pack("<IBI", number, 4, len(samples))
    return chunk(2, struct.pack("<I", number) + head.encode()) + chunk(3, count + body) + clock


tms, left = (struct.pack("<BB", 1, len(text)) + text for text in (b"tms", b"left"))
emg = [(at / 1000, struct.pack("<f", 0)) for at in range(10_000)]
with open("session.xdf", "wb") as file:
    file.write(b"XDF:" + chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>"))
    file.write(stream(1, "EMG", 1000, "float32", emg) + stream(2, "one", 0, "string", [(time, tms) for time in TIMES]))
    file.write(stream(3, "two", 0, "string", [(time, tms + left) for time in TIMES], channels=2))
two = next(one for one in pyxdf.load_xdf("session.xdf")[0] if one["info"]["name"][0] == "two")
print("pyxdf reads", two["time_series"])
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    seen = {ids: len(mne_xdf.read_raw_xdf("session.xdf", [1], list(ids) or None).annotations) for ids in ((), (2,), (3,))}
for ids, count in seen.items():
    print(f"marker_ids={list(ids) or None}: {count} annotations")
print("warnings:", [str(warning.message) for warning in caught])
print("mne-xdf", meta.version("mne-xdf"), "pyxdf", meta.version("pyxdf"), "mne", meta.version("mne"))
still = two["time_series"] == [["tms", "left"]] * 4 and seen == {(): 4, (2,): 4, (3,): 0} and not caught
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
