"""Logs that earlier versions wrote, as they wrote them: each opens, is drawn, and goes on."""

from __future__ import annotations

import hashlib
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import isiw
from isiw.errors import OtherVersionsWarning
from isiw.findings import Kind
from isiw.native.engine import version
from isiw.plots import session_figure
from isiw.report import final_statement
from isiw.session.replay import strategy_of
from isiw.session.sink import SessionUpdate

FOLDER = Path(__file__).parents[1] / "data" / "logs"
LOGS = sorted(path.name for path in FOLDER.glob("*.mcap*"))
DIGESTS = {
    "06ce820-default.mcap": "5f90af0009d8aed690ed1dab4200fc1cf24f86c5e1a9d3fef4f42d68bfe69964",
    "06ce820-killed.mcap.part": "feeb16e3a3b786f7e8959772295c129d5588e80f008121ea5318972c4fd02a92",
    "217a22d-default.mcap": "c2701192d0ac1669704b44815de8f0f1474758d402a5bd90c4562f74f108ef26",
    "adc1fc6-visit.mcap": "ecc7ccbdf46f4e3b4019e8f92abeb3dda88f8842ff461e4ac4df28c0f1a97e6c",
    "e31d040-default.mcap": "83587e93485c31eb5620952acd995a7a39f71615834c76714506633e3644f3c5",
    "e31d040-killed.mcap.part": "7554daa23acf26ecbff3cb96996ea3411159702cdee6656bc2e70cfa66adf254",
    "e31d040-nr.mcap": "9d815ce87a32f76f4a4bf706e352e8c2a3adea78f279f141fe969a914e067ea1",
    "e31d040-pf.mcap": "1c78c73e1c6f44db1909f75ab4adcf4e7fe5f5fad4b37941026c5c176c68d69c",
    "e31d040-resumed.mcap": "290aaecc3a22f95aa72cd5a928820bb192bdffe1b827db11bace82cc1d9f54e3",
    "e31d040-waveforms.mcap": "3a6af29cdbf3943ea5ff2d794ee29807b36b65322c19bebafb0a29dd7049c07e",
    "f0fbfc8-default.mcap": "3d27373a6125117b1e349f671c7c88b005103285fb830dc0d27bc8fa64c57169",
    "f2fd174-default.mcap": "2a545e6c25d097b6b0960154cc9c85f075f93e389cad11fbe15f05692a2afe09",
    "f2fd174-killed.mcap.part": "a793ea096e05c2346da3909bcd782a13c6ee70c38c745799f1d11689b5f3113c",
}

SCHEMA_VERSIONS = {"f0fbfc8": 3, "adc1fc6": 4}

DRAWN = ("06ce820-default.mcap", "e31d040-killed.mcap.part", "adc1fc6-visit.mcap")
"""One of each schema, one of them killed; drawing the others takes seconds."""


def log_of(name: str) -> str:
    return name.removesuffix(".part")


@pytest.fixture
def copy(tmp_path: Path) -> Callable[[str], Path]:
    def copied(name: str) -> Path:
        shutil.copyfile(FOLDER / name, tmp_path / name)
        return tmp_path / log_of(name)

    return copied


def person(name: str) -> isiw.Tapper | isiw.SimulatedPerson:
    if "waveforms" in name:
        answer = type("Answer", (), {"mep_mv": 0.2})()
        return isiw.Tapper(lambda _: answer, "subject2", isiw.TapperSettings(rate_hz=1000.0))
    begun = isiw.subjects.cohort("drift", 1, 3)[0].begin(3)
    return isiw.SimulatedPerson(lambda isi_ms: begun.respond(isi_ms, "valve"), "valve")


@pytest.mark.parametrize("name", LOGS)
def test_it_is_what_it_was(name: str) -> None:
    assert hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() == DIGESTS[name]


@pytest.mark.parametrize("name", LOGS)
def test_it_opens_whole(name: str) -> None:
    record = isiw.read_session(FOLDER / log_of(name))
    assert record.losses == ()
    assert record.finished is not name.endswith(".part")
    assert record.header.schema_version == SCHEMA_VERSIONS.get(name[:7], 1)
    assert [trial.index for trial in record.table] == list(range(len(record.table)))
    assert {estimate.trial for estimate in record.estimates} == {trial.index for trial in record.table}
    assert final_statement(record)


@pytest.mark.parametrize(
    "name", [name if name in DRAWN else pytest.param(name, marks=pytest.mark.slow) for name in LOGS]
)
def test_it_is_drawn(name: str) -> None:
    figure = session_figure(isiw.read_session(FOLDER / log_of(name)))
    figure.draw_without_rendering()  # what is drawn differs, not how a file is written
    assert figure.axes[0].has_data()


