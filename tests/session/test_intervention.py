"""The session of an intervention: what is delivered, when, what is shown, and how it is continued."""

from __future__ import annotations

import json
import re
import shutil
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from isiw import schedule
from isiw.devices.clock import VirtualClock
from isiw.devices.protocol import Readiness
from isiw.errors import InvalidValueError, LogError, StrategyError
from isiw.existing.reading import read_people
from isiw.export.collection import read_logs
from isiw.intervention import Arm
from isiw.log import moments, writer
from isiw.log.record import read_session
from isiw.log.schema import EstimateRecord, Intent, Waveform
from isiw.pairing.agenda import Agenda
from isiw.pairing.pulses import pairing_of
from isiw.plots.session import session_figure
from isiw.plots.timeline import timeline_figure
from isiw.report.comparison import comparison_rows, correlation_sentence, counts_table
from isiw.report.words import final_statement, trial_rows
from isiw.schedule import Part
from isiw.server.live.view import View
from isiw.session.afterwards import open_arm
from isiw.session.blocks import Blocks
from isiw.session.loop import Session
from isiw.session.resuming import open_session, resume
from isiw.session.rig import Safeguards
from isiw.sweeps import Measurement
from isiw.trials import Stimulus, Trial
from pairing.paired import EVERY_ARM, answering, device, intervention, knowing, planned, session
from scripted import FakeRealClock, scripted_strategy
from session.test_following import Remembering

PLAN = planned()
PAIRS = [slot.number for slot in schedule.slots(PLAN) if slot.part is Part.PAIRS]


def kinds(given: list[Stimulus]) -> Counter[str]:
    named = {True: "tap alone", False: "pair"}
    return Counter("TMS alone" if one.isi_ms is None and not one.tap_alone else named[one.tap_alone] for one in given)


@pytest.mark.parametrize("arm", [Arm.WINDOW, *(pytest.param(a, marks=pytest.mark.slow) for a in EVERY_ARM[1:])])
def test_each_arm_gets_its_stimuli_and_all_the_same_pulses_before_and_after(log: Path, arm: Arm) -> None:
    rig = device()
    result = session(log, intervention(arm), rig).run()
    between = [rig.delivered[number] for number in PAIRS]
    assert kinds([one for one in rig.delivered if one not in between]) == {"TMS alone": 9}
    expected = {Arm.TMS_ALONE: "TMS alone", Arm.TAP_ALONE: "tap alone"}.get(arm, "pair")
    assert kinds(between) == {expected: 50}
    inside = [70 <= one.isi_ms <= 130 for one in between if one.isi_ms is not None]
    assert sum(inside) >= 45 if arm is Arm.WINDOW else not any(inside)  # probes look beyond its edges, too
    assert result.decision.stop


def test_pairs_are_at_the_best_isi_but_for_probes(log: Path) -> None:
    session(log, intervention(arms=(Arm.WINDOW,))).run()
    pairs = pairing_of(read_session(log)).pairs
    assert sum(pair.probe for pair in pairs) == 5
    usual = [pair.isi_ms for pair in pairs if not pair.probe]
    assert max(abs(isi_ms - 100.0) for isi_ms in usual) < 10.0
    assert any(abs(pair.isi_ms - 100.0) > 10.0 for pair in pairs if pair.probe)


@pytest.mark.slow
def test_pairs_may_spread_over_the_window(log: Path) -> None:
    session(log, intervention(arms=(Arm.WINDOW,), over_window=True, probes=0.0)).run()
    isis_ms = [pair.isi_ms for pair in pairing_of(read_session(log)).pairs]
    assert len(set(isis_ms)) > 20
    assert min(isis_ms) < 80
    assert max(isis_ms) > 120


@pytest.mark.slow
def test_the_isi_follows_a_window_that_moves_within_what_the_operator_allowed(log: Path) -> None:
    def moving(trial: int) -> float:
        return 100.0 + 0.6 * trial

    allowed = intervention(arms=(Arm.WINDOW,), range_ms=(60.0, 125.0), follow_ms=6.0)
    session(log, allowed, device(moving), strategy=knowing(earlier=40)).run()  # from them, how little MEPs vary
    pairs = pairing_of(read_session(log)).pairs
    blocks = [[p.isi_ms for p in pairs[first : first + 20] if not p.probe] for first in (0, 20, 40)]
    assert blocks[2][-1] >= blocks[0][0] + 4.0
    assert all(60.0 <= pair.isi_ms <= 125.0 for pair in pairs)
    for before, block in zip([[100.0], *blocks], blocks, strict=False):
        assert max(abs(isi_ms - before[-1]) for isi_ms in block) <= 6.5  # the grid's step


