"""A device behind files in a folder, with another process at the other end."""

from __future__ import annotations

import json
import random
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import isiw
from hostile import IN_THE_WAY, at_once
from isiw.config import load_config, session_for
from isiw.errors import ConfigError, DeviceError, DeviceTimeoutError, InvalidValueError, NotDelivered
from isiw.findings import Kind
from isiw.session.sink import SessionResult
from isiw.sweeps import Measurement, Sweep
from isiw.testing import check_device
from isiw.trials import Stimulus
from known import instance
from scripted import scripted_strategy
from waiting import until

TESTS = Path(__file__).parents[2]
SPACE = isiw.DesignSpace(10, 100, reference="impact")
INFO = {"name": "folder", "reference": "impact", "simulated": True}
WAVEFORMS: dict[str, Any] = {"info": INFO | {"channels": {"emg": "mV", "force": "N"}}, "rate_hz": 2000.0}


@contextmanager
def rig(place: Path, faults: Mapping[str, str] | None = None, *, waveforms: bool = False) -> Iterator[None]:
    """Another process that answers in a folder, honestly or not."""
    flags = ["--waveforms"] if waveforms else []
    command = [sys.executable, "-m", "devices.transports.folder_rig", str(place), json.dumps(faults or {}), *flags]
    with subprocess.Popen(command, cwd=TESTS) as process:  # noqa: S603 - our own
        try:
            until((place / "ready").exists)
            yield
        finally:
            process.kill()


def device(place: Path, **changed: Any) -> isiw.FolderDevice:
    settings: dict[str, Any] = {"info": INFO, "stage_timeout_s": 5.0, "stop_timeout_s": 3.0}
    return isiw.FolderDevice(place, **settings | changed)


@contextmanager
def staged(place: Path, lie: str = "", *, waveforms: bool = False, **changed: Any) -> Iterator[isiw.FolderDevice]:
    with rig(place, {"1": lie}, waveforms=waveforms):
        made = device(place, **(WAVEFORMS if waveforms else {}) | changed)
        made.stage()
        yield made


def failing_delivery(made: isiw.FolderDevice, timeout_s: float, errors: list[BaseException]) -> None:
    with pytest.raises(DeviceError) as raised:
        made.deliver(Stimulus(1, 50.0), timeout_s)
    errors.append(raised.value)


def request_in(place: Path) -> dict[str, str]:
    pairs = [line.partition("=") for line in (place / "request.txt").read_text("utf-8").splitlines()]
    return {key: value for key, _, value in pairs}


def test_it_conforms_where_the_other_software_measures(tmp_path: Path) -> None:
    with rig(tmp_path):
        rows = dict(check_device(lambda: device(tmp_path), SPACE).rows)
    assert rows["realised minus wanted ISI"] == "+0.1, +0.1, +0.1 ms"
    assert rows["judged"] == "accepted, accepted, accepted, accepted"


def test_it_conforms_where_the_other_software_records(tmp_path: Path) -> None:
    with rig(tmp_path, waveforms=True):
        rows = dict(check_device(lambda: device(tmp_path, **WAVEFORMS), SPACE).rows)
    assert rows["units"] == "emg in mV, force in N"


def test_a_session_runs_from_a_configuration_file_and_leaves_no_answers_behind(tmp_path: Path) -> None:
    place = tmp_path / "shared"
    place.mkdir()
    (tmp_path / "session.toml").write_text(
        f"""
        log = "{tmp_path / "log.mcap"}"
        [device]
        factory = "isiw:FolderDevice"
        [device.settings]
        folder = "{place}"
        info = {{ name = "folder", reference = "impact", simulated = true }}
        [space]
        low_ms = 10
        high_ms = 100
        reference = "impact"
        [strategy]
        name = "incremental"
        settings = {{ max_trials = 4 }}
        """
    )
    with rig(place):
        result = session_for(load_config(tmp_path / "session.toml")).run()
    assert len(result.trials) == 4
    assert [trial.index for trial in result.trials.told] == [0, 1, 2, 3]
    assert (place / "ledger").read_text().split() == ["0", "1", "2", "3"]
    assert request_in(place)["verb"] == "disarm"
    assert not list(place.glob("answer-*"))


