from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.stats

import isiw
from isiw import sentences
from isiw.decision import StopDecision, StopKind
from isiw.errors import LogError
from isiw.report.evidence import changed_with_time, contradiction, growth, no_comparison, nothing_stood_out, p_of_larger
from isiw.summary import NO_MEP
from isiw.trials import Status, Trial
from isiw.types import FloatArray
from isiw.window import Window
from scripted import scripted_strategy


def trials(inside_mv: Sequence[float], outside_mv: Sequence[float]) -> list[Trial]:
    meps_mv = [(100.0 + k, mep_mv) for k, mep_mv in enumerate(inside_mv)]
    meps_mv += [(200.0 + k, mep_mv) for k, mep_mv in enumerate(outside_mv)]
    return [Trial(k, Status.ACCEPTED, isi, isi_ms=isi, mep_mv=mep) for k, (isi, mep) in enumerate(meps_mv)]


WINDOW = Window(90, 150)


def test_a_window_whose_meps_are_no_larger_is_not_borne_out() -> None:
    said = contradiction(WINDOW, trials([0.02, 0.021, 0.019, 0.02], [0.02, 0.022, 0.021, 0.02]))
    assert said == sentences.not_larger((20.0, 20.0))


def test_medians_that_say_the_contrary_are_left_out() -> None:
    said = contradiction(WINDOW, trials([0.06, 0.06, 0.06, 0.01, 0.01], [0.05, 0.05, 0.07, 0.07, 0.05, 0.02]))
    assert said == sentences.not_larger((60.0, 50.0))


def test_without_a_probability_it_is_said_too_that_meps_are_not_clearly_larger() -> None:
    told = trials([0.02, 0.021, 0.023, 0.02], [0.02, 0.022, 0.019, 0.02])
    assert contradiction(WINDOW, told) is None
    said = contradiction(WINDOW, told, without_probability=True)
    assert said is not None
    assert said.startswith("The data support this only weakly: the MEPs inside are not clearly larger")
    clear = trials([0.08, 0.05, 0.04, 0.06], [0.02, 0.022, 0.021, 0.02])
    assert contradiction(WINDOW, clear, without_probability=True) is None


@pytest.mark.parametrize(("factor", "word"), [(1.05, "grew"), (0.95, "shrank"), (1.0, None)])
def test_amplitudes_that_change_with_time_whatever_the_isi_are_told(factor: float, word: str | None) -> None:
    rng = np.random.default_rng(4)
    isis_ms = rng.uniform(50, 200, 50)
    meps_mv = 0.05 * factor ** np.arange(50) * np.exp(0.4 * rng.standard_normal(50))
    session = [
        Trial(k, Status.ACCEPTED, float(isi), isi_ms=float(isi), mep_mv=float(mep))
        for k, (isi, mep) in enumerate(zip(isis_ms, meps_mv, strict=True))
    ]
    said = changed_with_time(WINDOW, session)
    assert said is None if word is None else f"The amplitudes {word} during the session" in str(said)
    assert changed_with_time(None, session) is None
    assert changed_with_time(WINDOW, session[:4]) is None


@pytest.mark.parametrize("decimals", [15, 0], ids=["all different", "many equal"])
def test_the_rank_tests_say_what_scipy_says(decimals: int) -> None:
    rng = np.random.default_rng(5)
    for _ in range(100):
        inside, outside = rng.standard_normal(rng.integers(4, 30)), rng.standard_normal(rng.integers(8, 30))
        inside, outside = (inside + rng.uniform(-0.5, 1.5)).round(decimals), outside.round(decimals)
        p = scipy.stats.mannwhitneyu(inside, outside, alternative="greater").pvalue
        assert p_of_larger(inside.tolist(), outside.tolist()) == pytest.approx(p, abs=0.015)
        rising = (outside + rng.uniform(-0.1, 0.1) * np.arange(len(outside))).round(decimals)
        found = scipy.stats.kendalltau(np.arange(len(rising)), rising, alternative="greater", method="asymptotic")
        p = found.pvalue
        assert scipy.stats.norm.sf(growth(rising)) == pytest.approx(p, abs=0.005)