@pytest.mark.slow
def test_without_following_the_isi_stays(log: Path) -> None:
    fixed = intervention(arms=(Arm.WINDOW,), probes=0.0, follow_ms=0.0)
    session(log, fixed, device(lambda trial: 100.0 + trial)).run()
    assert len({pair.isi_ms for pair in pairing_of(read_session(log)).pairs}) == 1


def test_blocks_after_the_pairs_begin_when_they_are_due(log: Path) -> None:
    session(log).run()
    record = read_session(log)
    tests = pairing_of(record).tests
    firsts = {test.block: test.after_last_pair_s for test in reversed(tests)}
    assert firsts["before"] < 0
    assert 0.0 < firsts["after 0 min"] < 10.0
    assert firsts["after 2 min"] == pytest.approx(120.0, abs=0.01)
    late = {event.text: event.late_s for event in record.events if event.kind == "block" and event.late_s is not None}
    assert list(late.values()) == [pytest.approx(firsts["after 0 min"], abs=0.01), pytest.approx(0.0, abs=0.01)]


def test_a_due_block_is_announced_and_waits_for_the_operator_and_its_lateness_is_logged(log: Path) -> None:
    clock, asked = VirtualClock(), list[str]()

    def late(reason: str) -> bool:
        asked.append(reason)
        clock.sleep_s(100.0)
        return True

    rig = device()
    session(log, on=rig, clock=clock, safeguards=Safeguards(on_pause=late)).run()
    assert [reason.split(":")[0] for reason in asked] == [
        "The block after 0 min is due",
        "The block after 2 min is due in 3 s",  # as the operator was late before
    ]
    events = [event for event in read_session(log).events if event.kind == "block"]
    assert events[-1].late_s == pytest.approx(102.0, abs=1.0)  # 100 s from 3 s before, and an interval after arming
    assert "late" in events[-1].text
    assert pairing_of(read_session(log)).tests[-3].after_last_pair_s == pytest.approx(222.0, abs=1.0)
    assert rig.calls.count("stage") == 3  # nothing is armed while nothing comes


class Snapping(VirtualClock):
    """Keeps the log as a kill would leave it: at each delivery, and at one sleep in some."""

    def __init__(self, log: Path, kept: Path) -> None:
        super().__init__()
        self._log, self._kept, self.at = log, kept, list[Path]()

    def keep(self) -> None:
        kept = self._kept / f"{len(self.at)}" / self._log.name
        kept.parent.mkdir(parents=True)
        shutil.copy(f"{self._log}.part", f"{kept}.part")
        self.at.append(kept)


@pytest.fixture
def killed(log: Path, tmp_path: Path) -> tuple[list[Stimulus], list[Path]]:
    """The stimuli of an undisturbed intervention, and its log as it was while each of them was delivered."""
    rig = device()
    clock = Snapping(log, tmp_path / "kept")
    usual = rig.answer

    def answer(stimulus: Stimulus) -> object:
        clock.keep()
        return usual(stimulus)

    rig.answer = answer
    session(log, on=rig, clock=clock).run()
    return rig.delivered, clock.at


@pytest.mark.slow
@pytest.mark.parametrize("at", [0, 2, 3, 22, 23, 40, 52, 53, 55, 56, 58])
def test_killed_at_any_stimulus_and_resumed_none_is_lost_or_doubled(
    killed: tuple[list[Stimulus], list[Path]], at: int
) -> None:
    delivered, logs = killed
    rig = device()
    result = resume(logs[at], rig, knowing()).run()
    assert [one.trial for one in rig.delivered] == list(range(at + 1, len(schedule.slots(PLAN))))
    assert [trial.index for trial in result.trials] == list(range(len(schedule.slots(PLAN))))
    assert [one.tap_alone for one in rig.delivered] == [one.tap_alone for one in delivered[at + 1 :]]
    assert [one.isi_ms is None for one in rig.delivered] == [one.isi_ms is None for one in delivered[at + 1 :]]
    record = read_session(logs[at])
    assert record.conceals
    assert record.header.intervention == read_session(logs[0]).header.intervention
    due = [event for event in record.events if event.kind == "block" and event.late_s is not None]
    assert due[-1].late_s == pytest.approx(0.0, abs=1.0)
    times_s = [test.after_last_pair_s for test in pairing_of(record).tests if test.block == "after 2 min"]
    assert times_s[0] == pytest.approx(120.0, abs=1.0 if at < 56 else 15.0)


