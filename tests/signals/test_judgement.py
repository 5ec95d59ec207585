from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from isiw.design import DesignSpace
from isiw.errors import DeviceError, InvalidValueError
from isiw.findings import Kind
from isiw.signals import SignalLimits, is_saturated, judge, judge_measurement
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Status, Stimulus
from isiw.types import ArrayLike, FloatArray
from signals.made import sweep_of

IMPACT = DesignSpace(0, 320, reference="impact")
VALVE = DesignSpace(0, 500, reference="valve")
PAIR = Stimulus(0, 100.0)


def with_channel(sweep: Sweep, name: str, values: ArrayLike | None = None, **changes: Any) -> Sweep:
    channel = sweep.channels[name]
    values = channel.values if values is None else values
    changed = replace(channel, values=np.asarray(values, dtype=float), **changes)
    return replace(sweep, channels={**sweep.channels, name: changed})


def without(sweep: Sweep, name: str) -> Sweep:
    return replace(sweep, channels={key: value for key, value in sweep.channels.items() if key != name})


def test_a_good_sweep_is_accepted_with_all_its_numbers() -> None:
    judged = judge(sweep_of(), PAIR, IMPACT)
    assert (judged.status, judged.reason) == (Status.ACCEPTED, None)
    assert judged.isi_ms == pytest.approx(100.0, abs=0.2)
    assert judged.t_hit_ms == pytest.approx(680.0, abs=0.2)
    assert judged.mep_mv == pytest.approx(0.1, abs=0.01)
    assert judged.background_rms_uv == pytest.approx(2.0, rel=0.15)
    assert (judged.isi_sd_ms, judged.t_valve_ms, judged.t_tms_ms) == (0.0, 500.0, 780.0)


def test_from_the_valve_command_the_isi_is_counted_from_there() -> None:
    judged = judge(sweep_of(), Stimulus(0, 280.0), VALVE)
    assert judged.isi_ms == 280.0
    assert judged.reason is None


def test_tms_alone_has_no_isi_and_needs_no_impact() -> None:
    judged = judge(without(sweep_of(t_valve_ms=None), "acceleration"), Stimulus(0, None), IMPACT)
    assert judged.reason is None
    assert judged.isi_ms is None
    assert judged.mep_mv == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize("times", [{}, {"t_hit_ms": 5000.0}, {"t_valve_ms": 5000.0}])
def test_a_tap_alone_whose_sweep_does_not_show_when_it_came_is_lost_and_ends_no_session(times: dict[str, Any]) -> None:
    sweep = without(sweep_of(t_valve_ms=None, t_tms_ms=None), "acceleration")
    judged = judge(replace(sweep, **times), Stimulus(0, None, tap_alone=True), IMPACT)
    assert judged.reason is Kind.MISSING_CHANNEL


@pytest.mark.parametrize("unit", [("uV", 1000.0), ("µV", 1000.0), ("V", 0.001)])
def test_the_unit_of_the_emg_is_converted(unit: tuple[str, float]) -> None:
    name, factor = unit
    sweep = with_channel(sweep_of(), "emg", factor * sweep_of().channels["emg"].values, unit=name)
    assert judge(sweep, PAIR, IMPACT).mep_mv == pytest.approx(judge(sweep_of(), PAIR, IMPACT).mep_mv)


def mistrial_of(
    sweep: Sweep, stimulus: Stimulus = PAIR, space: DesignSpace = IMPACT, limits: SignalLimits | None = None
) -> Kind | None:
    judged = judge(sweep, stimulus, space, limits)
    assert judged.status is Status.MISTRIAL
    measured = judged.reason is Kind.BACKGROUND_ACTIVITY  # which an operator may still accept
    assert (judged.mep_mv is not None) is measured
    return judged.reason


def test_no_impact() -> None:
    noise = np.random.default_rng(0).standard_normal(5000)
    assert mistrial_of(with_channel(sweep_of(), "acceleration", noise)) is Kind.NO_IMPACT


def test_no_pulse() -> None:
    assert mistrial_of(sweep_of(t_tms_ms=None)) is Kind.NO_PULSE


