"""Each kind of lie ends as the kind of fault that it is."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from benchmarks.faulty_device import check_ledger
from benchmarks.pulse_peer import Lie, PulsePeer

import isiw
from devices.transports.line.parts import ENOUGH_S, HASTY, PAIR, TIMEOUT_S, made, staged
from isiw.errors import DeviceError, DeviceTimeoutError, NotDelivered
from isiw.findings import Kind
from isiw.session.rig import Safeguards
from isiw.signals.judgement import judge_measurement
from isiw.sweeps import Measurement
from isiw.trials import Status, Stimulus
from scripted import SPACE, scripted_strategy

FATAL = [Lie.SILENT_BEFORE, Lie.SILENT_AFTER, Lie.LATE, Lie.OTHER_NUMBER, Lie.CORRUPTS, Lie.ENDLESS, Lie.REFUSES]
DROPS = [Lie.DROPS_BEFORE, Lie.DROPS_AFTER]
BEFORE_FIRING = [("SET", Lie.SETS_ANOTHER), ("GET", Lie.NAN), ("GET", Lie.SILENT_BEFORE), ("GET", Lie.CORRUPTS)]
BEFORE_FIRING += [("SET", lie) for lie in (Lie.SILENT_AFTER, Lie.LATE, Lie.ENDLESS, Lie.REFUSES, Lie.DROPS_AFTER)]
BEFORE_FIRING += [("ARM", lie) for lie in FATAL + DROPS]
AFTER_FIRING = [("FIRE", lie) for lie in [*FATAL, *DROPS, Lie.NAN]]
AFTER_FIRING += [("RESULT", lie) for lie in (Lie.SILENT_AFTER, Lie.CORRUPTS, Lie.REFUSES, Lie.DROPS_AFTER, Lie.NAN)]


@pytest.mark.parametrize("verb", ["SET", "GET", "ARM", "FIRE", "RESULT"])
@pytest.mark.parametrize("lie", [Lie.SPLITS, Lie.REPEATS, Lie.GARBAGE])
def test_what_only_looks_odd_does_no_harm(address: str, peer: PulsePeer, verb: str, lie: Lie) -> None:
    device = staged(made(address))
    peer.lie(verb, lie)
    assert device.deliver(PAIR, 5.0) == Measurement(0.015, 50.0)
    assert peer.happened[lie] == 1
    device.unstage()


@pytest.mark.parametrize(("verb", "lie"), BEFORE_FIRING)
def test_what_fails_before_firing_gave_nothing_and_the_next_trial_goes_well(
    device: isiw.LineDevice, peer: PulsePeer, verb: str, lie: Lie
) -> None:
    peer.lie(verb, lie)
    with pytest.raises(NotDelivered):
        device.deliver(PAIR, TIMEOUT_S)
    assert peer.ledger == []
    assert isinstance(device.deliver(PAIR, ENOUGH_S), Measurement)
    assert len(peer.ledger) == 1


def test_after_a_missing_answer_the_next_trial_begins_over_a_fresh_connection_that_is_disarmed_first(
    device: isiw.LineDevice, peer: PulsePeer
) -> None:
    peer.lie("SET", Lie.LATE)
    with pytest.raises(NotDelivered):
        device.deliver(PAIR, TIMEOUT_S)
    so_far = len(peer.heard)
    device.deliver(PAIR, ENOUGH_S)
    assert [line.split()[1] for line in peer.heard[so_far:]] == ["DISARM", "SET", "GET", "ARM", "FIRE", "RESULT"]


@pytest.mark.parametrize(("verb", "lie"), AFTER_FIRING)
def test_what_fails_once_the_command_to_fire_is_sent_has_an_unknown_outcome_and_is_sent_once(
    device: isiw.LineDevice, peer: PulsePeer, verb: str, lie: Lie
) -> None:
    peer.lie(verb, lie)
    with pytest.raises(DeviceError) as raised:
        device.deliver(PAIR, TIMEOUT_S)
    assert not isinstance(raised.value, NotDelivered)
    silent = {Lie.SILENT_BEFORE, Lie.SILENT_AFTER, Lie.LATE, Lie.OTHER_NUMBER, Lie.CORRUPTS, Lie.ENDLESS}
    assert isinstance(raised.value, DeviceTimeoutError) == (lie in silent)
    assert sum("FIRE" in line for line in peer.heard) == 1


def test_the_next_trial_gets_its_own_answer_after_one_that_came_too_late(
    device: isiw.LineDevice, peer: PulsePeer
) -> None:
    peer.lie("RESULT", Lie.LATE)
    with pytest.raises(DeviceTimeoutError):
        device.deliver(Stimulus(0, 50.0), TIMEOUT_S)
    assert device.deliver(Stimulus(1, 150.0), ENOUGH_S) == Measurement(0.025, 150.0)


@pytest.mark.parametrize("lie", [Lie.GIVES_ANOTHER, Lie.REPORTS_ANOTHER])
def test_another_isi_than_the_one_read_back_is_a_mistrial(device: isiw.LineDevice, peer: PulsePeer, lie: Lie) -> None:
    peer.lie("FIRE", lie)
    answer = device.deliver(PAIR, ENOUGH_S)
    assert isinstance(answer, Measurement)
    assert answer.isi_ms == pytest.approx(90.0)
    assert judge_measurement(answer, PAIR, SPACE).reason is Kind.ISI_OFF


def test_a_session_tries_again_what_was_refused_before_firing(peer: PulsePeer, tmp_path: Path) -> None:
    peer.lie("SET", Lie.SETS_ANOTHER)
    limits = isiw.Limits.of_space(SPACE, min_iti_s=0.0)
    with peer.over_tcp() as at:
        guards = Safeguards(backoff_s=0.0)
        log = tmp_path / "log.mcap"
        isiw.Session(made(at), scripted_strategy(3), log=log, limits=limits, safeguards=guards).run()
    record = isiw.read_session(log)
    check_ledger(peer.ledger, record, limits)
    (refused,) = (event for event in record.events if event.kind == "refused")
    assert "another ISI than it was set to" in refused.text
    assert len(record.table.told) == 3


def test_a_session_that_hears_nothing_after_firing_ends_disarmed_with_an_unknown_outcome(
    peer: PulsePeer, tmp_path: Path
) -> None:
    limits = isiw.Limits.of_space(SPACE, min_iti_s=0.0)
    peer.lie("FIRE", Lie.SILENT_AFTER)
    with peer.over_tcp() as at, pytest.raises(DeviceTimeoutError):
        isiw.Session(
            made(at, line=HASTY), scripted_strategy(3), log=tmp_path / "log.mcap", limits=limits, timeout_s=0.5
        ).run()
    record = isiw.read_session(tmp_path / "log.mcap")
    (trial,) = record.table
    assert (trial.status, trial.reason) == (Status.MISTRIAL, Kind.OUTCOME_UNKNOWN)
    assert len(peer.ledger) == 1
    assert peer.heard[-1].endswith("DISARM")
    assert not peer.armed


def test_what_is_thrown_away_is_said(device: isiw.LineDevice, peer: PulsePeer, warned: io.StringIO) -> None:
    peer.lie("GET", Lie.REPEATS)
    device.deliver(PAIR, ENOUGH_S)
    assert "thrown away while" in warned.getvalue()
    assert "OK" in warned.getvalue()


@pytest.mark.parametrize("lie", [Lie.SILENT_BEFORE, Lie.NAN, Lie.DROPS_BEFORE])
def test_a_status_that_cannot_be_had_refuses_the_stimulus(device: isiw.LineDevice, peer: PulsePeer, lie: Lie) -> None:
    peer.lie("STATUS", lie)
    with pytest.raises(NotDelivered):
        device.readiness()