@pytest.mark.slow
def test_an_interrupted_intervention_goes_on_with_the_isis_that_it_would_have_had(log: Path, tmp_path: Path) -> None:
    undisturbed = device()
    open_plan = intervention(arms=(Arm.WINDOW,))
    session(log, open_plan, undisturbed).run()

    def stopping(update: Any) -> None:
        if update.trial.index == 30:
            raise KeyboardInterrupt

    interrupted = session(tmp_path / "i.mcap", open_plan, on_trial=stopping)
    with pytest.raises(KeyboardInterrupt):
        interrupted.run()
    rig = device()
    resume(tmp_path / "i.mcap", rig, knowing()).run()
    assert [one.isi_ms for one in rig.delivered] == [one.isi_ms for one in undisturbed.delivered[31:]]


class Computer(FakeRealClock):
    """A real rig's clock, on a computer whose own clock can be set while isiw does not run."""

    def __init__(self, patched: pytest.MonkeyPatch) -> None:
        super().__init__()
        self.set_by_s = 0.0
        patched.setattr(time, "time_ns", lambda: round((1.8e9 + self.time_s + self.set_by_s) * 1e9))
        patched.setattr(moments, "boot_s", lambda: self.time_s)
        for module in (moments, writer):
            patched.setattr(module, "boot_id", lambda: "this start")


@pytest.mark.slow
@pytest.mark.parametrize("set_by_s", [0.0, 7200.0, -7200.0])
def test_the_blocks_after_a_restart_are_due_when_they_were_whatever_the_clock_was_set_to(
    log: Path, monkeypatch: pytest.MonkeyPatch, set_by_s: float
) -> None:
    clock, answers = Computer(monkeypatch), iter([True, False])
    first = session(
        log, on=device(simulated=False), clock=clock, safeguards=Safeguards(on_pause=lambda _: next(answers))
    )
    first.run()  # nobody continues it when the block after 2 min is announced
    clock.time_s += 15.0
    clock.set_by_s = set_by_s
    again = resume(
        log, device(simulated=False), knowing(), clock=FarClock(clock), safeguards=Safeguards(on_pause=lambda _: True)
    )
    again.run()
    record = read_session(log)
    tests = pairing_of(record).tests
    assert tests[-3].after_last_pair_s == pytest.approx(120.0, abs=2.0)
    assert [event.late_s for event in record.events if event.kind == "block"][-1] == pytest.approx(0.0, abs=2.0)


class FarClock:
    """The same time, counted from elsewhere, as another process counts it."""

    def __init__(self, clock: FakeRealClock) -> None:
        self._clock = clock

    def now_s(self) -> float:
        return self._clock.now_s() - 90.0

    def sleep_s(self, duration_s: float) -> None:
        self._clock.sleep_s(duration_s)


def test_stop_ends_an_intervention_for_good(log: Path) -> None:
    running: list[Session] = []

    def stopping(update: Any) -> None:
        if update.trial.index == 1:
            running[0].end("Ended on the live page.")

    running.append(session(log, on_trial=stopping))
    running[0].run()
    assert [event.kind for event in read_session(log).events][-1] == "stop"
    with pytest.raises(LogError, match="was ended by its operator"):
        resume(log, device(), knowing())


@pytest.mark.slow
def test_who_has_left_has_not_ended_it(log: Path) -> None:
    session(log, safeguards=Safeguards(on_pause=lambda _: False)).run()
    assert "stop" not in [event.kind for event in read_session(log).events]
    assert resume(log, device(), knowing(), safeguards=Safeguards(on_pause=lambda _: True)).run().decision.stop


@pytest.mark.slow
@pytest.mark.parametrize("arm", EVERY_ARM)
def test_who_looks_on_gets_nothing_that_shows_the_arm(log: Path, arm: Arm) -> None:
    one, follower = session(log, intervention(arm)), Remembering()
    one.follow(follower)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("isiw.session.loop.goes_on", lambda _: True)
        patched.setattr(follower, "is_attended", lambda: False)
        one.run()
    seen = [record for record in follower.records if isinstance(record, Intent | Trial | EstimateRecord | Waveform)]
    numbers = {record.index if isinstance(record, Trial) else record.trial for record in seen}
    assert not numbers & set(PAIRS)
    assert not any(update.trial.index in PAIRS or update.next_isi_ms for update in follower.updates)
    assert not [r.next_isi_ms for r in seen if isinstance(r, EstimateRecord) and r.next_isi_ms is not None]
    assert {trial.index for trial in one.shown_trials}.isdisjoint(PAIRS)