def test_tms_before_the_impact_is_a_mistrial_from_the_impact_and_a_trial_from_the_valve() -> None:
    early = sweep_of(t_tms_ms=670.0)
    assert mistrial_of(early, Stimulus(0, 0.0)) is Kind.TMS_BEFORE_IMPACT
    assert judge(early, Stimulus(0, 170.0), VALVE).reason is None


def test_background_activity() -> None:
    emg = sweep_of().channels["emg"].values + 0.02 * np.random.default_rng(2).standard_normal(5000)
    assert mistrial_of(with_channel(sweep_of(), "emg", emg)) is Kind.BACKGROUND_ACTIVITY


def test_saturation() -> None:
    emg = np.clip(sweep_of().channels["emg"].values, -0.03, 0.03)
    assert mistrial_of(with_channel(sweep_of(), "emg", emg)) is Kind.SATURATION
    assert mistrial_of(sweep_of(), limits=SignalLimits(full_scale_mv=0.04)) is Kind.SATURATION


def with_mep(peak_mv: float, seed: int, *, turn_ms: float = 2.0, rate_hz: float = 5000.0) -> FloatArray:
    """EMG of 700 ms at rest, with an MEP whose two turns have this height and width, 600 ms after its begin [mV]."""
    since_ms = np.arange(-600, 100, 1000 / rate_hz)
    turns = (np.exp(-0.5 * ((since_ms - at_ms) / turn_ms) ** 2) for at_ms in (25.0, 30.0))
    noise_mv = 0.0015 * np.random.default_rng(seed).standard_normal(since_ms.size)
    return np.asarray(noise_mv + peak_mv * (next(turns) - next(turns)))


MEP_SPAN_MS = (615.0, 635.0)


@pytest.mark.parametrize("rate_hz", [2000.0, 5000.0, 10000.0])
@pytest.mark.parametrize("peak_mv", [0.4, 0.6, 1.0])
def test_an_amplifier_that_saturates_before_a_noisy_converter_is_noticed(peak_mv: float, rate_hz: float) -> None:
    for seed in range(10):
        emg_mv = np.clip(with_mep(peak_mv, seed, rate_hz=rate_hz), -0.25, 0.25)
        emg_mv += 2e-4 * np.random.default_rng(seed).standard_normal(emg_mv.size)
        assert is_saturated(emg_mv, rate_hz, span_ms=MEP_SPAN_MS)


@pytest.mark.parametrize("turn_ms", [1.2, 2.0, 4.0])
def test_the_rounded_top_of_an_mep_is_no_limit(turn_ms: float) -> None:
    for seed, peak_mv in enumerate(np.geomspace(0.02, 10.0, 60)):
        assert not is_saturated(with_mep(float(peak_mv), seed, turn_ms=turn_ms), 5000.0, span_ms=MEP_SPAN_MS)


@pytest.mark.parametrize("rate_hz", [1000.0, 1500.0, 2000.0])
@pytest.mark.parametrize("turn_ms", [8.0, 10.0, 14.0])
def test_a_rounded_mep_of_few_samples_is_not_clipped(rate_hz: float, turn_ms: float) -> None:
    time_ms = np.arange(0.0, 300.0, 1000 / rate_hz)
    noise_mv = 0.002 * np.sin(np.arange(time_ms.size) ** 2)
    for start_ms in np.linspace(120.0, 121.0, 11):
        turn = np.sin((time_ms - start_ms) / turn_ms * 2 * np.pi)
        emg_mv = noise_mv + 0.3 * turn * ((time_ms >= start_ms) & (time_ms < start_ms + turn_ms))
        assert not is_saturated(emg_mv, rate_hz)


def test_an_mep_that_is_on_its_flank_at_the_windows_edge_is_not_clipped() -> None:
    for late_ms in np.arange(4.0, 16.0, 0.5):
        emg_mv = with_mep(0.4, 0)
        assert not is_saturated(emg_mv, 5000.0, span_ms=(615.0 - late_ms, 635.0 - late_ms))


