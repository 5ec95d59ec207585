"""What tests of the server share: an application, a client, and a server in a process of its own."""

from __future__ import annotations

import ipaddress
import os
import shutil
import ssl
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from isiw.server import Rules, make_app
from isiw.server.app import Server, listening, settings_of
from known import known

TOKEN = "a token for the tests"  # noqa: S105 - of the tests
BEARER = {"Authorization": f"Bearer {TOKEN}"}
NOBODY = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
"""Trusts nobody, and is ready at once: for each client without it, all the world's authorities are read."""

OPENSSL = shutil.which("openssl") or ""
WITH_OPENSSL = pytest.mark.skipif(not OPENSSL, reason="needs openssl, to make a certificate")

SPACE = {"low_ms": 0, "high_ms": 200, "reference": "impact"}
SETTINGS = {"max_trials": 6, "particles": 10}
PLAN: dict[str, Any] = {
    "id": "P07",
    "seed": 7,
    "visit": {"subject": "P07", "muscle": "FCR"},
    "space": SPACE,
    "strategy": {"name": "even", "settings": SETTINGS},
    "limits": {"min_iti_s": 0.0},
}

SEVERAL: dict[str, Any] = {
    "visit": {**PLAN["visit"], "intensity_pct_rmt": 90},
    "strategy": {"name": "even", "settings": {**SETTINGS, "intensities_pct_rmt": [90, 110]}},
    "limits": {"min_iti_s": 0.0, "max_intensity_pct_rmt": 110},
}
"""A plan whose pairs have two intensities in turn."""


def certified(folder: Path) -> tuple[Path, Path]:
    """A certificate of this computer, of its own making, and its key."""
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    command = [OPENSSL, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=isiw"]
    files = ["-keyout", str(key), "-out", str(certificate), "-addext", "subjectAltName=IP:127.0.0.1"]
    subprocess.run([*command, *files], check=True, capture_output=True)  # noqa: S603 - our own command
    return certificate, key


@contextmanager
def client_of(folder: Path, **rules: Any) -> Iterator[httpx.Client]:
    """A client of a server in this process, over a socket."""
    allowed = Rules(TOKEN, **rules)
    server = Server(settings_of(make_app(folder, allowed), allowed, log_level="critical"))
    with listening(ipaddress.IPv4Address("127.0.0.1"), 0) as listener:
        thread = threading.Thread(target=server.run, args=([listener],))
        thread.start()
        port = listener.getsockname()[1]
        try:
            with httpx.Client(
                base_url=f"http://127.0.0.1:{port}", headers=BEARER, verify=NOBODY, timeout=120.0
            ) as client:
                yield client
        finally:
            server.should_exit = True
            thread.join()


def created(client: httpx.Client, name: str = "P07", /, **changes: Any) -> str:
    """The path of a session that was begun."""
    done(client.post("/sessions", json={**PLAN, "id": name, **changes}))
    return f"/sessions/{name}"


def done(response: httpx.Response) -> dict[str, Any]:
    """What was answered to a request that was done."""
    answer: dict[str, Any] = response.json()
    assert response.status_code == 200, answer
    assert answer["ok"] is True
    return answer


def refused(response: httpx.Response, status: int, kind: str) -> dict[str, Any]:
    """Why a request was refused."""
    answer: dict[str, Any] = response.json()
    assert (response.status_code, answer["ok"], answer["error"]["type"]) == (status, False, kind), answer
    error: dict[str, Any] = answer["error"]
    return error


def told(client: httpx.Client, session: str, trials: int) -> list[float]:
    """The ISIs of some trials that were asked for and told."""
    asked = []
    for _ in range(trials):
        answer = done(client.post(f"{session}/ask"))
        asked.append(answer["isi_ms"])
        outcome = {"trial": answer["trial"], "isi_ms": answer["isi_ms"], "mep_mv": mep_mv(answer["isi_ms"])}
        done(client.post(f"{session}/tell", json=outcome))
    return asked


def mep_mv(isi_ms: float) -> float:
    return 0.01 + isi_ms / 1e4


@contextmanager
def server(folder: Path, *options: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A server in a process of its own, killed in the end, and its address."""
    script = f"from isiw.cli import app; app({['serve', str(folder), '--port', '0', *options]!r})"
    environment = os.environ | {"ISIW_TOKEN": TOKEN}
    with subprocess.Popen(  # noqa: S603 - our own command
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        try:
            first = known(process.stdout).readline()
            assert "://127.0.0.1:" in first, first
            yield process, first.rsplit(maxsplit=1)[-1]
        finally:
            process.kill()