@contextmanager
def up_to_date() -> Iterator[None]:
    """Within, a page that nobody has open shows all at once, and no block waits for somebody."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(View, "is_attended", lambda _: False)
        patched.setattr("isiw.session.blocks.Blocks.announcement", lambda *_: None)
        patched.setattr("isiw.server.live.view.UPDATE_S", 0.0)
        patched.setattr("isiw.server.live.view.SHARE", 1e9)
        yield


def _shown(log: Path, arm: Arm, capsys: pytest.CaptureFixture[str]) -> tuple[str, list[str]]:
    """What the console prints, and what the live page shows after each trial that it hears of."""
    page: list[str] = []
    one = session(log, intervention(arm))
    view = View(one)

    def looking(_: object) -> None:
        page.append(view.shown().json)

    one.follow(view)
    one._sink.on_trial = looking  # noqa: SLF001 - while it is followed
    with up_to_date():
        one.run(progress=True)
    page.append(view.shown().json)
    return capsys.readouterr().out, page


@pytest.mark.slow
def test_console_and_live_page_are_the_same_whatever_the_arm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = []
    for arm in EVERY_ARM:
        (folder := tmp_path / str(arm)).mkdir()
        console, page = _shown(folder / "s.mcap", arm, capsys)
        shown.append((console, [_without_times(text) for text in page]))
    assert "Block 3 of 3 of the intervention begins." in shown[0][0]
    assert len(shown[0][1]) == 10
    assert all(each == shown[0] for each in shown)


def test_the_live_page_counts_what_is_left_while_pairs_are_concealed(log: Path) -> None:
    rig, usual, pages = device(), answering(), dict[int, dict[str, Any]]()
    one = session(log, on=rig)
    view = View(one)

    def answer(stimulus: Stimulus) -> Measurement:
        if stimulus.trial in {2, 20, 52, 55}:
            pages[stimulus.trial] = json.loads(view.shown().json)
        return usual(stimulus)

    rig.answer = answer
    one.follow(view)
    with up_to_date():
        one.run()
    assert {trial: page["left"] for trial, page in pages.items()} == {trial: 59 - trial for trial in pages}
    assert {trial: page["hides"] for trial, page in pages.items()} == {2: False, 20: True, 52: True, 55: False}


def _without_times(text: str) -> str:
    text = re.sub(r'"waitS":[^,]*', "", text)
    return re.sub(r"\d{4}-\d\d-\d\d[T ][\d:+]+", "", text)


SHOWING: dict[str, Callable[[Path], object]] = {
    "picture": lambda log: session_figure(read_session(log)),
    "timeline": lambda log: timeline_figure(read_session(log)),
    "table": lambda log: trial_rows(read_session(log)),
    "export": read_logs,
    "counts": lambda log: counts_table(read_session(log), 0.05, 0.4),
    "comparison": lambda log: comparison_rows([read_session(log)]),
    "correlation": lambda log: correlation_sentence(read_session(log), read_session(log)),
}


def test_nothing_is_made_of_a_concealed_log_until_somebody_opens_it_which_is_logged(log: Path) -> None:
    session(log, intervention(Arm.TAP_ALONE)).run()
    for show in SHOWING.values():
        with pytest.raises(LogError, match="concealed"):
            show(log)
    before = read_session(log)
    assert "concealed" in final_statement(before)
    assert not any(words in f"{before}{final_statement(before)}" for words in ("tap", "Tap"))
    assert open_arm(log) is Arm.TAP_ALONE
    assert open_arm(log) is Arm.TAP_ALONE
    after = read_session(log)
    assert [event.text for event in after.events if event.kind == "opening"] == ["The arm was opened: taps alone."]
    assert "Arm: taps alone." in final_statement(after)
    assert len(SHOWING["table"](log)) == len(schedule.slots(PLAN))  # type: ignore[arg-type]
    assert len(SHOWING["comparison"](log)) == 1  # type: ignore[arg-type]


def test_the_printed_result_says_of_a_concealed_arm_that_it_is(log: Path) -> None:
    result = session(log, intervention(Arm.TAP_ALONE)).run()
    for shown in (str(result), repr(result)):
        assert "The arm is concealed. Open it when nobody has to be blind: isiw pair --open" in shown
        assert not re.search(r"tap|Trials", shown)


def test_the_trials_of_an_intervention_are_no_search_that_could_be_analysed(log: Path) -> None:
    session(log, intervention(arms=(Arm.WINDOW,))).run()
    with pytest.raises(LogError, match="teaches no window"):
        read_people(log)


def test_the_header_names_no_arm_that_was_drawn(log: Path) -> None:
    session(log, intervention(Arm.OUTSIDE)).run()
    header = read_session(log).header
    assert header.kind == "intervention"
    assert header.intervention is not None
    names = {"sealed": header.intervention.sealed, "config": str(header.config), "strategy": str(header.strategy)}
    assert not any(arm in text for text in names.values() for arm in EVERY_ARM if arm != "window")


@pytest.mark.slow
def test_a_single_arm_is_not_concealed(log: Path) -> None:
    session(log, intervention(arms=(Arm.WINDOW,))).run()
    assert not read_session(log).conceals
    assert trial_rows(read_session(log))


def test_a_loop_of_the_labs_own_cannot_continue_an_intervention(log: Path) -> None:
    session(log, safeguards=Safeguards(on_pause=lambda _: False)).run()
    with pytest.raises(LogError, match="which isiw delivers itself"):
        open_session(knowing(), log, resume=True)


def test_a_strategy_that_found_no_window_has_none_to_use(log: Path) -> None:
    with pytest.raises(StrategyError, match="cannot be used"):
        Session(device(), scripted_strategy(3), log=log, intervention=intervention())


def test_a_range_beside_the_window_is_refused_before_anything_is_delivered(log: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"the range of the plan holds no ISI of the window.*70–130 ms"):
        session(log, intervention(range_ms=(20.0, 60.0)))
    assert not log.exists()


def test_pairs_of_a_control_arm_are_no_probes(log: Path) -> None:
    session(log, intervention(Arm.OUTSIDE)).run()
    assert not any(pair.probe for pair in pairing_of(read_session(log)).pairs)


def test_other_things_than_interventions_are_refused(log: Path) -> None:
    with pytest.raises(InvalidValueError, match="intervention"):
        Session(device(), knowing(), log=log, intervention="window")  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_plan_waits_until_each_intensity_is_set_and_the_pulses_have_it_in_the_log(log: Path) -> None:
    asked: list[str] = []

    def hearing(reason: str) -> bool:
        asked.append(reason)
        return True

    several = intervention(intensities_pct_rmt=(100.0, 120.0), before=2, after=1)
    rig, guards = device(simulated=False), Safeguards(on_pause=hearing)
    session(log, several, rig, clock=FakeRealClock(), safeguards=guards).run()
    said = [reason.rsplit("Set the intensity of the stimulator to ", 1)[-1] for reason in asked]
    assert said == ["100 % RMT.", "120 % RMT.", "that of the pairs.", *["100 % RMT.", "120 % RMT."] * 2]
    record, named = read_session(log), [100.0, 100.0, 120.0, 120.0, 100.0, 120.0, 100.0, 120.0]
    assert [pulse.intensity_pct_rmt for pulse in pairing_of(record).tests] == named
    assert [trial.intensity_pct_rmt for trial in record.table if trial.commanded_isi_ms is None] == named


def test_a_device_that_reports_its_intensity_refuses_several_by_hand_before_a_stimulus(log: Path) -> None:
    rig = device(simulated=False)
    rig.readiness = lambda: Readiness(intensity_pct_mso=50.0)  # type: ignore[attr-defined]
    several = intervention(intensities_pct_rmt=(100.0, 120.0))
    guards = Safeguards(on_pause=lambda _: True)
    with pytest.raises(InvalidValueError, match="what the device reports"):
        session(log, several, rig, clock=FakeRealClock(), safeguards=guards).run()
    assert not rig.delivered


def test_who_continues_amid_pulses_of_one_intensity_hears_which() -> None:
    agenda = Agenda(intervention(intensities_pct_rmt=(100.0, 120.0), before=3), knowing(), 0)
    blocks = Blocks(agenda, VirtualClock(), lambda: True)
    assert blocks.announcement(4) == "Set the intensity of the stimulator to 120 % RMT."
    blocks.came(4)
    assert blocks.announcement(5) is None


def test_a_screen_that_is_gone_ends_no_intervention(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = sys.stdout.write

    def gone(text: str) -> int:
        if "Block 2" in text:
            raise BrokenPipeError(32, "Broken pipe")
        return shown(text)

    monkeypatch.setattr(sys.stdout, "write", gone)
    session(log, intervention(Arm.WINDOW)).run(progress=True)
    assert len(read_session(log).table) == len(schedule.slots(PLAN))
