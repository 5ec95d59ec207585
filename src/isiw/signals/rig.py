"""What one trial and its sweep say is likely wrong with a rig.

Nobody is accused without a sign: if a sweep shows none, the reason of the mistrial stands for itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.findings import REMEDIES, Finding, Kind, Severity, UnitScale
from isiw.signals.impact import impact_time
from isiw.signals.judgement import of_one_length
from isiw.signals.limits import ARTEFACT_MS, EMG_UNITS_MV, SignalLimits
from isiw.signals.mep import MIN_BACKGROUND_MS, at_rest, disturbance
from isiw.signals.plausible import Counted, implausible_amplitude
from isiw.signals.waveforms import PULSE_GUARD_MS, is_recording, samples
from isiw.sweeps import Channel, Measurement, Sweep
from isiw.trials import Trial

REST_UV: Final = UnitScale(0.05, 400.0, usual=2.0)
"""RMS of EMG before the pulse: no amplifier is so quiet, and no muscle so loud, at rest or at work."""

_USUAL_LIMITS: Final = SignalLimits()


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known after a trial; what is not known is None or empty."""

    trial: Trial | None = None
    answer: Sweep | Measurement | None = None
    limits: SignalLimits = _USUAL_LIMITS
    told: Sequence[Counted] = ()  # the trials that count so far
    detection_limit_mv: float | None = None


DRIVEN_MS = 25.0
"""How long a hammer is driven before its impact, at least."""

EVOKED_SPAN_MS = (-2.0, 50.0)
"""When the pulse and what it evokes are in the EMG [ms after the pulse]."""

JOLT_MS = 60.0
"""How long after an impact its jolt may be the steepest edge."""

LATEST_HIT_MS = 300.0
"""From the valve command to the impact, in any rig that is plausible."""

BLANKED_MS = 12.0
"""How long amplifiers are blanked after a pulse, at most; the end of that is an edge, too."""

SHARP_MS = 1.0
LEAST_RATE_HZ = 2000.0
"""An edge that is steep for no longer than this is an artefact, since an MEP rises for some milliseconds. From this
rate on there are samples enough to say so."""

QUICK_MS, QUICK_SAMPLES = 3.0, 4
"""What is steep for longer than this, and than so many samples, may be a movement, however long after the pulse."""

CLEAR = 20.0


def too_early_by_chance(trial: Trial, space: DesignSpace) -> bool:
    """Whether the pulse came before the impact by no more than the tolerance: no rig is to blame for that."""
    error_ms = trial.isi_error_ms if trial.reason is Kind.TMS_BEFORE_IMPACT else None
    return error_ms is not None and abs(error_ms) <= space.tolerance_ms


def _finding(kind: Kind, trial: Trial, text: str, remedy: str) -> Finding:
    severity = Severity.NOTE if trial.reason is None else Severity.MISTRIAL
    return Finding(kind, severity, text, remedy)


def unusable_emg(sweep: Sweep, trial: Trial) -> Finding | None:
    """EMG that is missing, no recording, or not of the acceleration's duration."""
    emg = sweep.channels.get("emg")
    if emg is None or not emg.values.size:
        return _finding(
            Kind.NO_EMG, trial, "the sweep has no EMG", "Name the channel emg, and record it in every trial."
        )
    if not of_one_length(sweep) and is_recording(emg.values):
        text = "EMG and acceleration differ in duration"
        return _finding(Kind.DURATIONS, trial, text, "Check the sampling rates that the channels are given.")
    return _recording(emg, trial, "the EMG", "Is the amplifier on, and its cable plugged in?")


def _recording(channel: Channel, trial: Trial, what: str, look: str) -> Finding | None:
    """That a channel is no recording; None where it is one."""
    if not np.isfinite(channel.values).all():
        text = f"{what} has samples that are no numbers"
        return _finding(Kind.NOT_NUMBERS, trial, text, "Look at how the rig converts what it records.")
    return None if is_recording(channel.values) else _finding(Kind.FLAT_LINE, trial, f"{what} is a flat line", look)


def wrong_acceleration(sweep: Sweep, trial: Trial) -> Finding | None:
    """What is wrong with the acceleration of a trial that was lost, where the hit is sought in it."""
    acceleration, valve_ms = sweep.channels.get("acceleration"), sweep.t_valve_ms
    if trial.reason is None or acceleration is None or valve_ms is None or sweep.t_hit_ms is not None:
        return None
    if _driven_impact(sweep.channels["emg"], valve_ms) is not None:
        remedy = "The impact is in the channel emg: swap the two inputs."
        return _finding(Kind.SWAPPED, trial, "EMG and acceleration are swapped", remedy)
    broken = _recording(
        acceleration, trial, "the acceleration", "Is the accelerometer powered, and its cable plugged in?"
    )
    upright, inverted = (_driven_impact(acceleration, valve_ms, sign) for sign in (1.0, -1.0))
    if broken is None and inverted is not None and upright is None:
        remedy = "Turn it, or negate its values: towards the tendon is positive."
        return _finding(Kind.INVERTED, trial, "the accelerometer is inverted", remedy)
    return broken


