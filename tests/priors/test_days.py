"""The same person another day: where the window is looked for first, and whether it moved."""

from __future__ import annotations

from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import softmax

from isiw import priors
from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.errors import DamagedLogError, InvalidValueError, LogError
from isiw.log.record import read_session
from isiw.log.salvage import salvage
from isiw.log.schema import Event
from isiw.log.writer import LogWriter
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.prior import Prior
from isiw.priors.days import recalled
from isiw.session import open_session
from isiw.session.afterwards import exclude
from isiw.strategy.catalogue import make_strategy
from isiw.types import Singles
from isiw.visit import Visit
from known import known
from logs import damage
from native.drawn import Case
from priors.logged import EARLY_MS, person, write_log

LATE_MS = 200.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: Any) -> Any:
    return tmp_path_factory.mktemp("days")


@pytest.fixture(scope="module")
def first(folder: Path) -> Any:
    return read_session(write_log(folder / "first.mcap", person(), trials=18))


@pytest.fixture(scope="module")
def next_day(first: Any) -> Any:
    return priors.after(first)


def starts_ms(prior: Prior) -> Singles:
    start_ms: Singles = Case(prior, VALVE_SPACE).drawn(20_000, 1).of("start_ms")[0]
    return start_ms


def test_another_day_on_a_rig_with_another_hit_delay_is_refused(tmp_path: Path) -> None:
    paths = [
        write_log(tmp_path / f"{mean_ms}.mcap", person(), trials=6, created=f"2026-11-2{day}", seed=day,
                  hit_delay_ms=(mean_ms, 5.0))
        for day, mean_ms in enumerate((180.0, 184.0, 80.0), 1)
    ]  # fmt: skip
    first, second, elsewhere = map(read_session, paths)
    both = priors.after(first, second)
    assert both.profile.start.hit_delay_ms == (184.0, 5.0)  # each session has its own rig's
    assert {place.hit_delay_ms for place in both.profile.places} == {(180.0, 5.0), (184.0, 5.0)}
    for compared in (priors.after, priors.moved):
        with pytest.raises(InvalidValueError, match=r"another hit delay.*80\.0.*180\.0"):
            compared(first, elsewhere)
    with pytest.raises(InvalidValueError, match="another hit delay"):
        make_strategy(prior=both, hit_delay_ms=(80.0, 5.0), particles=50)
    with pytest.raises(LogError, match=r"80 to 180 ms"):
        priors.learn([paths[0], paths[2]], again=True)


def test_a_session_without_trials_is_no_day(tmp_path: Path) -> None:
    first, second = (
        read_session(write_log(tmp_path / f"{day}.mcap", trials=0, created=f"2026-11-2{day}")) for day in (1, 2)
    )
    with pytest.raises(LogError, match="no accepted trial"):
        priors.moved(first, second)


def test_seven_in_ten_windows_are_expected_about_the_first_days(next_day: Any) -> None:
    truth = known(person().window(VALVE_SPACE))
    near, usually = (np.abs(starts_ms(prior) - truth.start_ms) < 40.0 for prior in (next_day, Prior()))
    assert near.mean() > 0.6 + 0.25 * usually.mean()
    assert next_day.profile.p_place == pytest.approx(0.7)


def test_the_window_is_less_certain_than_it_was_by_the_shift(next_day: Any, first: Any) -> None:
    places = next_day.profile.places
    assert min(place.start_ms.sd for place in places) >= 12.0
    far = priors.after(first, law=priors.DayToDay(shift_sd_ms=40.0)).profile.places
    assert min(place.start_ms.sd for place in far) >= 40.0


def test_the_rest_of_the_person_is_nearly_kept(next_day: Any, first: Any) -> None:
    assert sum(floor.share for floor in next_day.floors[2:]) == pytest.approx(0.9)
    assert next_day.floors[-1].median_mv.median == pytest.approx(person().response.floor.median_mv, rel=0.2)
    forgotten = priors.after(first, law=priors.DayToDay(p_stays=0.0, p_other=1.0))
    assert forgotten.profile.p_window == pytest.approx(Prior().profile.p_window)
    assert forgotten.noise == Prior().noise


