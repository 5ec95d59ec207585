"""The two steps of [Kim2020, 8.1.3] by configuration: a window below the threshold, then the search above it."""

from pathlib import Path

import pytest

import isiw
from isiw.config.run import RunConfig
from isiw.config.session import session_for
from isiw.errors import ConfigError
from isiw.report.words import final_statement
from isiw.session.sink import SessionUpdate

SPACE = {"low_ms": 0.0, "high_ms": 120.0, "reference": "impact"}


def configured(log: Path, name: str, pct_rmt: float, **more: object) -> RunConfig:
    """A configuration of a simulated person."""
    settings = {"particles": 100, "max_trials": 4}
    return RunConfig.model_validate(
        {
            "seed": 3,
            "log": log,
            "subject": {"cohort": "supra-threshold"},
            "space": SPACE,
            "visit": {"intensity_pct_rmt": pct_rmt},
            "strategy": {"name": name, "settings": settings},
            **more,
        }
    )


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a session below the threshold."""
    log = tmp_path_factory.mktemp("first") / "sub.mcap"
    session_for(configured(log, "default", 90.0)).run()
    return log


def test_a_search_above_the_threshold_goes_on_from_the_window_below_it(tmp_path: Path, first: Path) -> None:
    session = session_for(configured(tmp_path / "supra.mcap", "supra-threshold", 120.0, after=(first,)))
    session.run()
    record = isiw.read_session(tmp_path / "supra.mcap")
    assert record.header.first_step is not None
    assert record.header.first_step.intensity_pct_rmt == 90.0
    assert "The profile correlates with that at 90 % of RMT (sub.mcap) by" in final_statement(record)
    assert len(record.header.strategy.settings["prior"]["start"]["spans"]) > 2


def test_it_resumes_with_the_same_asks_and_the_same_first_step(tmp_path: Path, first: Path) -> None:
    config = configured(tmp_path / "whole.mcap", "supra-threshold", 120.0, after=(first,))
    whole = session_for(config).run().trials

    class DeathError(Exception):
        """Ends the process, as far as a test can."""

    def die_at(update: SessionUpdate) -> None:
        if update.trial.index == 1:
            raise DeathError

    cut = tmp_path / "cut.mcap"
    config = config.model_copy(update={"log": cut})
    session = session_for(config)
    session._sink.on_trial = die_at  # noqa: SLF001 - the way in for who looks on
    with pytest.raises(DeathError):
        session.run()
    first.rename(first.with_name("gone.mcap"))  # what it was learnt from is in the log
    try:
        resumed = isiw.resume(cut, isiw.config.resume.device_of_log(isiw.read_session(cut), None))
        resumed.run()
    finally:
        first.with_name("gone.mcap").rename(first)
    assert [t.commanded_isi_ms for t in resumed.trials] == [t.commanded_isi_ms for t in whole]
    assert isiw.read_session(cut).header.first_step is not None


def test_a_session_of_another_muscle_is_no_first_step(tmp_path: Path) -> None:
    log = tmp_path / "ecr.mcap"
    visit = {"intensity_pct_rmt": 90.0, "muscle": "ECR"}
    session_for(configured(log, "default", 90.0, visit=visit)).run()
    visit = {"intensity_pct_rmt": 120.0, "muscle": "FCR"}
    with pytest.raises(ConfigError, match="different muscles"):
        session_for(configured(tmp_path / "supra.mcap", "supra-threshold", 120.0, visit=visit, after=(log,)))
