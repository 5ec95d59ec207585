from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from isiw.cli import app
from isiw.session import read_threshold
from isiw.session.threshold import search_of


def run(*arguments: object, typed: str | None = None) -> Result:
    return CliRunner().invoke(app, ["threshold", *map(str, arguments)], input=typed)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    log = tmp_path_factory.mktemp("threshold") / "t.mcap"
    result = run(log, "--method", "maximum-likelihood", "--seed", 3)
    assert result.exit_code == 0, result.output
    return log


def test_a_simulated_persons_threshold_is_found_and_told_beside_the_true_one(finished: Path) -> None:
    result = run(finished, "--show")
    assert result.exit_code == 0
    assert "Resting motor threshold: " in result.output
    assert "true threshold is" in result.output
    assert "17 pulses, learnt from 17." in result.output


def test_resuming_what_is_over_changes_nothing(finished: Path) -> None:
    before = run(finished, "--show").output
    result = run(finished, "--resume")
    assert result.exit_code == 0
    assert run(finished, "--show").output == before


def test_a_search_that_its_limit_ends_says_so_and_what_was_found(tmp_path: Path) -> None:
    log = tmp_path / "t.mcap"
    for arguments, code in ((("--max-pulses", 3), 1), (("--show",), 0), (("--resume",), 1)):
        result = run(log, *arguments)
        assert result.exit_code == code
        assert "Resting motor threshold: " in result.output
        assert "Ended by its limit of 3 pulses." in result.output
        assert "Resume with" not in result.output


def test_by_hand_the_highest_intensity_has_to_be_given(tmp_path: Path) -> None:
    result = run(tmp_path / "t.mcap", "--by-hand")
    assert result.exit_code == 1
    assert "--high" in result.output
    assert list(tmp_path.iterdir()) == []


def test_by_hand_what_is_typed_is_logged_and_nothing_beyond_the_limit_is_asked(tmp_path: Path) -> None:
    log = tmp_path / "t.mcap"
    options = ("--by-hand", "--high", 60, "--min-iti-s", 0, "--subject", "P1")
    result = run(log, *options, typed="n\n" * 20)
    assert result.exit_code == 0, result.output
    assert "set 61 % MSO" not in result.output
    assert "set 60 % MSO" in result.output
    assert "(this range ends at 60 % MSO)" in result.output
    again = run(log, *options)
    assert again.exit_code == 1
    assert "--resume" in again.output


@pytest.mark.parametrize("how", ["--resume", "--show"])
@pytest.mark.parametrize(
    "option",
    ["--high", "--low", "--step", "--max-pulses", "--min-iti-s", "--method", "--subject", "--cohort", "--seed"],
)
def test_a_limit_that_a_log_would_not_keep_is_refused_and_not_ignored(finished: Path, how: str, option: str) -> None:
    result = run(finished, how, option, 50)
    assert result.exit_code == 1
    assert f"got '{option}'" in result.output


@pytest.mark.parametrize("option", ["--cohort", "--seed"])
def test_nobody_is_simulated_by_hand(tmp_path: Path, option: str) -> None:
    result = run(tmp_path / "t.mcap", "--by-hand", "--high", 60, option, 1)
    assert result.exit_code == 1
    assert f"got '{option}'" in result.output
    assert list(tmp_path.iterdir()) == []


def test_a_single_pulse_is_counted_in_the_singular_and_one_that_was_not_given_not_at_all(tmp_path: Path) -> None:
    log = tmp_path / "t.mcap"
    result = run(log, "--by-hand", "--high", 60, "--min-iti-s", 0, typed="n\nq\n")
    assert result.exit_code == 0, result.output
    assert "\n1 pulse, learnt from 1." in result.output


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [(("--high", "120"), "from 1 to 100"), (("--method", "best"), "unknown"), (("--cohort", "gaussian"), "unknown")],
)
def test_what_cannot_be_is_an_error(tmp_path: Path, arguments: tuple[str, str], complaint: str) -> None:
    result = run(tmp_path / "t.mcap", *arguments)
    assert result.exit_code == 1
    assert complaint in result.output
    assert list(tmp_path.iterdir()) == []


def test_the_log_of_a_threshold_is_not_shown_as_a_session(finished: Path) -> None:
    result = CliRunner().invoke(app, ["show", str(finished)])
    assert result.exit_code == 1
    assert "isiw threshold" in result.output


def test_more_than_five_of_ten_is_an_option_that_its_log_keeps(tmp_path: Path) -> None:
    log = tmp_path / "t.mcap"
    result = run(log, "--method", "five-of-ten", "--enough", 6, "--seed", 3)
    assert result.exit_code == 0, result.output
    assert search_of(read_threshold(log)).settings["enough"] == 6


def test_only_five_of_ten_counts_responses(tmp_path: Path) -> None:
    result = run(tmp_path / "t.mcap", "--enough", 6)
    assert result.exit_code == 1
    assert "an option is of --method five-of-ten alone; got '--enough'" in result.output
    assert "of --method curve alone; got '--at, --each'" in run(tmp_path / "t.mcap", "--at", 60, "--each", 2).output


@pytest.mark.slow
def test_the_hot_spot_of_a_simulated_person_is_found_and_shown(tmp_path: Path) -> None:
    result = run(tmp_path / "t.mcap", "--method", "hot-spot", "--high", 75, "--cohort", "hand", "--seed", 6)
    assert result.exit_code == 0, result.output
    assert "75 % MSO, coil " in result.output
    assert "true hot spot is " in run(tmp_path / "t.mcap", "--show").output


def test_pulses_over_the_curve_are_those_that_were_named(tmp_path: Path) -> None:
    words = (tmp_path / "c.mcap", "--method", "curve", "--at", 40, "--at", 60, "--each", 2, "--muscle", "FCR")
    result = run(*words, "--by-hand", "--high", 60, "--min-iti-s", 0, "--seed", 3, typed="0.01\n0.4\n0.4\n0.01\n\n")
    assert result.exit_code == 0, result.output
    assert "All 4 pulses over the curve were given." in result.output
    record = read_threshold(tmp_path / "c.mcap")
    assert (record.header.muscle, record.header.search.settings["seed"]) == ("FCR", 3)
    assert sorted(outcome.intensity_pct_mso or 0.0 for outcome in record.outcomes) == [40.0, 40.0, 60.0, 60.0]
    beyond = run(tmp_path / "d.mcap", "--method", "curve", "--at", 70, "--by-hand", "--high", 60)
    assert beyond.exit_code == 1
    assert "beyond the limits" in beyond.output
    assert not (tmp_path / "d.mcap").exists()
