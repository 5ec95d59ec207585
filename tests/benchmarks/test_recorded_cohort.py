"""People whose MEPs were recorded: what a trial is, what is known beforehand, and how errors are counted."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from benchmarks.recorded_cohort import (
    EARLIER_NUMBERS,
    ELSE,
    LAW,
    LEARNT,
    SEARCHED,
    TOO_GOOD,
    Chunk,
    Earlier,
    RecordedSession,
    chunks,
    main,
)
from benchmarks.recorded_law import BINS, SPREAD_EVENLY, histograms, windows
from benchmarks.recorded_people import ADDED_MV, Bank, RecordedPerson, RecordedResponse, banks, smoothed
from benchmarks.recorded_tables import error_by_person, sure_and_wrong

import isiw

LEVELS = [90.0, 100.0, 110.0, 120.0, 130.0]
MEDIANS_MV = [0.02, 0.1, 0.5, 1.0, 1.5]


@pytest.fixture
def made_up(tmp_path: Path) -> Path:
    """A folder of made-up recordings, in the place of real ones: two people, two curves of ten pulses a level."""
    rng = np.random.default_rng(1)
    rows = [
        (person, "a", level, size * median_mv * np.exp(0.3 * rng.standard_normal()), 10 * place + pulse, 1)
        for person in (1, 2)
        for size in (1.0, 1.2)
        for place, (level, median_mv) in enumerate(zip(LEVELS, MEDIANS_MV, strict=True))
        for pulse in range(10)
    ]
    (tmp_path / "shayofir").mkdir()
    names = ["person", "coil", "intensity_pct_rmt", "mep_mv", "pulse", "use"]
    pd.DataFrame(rows, columns=names).to_csv(tmp_path / "shayofir" / "fdi_recruitment_trials.csv", index=False)
    return tmp_path


subject = RecordedPerson.subject


def counted() -> Bank:
    """Amplitudes are numbers of pulses, by hundreds of their level."""
    return Bank(1, "a", np.array([90.0, 100.0]), (np.linspace(100.0, 109.0, 10), np.linspace(200.0, 209.0, 10)))


def test_both_halves_share_no_pulse_and_lose_none() -> None:
    drawn, other = counted().half("drawn"), counted().half("other")
    assert drawn.amplitudes_mv[0].tolist() == [100, 102, 104, 106, 108]
    assert other.amplitudes_mv[1].tolist() == [201, 203, 205, 207, 209]


def test_a_trial_is_of_the_level_below_or_above_the_nearer_the_more_often() -> None:
    response, rng = RecordedResponse(counted(), boost_pct_rmt=10.0), np.random.default_rng(0)
    drawn = np.array([response.bank.drawn_mv(float(response.places(0.3)), rng) for _ in range(4000)])
    assert (drawn >= 200).mean() == pytest.approx(0.3, abs=0.03)
    assert drawn.mean() == pytest.approx(float(response.expected_evoked_mv(0.3)), abs=3.0)
    assert {float(response.expected_evoked_mv(level)) for level in (0.0, 1.0)} == {104.5, 204.5}


def test_below_the_lowest_level_it_is_the_lowest() -> None:
    assert counted().places([60.0, 90.0, 95.0, 130.0]).tolist() == [0.0, 0.0, 0.5, 1.0]


def test_single_pulses_are_of_the_other_half_and_the_first_of_many_are_the_few(made_up: Path) -> None:
    person = RecordedPerson(0, 5, made_up, banks="coils")
    many, few = person.single_pulses(60), person.single_pulses(10)
    other = {mv for level in person.bank.half("other").amplitudes_mv for mv in level.tolist()}
    assert many[:10] == few
    assert {mv for _, mv in many} <= other
    assert [level for level, _ in many].count(90.0) == 12


def test_pulses_of_a_search_are_shares_of_the_threshold_that_it_found(made_up: Path) -> None:
    person = RecordedPerson(0, 5, made_up, banks="coils")
    pulses = person.searched_pulses()
    other = {mv for level in person.bank.half("other").amplitudes_mv for mv in level.tolist()}
    assert {pulse.mep_mv for pulse in pulses} <= other
    above = [(pulse.mep_mv or 0.0) > 0.05 for pulse in pulses if abs((pulse.intensity_pct_rmt or 0.0) - 100.0) < 5.0]
    assert 0.2 < np.mean(above) < 0.8


def test_a_curve_begins_where_the_numbers_of_pulses_do(made_up: Path) -> None:
    assert [[len(level) for level in bank.amplitudes_mv] for bank in banks(made_up)] == [[10] * 5] * 4
    assert [bank.person for bank in banks(made_up)] == [1, 2, 1, 2]
    assert [[len(level) for level in bank.amplitudes_mv] for bank in banks(made_up, "coils")] == [[20] * 5] * 2


def test_amplitudes_of_a_curve_vary_as_recorded_about_the_mean_that_the_truth_is_of(made_up: Path) -> None:
    bank, rng = RecordedPerson(0, 5, made_up).bank, np.random.default_rng(0)
    drawn = np.array([[bank.drawn_mv(float(place), rng) for _ in range(4000)] for place in range(len(LEVELS))])
    assert drawn.mean(1) == pytest.approx(bank.means_mv, rel=0.03)
    logs = np.log(drawn + ADDED_MV)
    pulses = [np.log(level + ADDED_MV) for each in banks(made_up)[::2] for level in each.amplitudes_mv]
    of_person = np.reshape([level.var(ddof=1) for level in pulses], (2, 5)).mean(0)  # both curves of the person
    of_curve = np.array([level.var() for level in pulses[:5]])
    assert logs.std(1) == pytest.approx(np.sqrt(of_curve + of_person / 10), rel=0.05)
    edges, mass = histograms(bank)
    below = np.array([np.mean(level < edge) for level in logs for edge in edges[[5, 11, 17]]])
    assert below == pytest.approx(mass.cumsum(1)[:, [5, 11, 17]].ravel(), abs=0.03)


def test_pulses_of_a_curve_given_first_are_of_the_law_of_its_trials_and_not_the_same(made_up: Path) -> None:
    person = RecordedPerson(0, 5, made_up)
    assert person.bank.half("other") is person.bank.half("drawn")
    strong = np.array([mv for level, mv in person.single_pulses(2000) if level == LEVELS[-1]])
    assert len(set(strong.tolist())) == len(strong)
    assert strong.mean() == pytest.approx(person.bank.means_mv[-1], rel=0.06)


def test_people_who_are_made_up_have_the_levels_of_who_was_recorded_and_as_many_pulses_as_are_asked(
    made_up: Path,
) -> None:
    recorded, person = RecordedPerson(0, 5, made_up).bank, RecordedPerson(0, 5, made_up, 40)
    assert person.bank.levels_pct_rmt.tolist() == recorded.levels_pct_rmt.tolist()
    assert [len(level) for level in person.bank.half("drawn").amplitudes_mv] == [20] * 5
    assert (np.diff(person.bank.means_mv) > 0).all()
    assert RecordedPerson(0, 5, made_up, 40).bank.means_mv.tolist() == person.bank.means_mv.tolist()


def test_the_law_is_a_histogram_of_each_level_that_excludes_nothing() -> None:
    edges, mass = histograms(counted())
    assert edges.shape == (BINS - 1,)
    assert mass.sum(1) == pytest.approx(1.0)
    assert mass.min() >= SPREAD_EVENLY / BINS
    assert mass[:, :12].sum(1) == pytest.approx([0.98, 0.02], abs=0.02)
    assert windows()[2].sum() == pytest.approx(1.0)


@pytest.mark.slow
def test_who_knows_the_law_finds_the_window(made_up: Path) -> None:
    rows = [RecordedSession(RecordedPerson(number, 5, made_up), LAW, 0, 40).rows() for number in range(8)]
    found = pd.DataFrame([row for session in rows for row in session]).groupby("pairs")["f1"].mean()
    assert found[40] > 0.85 > found[0]


def test_sessions_that_were_kept_are_not_run_again(made_up: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    units = chunks([RecordedPerson(0, 5, made_up)], [0], 2, made_up)
    (unit,) = [unit for unit in units if unit.sessions[0].strategy == LAW]
    once = unit.run()
    monkeypatch.setattr(RecordedSession, "rows", lambda _: pytest.fail("it ran again"))
    pd.testing.assert_frame_equal(Chunk(unit.sessions, unit.file).run(), once)


def test_without_the_recordings_it_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(data=tmp_path / "nowhere", out=tmp_path / "result")
    assert "the recordings are not at hand" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_command_writes_its_tables(made_up: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(
        people=4,
        seed=5,
        given="0",
        trials=10,
        workers=1,
        data=made_up,
        out=tmp_path / "result",
        known=True,
        searched=True,
        lab=True,
    )
    written = (tmp_path / "result.md").read_text(encoding="utf-8")
    assert written in capsys.readouterr().out
    titles = ("By pairs", "At the stopping rule", "Without any pair", "By person", "What it believes")
    assert all(f"## {title}\n" in written for title in titles)
    assert {LAW, ELSE, LEARNT, SEARCHED} <= set(re.findall(r"(?m)^\| (\S[^|]*?) +\|", written))
    assert TOO_GOOD not in written


@pytest.mark.slow
def test_a_lab_s_prior_is_of_the_other_persons_and_learnt_once(made_up: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[RecordedPerson] = []

    def noted(person: RecordedPerson) -> isiw.subjects.SimulatedSubject:
        asked.append(person)
        return subject(person)

    monkeypatch.setattr("benchmarks.recorded_cohort.EARLIER_TRIALS", 3)
    monkeypatch.setattr(RecordedPerson, "subject", noted)
    earlier = Earlier(RecordedPerson(0, 5, made_up), made_up / "lab.toml")
    prior = earlier.prior()
    assert [(one.bank.person, one.number >= EARLIER_NUMBERS) for one in asked] == [(2, True)]
    assert earlier.prior() == prior
    assert len(asked) == 1


def test_sessions_of_one_person_are_no_independent_witnesses() -> None:
    values = pd.Series([0.0, 1.0] * 50)
    of_two, of_all = pd.Series([1, 2] * 50), pd.Series(range(100))
    assert error_by_person(values, of_all) == pytest.approx(0.05, abs=0.005)
    assert error_by_person(values, of_two) == pytest.approx(0.354, abs=0.02)


def test_sure_and_wrong_needs_both() -> None:
    rows = pd.DataFrame({"expected_f1": [0.7, 0.69, 0.9, 0.9], "f1": [0.35, 0.0, 0.5, 0.6]})
    assert sure_and_wrong(rows).tolist() == [True, False, True, False]


def test_the_recordings_are_of_ten_people_who_come_in_turn(shared_data: Path) -> None:
    found, curves = banks(shared_data, "coils"), banks(shared_data)
    assert (len(found), len(curves)) == (30, 55)
    assert {bank.person for bank in found[:10]} == {bank.person for bank in curves[:10]} == set(range(1, 11))
    assert sum(len(level) for bank in found for level in bank.amplitudes_mv) == 1917
    assert all({90.0, 100.0, 110.0, 120.0} <= set(bank.levels_pct_rmt.tolist()) for bank in curves)


def test_smoothing_keeps_the_variance_of_the_log_amplitudes_that_were_recorded(shared_data: Path) -> None:
    curves = banks(shared_data)
    recorded = [np.log(level + ADDED_MV) for bank in curves for level in bank.amplitudes_mv]
    kernels = np.concatenate([smoothed(bank, curves).kernel_log_sds for bank in curves])
    of_law = np.mean([logs.var() + sd**2 for logs, sd in zip(recorded, kernels, strict=True)])
    assert of_law == pytest.approx(np.mean([logs.var(ddof=1) for logs in recorded]), rel=0.03)
