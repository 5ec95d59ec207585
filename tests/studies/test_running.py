"""A study in its folder: whatever ends it, what is finished is kept."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import psutil
import pytest

from disks import no_room
from isiw import files
from isiw.errors import ConfigError, InvalidValueError, StudyError
from isiw.studies import Processes, Study, StudyStrategy, conduct, load_study, open_store, replay, run_unit, sessions
from isiw.studies import plan as plan_module
from isiw.studies import running as running_module
from isiw.studies import store as store_module
from isiw.studies.plan import Unit
from isiw.studies.running import unit_of_row
from isiw.studies.sessions import SimulatedSession
from isiw.studies.store import begin_store
from studies.tiny import TOML, timeless, tiny

posix = pytest.mark.skipif(os.name == "nt", reason="POSIX signals")


def keys_run(study: Study, folder: Path, **how: Any) -> list[str]:
    """The keys of the units that a run of the study had to run."""
    keys: list[str] = []
    conduct(study, folder, on_done=lambda unit, _result: keys.append(unit.key), **how)
    return keys


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A finished study of each engine."""
    folders = {engine: tmp_path_factory.mktemp(engine) / "s" for engine in ("single", "batched")}
    conduct(tiny(), folders["single"])
    conduct(tiny(engine="batched", batch=2), folders["batched"])
    return folders


@pytest.fixture
def finished(folders: dict[str, Path], tmp_path: Path) -> Path:
    """The folder of a finished study, which may be changed."""
    return Path(shutil.copytree(folders["single"], tmp_path / "finished"))


