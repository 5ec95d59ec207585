"""A session in which pairs have several intensities, each of which was named, set and noted."""

from dataclasses import replace
from pathlib import Path

import pytest

import isiw
from isiw.config.run import RunConfig
from isiw.config.session import session_for
from isiw.devices.clock import VirtualClock
from isiw.devices.limited import LimitedDevice
from isiw.devices.limits import Limits
from isiw.devices.protocol import Readiness
from isiw.errors import DeviceError, InvalidValueError, LimitExceededError, StrategyError
from isiw.models.particles.prior import Prior
from isiw.priors.days import recalled
from isiw.session.recorder import Recorder
from isiw.session.sink import SessionUpdate
from isiw.subjects.cohorts import person_of
from isiw.subjects.subject import Response
from isiw.trials import Stimulus, Trial
from isiw.visit import Visit, VisitProtocol

SPACE = isiw.DesignSpace(0, 300, reference="impact")
NAMED = (90.0, 100.0, 110.0)
QUICK = {"particles": 100, "max_trials": 6, "intensity_pct_rmt": 90.0}


def mixed(**settings: object) -> isiw.Strategy:
    """A strategy whose pairs have three intensities."""
    return isiw.make_strategy("default", SPACE, seed=3, intensities_pct_rmt=NAMED, **{**QUICK, **settings})


def device(*, sets_intensity: bool = True) -> isiw.SimulatedDevice:
    """A simulated person whose MEPs depend on the intensity."""
    responder = person_of("recruitment", 0, 1).begin(1)

    def respond(isi_ms: float | None, intensity_pct_rmt: float | None = None) -> Response:
        return responder.respond(isi_ms, "impact", intensity_pct_rmt=intensity_pct_rmt)

    return isiw.SimulatedDevice(isiw.SimulatedPerson(respond, "impact", sets_intensity=sets_intensity))


def session(log: Path, strategy: isiw.Strategy, most: float | None = 110.0, **options: object) -> isiw.Session:
    """A session of several intensities."""
    limits = replace(Limits.of_space(SPACE), max_intensity_pct_rmt=most)
    options = {"device": device(), "visit": Visit(intensity_pct_rmt=90.0), **options}
    rig = options.pop("device")
    return isiw.Session(rig, strategy, log=log, limits=limits, **options)  # type: ignore[arg-type]


def test_pairs_have_the_named_intensities_in_turn_and_the_log_says_which(tmp_path: Path) -> None:
    result = session(tmp_path / "mixed.mcap", mixed()).run()
    assert [trial.intensity_pct_rmt for trial in result.trials] == [None, 100.0, 110.0] * 2
    record = isiw.read_session(tmp_path / "mixed.mcap")
    assert [intent.intensity_pct_rmt for intent in record.intents] == [90.0, 100.0, 110.0] * 2
    rows = isiw.report.words.trial_rows(record)
    assert [("at 110 %" in outcome) for _, _, outcome, _ in rows] == [False, False, True] * 2


def test_the_acquisition_function_chooses_only_among_the_named_ones(tmp_path: Path) -> None:
    strategy = mixed(chooses_intensity=True)
    result = session(tmp_path / "chosen.mcap", strategy).run()
    assert {trial.intensity_pct_rmt for trial in result.trials} <= {None, 100.0, 110.0}


def test_another_day_learns_from_such_a_session_what_the_session_itself_did(tmp_path: Path) -> None:
    result = session(tmp_path / "mixed.mcap", mixed()).run()
    posterior = recalled(isiw.read_session(result.log), Prior(), particles=100)
    assert posterior.estimate().start_ms == pytest.approx(result.estimate.start_ms)
    assert posterior.estimate().probability == pytest.approx(result.estimate.probability)


def test_tms_alone_may_have_an_intensity_of_its_own(tmp_path: Path) -> None:
    protocol = VisitProtocol(tms_alone=0.3, alone_pct_rmt=100.0)
    strategy = isiw.make_strategy("default", SPACE, seed=3, **QUICK)
    result = session(tmp_path / "alone.mcap", strategy, protocol=protocol).run()
    record = isiw.read_session(tmp_path / "alone.mcap")
    set_for = {(intent.isi_ms is None, intent.intensity_pct_rmt) for intent in record.intents}
    assert set_for == {(True, 100.0), (False, 90.0)}  # it is set back for the pairs
    assert {trial.intensity_pct_rmt for trial in result.trials if trial.isi_ms is not None} == {None}


