from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from isiw import priors
from isiw.config import device_for, load_config, session_for
from isiw.config.session import TEMPLATE_FILES, device_from_factory, write_rig_template
from isiw.design import IMPACT_SPACE
from isiw.errors import ConfigError, LimitExceededError
from isiw.log.record import read_session
from isiw.visit import Visit
from known import known
from priors.logged import write_log


@pytest.fixture
def template(tmp_path: Path) -> Iterator[Path]:
    """The starting point of a rig, in a folder of its own; its module is forgotten afterwards."""
    write_rig_template(tmp_path / "lab")
    yield tmp_path / "lab"
    sys.modules.pop("rig", None)


def imported(file: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(file.parent))
    specification = known(importlib.util.spec_from_file_location(file.stem, file))
    module = importlib.util.module_from_spec(specification)
    known(specification.loader).exec_module(module)
    return module


def test_the_starting_point_passes_its_own_check(template: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    imported(template / "test_rig.py", monkeypatch).test_the_rig_conforms()


def test_its_check_is_of_what_its_configuration_says(template: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (template / "session.toml").read_text(encoding="utf-8")
    text = text.replace("max_pulses = 100", "max_pulses = 100\nmax_coil_c = 40.0")
    (template / "session.toml").write_text(text, encoding="utf-8")
    with pytest.raises(LimitExceededError, match="the coil is too hot"):
        imported(template / "test_rig.py", monkeypatch).test_the_rig_conforms()


def test_the_starting_point_is_short(template: Path) -> None:
    lines = (template / "rig.py").read_text(encoding="utf-8").splitlines()
    assert len([line for line in lines if line.strip()]) < 60


def test_a_starting_point_is_never_overwritten(template: Path) -> None:
    before = {name: (template / name).read_bytes() for name in TEMPLATE_FILES}
    (template / "session.toml").unlink()
    with pytest.raises(ConfigError, match=r"there already.*rig\.py"):
        write_rig_template(template)
    assert not (template / "session.toml").exists()
    assert (template / "rig.py").read_bytes() == before["rig.py"]


def test_a_starting_point_is_not_written_through_a_link_that_leads_nowhere(tmp_path: Path) -> None:
    (tmp_path / "rg").mkdir()
    (tmp_path / "rg" / "rig.py").symlink_to(tmp_path / "elsewhere.py")
    with pytest.raises(ConfigError, match=r"there already.*rig\.py"):
        write_rig_template(tmp_path / "rg")
    assert not (tmp_path / "elsewhere.py").exists()
    assert [path.name for path in (tmp_path / "rg").iterdir()] == ["rig.py"]


def test_an_error_of_the_labs_own_code_is_no_wrong_setting(tmp_path: Path) -> None:
    (tmp_path / "broken_rig.py").write_text("def make(port='COM3'):\n    return None + 1\n", encoding="utf-8")
    with pytest.raises(TypeError, match="unsupported operand"):
        device_from_factory("broken_rig:make", {}, tmp_path)
    with pytest.raises(ConfigError, match=r"function.*'prot'"):
        device_from_factory("broken_rig:make", {"prot": "COM4"}, tmp_path)


@pytest.mark.parametrize(
    ("factory", "settings", "meant"),
    [("rig:mak", {}, "make"), ("rg:make", {}, "rig"), ("rig:make", {"simulatd": True}, "simulated")],
)
def test_of_a_misspelt_module_function_or_setting_the_one_that_was_meant_is_named(
    template: Path, factory: str, settings: dict[str, Any], meant: str
) -> None:
    with pytest.raises(ConfigError, match=rf"Did you mean {meant}\?"):
        device_from_factory(factory, settings, template)


def test_a_session_runs_with_the_users_own_rig_and_the_log_does_not_name_it(template: Path) -> None:
    text = (template / "session.toml").read_text(encoding="utf-8").replace("max_trials = 40", "max_trials = 3")
    (template / "session.toml").write_text(text, encoding="utf-8")
    config = load_config(template / "session.toml").with_overrides(log=template / "s.mcap")
    session_for(config).run()
    record = read_session(template / "s.mcap")
    assert (record.header.device.name, record.header.subject, record.header.config) == ("my rig", "P01", {})
    assert len(record.table.told) == 3
    assert set(record.sweep(0)) == {"emg"}
    assert b"rig:make" not in (template / "s.mcap").read_bytes()


def test_settings_of_the_configuration_reach_the_factory(template: Path) -> None:
    text = (template / "session.toml").read_text(encoding="utf-8")
    (template / "session.toml").write_text(
        text.replace("simulated = true", 'simulated = true\nport = "COM3"'), encoding="utf-8"
    )
    device: Any = device_for(load_config(template / "session.toml"))
    assert device.port == "COM3"


@pytest.mark.parametrize(
    ("factory", "settings", "words"),
    [
        ("nowhere.to.be.found:make", {}, "cannot be imported.*nowhere"),
        ("rig:build", {}, "cannot be imported.*build"),
        ("rig:make", {"prot": "COM3"}, "do not fit.*prot"),
        ("json:loads", {"s": "1"}, "makes no device.*int"),
    ],
)
def test_a_factory_that_cannot_be_used_is_named(
    template: Path, factory: str, settings: dict[str, Any], words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        device_from_factory(factory, settings, template)


def test_a_device_and_a_simulated_person_exclude_each_other(tmp_path: Path) -> None:
    path = tmp_path / "both.toml"
    path.write_text('[device]\nfactory = "rig:make"\n[subject]\ncohort = "gaussian"\n')
    with pytest.raises(ConfigError, match="exclude each other"):
        load_config(path)


def test_a_factory_is_a_module_and_a_function(tmp_path: Path) -> None:
    path = tmp_path / "session.toml"
    path.write_text('[device]\nfactory = "rig.py"\n')
    with pytest.raises(ConfigError, match=r"device\.factory.*'rig.py'"):
        load_config(path)


def with_real_device(template: Path) -> Path:
    """The starting point for the subject P01, as with hardware that stimulates."""
    path = template / "session.toml"
    path.write_text(path.read_text(encoding="utf-8").replace("simulated = true", "simulated = false"), encoding="utf-8")
    return path


@pytest.mark.usefixtures("few_sweeps")
def test_a_session_starts_from_the_same_persons_earlier_ones_alone(template: Path, tmp_path: Path) -> None:
    own, others = (
        write_log(tmp_path / f"{subject}.mcap", subject=subject, trials=3, space=IMPACT_SPACE)
        for subject in ("P01", "P02")
    )
    config = load_config(with_real_device(template)).with_overrides(log=tmp_path / "s.mcap")
    prior = session_for(config.with_overrides(after=[own])).strategy.recipe.settings["prior"]
    assert prior != session_for(config).strategy.recipe.settings.get("prior")
    with pytest.raises(ConfigError, match=r"another person's.*P02.*P01"):
        session_for(config.with_overrides(after=[own, others]))


@pytest.mark.usefixtures("few_sweeps")
def test_a_session_does_not_start_from_one_of_another_muscle_or_intensity(template: Path, tmp_path: Path) -> None:
    other, far = (
        write_log(tmp_path / f"{name}.mcap", subject="P01", trials=3, space=IMPACT_SPACE, visit=visit)
        for name, visit in (("other", Visit(muscle="FDI")), ("far", Visit(muscle="FCR", intensity_pct_rmt=90.0)))
    )
    config = load_config(with_real_device(template)).with_overrides(log=tmp_path / "s.mcap")
    noted = replace(config.visit, muscle="FCR", intensity_pct_rmt=120.0)
    for earlier, what in ((other, "different muscles, FCR and FDI"), (far, "different intensities, 120 and 90 %")):
        with pytest.raises(ConfigError, match=what):
            session_for(config.model_copy(update={"visit": noted}).with_overrides(after=[earlier]))
    lab = priors.write_lab_prior(priors.learn([other]), tmp_path / "lab.toml")
    with pytest.raises(ConfigError, match="different muscles, FCR and FDI"):
        session_for(config.model_copy(update={"visit": noted}).with_overrides(prior=lab))


@pytest.mark.usefixtures("few_sweeps")
def test_what_simulated_sessions_taught_is_not_used_on_a_person(template: Path, tmp_path: Path) -> None:
    simulated = write_log(tmp_path / "sim.mcap", subject="P01", trials=3, space=IMPACT_SPACE, simulated=True)
    lab = priors.write_lab_prior(priors.learn([simulated]), tmp_path / "lab.toml")
    rehearsal = load_config(template / "session.toml").with_overrides(log=tmp_path / "s.mcap")
    assert session_for(rehearsal.with_overrides(after=[simulated], prior=lab)).strategy.recipe.settings["prior"]
    config = load_config(with_real_device(template)).with_overrides(log=tmp_path / "s.mcap")
    for taught in ({"after": [simulated]}, {"prior": lab}):
        with pytest.raises(ConfigError, match="simulated sessions"):
            session_for(config.with_overrides(**taught))