LIES: dict[str, tuple[type[Exception], str]] = {
    "silence": (DeviceTimeoutError, "no answer to deliver"),
    "late": (DeviceTimeoutError, "no answer to deliver"),
    "refuses": (NotDelivered, "refused to deliver: no air$"),
    "fails": (DeviceError, "failed to deliver: trigger lost"),
    "says another thing": (DeviceError, "expected delivered"),
    "says nothing": (DeviceError, "expected delivered"),
    "another trial": (DeviceError, "about another trial.*expected trial 1"),
    "another ISI": (DeviceError, "set to another ISI.*505"),
    "no ISI": (DeviceError, "set_isi_ms is missing"),
    "no number": (DeviceError, "set_isi_ms is not a number.*fifty"),
    "NaN": (DeviceError, "set_isi_ms is not a number.*nan"),
    "an unknown key": (DeviceError, "unknown key.*t_hits_ms.*t_hit_ms"),
    "an earlier run": (DeviceError, "to another request.*0badf00d"),
    "a later number": (DeviceError, "to another request"),
    "a decimal comma": (DeviceError, "mep_mv is not a number.*0,4.*decimal point"),
    "a NaN MEP": (DeviceError, "mep_mv is not a number"),
    "an enormous MEP": (DeviceError, "more than any amplifier gives"),
    "no MEP": (DeviceError, "mep_mv is missing"),
    "a key twice": (DeviceError, "there twice.*said=delivered"),
    "a line without a sign": (DeviceError, "not key=value.*all is well"),
    "half-written": (DeviceError, "half-written"),
    "too large": (DeviceError, "too large"),
}


@pytest.mark.parametrize("lie", LIES)
def test_a_lie_about_a_delivery_is_a_fault_of_its_own_and_disarms(tmp_path: Path, lie: str) -> None:
    error, words = LIES[lie]
    with staged(tmp_path, lie) as made:
        made.deliver(Stimulus(0, 50.0), 5.0)
        with pytest.raises(error, match=words) as raised:
            made.deliver(Stimulus(1, 50.0), 0.5 if lie in {"silence", "late", "half-written"} else 5.0)
        assert type(raised.value) is error
        if error is not NotDelivered:
            assert request_in(tmp_path)["verb"] == "disarm"
            with pytest.raises(NotDelivered, match="not staged"):
                made.deliver(Stimulus(2, 50.0), 0.5)
        made.stop()


def test_a_file_is_named_where_its_answer_cannot_be_used(tmp_path: Path) -> None:
    with staged(tmp_path, "half-written") as made, pytest.raises(DeviceError, match=r"^answer-[0-9a-f]{8}-3\.txt "):
        made.deliver(Stimulus(1, 50.0), 0.3)


def test_another_realised_isi_is_left_to_the_judgement_of_the_session(tmp_path: Path) -> None:
    with staged(tmp_path, "another realised ISI") as made:
        assert instance(Measurement, made.deliver(Stimulus(1, 50.0), 5.0)).isi_ms == 1050.0


@pytest.mark.slow
def test_whatever_fails_a_session_goes_on_and_its_log_has_each_pair_that_was_fired_once(tmp_path: Path) -> None:
    rng, trials = random.Random(20), 30  # noqa: S311 - which trials fail
    lies = [lie for lie in LIES if lie not in {"refuses", "late"}]
    faults = {str(trial): rng.choice(lies) for trial in rng.sample(range(trials), 12)}
    strategy, log = scripted_strategy(trials, space=SPACE), tmp_path / "log.mcap"
    with rig(tmp_path, faults):
        session = isiw.Session(device(tmp_path), strategy, log=log, timeout_s=0.6)
        ended = 0
        while (result := finished(session)) is None:
            ended += 1
            session = isiw.resume(log, device(tmp_path), scripted_strategy(trials, space=SPACE))
    assert ended == len(faults)
    assert (tmp_path / "ledger").read_text().split() == [str(trial.index) for trial in result.trials]
    unknown = {str(trial.index) for trial in result.trials if trial.reason is Kind.OUTCOME_UNKNOWN}
    assert unknown == set(faults)


def finished(session: isiw.Session) -> SessionResult | None:
    """The result of a session; None where it ended because the device failed."""
    try:
        return session.run()
    except DeviceError:
        return None