@pytest.mark.parametrize("chooses", [False, True])
def test_a_mixed_session_that_died_goes_on_as_if_it_had_not(tmp_path: Path, chooses: bool) -> None:  # noqa: FBT001
    whole = session(tmp_path / "whole.mcap", mixed(chooses_intensity=chooses)).run().trials

    class DeathError(Exception):
        """Ends the process, as far as a test can."""

    def die(update: SessionUpdate) -> None:
        if update.trial.index == 2:
            raise DeathError

    cut = tmp_path / "cut.mcap"
    with pytest.raises(DeathError):
        session(cut, mixed(chooses_intensity=chooses), on_trial=die).run()
    resumed = isiw.resume(cut, device()).run().trials
    assert [(t.commanded_isi_ms, t.intensity_pct_rmt, t.mep_mv) for t in resumed] == [
        (t.commanded_isi_ms, t.intensity_pct_rmt, t.mep_mv) for t in whole
    ]


def test_an_intensity_beyond_the_limits_ends_the_session_before_anything_is_given(tmp_path: Path) -> None:
    for most in (None, 105.0):
        with pytest.raises(InvalidValueError, match="beyond the limits"):
            session(tmp_path / "high.mcap", mixed(), most=most).run()
    assert not (tmp_path / "high.mcap").exists()


def test_a_session_of_several_intensities_goes_on_with_a_highest_one_alone(tmp_path: Path) -> None:
    log = tmp_path / "s.mcap"

    def end(update: SessionUpdate) -> None:
        if update.trial.index == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        session(log, mixed(), on_trial=end).run()
    before = isiw.read_session(log).header
    with pytest.raises(InvalidValueError, match="Write max_intensity_pct_rmt"):
        isiw.resume(log, device(), mixed(), limits=Limits.of_space(SPACE)).run()
    assert isiw.read_session(log).header == before


def test_a_session_stops_before_it_fires_where_the_device_reports_another_intensity(tmp_path: Path) -> None:
    class Stuck(isiw.SimulatedDevice):
        """Reports one intensity, whatever it was asked to set."""

        def readiness(self) -> Readiness:
            return Readiness(intensity_pct_mso=45.0)

    responder = person_of("recruitment", 0, 1).begin(1)
    stuck = Stuck(
        isiw.SimulatedPerson(lambda isi_ms, **_: responder.respond(isi_ms, "impact"), "impact", sets_intensity=True)
    )
    visit = Visit(intensity_pct_rmt=90.0, intensity_pct_mso=45.0)
    with pytest.raises(LimitExceededError, match=r"45 % MSO.*50\.0 % MSO, which is 100 % RMT"):
        session(tmp_path / "stuck.mcap", mixed(), device=stuck, visit=visit).run()
    record = isiw.read_session(tmp_path / "stuck.mcap")
    assert [trial.intensity_pct_rmt for trial in record.table] == [None, 100.0]
    assert "has set another intensity" in record.events[-1].text


def test_no_intensity_is_set_that_the_limits_do_not_allow() -> None:
    for most in (None, 105.0):
        limits = Limits(0, 300, min_iti_s=0.0, max_intensity_pct_rmt=most)
        limited = LimitedDevice(device(), limits, VirtualClock())
        limited.stage()
        limited.check(Stimulus(0, 50.0))
        with pytest.raises(LimitExceededError, match="the intensity is beyond the limits"):
            limited.deliver(Stimulus(0, 50.0, intensity_pct_rmt=110.0), 1.0)


def test_an_intensity_of_tms_alone_needs_tms_alone(tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="without TMS alone"):
        session(tmp_path / "none.mcap", mixed(), protocol=VisitProtocol(alone_pct_rmt=100.0)).run()


def test_a_device_that_sets_no_intensity_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="the device sets none"):
        session(tmp_path / "no.mcap", mixed(), device=device(sets_intensity=False))


def test_the_usual_intensity_has_to_be_stated_and_the_same(tmp_path: Path) -> None:
    for visit in (Visit(), Visit(intensity_pct_rmt=95.0)):
        with pytest.raises(InvalidValueError, match="intensit"):
            session(tmp_path / "usual.mcap", mixed(), visit=visit).run()


