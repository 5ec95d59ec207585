"""A rig of one's own from the command line: a starting point, its check, a session, and going on with it."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from contextlib import chdir
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from cli.conftest import Command
from isiw.cli import app
from isiw.config import load_config, session_for
from isiw.config.session import device_for
from isiw.log.record import read_session

pytestmark = pytest.mark.usefixtures("blank_pictures")


@pytest.fixture
def isiw(isiw: Command) -> Iterator[Command]:
    """The same, which imports the rig anew each time."""

    def run(*arguments: object, **given: Any) -> Result:
        sys.modules.pop("rig", None)  # each run is a process of its own, in truth
        return isiw(*arguments, **given)

    yield run
    sys.modules.pop("rig", None)


def changed(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.slow
def test_from_nothing_to_a_session_and_on(isiw: Command, tmp_path: Path) -> None:
    assert "rig.py" in isiw("new", "rig", "lab").output
    checked = isiw("check", "lab/session.toml")
    assert checked.exit_code == 0, checked.output
    assert "background EMG" in checked.output
    changed(tmp_path / "lab" / "session.toml", "max_trials = 40", "max_trials = 4")
    changed(tmp_path / "lab" / "session.toml", "max_pulses = 100", "max_pulses = 3")
    ran = isiw("run", "lab/session.toml", "--log", "s.mcap")
    assert ran.exit_code == 0, ran.output
    assert "P: probability of a window" in ran.output
    assert "This simulated person" not in ran.output
    assert (tmp_path / "s.png").exists()
    without = isiw("resume", "s.mcap")
    assert without.exit_code == 1
    assert "isiw resume s.mcap CONFIG" in without.output
    went_on = isiw("resume", "s.mcap", "lab/session.toml")
    assert went_on.exit_code == 0, went_on.output
    assert read_session("s.mcap").events[-1].kind == "limit"


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a session that has reached its limit of three pulses."""
    folder = tmp_path_factory.mktemp("ended")
    with chdir(folder):
        CliRunner().invoke(app, ["new", "rig", "."])
        changed(folder / "session.toml", "max_trials = 40", "max_trials = 6")
        changed(folder / "session.toml", "max_pulses = 100", "max_pulses = 3")
        ran = CliRunner().invoke(app, ["run", "session.toml", "--log", "s.mcap"])
    sys.modules.pop("rig", None)
    assert ran.exit_code == 0, ran.output
    return folder


