from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import pytest
import tomli_w

from isiw.config import RunConfig, device_for, load_config, session_for
from isiw.config.given import given_before
from isiw.config.resume import Truth, run_of_log, truth_of
from isiw.config.sections import SimulatedConfig
from isiw.config.session import assumed_space, fresh_log_path
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.devices.simulated import SimulatedDevice
from isiw.errors import ConfigError, DeviceError, InvalidValueError, IsiwError, StrategyError
from isiw.log.record import read_session
from isiw.session.loop import Session
from isiw.session.threshold import open_threshold, read_threshold, resume_threshold
from isiw.strategy.threshold import IntensityRange, make_threshold_search
from isiw.subjects.cohorts import person_of
from isiw.subjects.responses import RecruitmentResponse
from scripted import ScriptedDevice, scripted_strategy

WriteFile: TypeAlias = Callable[[str], Path]


@pytest.fixture
def config_file(tmp_path: Path) -> WriteFile:
    def write(text: str) -> Path:
        path = tmp_path / "session.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_without_a_file_there_are_defaults() -> None:
    config = load_config()
    assert config.model_dump() == RunConfig().model_dump()
    assert (config.space.reference, config.subject.cohort) == ("valve", "recruitment")


def test_a_file_changes_what_it_names(config_file: WriteFile) -> None:
    config = load_config(config_file('seed = 7\n[subject]\ncohort = "gaussian"\n[strategy.settings]\nmax_trials = 4\n'))
    assert config.seed == 7
    assert config.subject.cohort == "gaussian"
    assert config.strategy.settings == {"max_trials": 4}
    assert config.limits == RunConfig().limits


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("sead = 7", ["session.toml", "sead", "7", "Did you mean seed?"]),
        ("[subject]\ncohrt = 'x'", ["subject.cohrt", "'x'", "Did you mean cohort?", "cohort, data, kind, number"]),
        ("seed = 'many'", ["value of seed", "'many'", "a whole number"]),
        ("[strategy.settings]\nmax_trails = 9", ["strategy.settings", "max_trails", "Did you mean max_trials?"]),
        ("seed = -1", ["value of seed", "-1"]),
        ("log = 3", ["value of log", "3", "expected a path"]),
        ('[device]\nfactory = "rig"', ["device.factory", "module:function, such as rig:make"]),
        ("[space]\nreference = 'impact'\nlow_ms = '0'", ["space.low_ms", "expected a number"]),
        ("[subject]\nkind = 'real'", ["subject.kind", "'real'", "'simulated' or 'recorded'"]),
        ("[subject]\nkind = 'Recordd'", ["subject.kind", "'Recordd'", "Did you mean recorded?"]),
        ("[space]\nreference = 'coil'", ["space.reference", "'coil'", "'impact' or 'valve'"]),
        ("[strategy]\nname = 'foo'", ["session.toml", "value of strategy.name", "'foo'", "default or "]),
        ("[subject]\ncohort = 'foo'", ["session.toml", "value of subject.cohort", "'foo'", "nonresponder"]),
        ("[space]\nhigh_ms = 320", ["value of space", "needs its reference", '"impact", the', '"valve", the', "rig"]),
        (
            "[space]\nreference = 'valve'\nlow_ms = nan",
            ["session.toml", "value of space.low_ms", "got nan", "a finite number"],
        ),
        ("[strategy.settings]\nmax_trials = 0", ["value of strategy.settings", "max_trials", "got 0", "at least 1"]),
        ("seed = = 7", ["session.toml", "not valid TOML", "line 1"]),
    ],
)
def test_a_bad_file_is_an_error_that_names_file_key_value_and_remedy(
    config_file: WriteFile, text: str, parts: list[str]
) -> None:
    with pytest.raises(ConfigError) as caught:
        load_config(config_file(text))
    for part in parts:
        assert part in str(caught.value)
    assert str(caught.value).endswith(".")


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("[subject]\ncohort = 'recruitmnt'", "recruitment"),
        ("[strategy]\nname = 'defualt'", "default"),
        ("[strategy.settings]\nmuscle = 'forarm'", "forearm"),
    ],
)
def test_of_a_misspelt_value_the_one_that_was_meant_is_named(config_file: WriteFile, text: str, meant: str) -> None:
    with pytest.raises(ConfigError, match=rf"Did you mean {meant}\?"):
        load_config(config_file(text))


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("[limits]\nmin_iti_s = 5000", "Is it in ms"),
        ("[protocol]\niti_s = [5000, 8000]", "Is it in ms"),
        ("[strategy.settings]\nstop_width_ms = 0.025", r"Is it in s\? Multiply by 1000"),
        ("[visit]\nintensity_pct_mso = 0.6", r"Is it in parts of 1\? Multiply by 100"),
    ],
)
def test_a_slip_of_unit_is_refused_with_the_unit_that_it_is_probably_in(
    config_file: WriteFile, text: str, hint: str
) -> None:
    with pytest.raises(ValueError, match=hint):
        load_config(config_file(text))


