"""A network of the Lab Streaming Layer for the tests of this process and the processes that it starts.

It is this machine's loopback, with a session id and ports of its own, so that tests that run side by side never meet,
and nothing of a lab's network is seen. Import it before anything calls liblsl, which reads its configuration once.
"""

from __future__ import annotations

import atexit
import os
import tempfile
import uuid
from pathlib import Path

_CONFIGURATION = f"""
[lab]
SessionID = isiw-tests-{uuid.uuid4().hex}
KnownPeers = {{127.0.0.1}}
[ports]
IPv6 = disable
BasePort = {17000 + os.getpid() % 300 * 128}
PortRange = 128
[multicast]
ResolveScope = machine
ListenAddress = 127.0.0.1
[tuning]
TimeProbeCount = 4
TimeUpdateMinProbes = 2
TimeProbeInterval = 0.01
TimeProbeMaxRTT = 0.05
[log]
level = -3
"""

with tempfile.NamedTemporaryFile("w", suffix=".cfg", prefix="isiw-lsl-", delete=False) as _file:
    _file.write(_CONFIGURATION)
os.environ["LSLAPICFG"] = _file.name
atexit.register(Path(_file.name).unlink, missing_ok=True)
