#!/usr/bin/env bash
# MNE cannot read the GDF files that BioSig, the format's own library, writes: a bare AssertionError.
#
# Expected: "GDF - a general dataformat for biosignals" (Schlögl, arXiv cs/0608052): the header's length is stated at byte
#   184 in blocks of 256 bytes, and from version 2.10 on may hold a third, optional part (tags, lengths, values) after the
#   fixed header and the channels' headers. A reader goes on at the stated length.
# Seen: MNE asserts that the header ends where the channels' headers end. BioSig's converters always write a third part,
#   so save2gdf's (2.51) and biosig2gdf's (3.00) files raise AssertionError, without a text, for one channel and any.
# Hurts: BioSig is the free way from Signal (.cfs), Nihon Kohden and some forty other formats, and GDF is its lossless
#   output; the next step, MNE, ends with an error that names neither the file nor the cause.
# Needs a Debian with its packages (apt-get download; they are unpacked in the temporary folder, not installed).
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check mne==1.13.2 edfio==0.4.18 numpy==2.4.6
cd "$tmp"
apt-get download -qq biosig-tools=2.5.0-1+b1 libbiosig3=2.5.0-1+b1 libdcmtk17 libtinyxml2.6.2v5 2>/dev/null
for package in *.deb; do dpkg -x "$package" root; done
lib=$(dirname "$(find root -name 'libbiosig.so*' | head -n 1)")
"$tmp/venv/bin/python" - <<'PY'
import edfio
import numpy as np

emg = edfio.EdfSignal(100 * np.sin(np.arange(5000)), 1000, label="FDI", physical_dimension="uV")
edfio.Edf([emg], annotations=[edfio.EdfAnnotation(1, None, "tms")]).write("emg.edf")
PY
LD_LIBRARY_PATH="$lib" root/usr/bin/save2gdf -f=GDF emg.edf save2gdf.gdf >log 2>&1 || { cat log; exit 1; }
LD_LIBRARY_PATH="$lib" root/usr/bin/biosig2gdf emg.edf >biosig2gdf.gdf 2>log || { cat log; exit 1; }
"$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import struct
import sys

import mne

mne.set_log_level("ERROR")
still = True
for path in ("save2gdf.gdf", "biosig2gdf.gdf"):
    head = open(path, "rb").read(256)
    blocks, channels = struct.unpack("<H", head[184:186])[0], struct.unpack("<H", head[252:254])[0]
    try:
        outcome = f"read, {mne.io.read_raw_gdf(path).n_times} samples"
    except AssertionError as error:
        outcome = f"AssertionError({str(error)!r})"
    parts = f"header of {blocks} blocks of which {channels + 1} are for the fixed part and {channels} channels"
    print(f"{path}: {head[:8].decode()}, {parts}: {outcome}")
    still = still and blocks > channels + 1 and outcome.startswith("AssertionError")
print("mne", meta.version("mne"), "biosig-tools 2.5.0")
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