def test_a_width_that_is_to_end_no_session_is_no_slip(config_file: WriteFile) -> None:
    config = load_config(config_file("[strategy.settings]\nstop_width_ms = 0.001\n"))
    assert config.strategy.settings == {"stop_width_ms": 0.001}


def test_files_that_are_read_are_looked_for_beside_the_configuration(
    config_file: WriteFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = config_file('log = "s.mcap"\nprior = "lab.toml"\nafter = ["../P07.mcap"]\n[subject]\ndata = "uef"\n')
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    config = load_config(file)
    assert (config.prior, config.after) == (tmp_path.resolve() / "lab.toml", (tmp_path.resolve().parent / "P07.mcap",))
    assert (config.subject.data, config.log) == (tmp_path.resolve() / "uef", Path("s.mcap"))
    assert config.with_overrides(prior=Path("own.toml")).prior == Path("own.toml")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"cannot be read.*nowhere.toml"):
        load_config(tmp_path / "nowhere.toml")


def test_the_command_line_wins_over_the_file(config_file: WriteFile) -> None:
    config = load_config(config_file("seed = 7\n")).with_overrides(seed=8, subject="recorded", data=Path("there"))
    assert (config.seed, config.subject.kind, config.subject.data) == (8, "recorded", Path("there"))
    assert config.with_overrides() == config


def test_a_bad_value_on_the_command_line_is_named() -> None:
    with pytest.raises(ConfigError, match=r"subject.kind.*'reel'"):
        RunConfig().with_overrides(subject="reel")


@pytest.mark.parametrize("given", [{"max_trials": 80}, {"max_trials": 50}, {}])
def test_another_strategy_on_the_command_line_keeps_the_settings_that_were_given(
    config_file: WriteFile, given: dict[str, int]
) -> None:
    text = "".join(f"{key} = {value}\n" for key, value in given.items())
    config = load_config(config_file(f"[strategy.settings]\n{text}"))
    overridden = config.with_overrides(seed=8).with_overrides(strategy="pf")
    assert overridden.strategy.settings == given
    assert overridden.with_overrides(strategy="default").strategy == config.strategy


def test_what_a_strategys_name_stands_for_is_not_kept_with_another(config_file: WriteFile) -> None:
    config = load_config(config_file('[strategy]\nname = "nr2"\n'))
    assert config.with_overrides(strategy="nr").strategy.settings == {}


@pytest.mark.parametrize(("section", "block"), [("protocol", "block_trials"), ("limits", "max_block_pulses")])
def test_a_length_of_rests_needs_blocks(config_file: WriteFile, section: str, block: str) -> None:
    with pytest.raises(ConfigError, match=rf"{section}.rest_s.*{section}.{block}"):
        load_config(config_file(f"[{section}]\nrest_s = 300.0\n"))
    config = load_config(config_file(f"[{section}]\nrest_s = 300.0\n{block} = 10\n"))
    assert getattr(config, section).rest_s == 300.0


def test_a_period_needs_a_number_of_pulses_also_where_it_is_the_usual_one(config_file: WriteFile) -> None:
    with pytest.raises(ConfigError, match=r"does nothing without"):
        load_config(config_file("[limits]\nperiod_s = 3600.0\n"))


@pytest.mark.parametrize(
    "text",
    [
        "[limits]\nmax_block_pulses = 3\nrest_s = 2.0\n",
        "[protocol]\nblock_trials = 3\nrest_s = 20.0\n[limits]\nmin_iti_s = 30.0\n",
    ],
)
def test_a_rest_or_a_period_that_limits_nothing_is_refused(config_file: WriteFile, text: str) -> None:
    with pytest.raises(InvalidValueError, match=r"no effect"):
        load_config(config_file(text))


RIG = '[device]\nfactory = "rig:make"\n'