@pytest.fixture
def begun(ended: Path, tmp_path: Path) -> Path:
    """The configuration of that session, in a copy of its folder."""
    shutil.copytree(ended, tmp_path, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path / "session.toml"


@pytest.mark.slow
def test_a_session_goes_on_within_the_limits_that_the_configuration_says_now(isiw: Command, begun: Path) -> None:
    changed(begun, "max_pulses = 3", "max_pulses = 5\nmax_coil_c = 40.0")
    hot = isiw("resume", "s.mcap", begun)
    assert hot.exit_code == 1
    assert "no temperature" in hot.output
    assert f"The limits are under [limits] in {begun}" in hot.output
    assert hot.stdout.endswith(f"The log is kept; resume with: isiw resume s.mcap {begun}\n")
    assert len(read_session("s.mcap").table) == 3
    changed(begun, "\nmax_coil_c = 40.0", "")
    changed(begun, "background_uv = 10.0", "background_uv = 25.0")
    changed(begun, 'factory = "rig:make"', 'timeout_s = 7.0\nfactory = "rig:make"')
    result = isiw("resume", "s.mcap", begun)
    assert result.exit_code == 0, result.output
    assert "limits.max_coil_c is not set from here on; it was 40.0." in result.output
    assert "device.timeout_s is 7.0 from here on; it was 30.0." in result.output
    assert "signals.background_uv is 25.0 from here on; it was 10.0." in result.output
    record = read_session("s.mcap")
    assert len(record.table) == 5
    assert (record.header.limits.max_pulses, record.header.limits.min_iti_s) == (5, 5.0)
    assert (record.header.signals.background_uv, record.header.timeout_s) == (25.0, 7.0)


@pytest.mark.slow
def test_a_session_that_its_limits_have_ended_says_which_file_to_change(isiw: Command, begun: Path) -> None:
    for output in (isiw("resume", "s.mcap", begun).output, isiw("run", begun, "--log", "new.mcap").output):
        assert f"a higher max_pulses under [limits] in {begun}, then resume with: isiw resume" in output
        assert output.endswith(f".mcap {begun}\n")


@pytest.mark.slow
def test_a_session_that_was_over_says_so_when_it_is_resumed_and_how_the_person_goes_on(
    isiw: Command, begun: Path
) -> None:
    changed(begun, "max_trials = 6", "max_trials = 2")
    ran = isiw("run", begun, "--log", "over.mcap")
    assert (ran.exit_code, "is over" in ran.output) == (0, False)
    resumed = isiw("resume", "over.mcap", begun)
    assert resumed.exit_code == 0
    assert "The session is over, so no stimulus was delivered." in resumed.output
    command = f"isiw run {begun} --after over.mcap"
    assert resumed.output.endswith(f"{command}\n")
    assert isiw(*command.split()[1:], "--log", "another.mcap").exit_code == 0


@pytest.mark.slow
def test_a_session_that_was_over_and_learns_nothing_goes_on_without_what_it_found(isiw: Command, begun: Path) -> None:
    changed(begun, "max_trials = 6", "max_trials = 2")
    isiw("run", begun, "--strategy", "gp-ei", "--log", "over.mcap")
    assert isiw("resume", "over.mcap", begun).output.endswith(f"isiw run {begun}\n")


def test_a_log_and_a_configuration_in_the_wrong_order_are_told_with_the_right_command(
    isiw: Command, begun: Path
) -> None:
    result = isiw("resume", begun, "s.mcap")
    assert result.exit_code == 1
    assert f"are swapped; got '{begun} s.mcap'" in result.output
    assert f"Type: isiw resume s.mcap {begun}" in result.output
    alone = isiw("resume", begun)
    assert alone.exit_code == 3
    assert "swapped" not in alone.output


def test_a_section_that_the_configuration_does_not_have_stays_as_it_was_logged(isiw: Command, begun: Path) -> None:
    text = begun.read_text()
    begun.write_text(text[: text.index("[limits]")] + text[text.index("[protocol]") : text.index("[signals]")])
    assert isiw("resume", "s.mcap", begun).exit_code == 0
    header = read_session("s.mcap").header
    assert (header.limits.max_pulses, header.signals.mep_window_ms) == (3, (15.0, 35.0))


def test_what_cannot_change_on_the_way_is_refused_or_said(isiw: Command, begun: Path) -> None:
    changed(begun, "max_trials = 6", "max_trials = 4")
    changed(begun, "rest_s = 120.0", "rest_s = 60.0")
    changed(begun, "day = 1", "day = 2")
    result = isiw("resume", "s.mcap", begun)
    assert result.exit_code == 0
    assert "strategy.settings.max_trials stays as the session began, 6; the configuration says 4." in result.output
    assert "protocol.rest_s stays as the session began, 120.0; the configuration says 60.0." in result.output
    assert "visit.day stays as the session began, 1; the configuration says 2." in result.output
    assert result.output.count("stays as the session began") == 3
    changed(begun, "high_ms = 320.0", "high_ms = 100.0")
    refused = isiw("resume", "s.mcap", begun)
    assert refused.exit_code == 1
    assert "the design space that it began with" in refused.output
    assert "space.high_ms = 100.0" in refused.output
    assert "space.high_ms = 320.0" in refused.output


def test_a_log_does_not_go_on_with_the_next_persons_configuration(isiw: Command, tmp_path: Path) -> None:
    isiw("new", "rig", ".")
    changed(tmp_path / "session.toml", "max_trials = 40", "max_trials = 2")
    assert isiw("run", "session.toml", "--log", "P01.mcap").exit_code == 0
    before = (tmp_path / "P01.mcap").read_bytes()
    changed(tmp_path / "session.toml", 'subject = "P01"', 'subject = "P02"')
    refused = isiw("resume", "P01.mcap", "session.toml")
    assert refused.exit_code == 1
    assert "another person's" in refused.output
    assert "visit.subject" in refused.output
    assert (tmp_path / "P01.mcap").read_bytes() == before


def test_a_faulty_rig_fails_its_check_with_a_table_and_the_fault(isiw: Command, tmp_path: Path) -> None:
    isiw("new", "rig", ".")
    changed(tmp_path / "rig.py", 'Channel(emg_mv, RATE_HZ, "mV"', 'Channel(1e3 * emg_mv, RATE_HZ, "mV"')
    checked = isiw("check", "session.toml")
    assert checked.exit_code == 1
    assert "background EMG" in checked.output
    assert "in µV, and described as mV" in checked.output


def test_a_configuration_without_a_device_has_nothing_to_check_and_is_told_how_to_name_one(
    isiw: Command, tmp_path: Path
) -> None:
    (tmp_path / "c.toml").write_text("seed = 1\n", encoding="utf-8")
    result = isiw("check", "c.toml")
    assert result.exit_code == 1
    assert (
        "c.toml names no device of your own, so there is nothing to check; expected a section [device]" in result.output
    )
    assert 'factory = "rig:make"' in result.output


def test_a_persons_code_is_not_taken_for_a_kind_of_simulation(isiw: Command, tmp_path: Path) -> None:
    isiw("new", "rig", ".")
    result = isiw("run", "session.toml", "--subject", "P07")
    assert result.exit_code == 1
    assert 'under [visit] write subject = "P07"' in result.output
    assert list(tmp_path.glob("*.mcap*")) == []
    assert "Did you mean recorded?" in isiw("run", "--subject", "recordd").output


def test_a_refusal_before_the_first_trial_says_how_to_go_on_and_one_before_the_log_does_not(
    isiw: Command, tmp_path: Path
) -> None:
    isiw("new", "rig", ".")
    changed(tmp_path / "rig.py", "self.armed = True", 'raise isiw.errors.DeviceError("no cable")')
    assert "resume with" not in isiw("run", "session.toml", "--log", "s.mcap").output
    assert not (tmp_path / "s.mcap").exists()
    not_ready = "\n    def readiness(self):\n        return isiw.Readiness(ready=False)\n\n    def deliver("
    changed(tmp_path / "rig.py", 'raise isiw.errors.DeviceError("no cable")', "self.armed = True")
    changed(tmp_path / "rig.py", "\n    def deliver(", not_ready)
    refused = isiw("run", "session.toml", "--log", "s.mcap")
    assert refused.exit_code == 1
    assert "The log is kept; resume with: isiw resume s.mcap session.toml" in refused.output
    assert "limit (no trial): " in isiw("show", "s.mcap").output


def test_a_rig_that_stimulates_is_checked_only_when_somebody_says_so(isiw: Command, tmp_path: Path) -> None:
    isiw("new", "rig", ".")
    changed(tmp_path / "session.toml", "simulated = true", "simulated = false")
    refused = isiw("check", "session.toml", input="n\n")
    assert refused.exit_code == 1
    assert "Is the coil on a phantom?" in refused.output
    assert "background EMG" not in refused.output


def test_a_check_keeps_the_limits_of_its_configuration(isiw: Command, tmp_path: Path) -> None:
    isiw("new", "rig", ".")
    changed(tmp_path / "session.toml", "max_pulses = 100", "max_pulses = 100\nmax_coil_c = 40.0")
    refused = isiw("check", "session.toml")
    assert refused.exit_code == 1
    assert "the coil is too hot, or its temperature is not known; got 'no temperature'" in refused.output
    assert "background EMG" not in refused.output


def test_a_driver_beside_the_rig_may_be_imported_late(isiw: Command, tmp_path: Path) -> None:
    isiw("new", "rig", ".")
    (tmp_path / "vendor_driver.py").write_text("SIMULATED = True\n", encoding="utf-8")
    rig = (tmp_path / "rig.py").read_text(encoding="utf-8")
    (tmp_path / "rig.py").write_text(
        rig + "\n\ndef late(simulated):\n    from vendor_driver import SIMULATED\n\n    return make(SIMULATED)\n",
        encoding="utf-8",
    )
    changed(tmp_path / "session.toml", "rig:make", "rig:late")
    changed(tmp_path / "session.toml", "max_trials = 40", "max_trials = 2")
    result = isiw("run", "session.toml", "--log", "s.mcap")
    assert result.exit_code == 0, result.output


def test_a_session_that_pauses_where_nobody_is_ends_with_a_code_of_its_own(isiw: Command, tmp_path: Path) -> None:
    isiw("new", "rig", ".")
    changed(tmp_path / "rig.py", 'Channel(emg_mv, RATE_HZ, "mV"', 'Channel(1e3 * emg_mv, RATE_HZ, "mV"')
    result = isiw("run", "session.toml", "--log", "a lab.mcap")
    assert result.exit_code == 5
    assert "The session is paused" in result.output
    assert "resume with: isiw resume 'a lab.mcap' session.toml" in result.output
    assert "isiw resume 'a lab.mcap' CONFIG, where CONFIG names your device" in isiw("show", "a lab.mcap").output


def test_recordings_that_would_be_ignored_are_refused(isiw: Command, tmp_path: Path, log: Path) -> None:
    (tmp_path / "c.toml").write_text('[subject]\ndata = "recordings"\n', encoding="utf-8")
    for words in (["run", "c.toml"], ["resume", log, "--data", "recordings"]):
        result = isiw(*words)
        assert result.exit_code == 1
        assert "would be ignored" in result.output


@pytest.mark.slow
def test_a_log_that_was_made_before_slips_were_refused_is_read_and_goes_on(
    isiw: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for place in ("isiw.session.stated", "isiw.strategy.catalogue"):
        monkeypatch.setattr(f"{place}.require_percent", lambda *_: None)
    short = "[strategy.settings]\nmax_trials = 3\nparticles = 100\n"
    (tmp_path / "c.toml").write_text(short, encoding="utf-8")
    config = load_config(tmp_path / "c.toml")
    device = device_for(config)
    monkeypatch.setattr("isiw.config.session.device_for", lambda _config: device)
    slips = {"subject": config.subject.model_copy(update={"data": tmp_path}),
             "visit": replace(config.visit, intensity_pct_rmt=1.2)}  # fmt: skip
    session_for(config.model_copy(update={**slips, "log": tmp_path / "old.mcap"})).run()
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    for command in ("show", "plot", "resume"):
        result = isiw(command, "old.mcap")
        assert result.exit_code == 0, result.output


def test_a_simulated_session_does_not_go_on_with_another_simulated_person(isiw: Command, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text("[strategy.settings]\nmax_trials = 2\nparticles = 100\n", encoding="utf-8")
    isiw("run", "c.toml", "--seed", 3, "--log", "s.mcap")
    assert isiw("resume", "s.mcap", "c.toml").exit_code == 0  # the log's seed, since the file states none
    (tmp_path / "c.toml").write_text(
        "seed = 4\n[strategy.settings]\nmax_trials = 2\nparticles = 100\n", encoding="utf-8"
    )
    refused = isiw("resume", "s.mcap", "c.toml")
    assert refused.exit_code == 1
    assert "simulates another person" in refused.output
    assert isiw("resume", "s.mcap").exit_code == 0


@pytest.mark.parametrize("source", ["nope.mcap", ".", "logs/P01"])
def test_a_path_without_a_log_has_no_timing(isiw: Command, source: str) -> None:
    result = isiw("timing", source)
    assert result.exit_code == 1
    assert "there is no such log" in result.output


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('raise RuntimeError("no cable")', "error: RuntimeError: no cable (rig.py, line "),
        ("raise SystemExit(0)", "error: SystemExit: 0 (rig.py, line "),
    ],
)
def test_what_a_rig_raises_is_shown_where_it_happened_and_how_to_go_on_last(
    isiw: Command, tmp_path: Path, line: str, words: str
) -> None:
    isiw("new", "rig", ".")
    text = (tmp_path / "rig.py").read_text(encoding="utf-8")
    head, deliver, body = text.partition("def deliver")
    signature, _, rest = body.partition("\n")
    broken = f"{head}{deliver}{signature}\n        if stimulus.trial == 1:\n            {line}\n{rest}"
    (tmp_path / "rig.py").write_text(broken, encoding="utf-8")
    result = isiw("run", "session.toml", "--log", "s.mcap")
    assert result.exit_code == 1
    assert "Traceback" in result.output
    assert words in result.output
    last = "The session ended early. Its log is safe; resume with: isiw resume s.mcap session.toml"
    assert result.output.splitlines()[-1] == last