def no_origin(sweep: Sweep, trial: Trial) -> Finding | None:
    """A pulse whose ISI cannot be counted, with nothing that the hit could be found in."""
    is_missing = trial.reason is Kind.MISSING_CHANNEL and sweep.t_tms_ms is not None
    has_impact = "acceleration" in sweep.channels and sweep.t_valve_ms is not None
    if not is_missing or has_impact or trial.isi_ms is not None or trial.commanded_isi_ms is None:
        return None
    remedy = (
        "Where it is the impact, give t_hit_ms, or the acceleration with t_valve_ms; where it is the valve command, "
        "t_valve_ms."
    )
    return _finding(Kind.NO_ORIGIN, trial, "the sweep has no time of the event that ISIs count from", remedy)


def _driven_impact(channel: Channel, valve_ms: float, sign: float = 1.0) -> float | None:
    """The impact of a hammer that was driven towards it for a while [ms]; artefacts in the EMG are not."""
    rate, valve = channel.rate_hz, valve_ms - channel.t0_ms
    values = sign * channel.values
    if not is_recording(values) or valve < DRIVEN_MS:
        return None
    hit = impact_time(values, rate, valve)
    if hit is None:
        return None
    rest = values[: math.floor(valve * rate / 1000)]
    way = values[math.floor((hit - DRIVEN_MS) * rate / 1000) : math.floor((hit - 3.0) * rate / 1000)] - np.median(rest)
    driven = bool((way > 0).mean() > 0.9) and float(np.median(way)) > float(rest.std())
    return hit + channel.t0_ms if driven else None


def double_pulse(sweep: Sweep, trial: Trial) -> Finding | None:
    """A spike like the pulse's artefact at another time, as of a stimulator that is left on paired pulses."""
    emg = sweep.channels["emg"]
    if trial.t_tms_ms is None or emg.rate_hz < LEAST_RATE_HZ or steepest_edge(emg) is None:
        return None
    tap_ms = tap_span_ms(trial)
    since_ms = [ms - trial.t_tms_ms for ms in _spikes_ms(emg) if tap_ms is None or not tap_ms[0] <= ms <= tap_ms[1]]
    other_ms = [ms for ms in since_ms if abs(ms) > ARTEFACT_MS]
    if not other_ms or len(other_ms) == len(since_ms):
        return None
    side = "after" if other_ms[0] > 0 else "before"
    text = f"the EMG has a spike like that of the pulse {abs(other_ms[0]):.0f} ms {side} it"
    remedy = "Does the stimulator give two pulses? Set it to single pulses, and look for a trigger that bounces."
    return _finding(Kind.DOUBLE_PULSE, trial, text, remedy)


def _spikes_ms(emg: Channel) -> list[float]:
    """When the EMG jumps and comes back at once, about as steeply as anywhere [ms on the sweep's clock]."""
    steps = np.diff(emg.values)
    most, apart = np.abs(steps).max(), samples(SHARP_MS, emg.rate_hz)
    steep = np.flatnonzero(np.abs(steps) > 0.3 * most)
    spikes = np.split(steep, np.flatnonzero(np.diff(steep) > apart) + 1)
    comes_back = (at for at in spikes if at[-1] - at[0] <= apart and np.ptp(np.sign(steps[at])))
    return [emg.t0_ms + 1000 * at[0] / emg.rate_hz for at in comes_back if np.abs(steps[at]).max() > 0.5 * most]


def stray_edge(sweep: Sweep, trial: Trial) -> Finding | None:
    """The steepest edge of an EMG is the pulse's artefact, or belongs to what it evokes, or to the tap."""
    if trial.t_tms_ms is None:
        return None
    emg = sweep.channels["emg"]
    steepest_ms = steepest_edge(emg)
    evoked_ms = (trial.t_tms_ms + EVOKED_SPAN_MS[0], trial.t_tms_ms + EVOKED_SPAN_MS[1])
    tap_ms = tap_span_ms(trial)
    if steepest_ms is None or (tap_ms is not None and tap_ms[0] <= steepest_ms <= tap_ms[1]):
        return None
    steps = np.abs(np.diff(emg.values))
    steep = int(np.ptp(np.flatnonzero(steps > 0.3 * steps.max()))) + 1  # all flanks of an MEP, if it is one
    is_fast = emg.rate_hz >= LEAST_RATE_HZ
    may_be_evoked = steepest_ms <= trial.t_tms_ms + BLANKED_MS or not is_fast or steep > samples(SHARP_MS, emg.rate_hz)
    if evoked_ms[0] <= steepest_ms <= evoked_ms[1] and may_be_evoked:
        return None
    if steep > max(samples(QUICK_MS, emg.rate_hz), QUICK_SAMPLES):
        return None  # a movement
    text = (
        f"the steepest edge of the EMG is at {steepest_ms:.0f} ms, but the device reports the pulse at "
        f"{trial.t_tms_ms:.0f} ms"
    )
    remedy = "Is that edge the pulse's? Then check the sampling rate, and that all times are on the sweep's own clock."
    return _finding(Kind.STRAY_EDGE, trial, text, remedy)