@pytest.mark.parametrize("given", [{"subject": "simulated"}, {"subject": "recorded"}, {"data": Path("there")}])
def test_who_asks_for_a_simulated_person_does_not_get_the_real_rig(
    config_file: WriteFile, given: dict[str, Any]
) -> None:
    config = load_config(config_file(RIG))
    assert config.with_overrides(seed=8, day=2).device is not None
    with pytest.raises(ConfigError, match="device and subject"):
        config.with_overrides(**given)


def test_a_file_with_a_device_names_no_subject_not_even_the_usual_one(config_file: WriteFile) -> None:
    with pytest.raises(ConfigError, match="device and subject"):
        load_config(config_file(f'{RIG}[subject]\nkind = "simulated"\n'))


@pytest.mark.parametrize("name", ["nr", "gp-ei", "parametric-mi", "supra-threshold"])
def test_a_prior_for_a_strategy_that_learns_nothing_from_it_is_refused(tmp_path: Path, name: str) -> None:
    config = RunConfig(log=tmp_path / "s.mcap").with_overrides(strategy=name, prior=tmp_path / "lab.toml")
    with pytest.raises(StrategyError, match=f"{name} learns nothing"):
        session_for(config)


def test_a_fresh_log_path_is_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first = fresh_log_path(RunConfig())
    first.parent.mkdir()
    first.with_name(f"{first.name}.part").touch()
    assert fresh_log_path(RunConfig()) != first
    assert first.parts[0] == "isiw-sessions"


def test_recorded_emg_needs_its_folder() -> None:
    with pytest.raises(ConfigError, match=r"recorded EMG.*--data"):
        device_for(RunConfig().with_overrides(subject="recorded"))


def test_a_folder_without_recordings_is_named(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="not found"):
        device_for(RunConfig().with_overrides(subject="recorded", data=tmp_path))


def test_a_simulated_device_answers_on_the_spaces_reference() -> None:
    device = device_for(RunConfig())
    assert isinstance(device, SimulatedDevice)
    assert device.describe().reference == "valve"


def test_a_log_holds_the_configuration_it_was_run_with(tmp_path: Path, config_file: WriteFile) -> None:
    config = load_config(config_file("seed = 5\n[strategy.settings]\nmax_trials = 2\n"))
    config = config.with_overrides(log=tmp_path / "s.mcap")
    session_for(config).run()
    record = read_session(tmp_path / "s.mcap")
    person = config.subject.model_dump(exclude={"data"})
    assert run_of_log(record).model_dump() == {"seed": 5, "subject": person, "device": None}
    assert truth_of(record) == Truth(
        known=True, window=person_of(config.subject.cohort, 0, 5).window(record.header.space)
    )
    assert len(record.table) == 2


@pytest.mark.parametrize("config", [{}, {"rig": "A"}, {"seed": 3}])
def test_a_log_of_other_software_has_no_configuration(tmp_path: Path, config: dict[str, Any]) -> None:
    Session(ScriptedDevice(), scripted_strategy(1), log=tmp_path / "s.mcap", config=config).run()
    with pytest.raises(ConfigError, match=r"device.*isiw.resume"):
        run_of_log(read_session(tmp_path / "s.mcap"))


@pytest.mark.slow
def test_every_limit_of_a_configuration_is_the_sessions(tmp_path: Path) -> None:
    wanted = {"min_iti_s": 6, "max_pulses": 30, "max_block_pulses": 12, "rest_s": 90.0, "max_period_pulses": 40}
    file = tmp_path / "session.toml"
    short = {"settings": {"max_trials": 3}}
    file.write_text(tomli_w.dumps({"log": str(tmp_path / "s.mcap"), "limits": wanted, "strategy": short}))
    session_for(load_config(file).with_overrides(strategy="random")).run()
    kept = read_session(tmp_path / "s.mcap").header.limits
    assert {name: getattr(kept, name) for name in wanted} == wanted


def test_the_strategy_is_told_what_the_device_delivers_first(config_file: WriteFile, tmp_path: Path) -> None:
    text = f"log = '{tmp_path}/s.mcap'\n[subject]\ncohort = 'COHORT'\n[space]\nreference = 'impact'\nhigh_ms = 320\n"
    # A tap is also what a device says that states nothing.
    for cohort, stimulus in (("electrical", "electrical"), ("recruitment", None)):
        session = session_for(load_config(config_file(text.replace("COHORT", cohort))))
        assert session.strategy.recipe.settings.get("conditioning") == stimulus