WRONG_WAVEFORMS = {
    "no waveforms": "the waveforms are missing",
    "too few samples": "not whole; got 1399; expected 1400 samples",
    "too few columns": "another number of channels; got 1; expected 2",
    "decimal commas": "not numbers: .*decimal points",
    "text as samples": "not numbers: .*overload",
    "another rate": "another sampling rate; got 4000.0; expected 2000 Hz",
}


@pytest.mark.parametrize("lie", WRONG_WAVEFORMS)
def test_waveforms_that_are_not_what_they_should_be_are_told(tmp_path: Path, lie: str) -> None:
    with staged(tmp_path, lie, waveforms=True) as made:
        made.deliver(Stimulus(0, 50.0), 5.0)
        with pytest.raises(DeviceError, match=WRONG_WAVEFORMS[lie]):
            made.deliver(Stimulus(1, 50.0), 5.0)


def test_a_sweep_has_its_channels_and_times(tmp_path: Path) -> None:
    with staged(tmp_path, waveforms=True) as made:
        sweep = instance(Sweep, made.deliver(Stimulus(0, 50.0), 5.0))
    assert {name: (channel.unit, channel.values.size) for name, channel in sweep.channels.items()} == {
        "emg": ("mV", 1400),
        "force": ("N", 1400),
    }
    assert (sweep.t_tms_ms, sweep.t_hit_ms, sweep.t_valve_ms) == (600.0, 550.0, None)
    assert not list(tmp_path.glob("waveforms-*"))


def test_without_anybody_there_staging_fails_in_time_and_stopping_is_harmless(tmp_path: Path) -> None:
    made = device(tmp_path, stage_timeout_s=0.2, stop_timeout_s=0.2)
    with pytest.raises(DeviceTimeoutError, match=r"no answer to disarm"):
        made.stage()
    made.stop()
    made.unstage()


def test_without_the_folder_staging_fails(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="Is the folder there"):
        device(tmp_path / "nowhere").stage()


def test_what_does_not_arm_is_not_staged(tmp_path: Path) -> None:
    with rig(tmp_path, {"arm": "cannot arm"}):
        made = device(tmp_path)
        with pytest.raises(DeviceError, match="the relay is stuck"):
            made.stage()
        with pytest.raises(NotDelivered, match="not staged"):
            made.deliver(Stimulus(0, 50.0), 1.0)
        made.stop()


def test_what_is_deaf_to_arming_is_disarmed(tmp_path: Path) -> None:
    with rig(tmp_path, {"arm": "silence"}):
        made = device(tmp_path, stage_timeout_s=0.3)
        with pytest.raises(DeviceTimeoutError, match="no answer to arm"):
            made.stage()
        assert request_in(tmp_path)["verb"] == "disarm"
        made.stop()


def test_stopping_fails_where_what_may_be_armed_does_not_answer(tmp_path: Path) -> None:
    with staged(tmp_path):
        made = device(tmp_path, stop_timeout_s=0.2)
        made.stage()
    for verb in (made.stop, made.unstage):
        with pytest.raises(DeviceTimeoutError, match="no answer to disarm"):
            verb()


def test_a_delivery_that_nobody_has_read_is_gone_when_it_is_stopped(tmp_path: Path) -> None:
    with rig(tmp_path):
        made = device(tmp_path, stop_timeout_s=0.2)
        made.stage()
    errors: list[BaseException] = []
    delivering = threading.Thread(target=failing_delivery, args=(made, 0.6, errors))
    delivering.start()
    until(lambda: request_in(tmp_path)["verb"] == "deliver")
    with pytest.raises(DeviceTimeoutError):
        made.stop()
    assert request_in(tmp_path)["verb"] == "disarm"
    delivering.join()
    assert errors
    assert request_in(tmp_path)["verb"] == "disarm"
    assert not (tmp_path / "ledger").exists()


def test_stopping_ends_a_delivery_that_waits(tmp_path: Path) -> None:
    errors: list[BaseException] = []
    with staged(tmp_path, "silence") as made:
        delivering = threading.Thread(target=failing_delivery, args=(made, 20.0, errors))
        delivering.start()
        until(lambda: request_in(tmp_path)["verb"] == "deliver")
        made.stop()
        delivering.join(5.0)
    assert "disarmed before it answered to deliver" in str(errors[0])