@pytest.fixture
def crash(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Makes the sessions of one strategy raise."""
    usual = sessions.simulate

    def simulate(session: SimulatedSession) -> pd.DataFrame:
        if session.strategy == "incremental" and session.cohort == "nonresponder":
            raise RuntimeError("the sweep\nis stuck")
        return usual(session)

    monkeypatch.setattr(plan_module, "simulate", simulate)
    return monkeypatch


def test_a_study_has_one_row_a_mark_of_every_person_and_says_whose(finished: Path) -> None:
    rows = open_store(finished).rows()
    assert len(rows) == 2 * 2 * 3 * 2
    assert rows["unit"].iloc[0] == "even.gaussian.00000"
    assert rows.columns[:5].tolist() == ["strategy", "cohort", "person", "seed", "trial"]


def test_a_finished_study_has_nothing_left_to_run(tmp_path: Path) -> None:
    rows = conduct(swept(), tmp_path).rows()
    assert keys_run(swept(), tmp_path) == []
    assert open_store(tmp_path).rows().equals(rows)


def test_a_study_goes_on_with_what_is_missing_and_writes_over_what_was_cut_off(finished: Path) -> None:
    whole = timeless(open_store(finished).rows())
    (lost,) = (finished / "parts").glob("even.gaussian.00001.*")
    lost.rename(lost.with_name("even.gaussian.00001.part")).write_bytes(b"half of a pa")
    assert len(open_store(finished).rows()) == len(whole) - 2
    assert keys_run(tiny(), finished) == ["even.gaussian.00001"]
    pd.testing.assert_frame_equal(timeless(open_store(finished).rows()), whole)
    assert not list(finished.rglob("*.part"))


def test_a_folder_of_another_study_is_refused_with_what_differs(tmp_path: Path) -> None:
    begin_store(tiny(), tmp_path)
    with pytest.raises(StudyError, match=r"people was 3, now 4"):
        begin_store(tiny(people=4), tmp_path)


def test_a_folder_of_another_version_is_refused(tmp_path: Path) -> None:
    begin_store(tiny(), tmp_path)
    path = tmp_path / "study.toml"
    path.write_text(path.read_text().replace('isiw = "', 'isiw = "9.'))
    with pytest.raises(StudyError, match="another version of isiw; got '9"):
        begin_store(tiny(), tmp_path)


def test_other_code_adds_no_rows_to_a_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = begin_store(tiny(), tmp_path)
    unit = begun.left()[0]
    begun.keep(unit, run_unit(unit))
    monkeypatch.setattr(store_module, "code_checksum", lambda: "00000000")
    with pytest.raises(StudyError, match="was changed since"):
        conduct(tiny(), tmp_path)
    assert open_store(tmp_path).rows().equals(begun.rows())


def test_a_worker_with_other_code_fails_its_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    checksums = iter(["11111111"])  # of who hands out; then that of the worker
    monkeypatch.setattr(running_module, "code_checksum", lambda: next(checksums, "22222222"))
    store = conduct(tiny(), tmp_path)
    assert not len(store.rows())
    assert set(store.errors()["error"].str.contains("the worker has other code")) == {True}


def test_what_is_no_executor_is_refused_before_anything_is_made(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="Processes"):
        conduct(tiny(), tmp_path / "s", 2)  # type: ignore[arg-type] # which is what is tested
    assert not (tmp_path / "s").exists()


def test_a_folder_without_a_study_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        open_store(tmp_path)


def test_a_strategy_that_crashes_is_reported_and_the_study_finishes(tmp_path: Path, crash: pytest.MonkeyPatch) -> None:
    store = conduct(tiny(), tmp_path)
    errors = store.errors()
    assert errors["person"].tolist() == [0, 1, 2]
    assert set(errors["strategy"]) == {"incremental"}
    assert set(errors["error"]) == {"RuntimeError: the sweep is stuck"}
    assert "in simulate" in errors["details"].iloc[0]
    assert len(store.rows()) == (12 - 3) * 2
    assert keys_run(tiny(), tmp_path) == []
    crash.undo()
    assert len(keys_run(tiny(), tmp_path, retry=True)) == 3
    assert len(store.errors()) == 0
    assert len(store.rows()) == 12 * 2


@pytest.mark.parametrize("engine", ["single", "batched"])
def test_a_replay_gives_identical_rows(folders: dict[str, Path], engine: str) -> None:
    store = open_store(folders[engine])
    for unit in store.study.units()[::3]:
        again = replay(store, unit.key)
        assert again.differing == ()
        assert len(again.kept) == len(again.again) == 2 * len(unit.sessions)


def test_a_replay_of_one_person_of_a_batch_compares_that_person(folders: dict[str, Path]) -> None:
    store = open_store(folders["batched"])
    key, person = unit_of_row(store, 3)
    assert (key, person) == ("even.gaussian.00000-00001", 1)
    assert set(replay(store, key, person).again["person"]) == {1}
    with pytest.raises(StudyError, match="not in the unit; got 2"):
        replay(store, key, 2)


def test_a_replay_says_which_columns_differ(finished: Path) -> None:
    store = open_store(finished)
    unit, rows = store.unit("even.gaussian.00001"), store.rows()
    rows = rows[rows["unit"] == unit.key]
    store.keep(unit, rows.assign(f1=rows["f1"] + 0.1, ask_ms=0.0))
    assert replay(store, "even.gaussian.00001").differing == ("f1",)


@pytest.mark.usefixtures("crash")
def test_what_cannot_be_replayed_is_told(tmp_path: Path) -> None:
    store = conduct(tiny(), tmp_path)
    with pytest.raises(StudyError, match="no such unit; got 'odd'"):
        replay(store, "odd")
    with pytest.raises(StudyError, match="not finished"):
        replay(store, "incremental.nonresponder.00001")
    with pytest.raises(StudyError, match="got 99; expected 0 to"):
        unit_of_row(store, 99)


def workers_of(process: psutil.Process) -> list[psutil.Process]:
    """The processes that loky has started for it."""
    return [child for child in process.children() if any("LokyProcess" in part for part in child.cmdline())]


@posix
@pytest.mark.slow
def test_the_death_of_a_worker_in_mid_study_loses_no_row(tmp_path: Path) -> None:
    study, killed = tiny(people=6), list[int]()
    keys: list[str] = []

    def on_done(unit: Unit, _result: object) -> None:
        keys.append(unit.key)
        if len(keys) == 4:
            victim = workers_of(psutil.Process())[0]
            victim.kill()
            killed.append(victim.pid)

    store = conduct(study, tmp_path / "killed", Processes(2), on_done=on_done)
    assert killed
    assert sorted(keys) == sorted(unit.key for unit in study.units())
    assert len(store.errors()) == 0
    pd.testing.assert_frame_equal(timeless(store.rows()), timeless(conduct(study, tmp_path / "whole").rows()))


# Whoever runs the tests in the background has its children ignore Ctrl-C.
LISTEN = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
COMMAND = [sys.executable, "-c", f"{LISTEN}; from isiw.cli import app; app()"]


@pytest.fixture
def started(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A study that runs in another process, some of it finished; its workers must not outlive it."""
    (tmp_path / "tiny.toml").write_text(TOML.replace("people = 12", "people = 40"))
    parts = tmp_path / "tiny.study" / "parts"
    command = [*COMMAND, "study", "run", str(tmp_path / "tiny.toml"), "--workers", "2"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:  # noqa: S603
        while len(list(parts.glob("*.parquet"))) < 5:
            assert process.poll() is None
            time.sleep(0.01)
        workers = workers_of(psutil.Process(process.pid))
        assert len(workers) == 2
        yield process
        assert psutil.wait_procs(workers, timeout=10)[1] == []


def finished_to_the_end(folder: Path) -> pd.DataFrame:
    """The rows of a study that was ended early, once it has gone on; what was there must not have been run again."""
    store = open_store(folder)
    before, left = store.rows(), [unit.key for unit in store.left()]
    assert len(before) >= 2 * 5
    assert len(before) // 2 + len(left) == len(store.study.units())
    assert left
    assert keys_run(store.study, folder) == left
    after = store.rows()
    pd.testing.assert_frame_equal(after[~after["unit"].isin(left)].reset_index(drop=True), before)
    return after


@posix
@pytest.mark.slow
def test_the_death_of_the_main_process_in_mid_study_loses_no_row(
    tmp_path: Path, started: subprocess.Popen[str]
) -> None:
    started.kill()
    started.wait(timeout=10)
    rows = finished_to_the_end(tmp_path / "tiny.study")
    whole = conduct(load_study(tmp_path / "tiny.toml"), tmp_path / "whole").rows()
    pd.testing.assert_frame_equal(timeless(rows), timeless(whole))


@posix
@pytest.mark.slow
def test_ctrl_c_says_that_all_is_kept_and_how_to_go_on(tmp_path: Path, started: subprocess.Popen[str]) -> None:
    os.killpg(started.pid, signal.SIGINT)  # a terminal tells the workers, too
    _, errors = started.communicate(timeout=30)
    assert started.returncode == 130, errors
    assert f"continue with: isiw study run {tmp_path / 'tiny.toml'} --out {tmp_path / 'tiny.study'}" in errors
    assert "Traceback" not in errors
    finished_to_the_end(tmp_path / "tiny.study")


@pytest.mark.parametrize("damage", [lambda whole: whole[:-20], lambda whole: whole[:100] + bytes(800) + whole[900:]])
def test_a_damaged_part_is_named_with_the_way_out(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    conduct(tiny(people=1), tmp_path)
    part = next((tmp_path / "parts").glob("*.parquet"))
    part.write_bytes(damage(part.read_bytes()))
    with pytest.raises(StudyError, match=rf"damaged.*{part.name}"):
        open_store(tmp_path).rows()


def swept(people: int = 2) -> Study:
    """A study of the conventional search, which takes a moment."""
    return tiny(strategies=(StudyStrategy("incremental"),), cohorts=("gaussian",), people=people)


def test_no_flipped_bit_of_a_part_gives_other_values_silently(tmp_path: Path) -> None:
    store = conduct(swept(people=1), tmp_path)
    part = next((tmp_path / "parts").glob("*.parquet"))
    whole, usual = part.read_bytes(), store.rows()
    for bit in np.random.default_rng(3).choice(8 * len(whole), 300, replace=False).tolist():
        flipped = bytearray(whole)
        flipped[bit // 8] ^= 1 << bit % 8
        part.write_bytes(flipped)
        with pytest.raises(StudyError, match=r"damaged.*checksum fails"):
            store.rows()
    part.write_bytes(whole)
    pd.testing.assert_frame_equal(store.rows(), usual)


def test_a_part_without_a_checksum_in_its_name_is_no_part(tmp_path: Path) -> None:
    store = conduct(swept(people=1), tmp_path)
    part = next((tmp_path / "parts").glob("*.parquet"))
    part.rename(part.with_name("even.gaussian.00000.parquet"))
    with pytest.raises(StudyError, match="damaged"):
        store.rows()


def test_a_folder_that_is_being_written_takes_no_second_writer_and_is_still_read(tmp_path: Path) -> None:
    refused: list[str] = []

    def try_it_too(unit: Any, _result: Any) -> None:
        with pytest.raises(StudyError, match=r"another process.*Wait for it") as caught:
            conduct(swept(), tmp_path)
        refused.append(str(caught.value))
        assert unit.key not in {left.key for left in open_store(tmp_path).left()}

    assert len(conduct(swept(), tmp_path, on_done=try_it_too).rows()) == 2 * 2
    assert len(refused) == 2
    assert keys_run(swept(), tmp_path) == []


def test_who_begins_a_folder_at_the_same_moment_goes_on_with_the_same_study_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = files.put

    def put_late(path: Path, content: Any, **how: Any) -> None:
        monkeypatch.setattr(store_module, "put", usual)
        begin_store(tiny(people=4), tmp_path)
        usual(path, content, **how)

    monkeypatch.setattr(store_module, "put", put_late)
    with pytest.raises(StudyError, match="people was 4, now 3"):
        begin_store(tiny(), tmp_path)
    assert open_store(tmp_path).study.people == 4


def test_a_full_disk_is_an_error_of_the_study_and_all_that_is_finished_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill(_unit: Any, _result: Any) -> None:
        monkeypatch.setattr(os, "fsync", no_room)

    with pytest.raises(StudyError, match=r"No space left.*make room"):
        conduct(swept(), tmp_path, on_done=fill)
    assert len(open_store(tmp_path).rows()) == 2
    assert not list(tmp_path.rglob("*.part"))
    with pytest.raises(StudyError, match="No space left"):
        begin_store(swept(), tmp_path / "new")
    monkeypatch.undo()
    assert len(keys_run(swept(), tmp_path)) == 1


def test_a_folder_that_cannot_be_made_is_an_error_of_the_study(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StudyError, match="cannot be written"):
        begin_store(tiny(), tmp_path / "file")