def test_the_strategy_is_told_the_intensity_that_the_visit_states(config_file: WriteFile, tmp_path: Path) -> None:
    text = f"log = '{tmp_path}/s.mcap'\n[visit]\nintensity_pct_rmt = 110\n[strategy]\nname = 'NAME'\n"
    for name, told_pct_rmt in (("default", 110.0), ("nr", None)):
        session = session_for(load_config(config_file(text.replace("NAME", name))))
        assert session.strategy.recipe.settings.get("intensity_pct_rmt") == told_pct_rmt


def test_a_device_of_ones_own_needs_a_space_before_it_is_made(config_file: WriteFile) -> None:
    config = load_config(config_file('[device]\nfactory = "nowhere:make"\n'))
    with pytest.raises(ConfigError, match=r"\[space\].*\"impact\".*\"valve\""):
        session_for(config)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "No [space] is given, so ISIs are 0–500 ms after the valve command, every 1 ms."),
        ("[space]\nreference = 'valve'\n", None),
    ],
)
def test_the_space_that_nobody_named_is_said(config_file: WriteFile, text: str, said: str | None) -> None:
    config = load_config(config_file(text)).with_overrides(strategy="even", seed=3)
    assert assumed_space(config) == said
    assert config.design() == VALVE_SPACE


def test_a_space_can_be_a_list_of_isis_and_not_a_range_as_well(tmp_path: Path) -> None:
    path = tmp_path / "list.toml"
    path.write_text('[space]\nisis_ms = [10, 20, 50]\nreference = "impact"\n')
    assert load_config(path).space == DesignSpace.of([10, 20, 50], reference="impact")
    path.write_text('[space]\nisis_ms = [10, 20, 50]\nhigh_ms = 60.0\nreference = "impact"\n')
    with pytest.raises(ConfigError, match="exclude each other"):
        load_config(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[device]\nfactory = "rig:make"\ntimeout_s = 30000', r"device.timeout_s.*Is it in ms"),
        ("[limits]\nmax_coil_c = 4000.0", "such as 40"),
        ("[limits]\nintensity_pct_mso = 0.55", "Multiply by 100"),
        ("[limits]\nmax_intensity_pct_rmt = 1100.0", "Divide by 10"),
        ("seed = true", "a whole number"),
        ("[visit]\nday = 20260304", "no date"),
        ("[signals]\nbackground_uv = 10000.0", "Divide by 1000"),
        ("[signals]\nmep_window_ms = [15000, 35000]", "Divide by 1000"),
        ("[protocol]\niti_s = [2.0, 4.0]", "intervals up to more than 5 s"),
    ],
)
def test_what_would_disable_a_safeguard_or_is_no_number_is_refused(
    config_file: WriteFile, text: str, words: str
) -> None:
    with pytest.raises((ConfigError, InvalidValueError), match=words):
        load_config(config_file(text))


def test_a_strategys_intensity_in_parts_of_one_is_refused(config_file: WriteFile) -> None:
    config = load_config(config_file("[strategy.settings]\nintensity_pct_rmt = 1.1"))
    with pytest.raises(InvalidValueError, match="the strategy's intensity_pct_rmt is probably in another unit"):
        session_for(config)


def threshold_log(tmp_path: Path, muscle: str = "FCR", subject: str = "P07") -> Path:
    """A short search for the threshold of a real person; MEPs begin at 50 % MSO."""
    log = tmp_path / f"{muscle}-{subject}.mcap"
    search = make_threshold_search("bayes", IntensityRange(20, 80))
    with open_threshold(search, log, min_iti_s=0, subject=subject, muscle=muscle) as session:
        for _ in range(6):
            asked = session.ask()
            session.tell(0.01 if asked < 50 else 0.05 * (asked - 48))
    return log


VISIT = '[visit]\nsubject = "P07"\nmuscle = "FCR"\n'