def test_an_artefact_that_saturates_outside_the_mep_window_is_no_saturation() -> None:
    emg = sweep_of().channels["emg"].values.copy()
    emg[3899:3909] = 5.0  # the pulse
    emg[3500:3510] = -5.0  # the tap
    assert is_saturated(emg, 5000.0)
    assert judge(with_channel(sweep_of(), "emg", emg), PAIR, IMPACT, SignalLimits(full_scale_mv=5.0)).reason is None


def test_a_coarse_converter_at_rest_is_not_saturated() -> None:
    steps = np.round(np.random.default_rng(0).standard_normal(5000) * 0.7)
    assert not is_saturated(0.001 * steps, 5000.0)


def coarse_sweeps_mv(step_mv: float, mep_mv: float) -> FloatArray:
    """Thirty sweeps of EMG at rest with an MEP of this peak, as a converter with such steps shows them."""
    t_ms = np.arange(0, 700, 0.2)
    band = butter(2, (10, 500), "bandpass", fs=5000.0, output="sos")
    noise = sosfilt(band, np.random.default_rng(0).standard_normal((30, t_ms.size)))
    mep = mep_mv * np.sin(2 * np.pi * (t_ms - 420) / 20) * (np.abs(t_ms - 430) <= 10)
    return np.asarray(step_mv * np.round((0.0015 * noise / noise.std() + mep) / step_mv))


@pytest.mark.parametrize("step_mv", [0.00244, 0.00488])
@pytest.mark.parametrize("mep_mv", [0.0, 0.06])
def test_emg_of_a_coarse_converter_is_not_saturated(step_mv: float, mep_mv: float) -> None:
    assert not any(is_saturated(emg_mv, 5000.0) for emg_mv in coarse_sweeps_mv(step_mv, mep_mv))


def test_a_clipped_mep_of_a_coarse_converter_is_saturated() -> None:
    assert all(is_saturated(emg_mv.clip(-0.25, 0.25), 5000.0) for emg_mv in coarse_sweeps_mv(0.00488, 0.5))


def test_an_isi_that_is_off_by_more_than_the_tolerance() -> None:
    assert mistrial_of(sweep_of(), Stimulus(0, 85.0)) is Kind.ISI_OFF
    assert judge(sweep_of(), Stimulus(0, 95.0), IMPACT).reason is None
    narrow = SignalLimits(isi_tolerance_ms=2.0)
    assert mistrial_of(sweep_of(), Stimulus(0, 95.0), limits=narrow) is Kind.ISI_OFF


@pytest.mark.parametrize("name", ["emg", "acceleration"])
@pytest.mark.parametrize(
    "values",
    [np.empty(0), np.zeros(5000), np.where(np.arange(5000) == 9, np.nan, 1.0), np.arange(2000.0)],
    ids=["empty", "constant", "NaN", "other length"],
)
def test_a_malformed_channel_is_a_missing_channel_and_never_a_number(name: str, values: FloatArray) -> None:
    assert mistrial_of(with_channel(sweep_of(), name, values)) is Kind.MISSING_CHANNEL


def test_a_channel_that_is_not_there_is_a_missing_channel() -> None:
    assert mistrial_of(without(sweep_of(), "emg")) is Kind.MISSING_CHANNEL
    assert mistrial_of(without(sweep_of(), "acceleration")) is Kind.MISSING_CHANNEL
    assert mistrial_of(sweep_of(t_valve_ms=None), space=VALVE) is Kind.MISSING_CHANNEL


def test_a_sweep_that_ends_before_the_mep_is_a_missing_channel() -> None:
    assert mistrial_of(sweep_of(t_tms_ms=980.0), Stimulus(0, 300.0)) is Kind.MISSING_CHANNEL


@pytest.mark.parametrize("name", ["emg", "acceleration"])
def test_an_unknown_unit_is_an_error(name: str) -> None:
    with pytest.raises(InvalidValueError, match=r"unit of the channel"):
        judge(with_channel(sweep_of(), name, unit="furlong"), PAIR, IMPACT)


def test_a_rate_in_khz_is_an_error() -> None:
    sweep = sweep_of()
    slow = {name: replace(channel, rate_hz=5.0) for name, channel in sweep.channels.items()}
    with pytest.raises(InvalidValueError, match="Is it in kHz"):
        judge(replace(sweep, channels=slow), PAIR, IMPACT)