@pytest.mark.parametrize(("factor", "word"), [(1.0, None), (0.97, "shrank")])
def test_amplitudes_that_are_smaller_since_isis_move_to_the_edges_have_not_shrunk(
    factor: float, word: str | None
) -> None:
    rng = np.random.default_rng(6)
    away_ms = np.linspace(0, 60, 60) * rng.choice((-1, 1), 60)
    isis_ms = 120 + away_ms
    usual_mv = 0.02 + 0.3 * np.exp(-0.5 * (away_ms / 25) ** 2)
    meps_mv = usual_mv * factor ** np.arange(60) * np.exp(0.4 * rng.standard_normal(60))
    session = [
        Trial(k, Status.ACCEPTED, float(isi), isi_ms=float(isi), mep_mv=float(mep))
        for k, (isi, mep) in enumerate(zip(isis_ms, meps_mv, strict=True))
    ]
    order = np.argsort(isis_ms)
    said = changed_with_time(WINDOW, session, (isis_ms[order].tolist(), usual_mv[order].tolist()))
    assert said is None if word is None else f"The amplitudes {word} during the session" in str(said)
    assert growth(meps_mv) < -3  # as if they had, were it not for the ISIs


def test_a_change_shows_in_many_trials_as_in_few_though_each_is_compared_with_some_of_the_others() -> None:
    rng = np.random.default_rng(7)
    found = np.array([growth(rng.lognormal(sigma=0.5, size=530), None, rng.uniform(0, 320, 530)) for _ in range(60)])
    assert np.abs(found).max() < 4  # standard errors
    assert 0.8 < found.std() < 1.2
    rising = rng.lognormal(0.003 * np.arange(530), 0.5)
    assert growth(rising) == pytest.approx(growth_by_all_pairs(rising), rel=0.05)


def growth_by_all_pairs(meps_mv: FloatArray) -> float:
    """Kendall's statistic of amplitudes against order, in standard errors, ties and ISIs apart."""
    n = len(meps_mv)
    rises = np.triu(np.sign(np.subtract.outer(meps_mv, meps_mv)).T).sum()
    return float(rises) / float(np.sqrt(n * (n - 1) * (2 * n + 5) / 18))


def test_nothing_is_larger_where_everything_is_equal() -> None:
    assert p_of_larger([0.02] * 4, [0.02] * 5) == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("cohort", ["recruitment", "gaussian"])
def test_a_usual_person_whose_isis_are_asked_by_the_default_has_no_change_with_time(cohort: str) -> None:
    said = 0
    for person in range(6):
        subject = isiw.subjects.cohort(cohort, person + 1, seed=30)[person]
        strategy, responder = isiw.make_strategy(seed=person, particles=200), subject.begin(person)
        told = list[Trial]()
        for k in range(30):
            outcome = responder.respond(strategy.ask(), "valve")
            strategy.tell(outcome.isi_ms, outcome.mep_mv)
            told.append(Trial(k, Status.ACCEPTED, outcome.isi_ms, isi_ms=outcome.isi_ms, mep_mv=outcome.mep_mv))
        said += changed_with_time(subject.window(isiw.DesignSpace(0, 500, reference="impact")), told) is not None
    assert said == 0


@pytest.mark.parametrize(
    ("window", "inside_mv", "outside_mv"),
    [
        (WINDOW, [0.08, 0.05, 0.02, 0.06], [0.02, 0.022, 0.021, 0.02]),
        (WINDOW, [0.01, 0.01, 0.01], [0.02, 0.022, 0.021, 0.02]),
        (None, [0.02, 0.021, 0.019, 0.02], [0.02, 0.022, 0.021, 0.02]),
    ],
)
def test_larger_meps_too_few_of_them_and_no_window_contradict_nothing(
    window: Window | None, inside_mv: list[float], outside_mv: list[float]
) -> None:
    assert contradiction(window, trials(inside_mv, outside_mv)) is None


def test_a_window_with_hardly_a_trial_outside_has_nothing_to_be_compared_with() -> None:
    told = trials([1.0, 1.1, 0.9, 1.0, 1.0], [1.0])
    assert "(1 of 6 pairs outside the window, 0 pulses of TMS alone)" in str(no_comparison(WINDOW, told))
    alone = [Trial(6 + k, Status.ACCEPTED, None, mep_mv=0.02) for k in range(3)]
    assert no_comparison(WINDOW, [*told, *alone]) is None
    assert no_comparison(None, told) is None


def at_rest(mep_mv: float, rest_uv: float | None = 1.5) -> Trial:
    return Trial(0, Status.ACCEPTED, 50.0, isi_ms=50.0, mep_mv=mep_mv, background_rms_uv=rest_uv)


def test_where_no_mep_stands_out_of_emg_at_rest_the_statement_asks_whether_the_stimulator_fired() -> None:
    quiet = [at_rest(0.01)] * 10
    assert "larger than at rest. Did the stimulator fire" in str(nothing_stood_out(quiet))
    assert nothing_stood_out(quiet[:9]) is None
    assert nothing_stood_out([*quiet, at_rest(0.05)]) is None
    assert nothing_stood_out([at_rest(0.01, None)] * 20) is None