def tap_span_ms(trial: Trial) -> tuple[float, float] | None:
    """When a trial's tap may be in the EMG [ms on the sweep's clock], valve and all; None without a time of it."""
    begins = [ms for ms in (trial.t_valve_ms, trial.t_hit_ms) if ms is not None]
    if not begins:
        return None
    hit_ms = begins[0] + LATEST_HIT_MS if trial.t_hit_ms is None else trial.t_hit_ms
    return begins[0] - 2.0, hit_ms + JOLT_MS


def steepest_edge(emg: Channel) -> float | None:
    """When the EMG rises or falls most steeply [ms on the sweep's clock]; None where no edge, or many, stand out."""
    steps = np.abs(np.diff(emg.values))
    usual = float(np.median(steps)) if steps.size else 0.0
    if usual == 0 or steps.max() <= CLEAR * usual or (steps > 0.5 * steps.max()).mean() >= 0.01:
        return None
    return emg.t0_ms + 1000 * float(steps.argmax()) / emg.rate_hz


def wrong_level(trial: Trial, evidence: Evidence) -> Finding | None:
    """EMG before the pulse that is no muscle's, or no amplifier's."""
    rest_uv = trial.background_rms_uv
    if rest_uv is None or REST_UV.least <= rest_uv <= REST_UV.most:
        return None
    if rest_uv > REST_UV.most:
        scale, unit = (1e6, "V") if rest_uv >= 1e6 else (1e3, "mV")
        level = f"{float(f'{rest_uv / scale:.2g}'):g} {unit}"
        kind, text, look = Kind.LOUD, f"{level} RMS, more than any muscle's at rest", "."
    else:
        text = f"{rest_uv:.1g} µV RMS, less than any amplifier's noise"
        kind, look = Kind.QUIET, "; is the amplifier on?"
    question = _unit_question(rest_uv, evidence)
    correct = f"{question}, or correct the gain" if question else "Correct the gain"
    return _finding(kind, trial, f"the EMG before the pulse has {text}", f"{correct}{look}")


def _unit_question(rest_uv: float, evidence: Evidence) -> str | None:
    """Which unit the EMG is likely in, and what to do about it; None where no unit makes its level plausible."""
    emg = evidence.answer.channels.get("emg") if isinstance(evidence.answer, Sweep) else None
    if emg is None:  # the device itself measures
        return "Is background_rms_uv, as the device reports it, in µV? Convert it"
    levels_uv = {unit: rest_uv * EMG_UNITS_MV[unit] / EMG_UNITS_MV[emg.unit] for unit in ("V", "mV", "µV")}
    possible = {unit: uv for unit, uv in levels_uv.items() if REST_UV.least <= uv <= REST_UV.most}
    likely = min(possible, key=lambda unit: abs(math.log(possible[unit] / REST_UV.usual)), default=None)
    return likely and f"Is it in {likely}, and described as {emg.unit}? Give the channel its unit"


def lost_trial(trial: Trial, evidence: Evidence) -> Finding | None:
    """The reason of a mistrial, with the figure behind it."""
    if trial.reason is None:
        return None
    amplitude = implausible_amplitude(trial.mep_mv or 0.0)
    if trial.reason is Kind.IMPLAUSIBLE and amplitude is not None:
        return replace(amplitude, severity=Severity.MISTRIAL)
    return _finding(trial.reason, trial, _explained(trial, evidence), REMEDIES[trial.reason])


def _explained(trial: Trial, evidence: Evidence) -> str:
    emg = evidence.answer.channels.get("emg") if isinstance(evidence.answer, Sweep) else None
    if trial.reason is Kind.TOO_LITTLE_REST and emg is not None and trial.t_tms_ms is not None:
        before_ms, least_ms = trial.t_tms_ms - emg.t0_ms, MIN_BACKGROUND_MS + PULSE_GUARD_MS
        if before_ms <= least_ms + 1:
            return f"the sweep has {before_ms:.0f} ms of EMG before the pulse, at least {least_ms:.0f} ms are needed"
        return "the acceleration has too little rest before the valve command"
    if trial.reason is Kind.BACKGROUND_ACTIVITY and trial.background_rms_uv is not None:
        level = f"{trial.background_rms_uv:.0f} µV RMS, at most {evidence.limits.background_uv:g} at rest"
        found = emg and disturbance(EMG_UNITS_MV[emg.unit] * emg.values, emg.rate_hz, at_rest(emg, trial))
        if found and found.hum_mv:
            return f"the EMG before the pulse has {level}, and most of it is mains hum of {found.hum_hz:.0f} Hz"
        return f"the muscle is tense: {level}"
    if trial.reason is Kind.ISI_OFF and trial.isi_ms is not None:
        return f"the realised ISI was {trial.isi_ms:.0f} ms, not the commanded {trial.commanded_isi_ms:g} ms"
    return f"{trial.reason}"
