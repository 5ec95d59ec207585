#!/usr/bin/env bash
# phyrec's power of a signal in millivolts is in millivolts: converted to microvolts it is a thousand times too small.
#
# Expected: docstring of power: the squared signal "with units of [original_units]^2". 2 mV squared are 4 mV^2, which are
#   4000000 uV^2.
# Seen: the values are squared, the unit is not. The result says 4 mV; rescaled to microvolts, as neo and quantities do by
#   themselves when it is added to, compared with or stored beside another signal, it is 4000, and nothing objects to adding
#   it to a voltage.
# Hurts: powers of channels with different units (mV and uV) are off by a factor of a thousand against each other: the unit
#   check, the reason to use neo, is defeated.
# (Its plots are left out.)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check --no-deps phyrec==0.9.1
"$tmp/venv/bin/pip" install -q --disable-pip-version-check \
    neo==0.14.6 quantities==0.16.4 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
cd "$tmp"
MPLBACKEND=Agg "$tmp/venv/bin/python" -W ignore - <<'PY'
import importlib.metadata as meta
import sys
import types
from unittest.mock import MagicMock

import neo
import numpy as np
import quantities as pq

package = sys.modules["PhyREC"] = types.ModuleType("PhyREC")
package.__path__ = [str(meta.distribution("phyrec").locate_file("PhyREC"))]
package.PlotWaves = sys.modules["PhyREC.PlotWaves"] = MagicMock()
from PhyREC.SignalProcess import power

in_mv = neo.AnalogSignal(np.full(10, 2.0), units="mV", sampling_rate=1000 * pq.Hz)
in_uv = in_mv.rescale("uV")
both = [power(signal) for signal in (in_mv, in_uv)]
values = [float(result[0, 0].rescale("uV").magnitude) for result in both]
print("one signal of 2 mV, given in mV and in uV; its power is 4 mV^2 = 4000000 uV^2")
print("units of the powers:", [str(result.units) for result in both], "- both in uV:", values)
print("phyrec", meta.version("phyrec"), "neo", meta.version("neo"))
still = [result.units for result in both] == [pq.mV, pq.uV] and np.allclose(values, [4e3, 4e6])
print("as described" if still else "CHANGED")
sys.exit(0 if still else 1)
PY
