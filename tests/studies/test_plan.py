"""What a study is, from Python and from TOML."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, cast

import pytest
import tomli_w

from isiw.design import IMPACT_SPACE, VALVE_SPACE, DesignSpace
from isiw.errors import ConfigError, InvalidValueError
from isiw.strategy.catalogue import make_strategy
from isiw.studies import Study, StudyStrategy, load_study
from isiw.studies.plan import study_from, study_values
from isiw.subjects import cohort
from studies.tiny import TOML, tiny


def people_by_strategy(study: Study) -> list[tuple[str, str, int]]:
    return [(session.label, session.cohort, session.person) for unit in study.units() for session in unit.sessions]


def test_every_strategy_meets_the_same_people_with_the_same_seed() -> None:
    sessions = [session for unit in tiny().units() for session in unit.sessions]
    met = {(s.label, s.cohort, s.person, s.seed) for s in sessions}
    assert len(sessions) == len(met) == 2 * 2 * 3
    assert {m[1:] for m in met if m[0] == "even"} == {m[1:] for m in met if m[0] == "incremental"}


def test_batches_hold_the_same_sessions_as_units_of_their_own() -> None:
    single, batched = tiny(), tiny(engine="batched", batch=2)
    assert sorted(people_by_strategy(single)) == sorted(people_by_strategy(batched))
    assert [len(unit.sessions) for unit in batched.units()] == [2] * 4 + [1] * 4
    assert batched.units()[0].key == "even.gaussian.00000-00001"


def test_more_people_leave_the_keys_of_the_others_alone() -> None:
    few, many = ({unit.key: unit for unit in tiny(people=n).units()} for n in (3, 5))
    assert few.items() <= many.items()
    assert len(many) == 2 * 2 * 5


def test_a_study_from_toml_has_defaults_and_short_forms(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(TOML + 'space = "impact"\n')
    study = load_study(tmp_path / "study.toml")
    assert study.strategies == (StudyStrategy("even", {"particles": 40}), StudyStrategy("incremental"))
    assert study.space == IMPACT_SPACE
    assert (study.people, study.marks, study.engine, study.batch) == (12, (2, 4), "single", 50)
    assert study_from({"strategies": ["even"], "cohorts": ["wide"]}, "here").space == VALVE_SPACE


def test_marks_are_each_fifth_trial_and_the_last_by_default() -> None:
    assert tiny(trials=12, marks=()).marks == (5, 10, 12)
    assert tiny(trials=3, marks=()).marks == (3,)


def test_toml_values_make_the_same_study_again() -> None:
    study = tiny(strategies=(StudyStrategy("pf", {"stop_sd_ms": 30, "floor": "zeroed"}, "mine"),), space=IMPACT_SPACE)
    assert study_from(tomllib.loads(tomli_w.dumps(study_values(study))), "again") == study


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TOML + "peple = 3", r"study.toml: the key peple is unknown.*Did you mean people"),
        (TOML.replace("people = 12", "people = 0"), r"people must be a whole number from 1 to .*; got 0"),
        (
            TOML + "amplitude = -1.0",
            r"study.toml: the value of amplitude cannot be used: amplitude must .* above 0; got -1.0",
        ),
        (TOML + "seed = 5000000000000000000", r"seed must be a whole number from 0 to"),
        (TOML.replace('"ignored"', '"never"'), r"the value of stopping cannot be used; got 'never'"),
        (TOML.replace("[2, 4]", "[4, 2]"), r"marks ascend"),
        (TOML.replace("[2, 4]", "[2, 5]"), r"marks ascend"),
        (TOML.replace('"gaussian"', '"gausian"'), r"unknown cohorts; got \['gausian'\]; expected gaussian"),
        (TOML.replace('"incremental"', '"even"'), r"each once.*another label"),
        (TOML.replace("[{", "[ ] # "), r"a study needs strategies"),
        (
            TOML.replace("particles", "partikels"),
            r"the strategy 'even' has no setting 'partikels'.*Did you mean particles",
        ),
        (TOML.replace("= 40", "= 1"), r"particles must be a whole number from 2 to 100000; got 1"),
        (TOML.replace("= 40", '= "many"'), r"particles must be a whole number from 2 to 100000; got 'many'"),
        (TOML.replace("settings =", "setings ="), r"strategies.0.setings is unknown.*Did you mean settings"),
        (TOML + 'space = "head"', r"the value of space cannot be used; got 'head'; expected .*valve"),
        (TOML.replace('name = "even"', 'label = "a/b", name = "even"'), r"a label is part of a file's name; got 'a/b'"),
    ],
)
def test_what_is_wrong_with_a_file_is_told_with_the_way_out(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_study(tmp_path / "study.toml")


def test_an_unknown_strategy_is_told_with_the_known_ones(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(TOML.replace("incremental", "incrementel"))
    with pytest.raises(ConfigError, match=r"study.toml: .*got 'incrementel'"):
        load_study(tmp_path / "study.toml")


def test_from_python_invalid_values_are_refused_as_well() -> None:
    with pytest.raises(InvalidValueError, match="engine is unknown"):
        Study((StudyStrategy("even"),), ("wide",), engine=cast("Any", "fast"))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"cohorts": (cohort("gaussian", 2, 0),)}, r"unknown cohorts; got \['<list>'\].*People of your own"),
        ({"cohorts": cohort("gaussian", 1, 0)}, r"got \['<SimulatedSubject>'\]; expected gaussian"),
        ({"cohorts": 5}, r"got \['<int>'\]; expected gaussian"),
        (
            {"strategies": (make_strategy("even", particles=10),)},
            r"by their names; got 'Strategy'; expected a name.*A strategy of your own",
        ),
        ({"strategies": make_strategy("even", particles=10)}, r"by their names; got 'Strategy'"),
        ({"marks": (2, 2.5)}, r"a mark must be a whole number"),
        ({"marks": 5}, r"marks ascend.*got \(5,\)"),
    ],
)
def test_what_is_no_name_is_told_with_the_way_out(changed: Any, message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        tiny(**changed)


@pytest.mark.parametrize("changed", [{"people": 10**9}, {"trials": 10**9}, {"batch": 10**9}, {"people": 300_000}])
def test_a_study_that_could_not_even_be_listed_is_refused(changed: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"at most|whole number from 1 to"):
        tiny(**changed)


def test_no_value_for_a_setting_is_refused_as_a_rig_might_state_one() -> None:
    with pytest.raises(InvalidValueError, match=r"None for hit_delay_ms.*unstated"):
        StudyStrategy("default", {"hit_delay_ms": None})


def test_a_single_name_is_a_strategy_and_a_cohort() -> None:
    study = tiny(strategies=("nr",), cohorts="gaussian")
    assert (study.strategies, study.cohorts) == ((StudyStrategy("nr"),), ("gaussian",))
    assert tiny(strategies="nr").strategies == (StudyStrategy("nr"),)


def test_what_the_rig_states_is_told_where_a_study_says_so() -> None:
    def settings(hit_delay: Any, space: DesignSpace) -> list[dict[str, Any]]:
        study = Study((StudyStrategy("default"),), ("recruitment", "electrical"), 1, space=space, hit_delay=hit_delay)
        return [dict(unit.sessions[0].settings) for unit in study.units()]

    assert settings("unstated", IMPACT_SPACE) == [{}, {}]
    assert settings("stated", IMPACT_SPACE) == [{}, {"conditioning": "electrical"}]
    delay = {"hit_delay_ms": (180.0, 6.0)}
    assert settings("stated", VALVE_SPACE) == [delay, delay | {"conditioning": "electrical"}]


def test_the_intensity_that_a_visit_states_is_told_where_a_study_says_so_and_people_of_one_are_side_by_side() -> None:
    cohorts = ("hand-flat", "gaussian")
    study = Study((StudyStrategy("default"),), cohorts, 12, engine="batched", intensity="stated")
    flat, gaussian = ([unit for unit in study.units() if name in unit.key] for name in cohorts)
    stated = [dict(unit.sessions[0].settings) for unit in flat]
    assert stated == [{"intensity_pct_rmt": 100.0}, {"intensity_pct_rmt": 110.0}, {"intensity_pct_rmt": 90.0}]
    assert sorted(session.person for unit in flat for session in unit.sessions) == list(range(12))
    assert [unit.sessions[0].settings for unit in gaussian] == [()]


def test_spaces_have_names_in_python_too() -> None:
    assert tiny(space="impact").space == IMPACT_SPACE


@pytest.mark.parametrize("wrong", [{"space": "impacts"}, {"space": None}, {"strategies": ("even", 5)}])
def test_what_no_session_could_run_with_is_refused_at_once(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        tiny(**wrong)


@pytest.mark.parametrize("wrong", [{"label": 5}, {"settings": 5}, {"settings": [("particles", 5)]}])
def test_a_strategy_with_an_impossible_label_or_settings_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        StudyStrategy("nr", **wrong)
