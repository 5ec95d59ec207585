from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cli.conftest import Command
from isiw import priors
from isiw.cli.console import DAMAGED
from isiw.log.record import read_session
from logs import damage

pytestmark = pytest.mark.usefixtures("few_sweeps", "blank_pictures")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: Any) -> Any:
    """Logs of two people, and the lab's prior learnt from them."""
    return tmp_path_factory.mktemp("lab")


@pytest.fixture
def isiw(isiw: Command, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """The same, in the folder of the logs."""
    monkeypatch.chdir(folder)
    return isiw


@pytest.fixture
def logs(isiw: Command, folder: Path) -> Any:
    (folder / "short.toml").write_text("[strategy.settings]\nmax_trials = 3\nparticles = 200\n")
    paths = [folder / f"{seed}.mcap" for seed in (1, 2)]
    for seed, path in enumerate(paths, start=1):
        if not path.exists():
            assert isiw("run", "short.toml", "--seed", seed, "--log", path).exit_code == 0
    return paths


@pytest.fixture
def lab(isiw: Command, logs: Any, folder: Path) -> Any:
    if not (folder / "lab.toml").exists():
        result = isiw("prior", "learn", *logs, "-o", "lab.toml")
        assert result.exit_code == 0, result.output
        assert "Learnt from 2 sessions with 6 trials" in result.output
        assert "isiw run CONFIG --prior lab.toml" in result.output
    return folder / "lab.toml"


@pytest.mark.slow
def test_a_lab_prior_is_shown_beside_the_built_in_one_and_drawn(isiw: Command, lab: Any, folder: Path) -> None:
    result = isiw("prior", "show", lab, "-o", "lab.png")
    assert result.exit_code == 0, result.output
    assert "EMG floor [mV]" in result.output
    assert "built-in median" in result.output
    assert (folder / "lab.png").exists()


@pytest.mark.parametrize("flags", [(), ("--overwrite",)])
def test_learning_replaces_no_log_and_asks_before_the_work_begins(isiw: Command, logs: Any, flags: Any) -> None:
    before = logs[0].read_bytes()
    result = isiw("prior", "learn", *logs, "-o", logs[0], *flags)
    assert result.exit_code == 1
    assert result.output.startswith("Learning from 2 sessions …\n")
    assert "overwritten" in result.output
    assert "of 2" not in result.output  # the count of a work that has begun
    assert logs[0].read_bytes() == before


@pytest.mark.slow
def test_a_prior_and_its_picture_are_replaced_only_where_that_is_asked_for(
    isiw: Command, lab: Any, folder: Path
) -> None:
    picture = folder / "kept.png"
    picture.write_bytes(b"kept")
    for command in (("learn", folder / "1.mcap", "-o", lab), ("show", lab, "-o", picture)):
        before = lab.read_bytes()
        refused = isiw("prior", *command)
        assert refused.exit_code == 1
        assert "--overwrite" in refused.output
        assert (lab.read_bytes(), picture.read_bytes()) == (before, b"kept")
    assert isiw("prior", "show", lab, "-o", picture, "--overwrite").exit_code == 0
    assert picture.read_bytes() != b"kept"


@pytest.mark.slow
def test_a_session_is_run_with_a_lab_prior_and_its_log_holds_the_numbers(isiw: Command, lab: Any, folder: Path) -> None:
    result = isiw("run", "short.toml", "--prior", lab, "--log", "with.mcap")
    assert result.exit_code == 0, result.output
    places = read_session(folder / "with.mcap").header.strategy.settings["prior"]["profile"]["places"]
    assert [place["share"] for place in places] == [p.share for p in priors.load(lab).profile.places]


def test_a_session_starts_from_earlier_ones_of_the_person(isiw: Command, logs: Any, folder: Path) -> None:
    result = isiw("run", "short.toml", "--after", logs[0], "--log", "after.mcap")
    assert result.exit_code == 0, result.output
    header = read_session(folder / "after.mcap").header
    expected = priors.after(read_session(logs[0]))
    assert [floor["share"] for floor in header.strategy.settings["prior"]["floors"]] == [
        floor.share for floor in expected.floors
    ]
    assert header.config["isiw_run"]["after"] == [str(logs[0])]


@pytest.mark.slow
def test_a_session_with_a_prior_from_earlier_ones_is_resumed_without_their_files(
    isiw: Command, logs: Any, folder: Path
) -> None:
    gone = folder / "gone.mcap"
    gone.write_bytes(logs[0].read_bytes())
    assert isiw("run", "short.toml", "--after", gone, "--log", "resumed.mcap").exit_code == 0
    gone.unlink()
    result = isiw("resume", "resumed.mcap")
    assert result.exit_code == 0, result.output


def test_the_same_person_twice_is_refused_with_the_way_out(isiw: Command, logs: Any, folder: Path) -> None:
    (folder / "copy").mkdir()
    assert isiw("run", "short.toml", "--seed", 1, "--log", folder / "copy" / "second.mcap").exit_code == 0
    result = isiw("prior", "learn", logs[0], folder / "copy" / "second.mcap", "-o", "twice.toml")
    assert result.exit_code == 1
    assert "--again" in result.output
    assert not (folder / "twice.toml").exists()


def test_a_damaged_log_is_refused_or_learnt_with_a_warning_as_told(isiw: Command, logs: Any, folder: Path) -> None:
    damaged = folder / "damaged.mcap"
    damaged.write_bytes(logs[0].read_bytes())
    damage(damaged)
    for command, way_on in (
        (("prior", "learn", damaged, "-o", "d.toml"), "isiw prior learn --damaged"),
        (("run", "short.toml", "--after", damaged, "--log", "d2.mcap"), "damaged=True"),
        (("run", "short.toml", "--earlier", damaged, "--log", "d2.mcap"), "isiw export, then isiw analyse"),
    ):
        refused = isiw(*command)
        assert refused.exit_code == DAMAGED, refused.output
        assert "damaged.mcap: " in refused.output
        assert way_on in refused.output
    assert not (folder / "d.toml").exists()
    assert not list(folder.glob("d2.mcap*"))
    learnt = isiw("prior", "learn", damaged, "--damaged", "-o", "d.toml")
    assert learnt.exit_code == DAMAGED, learnt.output
    assert "damaged.mcap: " in learnt.output
    assert (folder / "d.toml").exists()


def test_a_prior_that_is_not_there_is_named(isiw: Command) -> None:
    result = isiw("run", "--prior", "nowhere.toml", "--log", "n.mcap")
    assert result.exit_code == 1
    assert "nowhere.toml" in result.output


def test_a_prior_among_the_settings_excludes_one_from_earlier_sessions(isiw: Command, lab: Any, folder: Path) -> None:
    (folder / "both.toml").write_text("[strategy.settings.prior.profile]\np_window = 0.5\n")
    result = isiw("run", "both.toml", "--prior", lab, "--log", "b.mcap")
    assert result.exit_code == 1
    assert "exclude each other" in result.output


def test_only_a_prior_is_replaced_by_a_prior(isiw: Command, logs: Any, lab: Path, folder: Path) -> None:
    content = (folder / "short.toml").read_text()
    refused = isiw("prior", "learn", *logs, "-o", "short.toml", "--overwrite")
    assert "the file that is there is not a lab's prior" in refused.output
    assert (folder / "short.toml").read_text() == content
    assert isiw("prior", "learn", *logs, "-o", lab, "--overwrite").exit_code == 0


def test_a_session_counts_once_however_its_logs_are_named(isiw: Command, logs: Any, folder: Path) -> None:
    copy = folder / "copied.mcap"
    copy.write_bytes(logs[0].read_bytes())
    assert isiw("exclude", copy, 0, "--reason", "coil slipped").exit_code == 0
    for twice in (
        ("--earlier", logs[0], "--earlier", logs[0]),
        ("--earlier", logs[0], "--after", logs[0]),
        ("--earlier", logs[0], "--earlier", copy),
        ("--after", logs[0], "--after", copy),
    ):
        refused = isiw("run", "short.toml", *twice, "--log", "t.mcap")
        assert refused.exit_code == 1
        assert "two logs are of the same session" in refused.output
        assert not list(folder.glob("t.mcap*"))
    refused = isiw("prior", "learn", logs[0], copy, "--again", "-o", "t.toml")
    assert "two logs are of the same session" in refused.output
