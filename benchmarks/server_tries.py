"""A server in a process of its own, and what is done to it: malformed requests, kills, calls from its description."""

from __future__ import annotations

import json
import os
import random
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx
import hypothesis
import psutil
import schemathesis
from hypothesis.strategies import SearchStrategy
from schemathesis import Case, GenerationMode
from schemathesis.checks import CheckFunction, not_a_server_error
from schemathesis.specs.openapi import checks

import isiw

TOKEN = "a token for benchmarks"  # noqa: S105 - of no real server
PLAN = {"space": {"low_ms": 0, "high_ms": 200, "reference": "impact"}, "limits": {"min_iti_s": 0.0, "max_pulses": 1000}}

DELIVERY_S = 0.005

PATIENCE_S = 60.0
"""How long a client repeats a call; a server that was killed is back in far less."""

FILES = 1024
"""How many files a process may have open by default, on most systems."""

SERVING = f"""
import os, resource, sys, signal
import isiw, torch
from pathlib import Path
torch.set_num_threads(1)
resource.setrlimit(resource.RLIMIT_NOFILE, ({FILES}, {FILES}))
settings = isiw.server.ServerSettings(Path(sys.argv[1]), port=int(sys.argv[2]), token=sys.argv[3])
isiw.make_strategy("even", particles=10).estimate()
while True:
    child = os.fork()
    if child == 0:
        isiw.server.serve(settings, lambda url: print(os.getpid(), url, flush=True))
        os._exit(0)
    os.waitpid(child, 0)
"""


