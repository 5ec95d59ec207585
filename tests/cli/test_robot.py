"""The dissertation's closed loop from the command line: the simulated robots that a configuration names by kind."""

from __future__ import annotations

from pathlib import Path

import pytest

from cli.conftest import Command
from isiw.config import load_config, session_for
from isiw.config.resume import device_of_log, truth_of
from isiw.errors import ConfigError, DeviceError
from isiw.log.record import SessionRecord, read_session
from isiw.trials import Status
from known import known
from logs import blocks_of

pytestmark = pytest.mark.usefixtures("blank_pictures")

ROBOT = """
seed = 3
[device]
kind = "{kind}"
[device.settings]
rate_hz = 2000.0
{settings}
[subject]
cohort = "gaussian"
[space]
reference = "impact"
low_ms = {low_ms}
high_ms = 320
[strategy.settings]
max_trials = {trials}
particles = 60
[protocol]
tms_alone = 0.2
tap_alone = 0.1
block_trials = 4
rest_s = 60
"""


def configured(folder: Path, kind: str = "tapper", settings: str = "", low_ms: int = 0, trials: int = 6) -> Path:
    path = folder / "robot.toml"
    path.write_text(ROBOT.format(kind=kind, settings=settings, low_ms=low_ms, trials=trials))
    return path


def killed_after(log: Path, trials: int, torn: Path) -> SessionRecord:
    """What a kill leaves of a log when so many trials were concluded."""
    whole = log.read_bytes()
    for _, end in blocks_of(log):
        torn.write_bytes(whole[:end])
        record = read_session(torn)
        if len(record.estimates) == trials and not record.unknown:
            return record
    raise AssertionError("no such place")


@pytest.mark.slow
def test_the_closed_loop_on_raw_sweeps_runs_and_goes_on_after_a_kill(isiw: Command, tmp_path: Path) -> None:
    config = configured(tmp_path)
    ran = isiw("run", config, "--log", "whole.mcap")
    assert ran.exit_code == 0, ran.output
    whole = read_session("whole.mcap")
    assert set(whole.sweep(0)) == {"valve", "pressure", "acceleration", "emg"}
    assert {trial.status for trial in whole.table} == {Status.ACCEPTED}
    assert any(trial.commanded_isi_ms is None and not trial.tap_alone for trial in whole.table)  # TMS alone
    realised = [t.isi_ms - t.commanded_isi_ms for t in whole.table if t.isi_ms is not None and t.commanded_isi_ms]
    assert 0 < max(map(abs, realised)) < 12  # detected in the sweep, not copied from the command
    rests = [later.t_s - before.t_s for before, later in zip(whole.intents, whole.intents[1:], strict=False)]
    assert rests[3] >= 60 > rests[0]

    killed_after(Path("whole.mcap"), 5, Path("killed.mcap.part"))
    resumed = isiw("resume", "killed.mcap")
    assert resumed.exit_code == 0, resumed.output
    assert read_session("killed.mcap").table == whole.table

    reported = isiw("report", "killed.mcap")
    assert reported.exit_code == 0, reported.output
    assert "acceleration" in Path("killed.html").read_text("utf-8")


@pytest.mark.slow
def test_the_vane_turns_the_wrist_in_the_sweeps_of_a_session(isiw: Command, tmp_path: Path) -> None:
    settings = 'geometry = "subject3"\nwait_ms = 80.0\nvane = { rotor = { height_mm = 20, depth_mm = 150 } }'
    ran = isiw("run", configured(tmp_path, "rotating-tapper", settings, trials=2), "--log", "vane.mcap")
    assert ran.exit_code == 0, ran.output
    record = read_session("vane.mcap")
    first = next(trial.index for trial in record.table if trial.commanded_isi_ms is not None)
    assert max(record.sweep(first)["angle"].values) > 170
    assert record.header.config["isiw_run"]["device"]["settings"]["geometry"] == "subject3"


def test_the_true_window_is_that_of_the_person_under_the_robot(tmp_path: Path) -> None:
    """From the valve command it depends on when the hammer hits, which is the wrist's."""
    text = configured(tmp_path, settings='geometry = "bench"', trials=1).read_text()
    (tmp_path / "robot.toml").write_text(text.replace('"impact"', '"valve"').replace("320", "500"))
    windows = []
    for geometry in ("bench", "subject2"):
        (tmp_path / "robot.toml").write_text((tmp_path / "robot.toml").read_text().replace("bench", geometry))
        config = load_config(tmp_path / "robot.toml").with_overrides(log=tmp_path / f"{geometry}.mcap")
        record = read_session(session_for(config).run(progress=False).log)
        assert device_of_log(record).describe() == record.header.device
        windows.append(known(truth_of(record).window))
    assert windows[0].start_ms - windows[1].start_ms == 188 - 172


@pytest.mark.parametrize(
    ("settings", "parts"),
    [
        ("sampling = 7", ["device.settings", "sampling", "geometry"]),
        ("rate_hz = 1e9", ["rate_hz", "100000"]),
        ('geometry = "nobody"', ["preset of the tapping robot", "nobody", "subject1"]),
        ("accelerometer = false", ["without an accelerometer"]),
        ("wait_ms = 80.0", ["wait_ms"]),  # which the robot without the vane does not have
    ],
)
def test_a_setting_that_the_robot_cannot_use_is_named_with_the_file(
    tmp_path: Path, settings: str, parts: list[str]
) -> None:
    path = configured(tmp_path, settings=settings)
    if "rate_hz" in settings:
        path.write_text(path.read_text().replace("rate_hz = 2000.0\n", ""))
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    for part in ("robot.toml", *parts):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("was", "becomes", "part"),
    [
        ('kind = "tapper"', "", "either a factory"),
        ('kind = "tapper"', 'kind = "tapper"\nfactory = "rig:make"', "either a factory"),
        ('kind = "tapper"', 'kind = "hammer"', "'tapper' or 'rotating-tapper'"),
        ('cohort = "gaussian"', 'cohort = "electrical"', "conditioned by electrical"),
        ('cohort = "gaussian"', 'kind = "recorded"', "records its own EMG"),
    ],
)
def test_a_device_that_is_neither_a_rig_nor_a_robot_for_this_person_is_refused(
    tmp_path: Path, was: str, becomes: str, part: str
) -> None:
    path = configured(tmp_path)
    path.write_text(path.read_text().replace(was, becomes))
    with pytest.raises(ConfigError, match=part):
        load_config(path)


def test_isis_that_the_impact_cannot_trigger_are_refused_before_the_session(tmp_path: Path) -> None:
    with pytest.raises((ConfigError, DeviceError), match="cannot come so soon after the impact"):
        load_config(configured(tmp_path, settings='trigger = "impact"'))
    load_config(configured(tmp_path, settings='trigger = "impact"', low_ms=5))


def test_a_session_goes_on_at_the_robot_that_it_began_with(isiw: Command, tmp_path: Path) -> None:
    assert isiw("run", configured(tmp_path, trials=1), "--log", "s.mcap").exit_code == 0
    other = isiw("resume", "s.mcap", configured(tmp_path, settings='geometry = "subject2"', trials=1))
    assert other.exit_code == 1
    assert "another robot" in other.output