def test_an_impact_that_the_device_only_predicts_carries_its_uncertainty() -> None:
    blind = without(sweep_of(t_hit_ms=682.0, isi_sd_ms=2.5), "acceleration")
    judged = judge(blind, PAIR, IMPACT)
    assert (judged.isi_ms, judged.isi_sd_ms) == (98.0, 2.5)


@pytest.mark.parametrize("after_hit_ms", [20, 70, 110])
def test_what_the_tap_does_to_the_emg_is_no_background(after_hit_ms: int) -> None:
    for isi_ms in (5.0, 40.0, 100.0, 140.0):
        emg = 0.002 * np.random.default_rng(5).standard_normal(5000)
        emg[5 * (680 + after_hit_ms) :][:150] += 0.5
        judged = judge(with_channel(sweep_of(t_tms_ms=680.0 + isi_ms), "emg", emg), Stimulus(0, isi_ms), IMPACT)
        assert judged.reason is None
        assert judged.background_rms_uv == pytest.approx(2.0, rel=0.2)


def test_a_short_sweep_that_begins_after_the_valve_command_is_judged_by_what_there_is() -> None:
    rng = np.random.default_rng(3)
    emg = Channel(2.0 * rng.standard_normal(450), 3000.0, "uV", t0_ms=-50.0)
    from_valve = judge(sweep(emg, t_valve_ms=-300.0), Stimulus(0, 300.0), VALVE)
    from_impact = judge(sweep(emg, t_hit_ms=-30.0), Stimulus(0, 30.0), IMPACT)
    assert from_valve.background_rms_uv == pytest.approx(2.0, rel=0.2)
    assert from_impact.background_rms_uv == pytest.approx(2.0, rel=0.2)


def sweep(emg: Channel, **times: Any) -> Sweep:
    return Sweep({"emg": emg}, t_tms_ms=0.0, **times)


def test_a_sweep_with_too_little_rest_says_so_and_not_that_a_channel_is_missing() -> None:
    emg = Channel(np.random.default_rng(3).standard_normal(450), 3000.0, "uV", t0_ms=-20.0)
    assert mistrial_of(sweep(emg), Stimulus(0, None)) is Kind.TOO_LITTLE_REST


@pytest.mark.parametrize("wrong", [{"background_uv": 0.0}, {"full_scale_mv": np.nan}, {"mep_window_ms": (35.0, 15.0)}])
def test_invalid_limits_are_errors(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match="SignalLimits"):
        SignalLimits(**wrong)


@pytest.mark.parametrize(
    ("isi_ms", "commanded_ms", "space", "limits", "reason"),
    [
        (-3.0, 5.0, IMPACT, None, Kind.TMS_BEFORE_IMPACT),
        (-3.0, 5.0, VALVE, None, None),
        (105.0, 100.0, IMPACT, None, None),
        (105.0, 100.0, IMPACT, SignalLimits(isi_tolerance_ms=2.0), Kind.ISI_OFF),
        (None, None, IMPACT, None, None),
    ],
)
def test_a_measurement_is_judged_by_the_rules_of_a_sweep(
    isi_ms: float, commanded_ms: float, space: DesignSpace, limits: SignalLimits | None, reason: Kind | None
) -> None:
    judged = judge_measurement(Measurement(0.1, isi_ms), Stimulus(0, commanded_ms), space, limits)
    assert judged.reason is reason
    assert judged.isi_ms == isi_ms
    assert judged.status is (Status.ACCEPTED if reason is None else Status.MISTRIAL)
    assert judged.mep_mv == 0.1  # of a mistrial for whoever looks at it


@pytest.mark.parametrize(
    ("space", "times"),
    [
        (IMPACT, {"t_hit_ms": 0.0, "t_tms_ms": 40.0}),
        (IMPACT, {"t_hit_ms": 40.0, "t_tms_ms": -60.0}),
        (VALVE, {"t_valve_ms": 0.0, "t_tms_ms": 400.0}),
        (VALVE, {"t_valve_ms": 0.0, "t_tms_ms": 0.1}),
    ],
)
def test_a_measurement_that_its_own_times_contradict_is_an_error(space: DesignSpace, times: dict[str, float]) -> None:
    with pytest.raises(DeviceError, match=r"contradict.*got 'a pulse .* 100 ms'"):
        judge_measurement(Measurement(0.1, 100.0, **times), Stimulus(0, 100.0), space)