def test_a_session_after_a_search_for_the_threshold_knows_its_pulses_and_counts_them(
    tmp_path: Path, config_file: WriteFile
) -> None:
    threshold_log(tmp_path)
    (tmp_path / "curve.csv").write_text("Pulse,intensity_pct_rmt,mep_mv\n1,110,0.4\n2,130,1.1\n")

    def read(most_trials: int) -> RunConfig:
        settings = f"[strategy.settings]\nparticles = 20\nmax_trials = {most_trials}\n[limits]\nmax_pulses = 9\n"
        return load_config(config_file(f'after = ["FCR-P07.mcap"]\nearlier = ["curve.csv"]\n{VISIT}{settings}'))

    with pytest.raises(InvalidValueError, match=r"max_pulses = 9, 8 of them given before.*at least 10"):
        session_for(read(2).with_overrides(log=tmp_path / "b.mcap")).require_effect()
    config = read(1)
    session = session_for(config.with_overrides(log=tmp_path / "a.mcap"))
    header = session.header
    assert (len(header.earlier), header.given_before, header.limits.max_pulses) == (8, 8, 9)
    assert [trial.intensity_pct_rmt for trial in header.earlier[-2:]] == [110.0, 130.0]
    assert not header.earlier_same_level
    said = given_before(config).sentence(config)
    assert "6 pulses of the search for the threshold came before" in said
    assert "of FCR, at the same hot spot" in said


def test_the_same_pulses_in_two_files_are_refused_whatever_the_files_are_called(
    tmp_path: Path, config_file: WriteFile
) -> None:
    amplitudes_mv = [outcome.mep_mv for outcome in read_threshold(threshold_log(tmp_path)).outcomes]
    rows = "".join(f"110;{mep_mv}\n" for mep_mv in amplitudes_mv)
    (tmp_path / "of_log.csv").write_text("intensity_pct_rmt;mep_mv\n" + rows)
    (tmp_path / "curve.csv").write_text("Pulse,intensity_pct_rmt,mep_mv\n1,110,0.4\n2,130,1.1\n")
    (tmp_path / "again.csv").write_text("intensity_pct_rmt;mep_mv\n110;0,4\n130;1,1\n")
    for earlier in ('"of_log.csv"', '"curve.csv", "again.csv"', '"curve.csv", "./curve.csv"'):
        twice = load_config(config_file(f'after = ["FCR-P07.mcap"]\nearlier = [{earlier}]\n{VISIT}'))
        with pytest.raises(ConfigError, match=r"same pulses, which would count twice.*Leave one out"):
            given_before(twice)
    (tmp_path / "other.csv").write_text("intensity_pct_rmt,mep_mv\n120,0.4\n130,1.1\n")  # alike in size alone
    alike = load_config(config_file(f'earlier = ["curve.csv", "other.csv"]\n{VISIT}'))
    assert len(given_before(alike).pulses) == 4


def test_a_search_of_another_muscle_or_person_is_refused_and_one_without_a_muscle_is_named(
    tmp_path: Path, config_file: WriteFile
) -> None:
    for muscle, subject, says in (("FDI", "P07", "of another muscle"), ("FCR", "P08", "another person's")):
        log = threshold_log(tmp_path, muscle, subject)
        config = load_config(config_file(f'after = ["{log.name}"]\n{VISIT}'))
        with pytest.raises(ConfigError, match=says):
            session_for(config.with_overrides(log=tmp_path / "a.mcap"))
    log = threshold_log(tmp_path, "")
    config = load_config(config_file(f'after = ["{log.name}"]\n{VISIT}'))
    assert f"not stated in {log.name}" in given_before(config).sentence(config)


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ("intensity,mep\n110,0.4\n", "the columns intensity, mep"),
        ("intensity_pct_rmt,mep_mv\n110,much\n", "row 1 of .* is no pulse"),
        ("intensity_pct_rmt,mep_mv\n1.1,0.4\n", "row 1 of .* is no pulse"),
        ("intensity_pct_rmt,mep_mv\n110,400\n", "row 1 of .* is no pulse.*in µV"),
        ("intensity_pct_rmt,mep_mv\n110,0.0009\n", "less than EMG at rest has.*in V"),
        ("intensity_pct_rmt,mep_mv\n110,0,4\n", "row 1 of .* more cells .*decimal sign"),
        ("intensity_pct_rmt,mep_mv\n", "no table of pulses"),
        ("intensity_pct_mso;mep_mv\n110;0.4\n", "intensity_pct_rmt is 100 times it by the threshold in % MSO"),
        ("intensity_pct_rmt,mep_mv,isi_ms\n110,0.4,80\n", "leave out other rows and columns"),
        ("intensity_pct_rmt,mep_mv,mep_mv\n110,0.4,80\n", "leave out other rows and columns"),
    ],
)
def test_a_table_that_holds_no_pulses_is_refused_by_its_row(
    tmp_path: Path, config_file: WriteFile, table: str, says: str
) -> None:
    (tmp_path / "curve.csv").write_text(table)
    config = load_config(config_file(f'earlier = ["curve.csv"]\n{VISIT}'))
    with pytest.raises(IsiwError, match=says):
        session_for(config.with_overrides(log=tmp_path / "a.mcap"))


