"""A process that dies before or after any file operation loses nothing, replaces nothing, and can be gone on from."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from isiw.errors import LogError
from isiw.log.record import SessionRecord, read_session
from isiw.session.afterwards import exclude
from isiw.session.loop import Session
from isiw.session.resuming import resume
from logs import blocks_of, damage
from scripted import ScriptedDevice, scripted_strategy
from session.crashes import Disk

if not hasattr(os, "link"):
    pytest.skip("needs hard links", allow_module_level=True)

TRIALS = 3
OTHERS = ("other.mcap", "other.mcap.part", "s.png")


@dataclass
class Bench:
    """A folder with a session's log and another person's files, and what the device really delivered."""

    folder: Path
    ledger: Path

    @property
    def log(self) -> Path:
        return self.folder / "s.mcap"

    def session_device(self) -> Any:
        """A device that writes down each delivery, where no power cut reaches it."""

        def answer(stimulus: Any) -> Any:
            with open(self.ledger, "a") as file:  # noqa: PTH123 - not one of the operations that are counted
                file.write(f"{stimulus.trial}\n")
            return usual(stimulus)

        device = ScriptedDevice()
        usual, device.answer = device.answer, answer
        return device

    def run(self, on_trial: Any = None) -> Any:
        return Session(self.session_device(), scripted_strategy(TRIALS), log=self.log, on_trial=on_trial).run()

    def resume(self) -> Any:
        return resume(self.log, self.session_device(), scripted_strategy(TRIALS)).run()

    def exclude(self) -> None:
        exclude(self.log, 1, "sneezed")

    @property
    def delivered(self) -> list[int]:
        return [int(line) for line in self.ledger.read_text().split()] if self.ledger.exists() else []


def one_trial(bench: Bench) -> None:
    def stop(update: Any) -> None:
        if update.trial.index == 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bench.run(stop)


def killed(bench: Bench) -> None:
    one_trial(bench)
    last, _ = blocks_of(bench.log)[-1]
    bench.log.with_name("s.mcap.part").write_bytes(bench.log.read_bytes()[:last])
    bench.log.unlink()


def damaged(bench: Bench) -> None:
    one_trial(bench)
    damage(bench.log, 2)


SCENARIOS: dict[str, tuple[Callable[[Bench], Any], Callable[[Bench], Any]]] = {
    "run": (lambda _: None, Bench.run),
    "resume a closed log": (one_trial, Bench.resume),
    "resume a killed one": (killed, Bench.resume),
    "salvage a damaged one": (damaged, Bench.resume),
    "exclude": (Bench.run, Bench.exclude),
}


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    (tmp_path / "logs").mkdir()
    return Bench(tmp_path / "logs", tmp_path / "ledger")


@pytest.fixture
def asks(tmp_path: Path) -> Any:
    """What an undisturbed session asks."""
    result = Session(ScriptedDevice(), scripted_strategy(TRIALS), log=tmp_path / "undisturbed.mcap").run()
    return [trial.commanded_isi_ms for trial in result.trials]


def require_nothing_lost(bench: Bench, before: SessionRecord | None, original: bytes | None) -> None:
    for name in OTHERS:
        assert (bench.folder / name).read_bytes() == b"precious"
    try:
        record = read_session(bench.log)
    except LogError:
        assert before is None
        assert bench.delivered == []
        return
    known = {trial.index for trial in record.table} | {intent.trial for intent in record.unknown}
    assert set(bench.delivered) <= known
    if before is not None:
        assert set(map(repr, before.history)) <= set(map(repr, record.history))
    if original is not None and before is not None and before.losses:
        assert original in [path.read_bytes() for path in bench.folder.iterdir()]


def require_it_goes_on(bench: Bench, asks: list[float]) -> None:
    try:
        read_session(bench.log)
    except LogError:  # it died before its first record: nothing was delivered, and nothing is in the way
        assert not list(bench.folder.glob("s.mcap*"))
        bench.run()
    else:
        bench.resume()
    record = read_session(bench.log)
    assert record.finished
    assert [path.name for path in sorted(bench.folder.glob("s.mcap*")) if "damaged" not in path.name] == ["s.mcap"]
    assert [trial.index for trial in record.table] == list(range(TRIALS))
    told = [trial.commanded_isi_ms for trial in record.table if trial.reason is None]
    assert told == asks[: len(told)]
    assert len(set(bench.delivered)) == len(bench.delivered)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_whenever_it_dies_nothing_is_lost_or_replaced_and_it_goes_on(scenario: str, bench: Bench, asks: Any) -> None:
    prepare, act = SCENARIOS[scenario]
    prepare(bench)
    for name in OTHERS:
        (bench.folder / name).write_bytes(b"precious")
    before, original = None, None
    if existing := next(bench.folder.glob("s.mcap*"), None):
        before, original = read_session(existing), existing.read_bytes()
    shadow = bench.folder.with_name("shadow")
    shadow.mkdir()
    disk = Disk(bench.folder, shadow, lambda: bench.ledger.read_bytes() if bench.ledger.exists() else b"")
    with pytest.MonkeyPatch.context() as patch:
        disk.install(patch)
        act(bench)
    for left, ledger in disk.left:
        shutil.rmtree(bench.folder)
        bench.folder.mkdir()
        for name, content in left:
            (bench.folder / name).write_bytes(content)
        bench.ledger.write_bytes(ledger)
        require_nothing_lost(bench, before, original)
        if scenario not in ("exclude", "salvage a damaged one"):
            require_it_goes_on(bench, asks)
    assert disk.steps >= 20
