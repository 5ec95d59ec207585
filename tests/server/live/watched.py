"""A session that goes on as far as a test lets it, and somebody who looks at its live page."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import httpx
import numpy as np

from isiw.devices.info import DeviceInfo
from isiw.log.record import SessionRecord, read_session
from isiw.server.live.page import LivePage, watch
from isiw.session.loop import Session
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus
from scripted import FakeRealClock, ScriptedDevice, scripted_strategy
from server.serving import NOBODY
from waiting import until

PATIENCE_S = 20.0
HOSTILE = "<script>document.title='taken'</script><b>P07</b>\x1b[2J"
RATE_HZ = 1000.0


def sweep(stimulus: Stimulus) -> Sweep:
    """An MEP, larger at longer ISIs, after a pulse at 100 ms, in a little noise."""
    time_ms = np.arange(300.0)
    size = 0.1 + (stimulus.isi_ms or 0.0) / 1e3
    emg = 0.002 * np.sin(np.arange(300.0) ** 2) + size * np.sin((time_ms - 120) / 10 * 2 * np.pi) * (
        (time_ms >= 120) & (time_ms < 130)
    )
    return Sweep({"emg": Channel(emg, RATE_HZ, "mV")}, t_valve_ms=100.0 - (stimulus.isi_ms or 0.0), t_tms_ms=100.0)


class Stepped(FakeRealClock):
    """A clock that stands still before each stimulus until it is let go on."""

    def __init__(self) -> None:
        super().__init__()
        self.let = 1
        self.session: Session | None = None

    def sleep_s(self, duration_s: float) -> None:
        if self.session is not None and len(self.session.trials) >= self.let:
            time.sleep(0.005)
        else:
            super().sleep_s(duration_s)


class Watched:
    """A session that runs in a thread, with its live page."""

    def __init__(self, log: Path, *, trials: int = 6, subject: str = HOSTILE) -> None:
        self.clock, self.log = Stepped(), log
        device = ScriptedDevice(sweep)
        device.info = DeviceInfo("scripted", "valve", simulated=True, channels={"emg": "mV"})
        self.session = Session(device, scripted_strategy(trials), log=log, clock=self.clock, subject=subject)
        self.clock.session = self.session
        self.page: LivePage = watch(self.session)
        base, _, token = self.page.url.partition("#")
        self.client = httpx.Client(
            base_url=base, headers={"Authorization": f"Bearer {token}"}, verify=NOBODY, timeout=PATIENCE_S
        )
        self._thread = threading.Thread(target=self.session.run)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.clock.let = 10**6
        if self._thread.is_alive() and self.session.paused is not None:
            self.session.end("The test is over.")
        self.client.close()
        if self._thread.ident is not None:
            self.finish()
        self.page.close()

    def start(self, trials: int = 1) -> None:
        """Begin, and wait until so many trials were concluded."""
        self.clock.let = trials
        self._thread.start()
        self.until(lambda: len(self.session.trials) == trials)

    def finish(self) -> None:
        """Wait for the end."""
        self.clock.let = 10**6
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()

    def until(self, holds: Any) -> None:
        until(holds, PATIENCE_S)

    def press(self, button: str, **body: Any) -> httpx.Response:
        return self.client.post(f"/{button}", json=body)

    @contextmanager
    def viewer(self) -> Iterator[Iterator[dict[str, Any]]]:
        """Somebody who looks on: all that is shown, one after the other."""
        with self.client.stream("GET", "/updates") as answer:
            assert answer.status_code == 200
            yield (json.loads(line[6:]) for line in answer.iter_lines() if line.startswith("data: "))

    @property
    def record(self) -> SessionRecord:
        return read_session(self.log)

    @property
    def events(self) -> list[tuple[str, str]]:
        return [(event.kind, event.text) for event in self.record.events]