def test_an_only_and_a_highest_intensity_exclude_each_other() -> None:
    with pytest.raises(InvalidValueError, match="both the only intensity and the highest one"):
        Limits(0, 300, intensity_pct_mso=50.0, max_intensity_pct_rmt=110.0)


def test_a_loop_of_ones_own_is_asked_for_an_intensity_and_reports_it(tmp_path: Path) -> None:
    responder, log = person_of("recruitment", 0, 1).begin(1), tmp_path / "own.mcap"
    limits = replace(Limits.of_space(SPACE), max_intensity_pct_rmt=110.0)
    visit = Visit(intensity_pct_rmt=90.0)
    with isiw.open_session(mixed(), log=log, limits=limits, visit=visit, clock=VirtualClock()) as own:
        for _ in range(3):
            outcome = responder.respond(own.ask(), "impact", intensity_pct_rmt=own.intensity_pct_rmt)
            own.tell(outcome.isi_ms, outcome.mep_mv)
    assert [trial.intensity_pct_rmt for trial in isiw.read_session(log).table] == [None, 100.0, 110.0]


def judge(own: Recorder, verdict: str) -> None:
    """Say something of the session or of its first trial."""
    if verdict == "note":
        own.note_change("the coil moved")
        return
    own.exclude(0)
    if verdict == "include":
        own.include(0)


@pytest.mark.parametrize("verdict", ["note", "exclude", "include"])
def test_a_verdict_while_a_pair_is_open_leaves_it_the_intensity_that_was_asked(tmp_path: Path, verdict: str) -> None:
    limits = replace(Limits.of_space(SPACE), max_intensity_pct_rmt=110.0)
    visit, log = Visit(intensity_pct_rmt=90.0), tmp_path / "own.mcap"
    with isiw.open_session(mixed(), log=log, limits=limits, visit=visit, clock=VirtualClock()) as own:
        for trial in range(6):
            isi_ms, asked = own.ask(), own.intensity_pct_rmt
            if trial and (verdict != "exclude" or trial == 1):
                judge(own, verdict)
            assert own.intensity_pct_rmt == asked
            own.mistrial("rejected") if trial == 1 else own.tell(isi_ms, 0.1)
    record = isiw.read_session(log)
    logged = [trial.intensity_pct_rmt or 90.0 for trial in record.table]
    assert logged == [intent.intensity_pct_rmt for intent in record.intents]
    assert (logged[1], record.table[1].status) == (100.0, "mistrial")
    assert {trial.intensity_pct_rmt for trial in record.table.trials[2:]} != {None}


def test_a_loop_of_ones_own_refuses_an_intensity_in_another_unit_and_logs_one_beyond_the_limits(tmp_path: Path) -> None:
    limits = replace(Limits.of_space(SPACE), max_intensity_pct_rmt=110.0)
    visit, log = Visit(intensity_pct_rmt=90.0), tmp_path / "own.mcap"
    with isiw.open_session(mixed(), log=log, limits=limits, visit=visit, clock=VirtualClock()) as own:
        own.tell(own.ask(), 0.1, intensity_pct_rmt=110.0)
        for paired, wrong, right in ((False, 1.2, 120.0), (True, 0.9, 110.5)):
            isi_ms = own.ask() if paired else None
            with pytest.raises(InvalidValueError, match="in another unit"):
                own.tell(isi_ms, 0.1, intensity_pct_rmt=wrong)
            own.tell(isi_ms, 0.1, intensity_pct_rmt=right)
    record = isiw.read_session(log)
    assert [trial.intensity_pct_rmt for trial in record.table.told] == [110.0, 120.0, 110.5]
    assert [(event.kind, event.trial, event.text) for event in record.events if event.kind == "limit"] == [
        ("limit", 1, "A pulse was given at 120 % RMT, beyond the limit of 110 % RMT."),
        ("limit", 2, "A pulse was given at 110.5 % RMT, beyond the limit of 110 % RMT."),
    ]


@pytest.mark.parametrize(
    ("mep_mv", "pct_rmt", "says"),
    [(0.5, 1.2, "in another unit"), (400.0, 110.0, "Is it in µV"), (0.0009, 110.0, "Is it in V")],
)
def test_pulses_given_before_in_another_unit_are_refused(
    tmp_path: Path, mep_mv: float, pct_rmt: float, says: str
) -> None:
    pulse = Trial.of(None, mep_mv, intensity_pct_rmt=pct_rmt)
    with pytest.raises(InvalidValueError, match=says):
        isiw.open_session(mixed(), log=tmp_path / "own.mcap", earlier=[pulse], visit=Visit(intensity_pct_rmt=90.0))
    assert not (tmp_path / "own.mcap").exists()


