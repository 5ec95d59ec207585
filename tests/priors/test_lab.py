"""A lab's prior: who is learnt from, what is kept of people in general, and its file."""

from __future__ import annotations

import hashlib
import math
import tomllib
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import isiw
from isiw import priors
from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.errors import ConfigError, DamagedLogError, InvalidValueError, LogError, StrategyError
from isiw.models.particles import ParticleModel
from isiw.models.particles.laws import NoiseShares
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.priors.days import recalled
from isiw.strategy.catalogue import make_strategy
from isiw.visit import Visit
from known import instance
from logs import damage
from native.drawn import Case
from priors.logged import gaussian_person, write_log

pytestmark = pytest.mark.usefixtures("few_sweeps")  # but for `lab`, whose numbers are looked at

TRIALS = 14


@pytest.fixture(scope="module")
def logs(tmp_path_factory: Any) -> Any:
    folder = tmp_path_factory.mktemp("logs")
    return [
        write_log(folder / f"{number}.mcap", gaussian_person(number), subject=f"P{number}", trials=TRIALS)
        for number in range(3)
    ]


@pytest.fixture(scope="module")
def lab(logs: Any) -> Any:
    return priors.learn(logs)


@pytest.fixture
def path(lab: Any, tmp_path: Path) -> Any:
    return priors.write_lab_prior(lab, tmp_path / "lab.toml")


@pytest.mark.slow
def test_a_lab_prior_names_its_sessions_by_their_content(lab: Any, logs: Any) -> None:
    assert [session.sha256 for session in lab.sessions] == [hashlib.sha256(p.read_bytes()).hexdigest() for p in logs]
    assert [(session.subject, session.trials) for session in lab.sessions] == [(f"P{k}", TRIALS) for k in range(3)]
    assert not lab.simulated


def test_every_session_is_reported_once_it_is_learnt(tmp_path: Path) -> None:
    done = []
    log = write_log(tmp_path / "short.mcap", trials=3)
    priors.learn([log], on_done=lambda record: done.append(record.header.subject))
    assert done == ["P1"]


def test_the_same_log_twice_is_refused_whatever_it_is_called(logs: Any, tmp_path: Path) -> None:
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(logs[0].read_bytes())
    with pytest.raises(LogError, match="two logs are the same"):
        priors.learn([logs[0], copy], again=True)


def test_the_same_person_twice_is_refused_unless_told(tmp_path: Path) -> None:
    twice = [write_log(tmp_path / f"{seed}.mcap", subject="P0", trials=3, seed=seed) for seed in (1, 2)]
    with pytest.raises(LogError, match=r"same person.*--again"):
        priors.learn(twice)
    assert len(priors.learn(twice, again=True).sessions) == 2


def test_another_spelling_of_a_code_is_the_same_person(tmp_path: Path) -> None:
    twice = [write_log(tmp_path / code / "s.mcap", subject=code, trials=3, seed=7) for code in ("P07", "p-07")]
    with pytest.raises(LogError, match=r"same person.*--again"):
        priors.learn(twice)


def test_people_without_a_name_may_be_the_same(tmp_path: Path) -> None:
    unnamed = [write_log(tmp_path / f"{k}.mcap", subject="", trials=4, seed=k) for k in range(2)]
    with pytest.raises(LogError, match="do not say of whom"):
        priors.learn(unnamed)


def test_sessions_on_different_clocks_are_refused(logs: Any, tmp_path: Path) -> None:
    other = write_log(tmp_path / "impact.mcap", subject="Q", trials=4, space=IMPACT_SPACE)
    with pytest.raises(LogError, match="different events"):
        priors.learn([logs[0], other])


def test_simulated_sessions_are_not_mixed_with_people(logs: Any, tmp_path: Path) -> None:
    other = write_log(tmp_path / "simulated.mcap", subject="Q", trials=4, simulated=True)
    with pytest.raises(LogError, match=r"are simulated.*simulated\.mcap"):
        priors.learn([logs[0], other])
    file = priors.write_lab_prior(priors.learn([other]), tmp_path / "simulated.toml")
    assert priors.read_lab_prior(file).simulated