@pytest.mark.parametrize("name", LOGS)
def test_it_goes_on(name: str, copy: Callable[[str], Path]) -> None:
    log = copy(name)
    before = isiw.read_session(log)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OtherVersionsWarning)  # the strategies have changed since
        session = isiw.resume(log, isiw.SimulatedDevice(person(name)))
    result = session.run()
    known = [trial for trial in result.trials if trial.index < len(before.table)]
    assert known == list(before.table)
    assert len(result.trials) >= len(before.table) + len(before.unknown)
    after = isiw.read_session(log)
    assert after.losses == ()
    assert after.finished
    assert [trial.index for trial in after.table] == list(range(len(after.table)))


def test_the_killed_session_delivers_what_is_left_of_its_budget(copy: Callable[[str], Path]) -> None:
    log = copy("e31d040-killed.mcap.part")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OtherVersionsWarning)
        trials = isiw.resume(log, isiw.SimulatedDevice(person("killed"))).run().trials
    assert len(trials) == 6
    assert [trial.reason for trial in trials].count(Kind.OUTCOME_UNKNOWN) == 1


def test_the_recorded_waveforms_are_there() -> None:
    record = isiw.read_session(FOLDER / "e31d040-waveforms.mcap")
    assert set(record.sweep(0)) == {"emg", "acceleration", "pressure", "valve"}
    assert record.sweep(0)["emg"].values.size == 1000


def test_shares_of_a_kind_that_the_log_does_not_name_are_none() -> None:
    header = isiw.read_session(FOLDER / "adc1fc6-visit.mcap").header
    prior = dict(header.strategy.settings["prior"])
    shares = {name: share for name, share in prior["noise"].items() if name != "all_or_none"}
    prior["noise"] = shares | {"missing": shares["missing"] + 1.0 - sum(shares.values())}
    recipe = header.strategy.model_copy(update={"settings": {"prior": prior}})
    noise = strategy_of(header.model_copy(update={"strategy": recipe})).recipe.settings["prior"]["noise"]
    assert noise == dict.fromkeys(noise, 0.0) | prior["noise"]
    assert "all_or_none" in noise


@pytest.mark.parametrize("stated", [{}, {"engine": "torch"}, {"engine": "compiled", "device": "cpu"}])
def test_a_log_of_an_earlier_engine_goes_on_with_the_one_there_is(copy: Callable[[str], Path], stated: Any) -> None:
    header = isiw.read_session(copy("e31d040-killed.mcap.part")).header
    recipe = header.strategy.model_copy(update={"settings": header.strategy.settings | stated})
    settings = strategy_of(header.model_copy(update={"strategy": recipe})).recipe.settings
    assert settings == strategy_of(header).recipe.settings
    assert not settings.keys() & {"engine", "device"}


def test_the_log_says_which_engine_it_goes_on_with(copy: Callable[[str], Path]) -> None:
    log = copy("e31d040-killed.mcap.part")
    with pytest.warns(OtherVersionsWarning):
        isiw.resume(log, isiw.SimulatedDevice(person("killed"))).run()
    assert isiw.read_session(log).header.versions["engine"] == version()


def test_settings_that_this_version_does_not_know_are_as_by_default_and_named() -> None:
    header = isiw.read_session(FOLDER / "06ce820-default.mcap").header
    recipe = header.strategy.model_copy(update={"settings": {"max_trials": 7, "prior": {"hand_boost": [3.0, 0.2]}}})
    with pytest.warns(OtherVersionsWarning, match="not known any more.*: prior"):
        strategy = strategy_of(header.model_copy(update={"strategy": recipe}))
    assert strategy.recipe.settings["max_trials"] == 7


def test_settings_by_their_earlier_name_are_kept() -> None:
    header = isiw.read_session(FOLDER / "06ce820-default.mcap").header
    recipe = header.strategy.model_copy(update={"name": "gp-ei", "settings": {"zero_below_mv": 0.004}})
    strategy = strategy_of(header.model_copy(update={"strategy": recipe}))
    assert strategy.recipe.settings["threshold_mv"] == 0.004


def test_a_budget_by_its_earlier_name_is_kept() -> None:
    header = isiw.read_session(FOLDER / "e31d040-nr.mcap").header
    recipe = header.strategy.model_copy(update={"settings": {"initial": 5, "max_iterations": 20}})
    strategy = strategy_of(header.model_copy(update={"strategy": recipe}))
    assert strategy.recipe.settings["max_trials"] == 25


def test_a_session_of_an_earlier_version_that_is_interrupted_again_goes_on_again(copy: Callable[[str], Path]) -> None:
    class InterruptedHereError(Exception):
        pass

    def interrupt(update: SessionUpdate) -> None:
        raise InterruptedHereError(update)

    path = copy("06ce820-killed.mcap.part")
    with pytest.warns(OtherVersionsWarning) as warned, pytest.raises(InterruptedHereError):
        isiw.resume(path, isiw.SimulatedDevice(person(path.name)), on_trial=interrupt).run()
    assert {warning.filename for warning in warned} == {__file__}
    assert isiw.resume(path, isiw.SimulatedDevice(person(path.name))).run().decision.stop
    assert isiw.read_session(path).header.asks_from > 0