@pytest.mark.parametrize(
    ("space", "times"),
    [
        (IMPACT, {"t_hit_ms": 41.0, "t_tms_ms": 140.0}),  # all three cut off to whole ms
        (IMPACT, {"t_valve_ms": 0.0, "t_tms_ms": 280.0}),  # the space counts from the impact, which is not told
        (IMPACT, {"t_tms_ms": 0.0}),
        (VALVE, {"t_valve_ms": -100.0, "t_hit_ms": 80.0, "t_tms_ms": 0.0}),
    ],
)
def test_a_measurement_that_its_own_times_do_not_contradict_counts(space: DesignSpace, times: dict[str, float]) -> None:
    assert judge_measurement(Measurement(0.1, 100.0, **times), Stimulus(0, 100.0), space).reason is None


def test_a_measurement_of_a_control_trial_has_no_time_of_what_was_not_to_come() -> None:
    with pytest.raises(DeviceError, match=r"got 'an impact at -100 ms'"):
        judge_measurement(Measurement(0.3, None, t_hit_ms=-100.0, t_tms_ms=0.0), Stimulus(0, None), IMPACT)
    with pytest.raises(DeviceError, match=r"got 'one at 3 ms'"):
        judge_measurement(Measurement(0.3, None, t_tms_ms=3.0), Stimulus(0, None, tap_alone=True), VALVE)
    tap = judge_measurement(Measurement(0.3, None, t_hit_ms=3.0), Stimulus(0, None, tap_alone=True), VALVE)
    assert tap.reason is None


@pytest.mark.parametrize("full_scale_mv", [None, 5.0])
def test_a_clipped_mep_is_saturated_also_one_step_below_the_full_scale(full_scale_mv: float | None) -> None:
    times = np.arange(5000) / 5.0
    swing = 9.0 * np.sin(2 * np.pi * (times - 798.0) / 14.0) * ((times > 798.0) & (times < 812.0))
    emg = np.clip(sweep_of().channels["emg"].values + swing, -5.0 * 32767 / 32768, 5.0 * 32767 / 32768)
    clipped, limits = with_channel(sweep_of(), "emg", emg), SignalLimits(full_scale_mv=full_scale_mv)
    assert mistrial_of(clipped, limits=limits) is Kind.SATURATION


def test_an_amplifier_that_blanks_the_mep_has_recorded_none() -> None:
    emg = sweep_of().channels["emg"].values.copy()
    emg[3895:4065] = 0.0  # from 1 ms before the pulse to 33 ms after it
    assert mistrial_of(with_channel(sweep_of(), "emg", emg)) is Kind.MISSING_CHANNEL
    emg[3960:] = sweep_of().channels["emg"].values[3960:]  # 12 ms after the pulse the MEP is yet to come
    assert judge(with_channel(sweep_of(), "emg", emg), PAIR, IMPACT).reason is None


def test_a_rig_that_fills_up_what_it_did_not_record_hides_no_blanking() -> None:
    emg = sweep_of().channels["emg"].values.copy()
    emg[3895:4050] = 0.0  # until 30 ms after the pulse
    emg[:200] = 0.0
    assert mistrial_of(with_channel(sweep_of(), "emg", emg)) is Kind.MISSING_CHANNEL


def test_a_coarse_converter_blanks_nothing() -> None:
    coarse = np.round(sweep_of().channels["emg"].values / 0.02) * 0.02  # ten times the noise at rest
    reason = judge(with_channel(sweep_of(), "emg", coarse), PAIR, IMPACT).reason
    assert reason is not Kind.MISSING_CHANNEL