def test_nothing_is_learnt_from_nobody(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no session"):
        priors.learn([])
    with pytest.raises(LogError, match=r"\[\"a\.mcap\"\]"):
        priors.learn("a.mcap")
    with pytest.raises(LogError, match="no accepted trial"):
        priors.learn([write_log(tmp_path / "empty.mcap", trials=0)])


def test_of_a_damaged_log_nothing_is_learnt_unless_told(tmp_path: Path) -> None:
    log = write_log(tmp_path / "s.mcap", trials=4)
    isiw.exclude(log, 2, "sneezed")
    damage(log)
    with pytest.raises(DamagedLogError, match=r"s\.mcap: .*lost.*damaged=True"):
        priors.learn([log])
    assert priors.learn([log], damaged=True).sessions[0].trials == 4  # the exclusion is lost


def test_people_in_general_keep_at_least_a_tenth_of_every_block(lab: Any) -> None:
    joined = lab.joined()
    assert joined.profile.p_place <= 0.9
    for blocks, usual in ((joined.floors, Prior().floors), (joined.gains, Prior().gains)):
        assert sum(block.share for block in blocks[: len(usual)]) >= 0.1 - 1e-9
        assert sum(block.share for block in blocks) == pytest.approx(1.0)


def test_of_three_people_the_built_in_prior_keeps_more_than_of_many(lab: Any) -> None:
    assert lab.floor is not None
    assert 0.5 < lab.floor.share <= 1.0 - 2 / 5


def test_the_lab_prior_expects_its_peoples_floor(lab: Any) -> None:
    floors_mv = [gaussian_person(number).response.floor.median_mv for number in range(3)]
    assert min(floors_mv) * 0.8 < lab.floor.median_mv.median < max(floors_mv) * 1.25


def test_the_file_says_what_was_learnt_and_nothing_else(lab: Any, path: Path) -> None:
    assert priors.read_lab_prior(path) == lab
    assert priors.load(path) == lab.joined()


def test_a_session_with_a_lab_prior_can_be_made_again_from_its_log_alone(path: Path) -> None:
    strategy = make_strategy(prior=priors.load(path), particles=100, seed=3)
    path.unlink()
    again = make_strategy(seed=3, **strategy.recipe.settings)
    assert again.model == strategy.model
    assert again.ask() == strategy.ask()


def test_what_the_rig_states_joins_a_lab_prior_in_any_order(path: Path) -> None:
    prior = priors.load(path)
    orders: list[dict[str, Any]] = [{"prior": prior, "hit_delay_ms": (90.0, 3.0)}]
    orders.append(dict(reversed(orders[0].items())))
    for settings in orders:
        made = instance(ParticleModel, make_strategy(particles=100, **settings).model).prior
        assert made.profile.start.hit_delay_ms == (90.0, 3.0)
        assert made.profile.places == prior.profile.places


def test_a_lab_prior_from_the_valve_is_refused_in_a_space_from_the_impact(path: Path) -> None:
    with pytest.raises(InvalidValueError, match="different events"):
        make_strategy(space=IMPACT_SPACE, prior=priors.load(path), particles=100)


def test_the_path_of_a_lab_prior_is_no_prior(path: Path) -> None:
    for given in (path, str(path)):
        with pytest.raises(ConfigError, match=r"isiw\.priors\.load"):
            make_strategy(prior=given)


def test_a_strategy_with_another_model_does_not_take_a_lab_prior(path: Path) -> None:
    with pytest.raises(StrategyError, match="another kind of model"):
        make_strategy("parametric-mi", prior=priors.load(path))


def test_a_lab_prior_is_joined_with_the_usual_one_before_a_strategy_takes_it(path: Path) -> None:
    learnt = priors.read_lab_prior(path)
    with pytest.raises(StrategyError, match=r"another kind of model.*joined\(\)"):
        make_strategy(prior=learnt)
    assert make_strategy(prior=learnt.joined(), particles=100).ask() >= 0


@pytest.mark.parametrize(
    ("line", "wrong", "message"),
    [
        ("schema_version = 2", "schema_version = 99", "newer isiw"),
        ("schema_version = 2", "schema_version = 2\nrun = 'rm'", "run is unknown"),
        ("p_window = ", "p_window = 1e3 #", "p_window"),
    ],
)
def test_a_file_that_is_no_lab_prior_is_refused(path: Path, line: Any, wrong: Any, message: Any) -> None:
    path.write_text(path.read_text().replace(line, wrong, 1))
    with pytest.raises(ConfigError, match=message):
        priors.load(path)


def test_a_file_that_knew_no_curves_with_a_threshold_gives_them_their_usual_share(path: Path, lab: Any) -> None:
    own = lab.noise.rectified
    others = {name: share / (1.0 - own) for name, share in asdict(lab.noise).items() if name != "rectified"}
    old = tomllib.loads(path.read_text()) | {"schema_version": 1, "noise": others}
    path.write_text(tomli_w.dumps(old))
    noise, usual = priors.load(path).noise, NoiseShares().rectified
    assert noise.rectified == usual
    assert noise.recruitment == pytest.approx((1.0 - usual) * others["recruitment"])
    path.write_text(tomli_w.dumps(old | {"noise": others | {"recruitment": "most"}}))
    with pytest.raises(ConfigError, match=r"noise\.recruitment"):
        priors.load(path)


def test_the_table_sets_the_lab_beside_people_in_general(lab: Any) -> None:
    table = priors.compared(lab)
    row = table.loc["EMG floor [mV]"]
    assert row["lab median"] == pytest.approx(lab.floor.median_mv.median, rel=0.1)
    assert row["built-in median"] == pytest.approx(0.009, rel=0.05)
    slope = table.loc["slope [1 / % RMT]"]
    assert slope["built-in 95 %"] > slope["built-in 5 %"]


def test_densities_of_either_prior_are_densities(lab: Any) -> None:
    table = priors.densities(replace(lab, place=None))
    curve = table[table["quantity"] == "start [ms]"]
    for whose in ("built_in", "lab"):
        area = (curve[whose] * curve["value"].diff().median()).sum()
        assert area == pytest.approx(0.997, abs=0.02)


def test_the_next_person_may_still_be_anyone(lab: Any) -> None:
    usual, joined = Prior(), lab.joined()
    values = Case(usual, VALVE_SPACE).drawn(500, 1).values
    own, other = (prior.log_densities(values, VALVE_SPACE) for prior in (joined, usual))
    assert np.sum([own[block] - other[block] for block in own], axis=0).min() > 4 * math.log(
        0.1
    )  # four blocks have laws


def test_zeros_are_recalled_as_below_the_limit_that_the_strategy_was_told(tmp_path: Path) -> None:
    strategy = make_strategy("default", particles=100, detection_limit_mv=0.05)
    with isiw.open_session(strategy, tmp_path / "s.mcap") as session:
        session.tell(session.ask(), 0.0)
    recall = recalled(isiw.read_session(tmp_path / "s.mcap"), Prior(), particles=100)
    assert recall.model.detection_limit_mv == 0.05


def test_zeros_are_recalled_as_a_model_of_a_users_own_took_them(tmp_path: Path) -> None:
    default, model = make_strategy("default", particles=100), ParticleModel(particles=100, detection_limit_mv=0.05)
    strategy = isiw.Strategy(default.space, model, default.acquisition, default.stopping)
    with isiw.open_session(strategy, tmp_path / "s.mcap") as session:
        session.tell(session.ask(), 0.0)
    record = isiw.read_session(tmp_path / "s.mcap")
    assert record.header.detection_limit_mv == 0.05
    assert recalled(record, Prior(), particles=100).model.detection_limit_mv == 0.05


def test_a_session_is_recalled_with_what_its_strategy_was_told_of_rig_and_muscle(tmp_path: Path) -> None:
    strategy = make_strategy("default", particles=100, hit_delay_ms=(60.0, 4.0), muscle="hand")
    with isiw.open_session(strategy, tmp_path / "s.mcap") as session:
        session.tell(session.ask(), 0.05)
    recall = recalled(isiw.read_session(tmp_path / "s.mcap"), Prior(), particles=100)
    assert recall.model.prior.profile.start.hit_delay_ms == (60.0, 4.0)
    assert recall.model.prior.muscle == "hand"


@pytest.mark.parametrize(
    ("settings", "visit"), [({"intensity_pct_rmt": 110.0}, isiw.Visit()), ({}, isiw.Visit(intensity_pct_rmt=110.0))]
)
def test_a_session_is_recalled_at_the_intensity_that_strategy_or_visit_states(
    tmp_path: Path, settings: dict[str, Any], visit: isiw.Visit
) -> None:
    strategy = make_strategy("default", particles=100, **settings)
    with isiw.open_session(strategy, tmp_path / "s.mcap", visit=visit) as session:
        session.tell(session.ask(), 0.05)
    recall = recalled(isiw.read_session(tmp_path / "s.mcap"), Prior(), particles=100)
    assert recall.model.prior.intensity_pct_rmt == 110.0


def test_what_electrical_pulses_taught_is_for_electrical_pulses(tmp_path: Path) -> None:
    pulsed = [
        write_log(
            tmp_path / f"{k}.mcap",
            gaussian_person(k),
            subject=f"E{k}",
            trials=TRIALS,
            conditioning="electrical",
            space=IMPACT_SPACE,
        )
        for k in range(2)
    ]
    prior = priors.load(priors.write_lab_prior(priors.learn(pulsed), tmp_path / "lab.toml"))
    assert prior.profile.conditioning == "electrical"
    assert prior.profile.widths == ProfilePrior(conditioning="electrical").widths
    assert make_strategy(space=IMPACT_SPACE, prior=prior, particles=50).estimate().probability is not None
    width_ms = priors.compared(priors.read_lab_prior(tmp_path / "lab.toml")).loc["width [ms]"]
    assert width_ms["built-in median"] < 40  # after an electrical pulse, not after a tap
    with pytest.raises(InvalidValueError, match="another conditioning stimulus"):
        make_strategy(space=IMPACT_SPACE, prior=prior, conditioning="tap", particles=50)
    tapped = write_log(tmp_path / "tapped.mcap", subject="T", trials=3, space=IMPACT_SPACE)
    with pytest.raises(LogError, match="different conditioning stimuli"):
        priors.learn([tapped, *pulsed])
    day, *_ = map(isiw.read_session, pulsed)
    assert {place.conditioning for place in priors.after(day).profile.places} == {"electrical"}


def test_a_lab_learns_from_one_intensity(tmp_path: Path) -> None:
    below, near, unsaid, above = (
        write_log(tmp_path / f"{number}.mcap", subject=f"P{number}", trials=3, visit=Visit(intensity_pct_rmt=noted))
        for number, noted in enumerate((90.0, 95.0, None, 120.0))
    )
    assert len(priors.learn([below, near, unsaid]).sessions) == 3
    with pytest.raises(LogError, match=r"different intensities.*90 to 120 % of RMT"):
        priors.learn([below, unsaid, above])


def test_a_lab_learns_from_one_muscle_and_notes_which(tmp_path: Path) -> None:
    one, same, unsaid, other = (
        write_log(tmp_path / f"{number}.mcap", subject=f"P{number}", trials=3, visit=Visit(muscle=muscle))
        for number, muscle in enumerate(("FCR", "fcr ", "", "FDI"))
    )
    lab = priors.read_lab_prior(priors.write_lab_prior(priors.learn([unsaid, one, same]), tmp_path / "lab.toml"))
    assert [session.muscle for session in lab.sessions] == ["", "FCR", "fcr"]
    assert lab.noted_muscle == "FCR"
    with pytest.raises(LogError, match=r"of different muscles.*FCR.*FDI"):
        priors.learn([one, other])