@pytest.mark.parametrize("named", [110, "110", ["90", "110"]])
def test_named_intensities_are_a_list_of_numbers(named: object) -> None:
    with pytest.raises(InvalidValueError, match=r"intensities_pct_rmt must be a (list of numbers|finite number)"):
        isiw.make_strategy(space=SPACE, intensities_pct_rmt=named)


def test_only_a_model_with_a_law_of_intensities_takes_pairs_of_several() -> None:
    with pytest.raises(StrategyError, match="cannot learn from pairs of several intensities"):
        isiw.make_strategy("gp-straddle", SPACE, intensities_pct_rmt=NAMED)
    strategy = isiw.make_strategy("supra-threshold", SPACE, particles=50)
    with pytest.raises(StrategyError, match="no law of pairs at another intensity"):
        strategy.tell(50.0, 0.1, intensity_pct_rmt=110.0)


def test_a_pair_at_another_intensity_says_something_else_than_one_at_the_usual() -> None:
    found = []
    for pct_rmt in (None, 140.0):
        strategy = isiw.make_strategy("default", SPACE, seed=1, particles=300, intensity_pct_rmt=90.0)
        for isi_ms, mep_mv in ((50.0, 0.8), (90.0, 0.7), (130.0, 0.75), (170.0, 0.85)):
            strategy.learn(Trial.of(isi_ms, mep_mv, intensity_pct_rmt=pct_rmt))
        found.append(strategy.estimate().probability)
    usual, strong = found
    assert usual is not None
    assert strong is not None
    assert strong < usual  # strong pulses evoke such MEPs at any ISI


def test_a_configuration_names_intensities_and_the_highest(tmp_path: Path) -> None:
    config = {
        "seed": 3,
        "log": tmp_path / "run.mcap",
        "space": {"low_ms": 0.0, "high_ms": 300.0, "reference": "impact"},
        "visit": {"intensity_pct_rmt": 90.0},
        "limits": {"max_intensity_pct_rmt": 110.0},
        "strategy": {"settings": {"particles": 100, "max_trials": 3, "intensities_pct_rmt": [90.0, 110.0]}},
    }
    result = session_for(RunConfig.model_validate(config)).run()
    assert [trial.intensity_pct_rmt for trial in result.trials] == [None, 110.0, None]
    record = isiw.read_session(tmp_path / "run.mcap")
    assert record.header.limits.max_intensity_pct_rmt == 110.0
    assert record.header.strategy.settings["intensities_pct_rmt"] == [90.0, 110.0]


def test_a_device_that_sets_intensities_is_told_the_usual_one_where_all_pulses_have_it(tmp_path: Path) -> None:
    usual = isiw.make_strategy("default", SPACE, seed=3, **QUICK)
    session(tmp_path / "usual.mcap", usual).run()
    record = isiw.read_session(tmp_path / "usual.mcap")
    assert {intent.intensity_pct_rmt for intent in record.intents} == {90.0}
    assert {trial.intensity_pct_rmt for trial in record.table} == {None}
    session(tmp_path / "unlimited.mcap", usual.restarted(), most=None).run()
    assert {intent.intensity_pct_rmt for intent in isiw.read_session(tmp_path / "unlimited.mcap").intents} == {None}


@pytest.mark.parametrize("stimulus", [Stimulus(0, None, tap_alone=True), Stimulus(0, 80.0, intensity_pct_rmt=100.0)])
def test_no_device_gets_what_it_does_not_say_that_it_gives(stimulus: Stimulus) -> None:
    limits = replace(Limits.of_space(SPACE, min_iti_s=0.0), max_intensity_pct_rmt=110.0)
    rig = device(sets_intensity=False)
    rig.stage()
    guarded = LimitedDevice(rig, limits, VirtualClock())
    guarded._info = replace(rig.describe(), tap_alone=False)  # noqa: SLF001 - the simulated one gives both
    with pytest.raises(LimitExceededError, match="does not say that it gives"):
        guarded.check(stimulus)