def test_a_third_day_knows_both(first: Any, next_day: Any, folder: Path) -> None:
    second = read_session(write_log(folder / "second.mcap", person(), trials=18, seed=2))
    third = priors.after(first, second)
    known = len(next_day.profile.places)
    assert [place.start_ms for place in third.profile.places[:known]] == [p.start_ms for p in next_day.profile.places]
    assert sum(place.share for place in third.profile.places[:known]) == pytest.approx(0.3 * 0.7)
    assert third.profile.p_place == pytest.approx(0.7 + 0.3 * 0.7)
    assert third == priors.after(second, prior=next_day)


def test_a_change_that_was_noted_is_one_to_whatever_learns_the_session(tmp_path: Path) -> None:
    path = write_log(tmp_path / "changed.mcap", person(), trials=18)
    with LogWriter.continuing(path, salvage(path), read_session(path).header) as log:
        log.append(Event(kind="change", trial=8, text="another gain"))
    posterior = recalled(read_session(path), Prior(), particles=100)
    assert posterior.model.prior.changes.noted == (9,)
    assert priors.after(read_session(path)).changes == Prior().changes  # the next day has none of it


@pytest.mark.slow
def test_a_window_that_stayed_probably_did_not_move_and_one_elsewhere_did(first: Any, folder: Path) -> None:
    stayed = read_session(write_log(folder / "stayed.mcap", person(EARLY_MS + 8.0), trials=18, seed=3))
    gone = read_session(write_log(folder / "gone.mcap", person(LATE_MS), trials=18, seed=3))
    assert priors.moved(first, stayed) < 0.25
    assert priors.moved(first, gone) > 0.9


@pytest.mark.slow
def test_whether_a_window_moved_is_judged_with_the_hit_delay_of_the_second_day(first: Any, folder: Path) -> None:
    path = write_log(folder / "stated.mcap", person(EARLY_MS + 60.0), trials=18, seed=3, hit_delay_ms=(180.0, 6.0))
    later = recalled(read_session(path), priors.after(first))
    weights = (np.exp(later.swarm.log_weights) * later.swarm.latents.present)[0]
    elsewhere = softmax(later.model.prior.log_places(later.swarm.latents.values, later.space)[0], axis=-1)[:, 0]
    assert priors.moved(first, read_session(path)) == pytest.approx(float((weights * elsewhere).sum() / weights.sum()))


def test_of_a_session_without_a_window_it_cannot_be_said_whether_it_moved(first: Any, folder: Path) -> None:
    none = read_session(write_log(folder / "none.mcap", person(gain=0.0), trials=18))
    with pytest.raises(InvalidValueError, match="probably has none"):
        priors.moved(none, first)


def test_a_day_whose_log_is_damaged_is_refused_unless_told(tmp_path: Path) -> None:
    log = write_log(tmp_path / "s.mcap", trials=4)
    exclude(log, 2, "sneezed")
    damage(log)
    record = read_session(log)
    with pytest.raises(DamagedLogError, match=r"s\.mcap: .*lost.*damaged=True"):
        priors.after(record)
    assert priors.after(record, damaged=True).profile.places


def test_days_of_different_people_are_refused(first: Any, folder: Path) -> None:
    other = read_session(write_log(folder / "other.mcap", person(), subject="P2", trials=5))
    for together in (priors.after, priors.moved):
        with pytest.raises(InvalidValueError, match="different people"):
            together(first, other)


@pytest.mark.parametrize(
    ("noted", "what"),
    [(Visit(muscle="FDI"), "different muscles, FCR and FDI"), (Visit(intensity_pct_rmt=120.0), "90 and 120 % of RMT")],
)
def test_days_of_different_muscles_or_intensities_are_refused(noted: Visit, what: str, tmp_path: Path) -> None:
    usual = Visit(muscle="FCR", intensity_pct_rmt=90.0)
    one, other = (
        read_session(write_log(tmp_path / f"{day}.mcap", trials=4, created=f"2026-11-2{day}", seed=day, visit=visit))
        for day, visit in enumerate((usual, noted), 1)
    )
    for together in (priors.after, priors.moved):
        with pytest.raises(InvalidValueError, match=what):
            together(one, other)