def test_what_an_earlier_run_left_behind_is_never_taken(tmp_path: Path) -> None:
    with staged(tmp_path) as made:
        made.deliver(Stimulus(0, 50.0), 5.0)
        left = tmp_path / "answer-0badf00d-3.txt"
        left.write_text("token=0badf00d\nnumber=3\nsaid=delivered\ntrial=1\nset_isi_ms=50\nmep_mv=9\nisi_ms=50\nend\n")
        assert instance(Measurement, made.deliver(Stimulus(1, 60.0), 5.0)) == Measurement(0.45, 60.1)
        assert left.exists()


def test_a_tap_alone_is_refused_whatever_the_table_says(tmp_path: Path) -> None:
    assert not device(tmp_path, info={"name": "MATLAB", "reference": "impact", "tap_alone": True}).describe().tap_alone
    with staged(tmp_path) as made, pytest.raises(NotDelivered, match="tap alone"):
        made.deliver(Stimulus(0, None, tap_alone=True), 1.0)


def test_a_request_is_written_whole_and_with_what_a_script_needs(tmp_path: Path) -> None:
    made = device(tmp_path, stage_timeout_s=0.05)
    with pytest.raises(DeviceTimeoutError):
        made.stage()
    text = (tmp_path / "request.txt").read_text("ascii")
    token = request_in(tmp_path)["token"]
    assert text == f"token={token}\nnumber=1\nverb=disarm\ntimeout_s=0.05\nanswer=answer-{token}-1.txt\nend\n"


@pytest.mark.parametrize(
    "changed",
    [
        {"poll_s": 0.0},
        {"stop_timeout_s": -1.0},
        {"stage_timeout_s": float("nan")},
        {"rate_hz": 2000.0},
        {"info": WAVEFORMS["info"]},
        {"info": {"name": "MATLAB", "refrence": "impact"}},
    ],
)
def test_settings_that_make_no_sense_are_refused(tmp_path: Path, changed: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError):
        device(tmp_path, **changed)


def test_a_misspelt_setting_is_told(tmp_path: Path) -> None:
    config = tmp_path / "session.toml"
    device = f'[device]\nfactory = "isiw:FolderDevice"\n[device.settings]\nfolder = "{tmp_path}"\ninf = {{}}\n'
    config.write_text(f'{device}[space]\nreference = "impact"\n')
    with pytest.raises(ConfigError, match=r"function.*inf"):
        session_for(load_config(config))


def test_no_request_is_written_through_a_link_whatever_its_name(tmp_path: Path) -> None:
    victim, place = tmp_path / "victim.toml", tmp_path / "shared"
    place.mkdir()
    victim.write_text("precious")
    for name in ("request.txt.new", "request.txt"):
        (place / name).symlink_to(victim)
    with pytest.raises(DeviceError):
        device(place, stage_timeout_s=0.1, stop_timeout_s=0.1).stage()
    assert victim.read_text() == "precious"
    assert not (place / "request.txt").is_symlink()
    assert sorted(path.name for path in place.iterdir()) == ["request.txt", "request.txt.new"]


@pytest.mark.parametrize("kind", IN_THE_WAY)
def test_what_is_no_file_in_the_place_of_an_answer_is_not_waited_for(tmp_path: Path, kind: str) -> None:
    made = device(tmp_path, stage_timeout_s=0.5, stop_timeout_s=0.1)

    def answer() -> None:
        until((tmp_path / "request.txt").exists)
        IN_THE_WAY[kind](tmp_path / request_in(tmp_path)["answer"])

    hostile = threading.Thread(target=answer)
    hostile.start()
    with pytest.raises(DeviceError):
        at_once(made.stage)
    hostile.join()


def test_an_answer_that_is_a_link_is_not_followed(tmp_path: Path) -> None:
    made = device(tmp_path, stage_timeout_s=2.0, stop_timeout_s=0.1)
    (tmp_path / "secret").write_text("password=1234\nend\n")

    def answer() -> None:
        until((tmp_path / "request.txt").exists)
        (tmp_path / request_in(tmp_path)["answer"]).symlink_to(tmp_path / "secret")

    hostile = threading.Thread(target=answer)
    hostile.start()
    with pytest.raises(DeviceError, match="cannot be read") as raised:
        made.stage()
    hostile.join()
    assert "password" not in str(raised.value)


def test_a_folder_of_two_names_is_one_device(tmp_path: Path) -> None:
    (tmp_path / "rig").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "rig")
    assert device(tmp_path / "link").describe().address == device(tmp_path / "rig").describe().address
