"""The conformance suite of devices."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from isiw.design import DesignSpace
from isiw.devices.protocol import Answer, Device, DeviceInfo, HasMemory
from isiw.errors import DeviceError
from isiw.testing.promises import require
from isiw.trials import Measurement, Stimulus, Sweep

__all__ = ["check_device"]


def check_device(make: Callable[[], Device], space: DesignSpace, *, timeout_s: float = 30.0) -> None:
    """Check that a device keeps the promises of `isiw.Device`. It delivers up to eleven pairs of stimuli.

    Args:
        make: makes the device, in the same state each time; called twice where the device has a memory.
        space: ISIs that it can deliver, on its reference.
        timeout_s: how long one delivery may take [s].

    Raises:
        AssertionError: a promise is broken; the message says which.
    """
    device = make()
    require(isinstance(device, Device), "it has describe, stage, deliver, stop and unstage")
    _check_description(device, space)
    _check_refusal(device, "before stage()", timeout_s)
    device.stage()
    stimuli = [Stimulus(trial, isi_ms) for trial, isi_ms in enumerate((space.low_ms, None, space.high_ms))]
    answers = [device.deliver(stimulus, timeout_s) for stimulus in stimuli]
    for stimulus, answer in zip(stimuli, answers, strict=True):
        _check_answer(device.describe(), stimulus, answer, space)
    for verb in (device.stop, device.stop, device.unstage, device.unstage):
        verb()
        _check_refusal(device, "after stop() or unstage()", timeout_s)
    device.stage()
    device.stop()
    _check_refusal(device, "after being staged again and stopped", timeout_s)
    if isinstance(device, HasMemory):
        _check_memory(make, space, timeout_s)


def _check_description(device: Device, space: DesignSpace) -> None:
    info = device.describe()
    require(isinstance(info, DeviceInfo), "describe() returns a DeviceInfo before it is staged")
    require(info == device.describe(), "describe() says the same each time")
    require(info.reference == space.reference, f"its reference is the space's, {space.reference}")


def _check_refusal(device: Device, when: str, timeout_s: float) -> None:
    try:
        device.deliver(Stimulus(0, None), timeout_s)
    except DeviceError:
        return
    raise AssertionError(f"broken promise: deliver raises a DeviceError {when}")


def _check_answer(info: DeviceInfo, stimulus: Stimulus, answer: Answer, space: DesignSpace) -> None:
    require(isinstance(answer, Sweep | Measurement), "deliver returns a Sweep or a Measurement")
    if isinstance(answer, Sweep):
        units = {name: channel.unit for name, channel in answer.channels.items()}
        require(units == dict(info.channels), f"a sweep has the channels and units of describe(), here {units}")
        require("emg" in units and answer.t_tms_ms is not None, "a sweep has its EMG and the time of the pulse")
        return
    require(not info.channels, "a device that measures the MEP itself describes no channels")
    if stimulus.isi_ms is None or answer.isi_ms is None:
        require(stimulus.isi_ms is answer.isi_ms, "the realised ISI is None for TMS alone, and only then")
    else:
        off_ms = abs(answer.isi_ms - stimulus.isi_ms)
        require(off_ms <= space.tolerance_ms, f"the realised ISI is near the commanded one, here {off_ms:g} ms off")


def _check_memory(make: Callable[[], Device], space: DesignSpace, timeout_s: float) -> None:
    grid = space.grid_ms
    stimuli = [Stimulus(trial, float(grid[trial * (len(grid) - 1) // 3])) for trial in range(4)]
    uninterrupted = _answers(make(), stimuli, timeout_s)
    resumed = make()
    if isinstance(resumed, HasMemory):
        resumed.resume_after(stimuli[:3])
    (last,) = _answers(resumed, stimuli[3:], timeout_s)
    require(_same(last, uninterrupted[3]), "after resume_after it answers as if it had never been interrupted")


def _answers(device: Device, stimuli: Sequence[Stimulus], timeout_s: float) -> list[Answer]:
    device.stage()
    answers = [device.deliver(stimulus, timeout_s) for stimulus in stimuli]
    device.stop()
    return answers


def _same(one: Answer, other: Answer) -> bool:
    if isinstance(one, Sweep) and isinstance(other, Sweep):
        same_times = (one.t_valve_ms, one.t_tms_ms, one.t_hit_ms) == (other.t_valve_ms, other.t_tms_ms, other.t_hit_ms)
        pairs = [(channel.values, other.channels[name].values) for name, channel in one.channels.items()]
        return same_times and all(a.shape == b.shape and bool((a == b).all()) for a, b in pairs)
    return one == other