def test_days_of_different_conditioning_stimuli_are_refused(tmp_path: Path) -> None:
    one, other = (
        read_session(write_log(tmp_path / f"{day}.mcap", trials=4, created=f"2026-11-2{day}", seed=day))
        for day in (1, 2)
    )
    pulsed = replace(other.header.device, conditioning="electrical")
    with pytest.raises(InvalidValueError, match="different conditioning stimuli"):
        priors.moved(one, replace(other, header=other.header.model_copy(update={"device": pulsed})))


def test_a_session_counts_once_also_as_a_copy(first: Any, folder: Path) -> None:
    copy = folder / "copy.mcap"
    copy.write_bytes(first.path.read_bytes())
    for together in (priors.after, priors.moved):
        with pytest.raises(InvalidValueError, match=r"same session.*copy\.mcap"):
            together(first, read_session(copy))


def test_a_path_is_no_session(first: Any) -> None:
    for ask in (priors.after, priors.moved, lambda *paths: priors.differences(paths)):
        with pytest.raises(InvalidValueError, match=r"isiw\.read_session"):
            ask(first.path, first.path)


def test_days_come_in_the_order_in_which_they_were(first: Any, folder: Path) -> None:
    later = read_session(write_log(folder / "later.mcap", person(), trials=5, created="2026-11-22T10:00:00+00:00"))
    with pytest.raises(InvalidValueError, match="the first one first"):
        priors.after(later, first)


def test_days_on_different_clocks_are_refused(first: Any, folder: Path) -> None:
    other = read_session(write_log(folder / "impact.mcap", person(), trials=5, space=IMPACT_SPACE))
    with pytest.raises(InvalidValueError, match="different events"):
        priors.after(first, other)


@pytest.mark.parametrize("wrong", [{"p_stays": 1.2}, {"shift_sd_ms": 0.0}, {"p_other": float("nan")}])
def test_an_impossible_law_of_days_is_refused(wrong: Any) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        priors.DayToDay(**wrong)


def test_a_law_of_days_leaves_something_to_windows_that_moved() -> None:
    with pytest.raises(InvalidValueError, match="p_stays"):
        priors.DayToDay(p_stays=1.0)


def test_a_path_is_no_prior(first: Any) -> None:
    wrong: Any = "lab.toml"
    with pytest.raises(InvalidValueError, match=r"isiw.priors.load"):
        priors.after(first, prior=wrong)


@pytest.mark.slow
@pytest.mark.usefixtures("few_sweeps")
def test_a_law_by_levels_teaches_nothing_of_the_kinds_of_noise(tmp_path: Path) -> None:
    log, rng = tmp_path / "levels.mcap", np.random.default_rng(1)
    levels = ((92.0, 0.02), (98.0, 0.05), (104.0, 0.06), (110.0, 0.5), (116.0, 0.55), (122.0, 2.0))
    strategy = make_strategy("even", IMPACT_SPACE, 1, intensity_pct_rmt=90.0, particles=50)
    with open_session(strategy, log=log, subject="P1") as session:
        for pct_rmt, mep_mv in 8 * levels:
            mep_mv *= float(np.exp(0.2 * rng.standard_normal()))  # noqa: PLW2901 - with noise
            session.tell(None, mep_mv, intensity_pct_rmt=pct_rmt)
        for mep_mv in (0.02, 0.03, 0.02):
            session.tell(session.ask(), mep_mv)
    record = read_session(log)
    latents = recalled(record, Prior()).swarm.latents
    assert (latents.noise == NoiseKind.BY_LEVELS).any()
    for prior in (priors.after(record), priors.learn([log])):  # a person's particles are left as they are usual
        assert sum(astuple(prior.noise)) == pytest.approx(1.0)
        assert prior.noise.all_or_none == pytest.approx(Prior().noise.all_or_none, abs=0.06)
