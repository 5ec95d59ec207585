"""A thousand connections without the token, and how soon whoever has it is answered meanwhile.

    python -m benchmarks.server_strangers PORT NUMBER

attempts so many connections to a port of this computer until it is killed: a third say nothing, a third never finish
their headers, a third send a byte of them every half second. Whoever is hung up on is back after a second.
"""

from __future__ import annotations

import asyncio
import http.client
import itertools
import json
import math
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from benchmarks.server_tries import FILES, TOKEN, Served
from isiw.session.pausing import SEPARATE_S

HALF = b"GET /sessions HTTP/1.1\r\nX: "
BACK_S = 1.0
SLOWLY_S = 0.5
LIVE = f"""
import random, resource, sys, time
import isiw
chance = random.Random(0)
resource.setrlimit(resource.RLIMIT_NOFILE, ({FILES}, {FILES}))
space = isiw.DesignSpace(20, 320, reference="impact")
class Rig:
    def describe(self):
        return isiw.DeviceInfo("rig", reference="impact", simulated=True)
    def stage(self):
        pass
    unstage = stop = stage
    def deliver(self, stimulus, timeout_s):
        time.sleep(0.2)
        return isiw.Measurement(chance.lognormvariate(-2, 0.5), stimulus.isi_ms)
strategy = isiw.make_strategy("random", space=space, seed=1, max_trials=100_000)
limits = isiw.Limits.of_space(space, min_iti_s=0.3, max_pulses=100_000)
session = isiw.Session(Rig(), strategy, log=sys.argv[1], limits=limits, clock=isiw.MonotonicClock())
with isiw.watch(session) as page:
    print(page.url, flush=True)
    print(session.run(progress=False).decision.reason, flush=True)
"""


@contextmanager
def strangers(port: int, number: int) -> Iterator[None]:
    """Within, so many connections without the token are attempted again and again, by a process of their own."""
    command = [sys.executable, "-m", "benchmarks.server_strangers", str(port), str(number)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:  # noqa: S603 - our own module
        try:
            if process.stdout is None or process.stdout.readline() != "all were attempted\n":
                sys.exit("the strangers have failed")
            yield
            if process.poll() is not None:
                sys.exit("the strangers have gone")
        finally:
            process.kill()


def answered_s(port: int, token: str, method: str, path: str, body: bytes | None = None) -> float:
    """How long the answer to a request takes, on a connection of its own [s]; infinite where it is not done.

    Args:
        port: of the server.
        token: of the server.
        method: of the request.
        path: of the request.
        body: of the request, in JSON.
    """
    begun_s = time.perf_counter()
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
    try:
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        done = bool(json.loads(answer.read())["ok"])
    except (OSError, http.client.HTTPException):
        done = False
    finally:
        connection.close()
    return time.perf_counter() - begun_s if done else math.inf


def served_meanwhile(folder: Path, number: int, tries: int) -> list[float]:
    """How long a client with the token waits for `isiw serve` while so many strangers are there [s].

    Args:
        folder: where the logs are.
        number: how many strangers.
        tries: how many requests.
    """
    with Served(folder) as served, strangers(served.port, number):
        return [_spaced(lambda: answered_s(served.port, TOKEN, "GET", "/sessions")) for _ in range(tries)]


def operated_meanwhile(folder: Path, number: int, pauses: int) -> tuple[list[float], str]:
    """How long Pause of the live page, and at last Stop, take while so many strangers are there [s]; why it ended.

    Args:
        folder: where the log is.
        number: how many strangers.
        pauses: how often it is paused, and goes on.
    """
    command = [sys.executable, "-c", LIVE, str(folder / "live.mcap")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as session:  # noqa: S603 - our own script
        assert session.stdout is not None  # noqa: S101 - it is a pipe
        try:
            found = re.search(r":(\d+)/#(.*)", session.stdout.readline())
            port, token = (int(found[1]), found[2]) if found else sys.exit("there is no page")
            with strangers(port, number):
                spent_s = []
                for pause in range(1, pauses + 1):
                    spent_s.append(_spaced(lambda: answered_s(port, token, "POST", "/pause")))
                    _until(lambda number=pause: _goes_on(port, token, number))  # type: ignore[misc] # a bound number
                spent_s.append(answered_s(port, token, "POST", "/stop"))
                return spent_s, session.stdout.readline().strip()
        finally:
            session.kill()


def _goes_on(port: int, token: str, pause: int) -> bool:
    time.sleep(1.1 * SEPARATE_S)  # sooner it would be taken for a key that is held
    return math.isfinite(answered_s(port, token, "POST", "/resume", json.dumps({"pause": pause}).encode()))


def _spaced(call: Callable[[], float]) -> float:
    time.sleep(0.05)
    return call()


def _until(holds: Callable[[], bool]) -> None:
    end_s = time.monotonic() + 20
    while not holds():
        if time.monotonic() > end_s:
            sys.exit("the session does not go on")
        time.sleep(0.05)


async def _come(port: int, head: bytes, *, slowly: bool, attempted: Callable[[], object]) -> None:
    """Connect again and again."""
    while True:
        with suppress(OSError):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            attempted()
            writer.write(head)
            while not await _hung_up(reader):
                writer.write(b"x" if slowly else b"")
            writer.close()
        await asyncio.sleep(BACK_S)


async def _hung_up(reader: asyncio.StreamReader) -> bool:
    with suppress(TimeoutError):
        async with asyncio.timeout(SLOWLY_S):
            await reader.read()
            return True
    return False


async def _main(port: int, number: int) -> None:
    attempts, all_there = itertools.count(1), asyncio.Event()
    tasks = [
        asyncio.create_task(
            _come(
                port,
                HALF if each % 3 else b"",
                slowly=each % 3 == 1,
                attempted=lambda: all_there.set() if next(attempts) == number else None,
            )
        )
        for each in range(number)
    ]
    await all_there.wait()
    print("all were attempted", flush=True)
    await asyncio.gather(*tasks)


if __name__ == "__main__":
    import resource  # which Windows has not

    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    with suppress(KeyboardInterrupt):
        asyncio.run(_main(*map(int, sys.argv[1:])))
    os._exit(0)
