"""The judgement of a trial: from its sweep to an amplitude at a realised ISI, or to the reason why there is none.

A device that measured itself is held to what was commanded, and to its own times.
What is wrong with every trial, such as an unknown unit, is an error: repeating the trial would not help.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from isiw.checks import MOST_MEP_MV, choice
from isiw.design import DesignSpace
from isiw.errors import DeviceError, InvalidValueError, IsiwError
from isiw.findings import MISTRIALS, Finding, Kind, Severity, refused
from isiw.signals.impact import impact_time
from isiw.signals.limits import EMG_UNITS_MV, SignalLimits
from isiw.signals.mep import TAP_SPAN_MS, at_rest, disturbance, known_background_rms, mep_amplitudes
from isiw.signals.plausible import before_impact, implausible_amplitude
from isiw.signals.spans import TAP_MS
from isiw.signals.waveforms import is_blanked, is_recording, is_saturated
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.text.sanitize import shown
from isiw.trials import Status, Stimulus, Trial
from isiw.types import FloatArray

ACCELERATION_UNITS = frozenset({"m/s^2", "m/s²", "g", "V", "mV"})
"""Units of the acceleration; the impact is found in any of them."""


def judged(answer: object, stimulus: Stimulus, space: DesignSpace, limits: SignalLimits | None = None) -> Trial:
    """Judge what a device has answered, a sweep or its own measurement; arguments and errors are those of both.

    Raises:
        DeviceError: it is neither.
    """
    if isinstance(answer, Sweep):
        return judge(answer, stimulus, space, limits)
    if isinstance(answer, Measurement):
        return judge_measurement(answer, stimulus, space, limits)
    raise DeviceError(
        f"the device's deliver returned {shown(answer)}",
        expected="an isiw.Sweep or an isiw.Measurement",
        remedy="Let it return what it recorded, or the MEP that it measured: isiw.Measurement(mep_mv, isi_ms).",
    )


def judge(sweep: Sweep, stimulus: Stimulus, space: DesignSpace, limits: SignalLimits | None = None) -> Trial:
    """Judge one sweep: the trial that it is, accepted or a mistrial. Its times are on the sweep's clock.

    Args:
        sweep: the recorded waveforms and what the device knows of their timing.
        stimulus: what was commanded.
        space: says which event the ISI counts from, and how far it may be off.
        limits: what the sweep must satisfy.

    Raises:
        InvalidValueError: an unknown unit, or a sampling rate too low to measure anything.
    """
    limits = limits or SignalLimits()
    if stimulus.tap_alone:
        return _judge_tap(sweep, stimulus, limits)
    timed = _judge_timing(sweep, stimulus, space, limits)
    if timed.reason is not Kind.OUTCOME_UNKNOWN:
        return timed
    try:
        return _judge_emg(sweep.channels["emg"], timed, limits)
    except InvalidValueError as error:
        return _mistrial(timed, _reason(error))


def _judge_emg(emg: Channel, timed: Trial, limits: SignalLimits) -> Trial:
    """The MEP and the EMG before it, of a trial whose timing is right."""
    emg_mv = emg.values * _unit_mv(emg)
    pulse = _on_channel(timed.t_tms_ms, emg)
    found = disturbance(emg_mv, emg.rate_hz, at_rest(emg, timed))
    level_mv, quiet_mv = (
        (emg_mv, emg_mv) if found is None else (emg_mv - found.drift_course_mv, emg_mv - found.course_mv)
    )
    mep_mv = float(mep_amplitudes(quiet_mv, emg.rate_hz, pulse, limits.mep_window_ms)[0])
    timed = replace(timed, background_rms_uv=_background_uv(level_mv, emg, timed))
    span_ms = (pulse + limits.mep_window_ms[0], pulse + limits.mep_window_ms[1])
    if is_saturated(emg_mv, emg.rate_hz, limits.full_scale_mv, span_ms=span_ms):
        return _mistrial(timed, Kind.SATURATION)
    if timed.background_rms_uv is None:
        return _mistrial(timed, Kind.TOO_LITTLE_REST)
    if is_blanked(emg_mv, emg.rate_hz, pulse, span_ms):
        return _mistrial(timed, Kind.MISSING_CHANNEL)
    if mep_mv == 0 or implausible_amplitude(mep_mv) is not None:  # in a sweep even EMG at rest has more than 0
        kept_mv = mep_mv if mep_mv <= MOST_MEP_MV else None  # as where a sample is missing and the converter says so
        measured = _mistrial(replace(timed, mep_mv=kept_mv), Kind.IMPLAUSIBLE)
    else:
        measured = replace(timed, status=Status.ACCEPTED, reason=None, mep_mv=mep_mv)
    return _mistrial(measured, Kind.BACKGROUND_ACTIVITY) if _is_tense(measured, limits) else measured


def _reason(error: InvalidValueError) -> Kind:
    """Which mistrial an error of a detector is; what is wrong with every trial is raised again."""
    if error.found not in MISTRIALS:
        raise error
    return Kind(error.found)


def _is_tense(judged: Trial | Measurement, limits: SignalLimits) -> bool:
    return (judged.background_rms_uv or 0.0) > limits.most_background_uv


def _judge_tap(sweep: Sweep, stimulus: Stimulus, limits: SignalLimits) -> Trial:
    """A tap alone, of which no MEP is expected: the impact must be there, and the muscle at rest before it."""
    if sweep.t_tms_ms is not None:
        raise pulse_with_tap_alone(sweep.t_tms_ms)
    judged = replace(Trial.unknown(stimulus), t_valve_ms=sweep.t_valve_ms)
    if not _usable(sweep, "emg") or not of_one_length(sweep):
        return _mistrial(judged, Kind.MISSING_CHANNEL)
    emg = sweep.channels["emg"]
    hit_ms, wrong = _impact(sweep)
    until_ms = sweep.t_valve_ms if hit_ms is None else hit_ms
    judged = replace(judged, t_hit_ms=hit_ms)
    if until_ms is None or _on_channel(until_ms, emg) > 1000 * emg.values.size / emg.rate_hz:
        return _mistrial(judged, wrong or Kind.MISSING_CHANNEL)
    at_rest_until = replace(judged, t_tms_ms=until_ms, t_hit_ms=None)
    judged = replace(judged, background_rms_uv=_background_uv(emg.values * _unit_mv(emg), emg, at_rest_until))
    if wrong is None and _is_tense(judged, limits):
        wrong = Kind.BACKGROUND_ACTIVITY
    return _mistrial(judged, wrong) if wrong else replace(judged, status=Status.ACCEPTED, reason=None)


def judge_measurement(
    measurement: Measurement, stimulus: Stimulus, space: DesignSpace, limits: SignalLimits | None = None
) -> Trial:
    """Judge what a device reports that measured the MEP itself, by the same rules as a sweep: the trial that it is.

    Args:
        measurement: what the device reports.
        stimulus: what was commanded.
        space: says which event the ISI counts from, and how far it may be off.
        limits: what the measurement must satisfy.

    Raises:
        DeviceError: a pair reported where TMS alone was commanded, or the other way round, or times that contradict the
            realised ISI.
    """
    limits = limits or SignalLimits()
    if (measurement.isi_ms is None) != (stimulus.isi_ms is None):
        raise DeviceError(
            "the device reports another kind of trial than it had to deliver",
            got=f"a realised ISI of {measurement.isi_ms}",
            expected=f"one for the commanded ISI of {stimulus.isi_ms}",
        )
    require_agreement(measurement, stimulus, space)
    judged = Trial(stimulus.trial, Status.ACCEPTED, stimulus.isi_ms, tap_alone=stimulus.tap_alone, **vars(measurement))
    wrong = None
    if measurement.isi_ms is not None and stimulus.isi_ms is not None:
        wrong = wrong_isi(measurement.isi_ms, stimulus.isi_ms, space, limits)
    if wrong is None and _is_tense(measurement, limits):
        wrong = Kind.BACKGROUND_ACTIVITY
    if wrong is None and implausible_amplitude(measurement.mep_mv) is not None:
        wrong = Kind.IMPLAUSIBLE
    return judged if wrong is None else _mistrial(judged, wrong)


def _mistrial(judged: Trial, reason: Kind) -> Trial:
    return replace(judged, status=Status.MISTRIAL, reason=reason)


def _judge_timing(sweep: Sweep, stimulus: Stimulus, space: DesignSpace, limits: SignalLimits) -> Trial:
    """The realised ISI, or what is wrong with the timing; where nothing is, the outcome is still unknown."""
    judged = replace(Trial.unknown(stimulus), t_valve_ms=sweep.t_valve_ms, t_tms_ms=sweep.t_tms_ms)
    if not _usable(sweep, "emg") or not of_one_length(sweep):
        return _mistrial(judged, Kind.MISSING_CHANNEL)
    _unit_mv(sweep.channels["emg"])
    if sweep.t_tms_ms is None:
        return _mistrial(judged, Kind.NO_PULSE)
    if stimulus.isi_ms is None:
        _require_no_tap(sweep)
        return judged
    hit, wrong = _impact(sweep)
    judged = replace(judged, t_hit_ms=hit, isi_sd_ms=sweep.isi_sd_ms)
    start = hit if space.reference == "impact" else sweep.t_valve_ms
    if wrong is not None or start is None:
        return _mistrial(judged, wrong or Kind.MISSING_CHANNEL)
    isi_ms = sweep.t_tms_ms - start
    judged = replace(judged, isi_ms=isi_ms)
    wrong = wrong_isi(isi_ms, stimulus.isi_ms, space, limits)
    return judged if wrong is None else _mistrial(judged, wrong)


def _require_no_tap(sweep: Sweep) -> None:
    """Raise where a tap came with TMS alone."""
    try:
        hit_ms, _ = _impact(sweep)
    except InvalidValueError:  # nothing that an impact could be found in
        return
    if hit_ms is not None and (sweep.t_hit_ms is not None or hit_ms < (sweep.t_tms_ms or 0.0)):
        raise tap_with_tms_alone(hit_ms)  # a twitch may move the hammer after the pulse


def wrong_isi(
    isi_ms: float, commanded_isi_ms: float, space: DesignSpace, limits: SignalLimits | None = None
) -> Kind | None:
    """The fault of a realised ISI; None if the trial can be learnt.

    Args:
        isi_ms: when the pulse came after the event that the space counts from [ms].
        commanded_isi_ms: when it should have come [ms].
        space: says which event the ISI counts from, and how far it may be off.
        limits: may ask for less than the space's tolerance.
    """
    limits = limits or SignalLimits()
    if before_impact(isi_ms, commanded_isi_ms, space):
        return Kind.TMS_BEFORE_IMPACT
    return Kind.ISI_OFF if abs(isi_ms - commanded_isi_ms) > limits.tolerance_ms(space) else None


def _impact(sweep: Sweep) -> tuple[float | None, Kind | None]:
    """The impact as told by the device or found in the acceleration, and what is wrong where it should be there."""
    if sweep.t_hit_ms is not None:
        return sweep.t_hit_ms, None
    if "acceleration" not in sweep.channels:
        return None, None
    channel = sweep.channels["acceleration"]
    choice("the unit of the channel acceleration", channel.unit, sorted(ACCELERATION_UNITS))
    if sweep.t_valve_ms is None or not _usable(sweep, "acceleration"):
        return None, Kind.MISSING_CHANNEL
    try:
        hit = impact_time(channel.values, channel.rate_hz, sweep.t_valve_ms - channel.t0_ms)
    except InvalidValueError as error:
        return None, _reason(error)
    return (None, Kind.NO_IMPACT) if hit is None else (hit + channel.t0_ms, None)


def _usable(sweep: Sweep, name: str) -> bool:
    return name in sweep.channels and is_recording(sweep.channels[name].values)


def of_one_length(sweep: Sweep) -> bool:
    """Whether EMG and acceleration, where there is one, cover the same time to within a sample."""
    channels = [sweep.channels[name] for name in ("emg", "acceleration") if name in sweep.channels]
    lengths = [channel.values.size / channel.rate_hz for channel in channels]
    return max(lengths) - min(lengths) <= max(1 / channel.rate_hz for channel in channels) + 1e-9  # rounding


def _unit_mv(emg: Channel) -> float:
    return EMG_UNITS_MV[choice("the unit of the channel emg", emg.unit, EMG_UNITS_MV)]


def _on_channel(time_ms: float | None, channel: Channel) -> float:
    """A time of the sweep's clock, counted from the channel's first sample [ms]; NaN where unknown."""
    return math.nan if time_ms is None else time_ms - channel.t0_ms


def _background_uv(emg_mv: FloatArray, emg: Channel, timed: Trial) -> float | None:
    """RMS of the EMG at rest, if possible of EMG that the tap cannot have touched; None if there is too little.

    A short sweep may hold nothing but the tap's reflexes, or nothing else: then all of its EMG before the pulse counts.
    """
    pulse, hit = _on_channel(timed.t_tms_ms, emg), _on_channel(timed.t_hit_ms, emg)
    untouched = np.fmin(pulse, _on_channel(timed.t_valve_ms, emg)) if math.isnan(hit) else pulse
    for end, tap, lasts_ms in ((float(untouched), hit, TAP_MS), (pulse, hit, TAP_SPAN_MS), (pulse, math.nan, 0.0)):
        rms_mv = known_background_rms(emg_mv, emg.rate_hz, end, tap, tap_ms=lasts_ms)
        if rms_mv is not None:
            return float(1000 * rms_mv[0])
    return None


CUT_OFF_MS: Final = 2.0
"""Pulse, event and ISI, each cut off to whole ms, disagree by less; a rig that is wrong about one of them, by more."""


def timed_isi_ms(source: Measurement | Trial, space: DesignSpace) -> float | None:
    """The ISI by the times of the pulse and of the event that it counts from [ms]; None if one is missing."""
    start_ms = source.t_hit_ms if space.reference == "impact" else source.t_valve_ms
    return None if start_ms is None or source.t_tms_ms is None else source.t_tms_ms - start_ms


def contradicts_its_times(source: Measurement | Trial, space: DesignSpace) -> bool:
    """Whether the realised ISI is another one than the times say."""
    timed_ms = timed_isi_ms(source, space)
    return timed_ms is not None and source.isi_ms is not None and abs(timed_ms - source.isi_ms) >= CUT_OFF_MS


def require_agreement(measurement: Measurement, stimulus: Stimulus, space: DesignSpace) -> None:
    """Refuse a measurement whose times are not those of the trial that was commanded, or of the ISI that it tells."""
    alone = stimulus.isi_ms is None
    if alone and not stimulus.tap_alone and measurement.t_hit_ms is not None:
        raise tap_with_tms_alone(measurement.t_hit_ms)
    if stimulus.tap_alone and measurement.t_tms_ms is not None:
        raise pulse_with_tap_alone(measurement.t_tms_ms)
    if contradicts_its_times(measurement, space):
        event = "impact" if space.reference == "impact" else "valve command"
        raise _of_device(
            Kind.TIMES,
            "the times that the device reports contradict the ISI that it reports",
            f"a pulse {timed_isi_ms(measurement, space):g} ms after the {event}, and a realised ISI of "
            f"{measurement.isi_ms:g} ms",
            "Report the realised ISI, never the wanted one. Are its times in ms, on one clock, of this trial?",
            f"the same to within {CUT_OFF_MS:g} ms",
        )


def tap_with_tms_alone(hit_ms: float) -> IsiwError:
    """That a tap hit at this time with TMS alone: a response to both would be taken for one to the pulse."""
    text, got = "the device reports a tap where TMS alone was commanded", f"an impact at {hit_ms:g} ms"
    remedy = "Does the valve stay open? Leave t_hit_ms and t_valve_ms out where nothing hits."
    return _of_device(Kind.TAP_UNWANTED, text, got, remedy)


def pulse_with_tap_alone(pulse_ms: float) -> IsiwError:
    """That a pulse came at this time with a tap alone."""
    text = "the device reports a magnetic pulse where a tap alone was commanded"
    return _of_device(Kind.PULSE_UNWANTED, text, f"one at {pulse_ms:g} ms")


def _of_device(kind: Kind, text: str, got: str, remedy: str = "", expected: str | None = None) -> IsiwError:
    return refused(Finding(kind, Severity.REFUSED, text, remedy), got, expected, DeviceError)