class Served:
    """A folder that is served by a child of a process, which begins another one where it is killed.

    Args:
        folder: where the logs are.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, _free_port()
        self.url, self.headers = f"http://127.0.0.1:{self.port}", {"Authorization": f"Bearer {TOKEN}"}
        self.context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # never used, but slow to make for each request
        command = [sys.executable, "-c", SERVING, str(folder), str(self.port), TOKEN]
        self._parent = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)  # noqa: S603 - our own script
        self.child, self.kills = self.next_child(), 0

    def next_child(self) -> int:
        """The process that serves, once it does."""
        line = self._parent.stdout.readline() if self._parent.stdout else ""
        self.child = int(line.split()[0])
        return self.child

    def client(self) -> httpx.Client:
        """A client of it."""
        return httpx.Client(base_url=self.url, headers=self.headers, timeout=60.0, verify=self.context)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._parent.kill()
        os.kill(self.child, signal.SIGKILL)
        self._parent.wait()
        if self._parent.stdout:
            self._parent.stdout.close()


def _free_port() -> int:
    """A port that no outgoing connection is given while nobody listens, unlike those that port 0 stands for."""
    for port in range(21_000 + 7 * os.getpid() % 10_000, 32_000):
        with suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return port
    sys.exit("no port is free")


def fuzzed(served: Served, requests: int, chance: random.Random) -> tuple[float, float, Counter[str]]:
    """Send malformed requests; the memory after the first tenth and at the end [MB], and what was answered.

    Args:
        served: the server.
        requests: how many.
        chance: what is random.
    """
    answers: Counter[str] = Counter()
    memory: list[float] = []
    with served.client() as client:
        client.post("/sessions", json={"id": "kept", **PLAN, "strategy": {"name": "pf"}}).raise_for_status()
        client.post("/sessions/kept/ask").raise_for_status()
        log = served.folder / "kept.mcap.part"
        before = client.get("/sessions/kept").json(), log.read_bytes()
        for number in range(requests):
            answers[_malformed(served, client, chance)] += 1
            if number in {requests // 10, requests - 1}:
                memory.append(psutil.Process(served.child).memory_info().rss / 1e6)
        after = client.get("/sessions/kept").json(), log.read_bytes()
        names = [session["id"] for session in client.get("/sessions").json()["sessions"]]
    if after != before or names != ["kept"] or any(status.startswith("5") for status in answers):
        sys.exit(f"the session has changed, or the server failed: {before[0]} {after[0]} {names} {answers}")
    return memory[0], memory[-1], answers


def _malformed(served: Served, client: httpx.Client, chance: random.Random) -> str:
    """Send one malformed request; its status, or that the server has hung up."""
    if chance.random() < 0.2:
        return _raw(served.port, _bytes(chance))
    verb = chance.choice(["ask", "tell", "mistrial", "note", "exclude", "include", "resume", "..", "%00", ""])
    name = chance.choice(["kept", "kept", "none", "..%2f..%2fetc", "a" * 300, "%ff"])
    body = _body(chance)
    kind = chance.choice(["application/json", "application/x-www-form-urlencoded", "text/plain", ""])
    method = chance.choice(["POST", "POST", "POST", "PUT", "GET", "DELETE"])
    headers = {"Content-Type": kind} | chance.choice([{}, {}, {}, {"Host": "evil.example"}, {"Authorization": "x"}])
    path = chance.choice([f"/sessions/{name}/{verb}", "/sessions", f"/{verb}"])
    return str(client.request(method, path, content=body, headers=headers).status_code)


def _bytes(chance: random.Random) -> bytes:
    head = f"POST /sessions HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {TOKEN}\r\n".encode()
    return chance.choice(
        [
            chance.randbytes(chance.randrange(1, 300)) + b"\r\n\r\n",
            head + b"Content-Length: -1\r\n\r\n",
            head + b"Content-Length: 99999999999\r\n\r\n",
            head + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n",
            head + b"Content-Length: 5\r\nContent-Length: 6\r\n\r\n{}",
            head + b"X: " + b"y" * 40_000 + b"\r\n\r\n",
        ]
    )


def _raw(port: int, request: bytes) -> str:
    with socket.create_connection(("127.0.0.1", port), timeout=30) as connection:
        try:
            connection.sendall(request)
            connection.shutdown(socket.SHUT_WR)
            answer = connection.recv(1000)
        except ConnectionError:
            answer = b""
    return answer[9:12].decode("latin-1") if answer.startswith(b"HTTP/1.1 ") else "hung up"


def _body(chance: random.Random) -> bytes:
    """A body that no call takes."""
    wrong = [None, True, -1, 1e300, 10**40, "x", [], {}, "\u00b5" * 50, [[[]]] * 20]
    fields = ["trial", "isi_ms", "mep_mv", "reason", "text", "key", "id", "space", "strategy", "nonsense", ""]
    values = {name: chance.choice(wrong) for name in chance.sample(fields, chance.randrange(1, 6))} | {"nonsense": 1}
    whole = json.dumps(values).encode()
    return chance.choice(
        [whole, whole[: len(whole) // 2], chance.randbytes(200), b"[" * 5000, b'{"a":' * 3000, b"nonsense=1&" * 60]
    )


def killed(folder: Path, number: int, chance: random.Random) -> str:
    """Kill the server at random moments while sessions run; what log and client say in the end, in words.

    Args:
        folder: where the logs are.
        number: how many kills.
        chance: what is random.
    """
    rig = _Rig()
    with Served(folder) as served:
        done = threading.Event()
        killer = threading.Thread(target=_kill, args=(served, number, chance, done))
        killer.start()
        sessions = 0
        while not done.is_set():
            rig.run(served, f"s{sessions}", "nr" if sessions % 2 else "pf")
            sessions += 1
        killer.join()
        if served.kills < number:
            sys.exit(f"the server ended by itself after {served.kills} kills")
    compared = Counter[str]()
    for session in range(sessions):
        compared += rig.compared(folder, f"s{session}")
    return (
        f"{sessions} sessions of 40 stimuli, seed 0. Of {compared['delivered']} stimuli that the client delivered, "
        f"{compared['accepted']} are accepted in the logs with the client's own values, and {compared['unknown']} are "
        f"mistrials of unknown outcome, {compared['late']} of them with the outcome that came too late as a note. "
        f"{compared['never']} more mistrials of unknown outcome were asked for and not delivered. None is missing, "
        f"none is there twice, and no log has an outcome that the client did not tell. Calls that were not answered "
        f"and repeated: {rig.repeated}."
    )


def _kill(served: Served, number: int, chance: random.Random, done: threading.Event) -> None:
    try:
        for _ in range(number):
            time.sleep(chance.uniform(0.05, 1.2))
            os.kill(served.child, signal.SIGKILL)
            served.next_child()
            served.kills += 1
    finally:
        done.set()


class _Rig:
    """A client with a rig, which repeats what is not answered, and keeps its own ledger."""

    def __init__(self) -> None:
        self.repeated = 0
        self.delivered: dict[tuple[str, int], tuple[float, float]] = {}
        self.answers: dict[tuple[str, int], str] = {}

    def run(self, served: Served, name: str, strategy: str) -> None:
        """Run one session to its end, whatever happens to the server."""
        plan = {"id": name, **PLAN, "strategy": {"name": strategy}}
        with served.client() as client:
            self._post(client, "/sessions", plan)
            trial = 0
            while trial < 40:
                answer = self._post(client, f"/sessions/{name}/ask", {"trial": trial})
                if not answer["ok"]:  # it was asked for, and the server was killed: its outcome is unknown
                    trial = self._post(client, f"/sessions/{name}/resume", {})["trials"]
                    continue
                if (name, trial) in self.delivered:
                    sys.exit(f"{name}: trial {trial} would be delivered twice")
                self.delivered[name, trial] = (answer["isi_ms"] + 0.25, 0.1 + trial / 1e3)
                time.sleep(DELIVERY_S)
                told = dict(zip(("isi_ms", "mep_mv"), self.delivered[name, trial], strict=True))
                answer = self._post(client, f"/sessions/{name}/tell", {"trial": trial, **told})
                self.answers[name, trial] = "accepted" if answer["ok"] else answer["error"]["type"]
                trial += 1
            self._post(client, f"/sessions/{name}/close", {})

    def _post(self, client: httpx.Client, path: str, body: dict[str, Any]) -> dict[str, Any]:
        """Send until it is answered; a session that the server has lost is resumed first."""
        until_s = time.monotonic() + PATIENCE_S
        while True:
            try:
                answer: dict[str, Any] = client.post(path, json=body).json()
                if answer["ok"] or answer["error"]["type"] != "NotOpen":
                    return answer
                client.post(f"{path.rpartition('/')[0]}/resume").raise_for_status()
            except httpx.HTTPError as error:
                if time.monotonic() > until_s:
                    sys.exit(f"{path}: no answer for {PATIENCE_S:.0f} s, and at last: {error}")
                self.repeated += 1
                time.sleep(0.05)

    def compared(self, folder: Path, name: str) -> Counter[str]:
        """Compare the ledger with the log, trial by trial."""
        record = isiw.read_session(folder / f"{name}.mcap")
        notes = [event.text for event in record.events if event.kind == "note"]
        found = Counter[str]()
        for trial in record.table:
            fired = self.delivered.get((name, trial.index))
            found["delivered"] += fired is not None
            if trial.told:
                found["accepted"] += 1
                same = (trial.isi_ms, trial.mep_mv) == fired and self.answers[name, trial.index] == "accepted"
            elif fired is None:
                found["never"] += 1
                same = True
            else:
                found["unknown"] += 1
                found["late"] += sum(f"of trial {trial.index} came too late" in note for note in notes)
                same = self.answers[name, trial.index] == "Late"
            if not same:
                sys.exit(f"{name}: {trial} is not what the client did: {fired}")
        missing = {number for key, number in self.delivered if key == name} - {trial.index for trial in record.table}
        if missing or record.losses:
            sys.exit(f"{name}: trials {missing} are missing, or the log is: {record.losses}")
        if not record.finished:
            sys.exit(f"{name}: the log is not finished")
        return found


CHECKS: tuple[CheckFunction, ...] = (
    not_a_server_error,
    checks.status_code_conformance,
    checks.content_type_conformance,
    checks.response_schema_conformance,
)
"""No failure of the server, and no answer that is not described."""


def tried(url: str, headers: dict[str, str], examples: int) -> tuple[Counter[int], list[str]]:
    """Call everything that the description has, validly and invalidly; what was answered, and what was wrong with it.

    The stream of progress is left out, as it does not end.

    Args:
        url: of the server.
        headers: with its token.
        examples: how many calls of each kind.
    """
    answers: Counter[int] = Counter()
    wrong: list[str] = []

    with httpx.Client(base_url=url, headers=headers, timeout=60.0) as client:
        client.post("/sessions", json={"id": "tried", **PLAN, "strategy": {"name": "pf"}}).raise_for_status()
        schema = schemathesis.openapi.from_dict(client.get("/openapi.json").json())

        def call(case: Case, mode: GenerationMode) -> None:
            if mode is GenerationMode.POSITIVE and case.path_parameters:  # a session that there is, and open
                case.path_parameters["id"] = "tried"
                client.post("/sessions/tried/resume")
            response = case.call(base_url=url, headers={**(case.headers or {}), **headers})
            answers[response.status_code] += 1
            try:
                case.validate_response(response, checks=list(CHECKS))
            except BaseExceptionGroup as error:
                wrong.append(f"{case.method} {case.path}: {error}")

        for operation in (found.ok() for found in schema.get_all_operations()):
            for mode in () if operation.path.endswith("/progress") else GenerationMode:
                _exampled(partial(call, mode=mode), operation.as_strategy(generation_mode=mode), examples)
    return answers, wrong


def _exampled(call: Callable[[Case], None], cases: SearchStrategy[Case], examples: int) -> None:
    """Make so many calls, always the same."""

    @hypothesis.settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=True,
        phases=[hypothesis.Phase.generate],
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    @hypothesis.given(case=cases)
    def run(case: Case) -> None:
        call(case)

    run()
