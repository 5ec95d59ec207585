"""All compiled code is loaded before the first stimulus."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import isiw
from isiw.models.particles import ParticleModel
from isiw.session import loop, rehearsal
from isiw.session.loop import Session
from isiw.session.rehearsal import rehearse
from isiw.session.resume import open_session
from isiw.strategy.stopping import Budget
from isiw.strategy.strategy import Strategy
from scripted import ScriptedDevice, scripted_strategy

WHOLE_SESSION = """
import gc, sys, warnings
import isiw
from isiw import compiled
from isiw.session.rehearsal import rehearse
from numba.core.registry import CPUDispatcher

warnings.simplefilter("ignore", isiw.errors.ImplausibleDataWarning)


def damaged(self):
    raise EOFError("Ran out of input")


compiled._Kept.flush = lambda self: None
load = compiled._Files.load
compiled._Files.load = lambda self, key: damaged(self) if "_table_rows" in self._index_name else load(self, key)

for name in ("default", "supra-threshold"):
    strategy = isiw.make_strategy(name, space=isiw.DesignSpace(20, 300, reference="impact"), particles=60, thinned=30)
    rehearse(strategy)
    print("ready", name, file=sys.stderr, flush=True)
    loops = [each for each in gc.get_objects() if isinstance(each, CPUDispatcher)]
    loaded = sum(len(each.signatures) for each in loops)
    with isiw.open_session(strategy, f"{sys.argv[1]}/{name}.mcap") as session:
        for number in range(6):
            isi_ms = session.ask()
            session.tell(isi_ms, 0.05 + 0.01 * number, isi_sd_ms=number % 2, mep_sd_mv=0.01)
            session.note_change("the coil moved")
        session.tell(session.ask(), 0.0)
        session.tell(session.ask(), mep_interval_mv=(0.02, 0.1))
        session.tell(None, 0.04)
        session.tell(60.0, 0.03, pulse=False)
        session.exclude(2)
        session.ask()
        str(session.estimate())
    assert sum(len(each.signatures) for each in loops) == loaded > 0, [e for e in loops if e.stats.cache_misses]
"""


@pytest.mark.slow
def test_what_a_session_computes_with_is_loaded_before_or_compiled_where_a_file_is_damaged(tmp_path: Path) -> None:
    ended = subprocess.run(  # noqa: S603 - a script of this test
        [sys.executable, "-c", WHOLE_SESSION, str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr.count("are damaged") == 1
    assert ended.stderr.index("are damaged") < ended.stderr.index("ready default")


def test_a_session_rehearses_before_the_device_is_armed(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device = ScriptedDevice()
    monkeypatch.setattr(loop, "rehearse", lambda _: device.calls.append("rehearsal"))
    Session(device, scripted_strategy(2), log=log).run(progress=False)
    assert device.calls[0] == "rehearsal"
    assert "stage" in device.calls


def test_a_loop_of_the_labs_own_is_rehearsed_before_its_log_begins(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(_: Strategy) -> None:
        raise RuntimeError("cannot be compiled")

    monkeypatch.setattr(sys.modules["isiw.session.resume"], "rehearse", failing)
    with pytest.raises(RuntimeError, match="cannot be compiled"):
        open_session(scripted_strategy(2), log)
    assert not list(log.parent.iterdir())


def test_a_users_own_acquisition_function_is_not_called_by_a_rehearsal(monkeypatch: pytest.MonkeyPatch) -> None:
    played: list[Strategy] = []
    monkeypatch.setattr(rehearsal, "_play", played.append)
    monkeypatch.setattr(rehearsal, "_rehearsed", set())

    def own(*_: Any) -> Any:
        raise AssertionError

    own.needs = ()  # type: ignore[attr-defined]
    strategy = Strategy(isiw.VALVE_SPACE, ParticleModel(particles=20, thinned=10), own, Budget(3))  # type: ignore[arg-type]
    for _ in range(2):
        rehearse(strategy)
    (brief,) = played
    assert brief.acquisition is not own
    assert strategy.delivered == 0
