#!/usr/bin/env bash
# emg2mcu's firmware has the signs of its filter's feedback turned: on the microcontroller the EMG filter grows without limit.
#
# Expected: docstring of generate_esp32_code: firmware with the given filter, meant for "numerical equivalence with SciPy"; its own
#   check, debug_esp32_filter, emulates the device and says how near it is.
# Seen: the feedback coefficients are stored with their sign turned, to be added; the emulation adds them, the C code that is written
#   subtracts them. The check calls the equivalence high; the C code, compiled here, is beyond 1e30 after a tenth of a
#   second of EMG, then not a number. With the signs turned back it is the filter.
# Hurts: whoever flashes it: no EMG comes out, although the check has passed.
# (Needs a C compiler. Only this module is loaded: others need much more.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps emg2mcu==0.1.0
cd "$tmp"
"$tmp/venv/bin/python" -W ignore - <<'PY'
import contextlib
import ctypes
import importlib.metadata as meta
import io
import re
import subprocess
import sys
import types
from pathlib import Path

import numpy as np

for name in ("matplotlib", "matplotlib.pyplot"):  # for its plots only
    sys.modules[name] = types.ModuleType(name)
package = sys.modules["EMG2MCU"] = types.ModuleType("EMG2MCU")
package.__path__ = [str(meta.distribution("emg2mcu").locate_file("EMG2MCU"))]
from EMG2MCU.signal import debug_esp32_filter, emg_filter, generate_esp32_code
from scipy.signal import sosfilt

emg = np.random.default_rng(1).normal(scale=0.1, size=1000).astype(np.float32)
with contextlib.redirect_stdout(io.StringIO()) as said:
    *_, sos, _ = emg_filter(emg, mode="deploy")
    checked = debug_esp32_filter([emg], sos)[0]
    generate_esp32_code(sos)
sketch = next(Path(".").rglob("*.ino")).read_text()
print("its own check:", re.search("CORRESPOND.*", said.getvalue()).group(), f"largest error {checked['max_error']:.1e}")


def compiled(code, name):
    """What the filter of a sketch makes of the EMG."""
    filtering = code[code.index("#define NUM_SECTIONS") : code.index("void setup()")]
    Path(f"{name}.c").write_text("#include <stdint.h>\n" + filtering)
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", f"{name}.so", f"{name}.c"], check=True)
    step = ctypes.CDLL(f"./{name}.so").biquad_process
    step.argtypes, step.restype = [ctypes.c_float], ctypes.c_float
    return np.array([step(float(value)) for value in emg])


right = sosfilt(sos, emg)
found = compiled(sketch, "sketch")
turned = compiled(sketch.replace("- coeffs[i][3]", "+ coeffs[i][3]").replace("- coeffs[i][4]", "+ coeffs[i][4]"), "turned")
print(f"SciPy: largest value {np.abs(right).max():.2f}")
print(f"C code as written: largest value in the first 100 samples {np.nanmax(np.abs(found[:100])):.1e}, last value {found[-1]}")
print(f"with the signs turned: largest error {np.abs(turned - right).max():.1e}")
print("emg2mcu", meta.version("emg2mcu"))
still = checked["max_error"] < 1e-5 and not np.isfinite(found[-1]) and np.nanmax(np.abs(found[:100])) > 1e30 and np.abs(turned - right).max() < 1e-4
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