def test_a_table_of_a_spreadsheet_has_spaces_and_empty_rows_and_is_no_workbook(
    tmp_path: Path, config_file: WriteFile
) -> None:
    for table in (
        "intensity_pct_rmt, mep_mv\n110, 0.4\n,\n\n",
        "intensity_pct_rmt;mep_mv\r\n110;0,4\r\n;\r\n",
        "mep_mv\tintensity_pct_rmt\n0,4\t110,0\n",
    ):
        (tmp_path / "curve.csv").write_text(table)
        config = load_config(config_file(f'earlier = ["curve.csv"]\n{VISIT}'))
        assert [(trial.intensity_pct_rmt, trial.mep_mv) for trial in given_before(config).pulses] == [(110.0, 0.4)]
    (tmp_path / "curve.xlsx").write_bytes(b"PK\xc7")
    config = load_config(config_file(f'earlier = ["curve.xlsx"]\n{VISIT}'))
    with pytest.raises(ConfigError, match=r"cannot be read.*Save it as CSV"):
        given_before(config)


def test_a_visit_with_pulses_over_the_curve_needs_the_log_of_all_of_them(
    tmp_path: Path, config_file: WriteFile
) -> None:
    space, log = IntensityRange(20, 80), tmp_path / "c.mcap"
    plan = f"{VISIT}curve = {{ at_pct_mso = [45, 55.0], each = 2 }}\n[strategy.settings]\nparticles = 20\n"
    config = load_config(config_file(f"seed = 7\n{plan}")).with_overrides(log=tmp_path / "a.mcap")
    asks = r"4 pulses at 45, 55 % MSO.*--method curve --at 45 --at 55 --each 2 --seed 7 --subject P07 --muscle FCR"
    with pytest.raises(ConfigError, match=asks):
        session_for(config)
    search = make_threshold_search("curve", space, at_pct_mso=(45.0, 55.0), each=2, seed=7)
    after = config.with_overrides(after=[log])
    with open_threshold(search, log, min_iti_s=0, subject="P07", muscle="FCR") as session:
        for _ in range(3):
            session.tell(0.01 if session.ask() < 50 else 0.4)
    with pytest.raises(ConfigError, match="no log of all of them"):
        session_for(after)
    with resume_threshold(log) as session:
        session.tell(0.01 if session.ask() < 50 else 0.4)
    assert session_for(after).header.given_before == 4
    with pytest.raises(ConfigError, match="at_pct_mso"):
        load_config(config_file(f"{VISIT}curve = {{ each = 2 }}"))


def test_a_simulated_person_is_stimulated_at_the_intensity_of_the_visit(tmp_path: Path, config_file: WriteFile) -> None:
    own = person_of("rmt-off", 0, 3)
    person = SimulatedConfig(cohort="rmt-off").person(3, 115.0)
    assert isinstance(own.response, RecruitmentResponse)
    assert isinstance(person.response, RecruitmentResponse)
    off_pct_rmt = own.response.intensity_pct_rmt - 90.0  # their threshold was measured wrongly, by as much at any
    assert person.response.intensity_pct_rmt == pytest.approx(115.0 + off_pct_rmt)
    sums_mv = []
    for pct_rmt in (90, 130):
        config = load_config(
            config_file(
                f"[strategy.settings]\nparticles = 20\nmax_trials = 8\n[visit]\nintensity_pct_rmt = {pct_rmt}\n"
            )
        )
        result = session_for(config.with_overrides(log=tmp_path / f"{pct_rmt}.mcap")).run()
        sums_mv.append(sum(trial.mep_mv or 0.0 for trial in result.trials))
        record = read_session(tmp_path / f"{pct_rmt}.mcap")
        assert truth_of(record).window == SimulatedConfig().person(0, pct_rmt).window(record.header.space)
    assert sums_mv[1] > 1.5 * sums_mv[0]


def test_a_simulated_person_may_have_an_after_effect(config_file: WriteFile) -> None:
    subject = load_config(config_file('[subject]\ncohort = "hand"\nafter_effect = "growth"\n')).subject
    assert subject.person(3).plasticity is not None
    assert person_of("hand", 0, 3).plasticity is None
    with pytest.raises(ConfigError, match="after-effect"):
        load_config(config_file('[subject]\nafter_effect = "groth"\n'))
