"""A device on the Lab Streaming Layer, over the loopback network, with another process at the other end."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import threading
import uuid
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import isiw
import lsl_network
from isiw.errors import ConfigError, DeviceError, DeviceTimeoutError, InvalidValueError, NotDelivered
from isiw.testing import check_device
from isiw.trials import Stimulus

pylsl = pytest.importorskip("pylsl", reason="the extra lsl is not installed")
assert lsl_network

TESTS = Path(__file__).parents[2]
SPACE = isiw.DesignSpace(10, 100, reference="impact")
RATE_HZ = 2000.0


@contextmanager
def rig(faults: Mapping[str, str] | None = None, *others_hz: float) -> Iterator[str]:
    """Another process with an amplifier and a stimulator, by the name of its streams."""
    name = f"rig-{uuid.uuid4().hex[:8]}"
    command = [sys.executable, "-m", "devices.transports.lsl_rig", name, json.dumps(faults or {})]
    command += map(str, (RATE_HZ, *others_hz))
    with subprocess.Popen(command, cwd=TESTS) as process:  # noqa: S603 - our own
        try:
            yield name
        finally:
            process.kill()


def device(name: str, **changed: Any) -> isiw.LslDevice:
    emg = {"stream": f"{name}-emg", "unit": "mV", "rate_hz": RATE_HZ}
    settings: dict[str, Any] = {
        "channels": {"emg": emg, "force": emg | {"unit": "N", "column": 1}},
        "info": {"name": "rig", "reference": "impact", "simulated": True},
        "markers": f"{name}-markers",
        "echo": f"{name}-echo",
        "stage_timeout_s": 10.0,
    }
    return isiw.LslDevice(**settings | changed)


@contextmanager
def staged(faults: Mapping[str, str]) -> Iterator[isiw.LslDevice]:
    with rig(faults) as name:
        made = device(name)
        made.stage()
        yield made


@pytest.mark.slow
def test_it_conforms_also_with_an_accelerometer_on_a_stream_of_its_own() -> None:
    with rig({}, 1000.0) as name:
        emg = {"stream": f"{name}-emg", "unit": "mV", "rate_hz": RATE_HZ}
        acceleration = {"stream": f"{name}-accelerometer", "unit": "m/s^2", "rate_hz": 1000.0, "column": 1}
        made = device(name, channels={"emg": emg, "acceleration": acceleration}, before_ms=150.0)
        rows = dict(check_device(lambda: made, SPACE, iti_s=0.15, clock=isiw.MonotonicClock()).rows)
    assert rows["realised minus wanted ISI"] == "+0.0, +0.0, +0.0 ms"
    assert rows["judged"] == "accepted, accepted, accepted, accepted"


@pytest.mark.slow
def test_a_sweep_is_where_its_timestamps_are_and_what_cannot_confirm_it_counts_as_armed() -> None:
    with staged({"1": "refuses"}) as made:
        sweep = made.deliver(Stimulus(0, 50.0), 5.0)
        with pytest.raises(NotDelivered, match=r"refused to deliver: no air$"):
            made.deliver(Stimulus(1, 50.0), 5.0)
        assert made.deliver(Stimulus(2, None), 5.0).t_hit_ms is None
    with pytest.raises(DeviceError, match=r"-echo is lost|no program listens"):
        made.stop()
    emg, force = sweep.channels["emg"], sweep.channels["force"]
    assert (sweep.t_tms_ms, sweep.t_hit_ms, emg.unit, emg.rate_hz) == (0.0, -50.0, "mV", RATE_HZ)
    assert emg.t0_ms == pytest.approx(-600.0, abs=0.6)
    assert emg.values.size == pytest.approx(1400, abs=1)
    assert emg.t0_ms + 1e3 * np.argmax(emg.values) / RATE_HZ == pytest.approx(25.0, abs=2.0)
    assert (np.diff(force.values) == 1).all()


FAULTS: dict[str, tuple[type[Exception], str]] = {
    "dropped": (DeviceError, r"^samples of rig-\w+-emg were dropped; got '\S+ ms after \S+ ms"),
    "late": (DeviceError, r"^the samples of rig-\w+-emg are late; got '\S+ s of the sweep"),
    "silent": (DeviceError, r"^the stream rig-\w+-emg has fallen silent; got 'no sample for 1 s"),
    "lost": (DeviceError, r"^the stream rig-\w+-emg is lost"),
    "rate": (
        DeviceError,
        r"^the samples of rig-\w+-emg do not come at their rate; got '19\d\d\S* Hz in the sweep'; expected 2000 Hz",
    ),
    "no echo": (DeviceTimeoutError, r"^no echo of the request to deliver; got 'silence on rig-\w+-echo'"),
    "another trial": (DeviceError, r"about another trial; got 1; expected trial 0"),
    "another ISI": (DeviceError, r"set to another ISI; got 505.0; expected 50 ms"),
    "an earlier run": (DeviceTimeoutError, r"no echo .* and 1 echoes of other requests"),
    "a later number": (DeviceTimeoutError, r"no echo .* and 1 echoes of other requests"),
    "an old pulse": (DeviceError, r"the pulse is not of this trial; got 't_fired -"),
    "not JSON": (DeviceError, r"^an echo on rig-\w+-echo: not JSON; got 'fired!'"),
    "a list": (DeviceError, r"^an echo on rig-\w+-echo: not a JSON object"),
    "too long": (DeviceError, r"^an echo on rig-\w+-echo: too long; got 70000"),
}


@pytest.fixture(scope="module")
def outcomes() -> dict[str, tuple[BaseException | None, BaseException | None]]:
    """What a delivery raises with each fault, and what the next one does; a rig each, side by side."""
    with ThreadPoolExecutor(len(FAULTS)) as pool:
        return dict(zip(FAULTS, pool.map(outcome, FAULTS), strict=True))


def outcome(fault: str) -> tuple[BaseException | None, BaseException | None]:
    with staged({"0": fault}) as made:
        raised = error_of(made, 0), error_of(made, 1)
        if fault != "lost":
            made.stop()
        return raised


def error_of(made: isiw.LslDevice, trial: int) -> BaseException | None:
    try:
        made.deliver(Stimulus(trial, 50.0), 4.0)
    except DeviceError as error:
        return error
    return None


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_told_as_what_it_is_and_disarms(
    fault: str, outcomes: Mapping[str, tuple[BaseException | None, BaseException | None]]
) -> None:
    kind, words = FAULTS[fault]
    error, afterwards = outcomes[fault]
    assert type(error) is kind
    assert re.search(words, str(error))
    assert type(afterwards) is NotDelivered


@pytest.mark.slow
def test_what_is_not_as_configured_is_not_staged() -> None:
    with rig({"arm": "cannot arm"}) as name:
        emg = {"stream": f"{name}-emg", "unit": "mV", "rate_hz": 5000.0, "column": 2}
        with pytest.raises(DeviceError, match=r"'2 channels at 2000 Hz'.* 3 at 5000 Hz"):
            device(name, channels={"emg": emg}).stage()
        made = device(name)
        with pytest.raises(DeviceError, match="the relay is stuck"):
            made.stage()
        made.stop()
        info = pylsl.StreamInfo(f"{name}-echo", "Markers", 1, 0, "string", "left over")
        twin = pylsl.StreamOutlet(info)
        with pytest.raises(DeviceError, match=r"is there 2 times.*earlier run"):
            made.stage()
        del twin


def test_without_its_streams_staging_fails_in_time_and_says_which_are_missing() -> None:
    made = device("nobody", stage_timeout_s=0.1)
    with pytest.raises(DeviceTimeoutError, match=r"got 'nobody-echo, nobody-emg'"):
        made.stage()
    made.stop()
    made.unstage()


@pytest.mark.slow
def test_stopping_from_another_thread_ends_a_delivery_that_waits() -> None:
    errors: list[BaseException | None] = []
    with rig({"0": "no echo"}) as name:
        made = device(name)
        made.stage()
        markers = pylsl.StreamInlet(pylsl.resolve_byprop("name", f"{name}-markers", 1, 5.0)[0])
        markers.open_stream(5.0)
        delivering = threading.Thread(target=lambda: errors.append(error_of(made, 0)))
        delivering.start()
        assert json.loads(markers.pull_sample(5.0)[0][0])["verb"] == "deliver"
        made.stop()
        delivering.join(5.0)
    assert "disarmed before it answered to deliver" in str(errors[0])


def test_without_pylsl_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(ConfigError, match=r'pip install "isiw\[lsl\]"'):
        device("rig")


def test_channels_must_make_sense() -> None:
    with pytest.raises(InvalidValueError, match="needs its EMG"):
        device("rig", channels={})
    emg = {"stream": "a", "unit": "mV", "rate_hz": 2000.0}
    with pytest.raises(InvalidValueError, match="a has two rates"):
        device("rig", channels={"emg": emg, "force": emg | {"rate_hz": 1000.0}})
    with pytest.raises(InvalidValueError, match="column"):
        device("rig", channels={"emg": emg | {"column": -1}})