def test_what_was_measured_in_the_mep_window_is_said_of_that_window_only() -> None:
    said = str(nothing_stood_out([at_rest(0.01)] * 10, (15.0, 35.0)))
    assert said.startswith("In no trial was the EMG in the MEP window, 15–35 ms after the pulse, larger than at rest. ")
    assert said.endswith("Is the time of the pulse right? Does the MEP window fit the muscle?")


def test_that_no_mep_is_seen_any_more_is_said_with_the_trial_from_which_on() -> None:
    meps_mv = [0.2, 0.1] * 4 + [0.006] * 12
    trials = [replace(at_rest(mep_mv), index=index) for index, mep_mv in enumerate(meps_mv)]
    assert str(nothing_stood_out(trials)).startswith("From trial 8 on, the EMG after the pulse was never larger than")
    assert nothing_stood_out(trials[:17]) is None
    assert nothing_stood_out(trials[:3] + trials[8:]) is None


def test_amplitudes_that_are_all_zero_are_doubted_and_find_nothing(tmp_path: Path) -> None:
    with isiw.open_session(scripted_strategy(12), tmp_path / "zeros.mcap") as session:
        for _ in range(9):
            session.tell(session.ask(), 0.0)
        with pytest.warns(UserWarning, match="None of the first 10 pulses evoked an MEP"):
            session.tell(session.ask(), 0.0)
        for _ in range(2):
            session.tell(session.ask(), 0.0)
    record = isiw.read_session(tmp_path / "zeros.mcap")
    assert [event.trial for event in record.events if event.kind == "doubt"] == [9]
    assert not record.rests_on_data
    said = isiw.report.final_statement(record)
    assert "No MEP was seen in any trial that counts" in said
    assert "The amplitudes of all 12 trials that count are 0" in said
    for confident in ("No window was found", "excluded", "expected F1", "There is no window"):
        assert confident not in said
    assert "No MEP was seen" in str(record)
    with pytest.raises(LogError, match="no MEP to learn from"):
        isiw.priors.learn([record.path])


@pytest.mark.parametrize(("limit_mv", "silent"), [(None, True), (0.005, True), (0.05, False)])
def test_zeros_below_a_high_detection_limit_are_a_finding(
    tmp_path: Path, limit_mv: float | None, *, silent: bool, recwarn: pytest.WarningsRecorder
) -> None:
    known: dict[str, Any] = {} if limit_mv is None else {"detection_limit_mv": limit_mv}
    strategy = isiw.make_strategy("default", particles=100, **known)
    with isiw.open_session(strategy, tmp_path / "zeros.mcap") as session:
        for _ in range(11):
            session.tell(session.ask(), 0.0)
    record = isiw.read_session(tmp_path / "zeros.mcap")
    assert record.is_silent == strategy.estimate().silent == silent
    assert (str(strategy.estimate()) == str(NO_MEP)) == (str(NO_MEP) in str(record)) == silent
    assert bool(recwarn.list) == silent


def test_a_strategy_finds_nothing_without_an_mep_and_goes_on() -> None:
    strategy = isiw.make_strategy("default", particles=200, max_trials=80)
    for _ in range(70):
        strategy.learn(Trial.of(strategy.ask(), 0.0))
    estimate = strategy.estimate()
    assert (estimate.probability or 1.0) < (estimate.beforehand or 0.0) / 4
    assert str(estimate) == str(NO_MEP)
    assert strategy.decision() == StopDecision(stop=False, reason=str(NO_MEP), kind=StopKind.TOO_LITTLE)
    strategy.learn(Trial.of(strategy.ask(), 0.2))
    assert strategy.estimate().rests_on_data


def test_the_reason_of_a_pause_is_said_also_where_no_mep_was_seen(tmp_path: Path) -> None:
    with isiw.open_session(scripted_strategy(4), tmp_path / "zeros.mcap") as session:
        for _ in range(4):
            session.tell(session.ask(), 0.0)
    record = isiw.read_session(tmp_path / "zeros.mcap")
    for kind, is_said in ((StopKind.PAUSED, True), (StopKind.LIMIT, True), (StopKind.ABSENT, False)):
        last = record.estimates[-1].model_copy(update={"reason": "So it is.", "stop_kind": kind})
        assert ("So it is." in isiw.report.final_statement(replace(record, history=(*record.history, last)))) == is_said