@pytest.mark.parametrize("samples", [-1, 1])
def test_channels_may_differ_by_a_sample(samples: int) -> None:
    sweep = sweep_of()
    acceleration = sweep.channels["acceleration"]
    slower = np.resize(acceleration.values[::5], 1000 + samples)
    assert judge(with_channel(sweep, "acceleration", slower, rate_hz=1000.0), PAIR, IMPACT).reason is not (
        Kind.MISSING_CHANNEL
    )


def test_a_tap_that_came_with_tms_alone_is_an_error() -> None:
    with pytest.raises(DeviceError, match=r"got 'an impact at 680 ms'"):
        judge(replace(without(sweep_of(), "acceleration"), t_hit_ms=680.0), Stimulus(0, None), IMPACT)


def test_a_tap_that_shows_in_the_acceleration_of_tms_alone_is_an_error() -> None:
    with pytest.raises(DeviceError, match=r"got 'an impact at 6(79|80)\."):
        judge(sweep_of(), Stimulus(0, None), IMPACT)


def test_tms_alone_needs_no_acceleration_that_an_impact_could_be_found_in() -> None:
    whole = sweep_of()
    unknown = with_channel(whole, "acceleration", unit="counts")
    for alone in (unknown, replace(whole, t_valve_ms=5.0), replace(whole, t_valve_ms=-100.0)):
        assert judge(alone, Stimulus(0, None), IMPACT).reason is None


def test_what_moves_the_hammer_after_the_pulse_is_no_tap() -> None:
    alone = judge(sweep_of(t_tms_ms=600.0), Stimulus(0, None), IMPACT)  # the impact is at 680 ms
    assert (alone.reason, alone.isi_ms) == (None, None)


def test_a_coarse_amplifiers_quiet_trials_are_not_taken_for_blanked_ones() -> None:
    rng = np.random.default_rng(0)
    for _ in range(40):
        emg = np.round(rng.normal(0.0, 0.0015, 5000) / 0.005) * 0.005
        quiet = with_channel(sweep_of(t_valve_ms=None, t_hit_ms=680.0), "emg", emg)
        assert judge(quiet, PAIR, IMPACT).reason is not Kind.MISSING_CHANNEL


def test_a_pulse_that_was_to_come_before_the_impact_counts() -> None:
    early = replace(sweep_of(t_tms_ms=650.0), t_hit_ms=680.0)
    space = DesignSpace(-50, 100, reference="impact")
    assert judge(early, Stimulus(0, -30.0), space).isi_ms == -30.0
    assert judge(early, Stimulus(0, -30.0), space).reason is None
    assert mistrial_of(early, Stimulus(0, 0.0), space) is Kind.TMS_BEFORE_IMPACT


def test_a_glitch_beyond_any_amplifier_is_a_mistrial() -> None:
    emg = sweep_of().channels["emg"].values.copy()
    emg[4005] = 2000.0
    assert mistrial_of(with_channel(sweep_of(), "emg", emg)) is Kind.IMPLAUSIBLE


@pytest.mark.parametrize("valve_ms", [5.0, -100.0])
def test_a_sweep_that_begins_after_the_valve_command_is_judged(valve_ms: float) -> None:
    judged = judge(replace(sweep_of(), t_valve_ms=valve_ms, t_hit_ms=680.0), PAIR, IMPACT)
    assert judged.mep_mv == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize("window_ms", [(15.0, 25.0, 35.0), (35.0,), (), 35.0])
def test_an_mep_window_has_two_edges(window_ms: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"mep_window_ms"):
        SignalLimits(mep_window_ms=window_ms)


@pytest.mark.parametrize("span_ms", [(0.0, np.inf), (2000.0, 2100.0)])
def test_whether_no_emg_is_saturated_is_no_question(span_ms: tuple[float, float]) -> None:
    emg = np.zeros(0) if span_ms[0] == 0 else np.arange(100.0)
    with pytest.raises(InvalidValueError, match="no EMG"):
        is_saturated(emg, 5000.0, span_ms=span_ms)


@pytest.mark.parametrize("wrong", [{"mep_window_ms": (0.015, 0.035)}, {"background_uv": 0.01}])
def test_a_limit_in_another_unit_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=rf"{next(iter(wrong))}.*Multiply by 1000"):
        SignalLimits(**wrong)
