from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest

from isiw.intervention import Arm
from isiw.log.record import read_session
from isiw.pairing import Delivered
from isiw.pairing.agenda import Agenda, FollowedPair, course_of
from isiw.pairing.pulses import pairing_of
from isiw.pairing.words import NOT_YET
from isiw.report.drawn import drawn
from isiw.report.intervention import InterventionContents, intervention_page
from isiw.report.page import report_page
from isiw.report.words import final_statement
from isiw.session.afterwards import open_arm
from isiw.session.sink import SessionUpdate
from known import known
from pairing.paired import intervention, knowing, session
from pairing.tested import visit
from report.sessions import HOSTILE, Page

DELIVERED = tuple(Delivered(88.0 + place % 3, 10.0 * place, 0.1, probe=place % 10 == 0) for place in range(50))
PULSES = visit(0, 2.0).pulses


@pytest.mark.slow
@pytest.mark.needs_pictures
def test_a_page_shows_the_change_each_block_the_dose_and_the_window() -> None:
    window = [(0.0, 60.0, 120.0), (400.0, 70.0, 130.0)]
    page = Page(intervention_page(InterventionContents(PULSES, DELIVERED, window=window, subject=HOSTILE)))
    assert "TMS alone evokes more than before" in page.words
    for said in ("after 0 min", "after 60 min", "all blocks", "45 pairs at 88–90 ms and 5 probes", "window"):
        assert said in page.words
    assert "taken" in page.words  # the subject's code is text


@pytest.mark.slow
@pytest.mark.needs_pictures
def test_a_page_shows_the_course_of_the_window_that_was_followed() -> None:
    course = [FollowedPair(1 + k, k // 25, 88.0 + k // 25, k % 10 == 0, 90.0, 80.0, 99.0, 0.9) for k in range(50)]
    words = Page(intervention_page(InterventionContents(PULSES, DELIVERED, course=course))).words
    for said in ("90 % interval of the best ISI", "inside the window (expected)", "outside"):
        assert said in words


@pytest.mark.slow
def test_a_course_is_what_was_known_at_each_pair(tmp_path: Path) -> None:
    session(tmp_path / "s.mcap", intervention(arms=(Arm.WINDOW,), before=6)).run()
    record = read_session(tmp_path / "s.mcap")
    agenda = Agenda(known(record.header.intervention), knowing(), record.header.seed)
    course = course_of(agenda, record.table, record.header.seed)
    assert [pair.number for pair in course] == list(range(1, 51))
    assert [pair.block for pair in course] == [0] * 20 + [1] * 20 + [2] * 10
    assert [pair.isi_ms for pair in course] == [pair.isi_ms for pair in pairing_of(record).pairs]
    assert sum(pair.probe for pair in course) == 5
    assert all(pair.low_ms <= pair.best_ms <= pair.high_ms for pair in course)
    assert max(abs(pair.best_ms - 100.0) for pair in course) < 10.0
    assert min(pair.p_inside for pair in course if not pair.probe) > 0.8


def test_the_live_page_has_the_window_that_was_searched_for_from_the_first_pulse_on(tmp_path: Path) -> None:
    session(tmp_path / "s.mcap", intervention(arms=(Arm.WINDOW,), before=6)).run()
    first = drawn(read_session(tmp_path / "s.mcap"))["beliefs"][0]
    assert first["window"]
    assert "Fewer than three pairs" not in first["found"]


def test_a_concealed_arm_is_not_shown_though_the_change_is() -> None:
    page = Page(intervention_page(InterventionContents(PULSES, None, stimuli=50)))
    assert "The arm is concealed" in page.words
    assert "after 15 min" in page.words
    assert "probe" not in page.words


def test_too_few_pulses_are_said_and_no_change_is_drawn() -> None:
    page = Page(intervention_page(InterventionContents(PULSES[:30], DELIVERED)))
    assert "Too few pulses of TMS alone" in page.words
    assert "all blocks" not in page.words


@pytest.mark.slow
@pytest.mark.needs_pictures
def test_pulses_of_several_intensities_are_told_apart() -> None:
    pulses = [
        type(pulse)(pulse.mep_mv, 110.0 + 10 * (place % 2), pulse.after_last_pair_s, pulse.block)
        for place, pulse in enumerate(PULSES)
    ]
    words = Page(intervention_page(InterventionContents(pulses, ()))).words
    assert "mean of a block at 110 % RMT" in words
    assert "No pair of stimuli was delivered." in words


def test_the_page_of_an_interventions_log_is_that_of_the_change_and_conceals_its_arm(tmp_path: Path) -> None:
    concealed = intervention(Arm.WINDOW, before=6, after=5)
    session(tmp_path / "s.mcap", concealed).run()
    page = Page(report_page(read_session(tmp_path / "s.mcap"))).words
    assert "TMS alone evokes" in page
    assert "after 2 min" in page
    assert "The arm is concealed" in page
    assert Arm.WINDOW.words not in page
    assert "probe" not in page
    open_arm(tmp_path / "s.mcap")
    opened = Page(report_page(read_session(tmp_path / "s.mcap"))).words
    assert Arm.WINDOW.words in opened
    assert "45 pairs at" in opened
    assert "5 probes of the window" in opened


def test_an_intervention_that_is_not_over_says_so(tmp_path: Path) -> None:
    def stopping(update: SessionUpdate) -> None:
        if update.trial.index == 6:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        session(tmp_path / "s.mcap", intervention(arms=(Arm.WINDOW,), before=6), on_trial=stopping).run()
    page = Page(report_page(read_session(tmp_path / "s.mcap"))).words
    assert "7 of 62 stimuli of the plan were given." in page
    assert "Too few pulses" in page


@pytest.mark.slow
def test_a_concealed_change_waits_for_the_end_of_the_plan(tmp_path: Path) -> None:
    def stopping(update: SessionUpdate) -> None:
        if update.trial.index == 61:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        session(tmp_path / "s.mcap", intervention(before=6, after=4), on_trial=stopping).run()
    record = read_session(tmp_path / "s.mcap")
    for said in (Page(report_page(record)).words, final_statement(record)):
        assert NOT_YET in said
        assert "90 % interval ×" not in said
    session(tmp_path / "t.mcap", intervention(before=6, after=4)).run()
    assert "90 % interval ×" in final_statement(read_session(tmp_path / "t.mcap"))
