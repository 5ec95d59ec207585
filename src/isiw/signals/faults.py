"""What is likely wrong with a rig, told from one trial and its sweep, in words that say what to do.

A judgement says why a trial does not count; a fault says why that is likely so. Nobody is accused without a sign: where
a sweep shows none, the reason of the mistrial stands for itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from isiw.design import DesignSpace
from isiw.signals.impact import impact_time
from isiw.signals.judgement import of_one_length
from isiw.signals.limits import SignalLimits
from isiw.signals.plausibility import implausible_amplitude, off_by
from isiw.signals.units import EMG_UNITS_MV
from isiw.signals.waveforms import is_recording
from isiw.trials import Channel, Measurement, MistrialReason, Sweep, Trial

__all__ = ["Fault", "likely_fault", "remedy_for", "steepest_edge", "tap_span_ms", "too_early_by_chance"]

TOO_LOUD_UV, TOO_QUIET_UV = 400.0, 0.05
"""EMG before the pulse [µV RMS] that is no muscle's at rest or at work, and no amplifier's."""

USUAL_UV = 2.0
"""EMG at rest [µV RMS], in the median."""

DRIVEN_MS = 25.0
"""How long a hammer is driven before its impact, at least."""

EVOKED_SPAN_MS = (-2.0, 50.0)
"""When the pulse and what it evokes are in the EMG [ms after the pulse]."""

JOLT_MS = 60.0
"""How long after an impact its jolt may be the steepest edge."""

LATEST_HIT_MS = 300.0
"""From the valve command to the impact, in any rig that is believed in."""

BLANKED_MS = 12.0
"""How long amplifiers are blanked after a pulse, at most; the end of that is an edge, too."""

SHARP_MS = 1.0
LEAST_RATE_HZ = 2000.0
"""An edge that is steep for no longer than this is an artefact, since an MEP rises for some milliseconds. From this
rate on there are samples enough to say so."""

CLEAR = 20.0


@dataclass(frozen=True)
class Fault:
    """A likely fault of a rig.

    Args:
        what: what is likely wrong, as a sentence without a full stop.
        remedy: what to do, in full sentences.
    """

    what: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.what}. {self.remedy}"


_REMEDIES: Mapping[MistrialReason, str] = MappingProxyType(
    {
        MistrialReason.NO_IMPACT: "Check the air supply, the valve, and the accelerometer on the hammer.",
        MistrialReason.NO_PULSE: "Check that the stimulator is charged and armed, and that its trigger is recorded.",
        MistrialReason.TMS_BEFORE_IMPACT: "Check the hit delay that the rig assumes, and the sampling rate.",
        MistrialReason.BACKGROUND_ACTIVITY: (
            "Ask the person to relax the muscle; check the electrodes and the ground, and look for mains hum. Where "
            "the tap alone evokes a reflex before the pulse, begin the space at larger ISIs."
        ),
        MistrialReason.SATURATION: "Lower the amplifier's gain, or keep cables away from the coil.",
        MistrialReason.MISSING_CHANNEL: (
            "Check that the EMG is recorded, and not blanked, from 50 ms before to 50 ms after the pulse."
        ),
        MistrialReason.ISI_OFF: "Check how the rig times the pulse, the reference of its ISIs, and the sampling rate.",
        MistrialReason.IMPLAUSIBLE: "Check the unit and the gain of the EMG.",
        MistrialReason.REJECTED: "See the notes in the log.",
        MistrialReason.OUTCOME_UNKNOWN: "Check whether the device is connected and answers.",
    }
)


def remedy_for(reason: MistrialReason) -> str:
    """What to do about a mistrial of this reason."""
    return _REMEDIES[reason]


def too_early_by_chance(trial: Trial, space: DesignSpace) -> bool:
    """Whether the pulse came before the impact by no more than the tolerance: no rig is to blame for that.

    Args:
        trial: a trial.
        space: the design space.
    """
    if trial.reason is not MistrialReason.TMS_BEFORE_IMPACT or trial.isi_ms is None or trial.commanded_isi_ms is None:
        return False
    return not off_by(trial.isi_ms, trial.commanded_isi_ms, space)


def likely_fault(answer: Sweep | Measurement, trial: Trial, limits: SignalLimits | None = None) -> Fault | None:
    """What is likely wrong with the rig that gave an answer; None where nothing is.

    Args:
        answer: what the device answered.
        trial: the trial that it was judged to be.
        limits: what it was judged by.
    """
    found = _fault_of_sweep(answer, trial) if isinstance(answer, Sweep) else None
    found = found or _fault_of_level(trial, _emg_unit(answer))
    if found is not None or trial.reason is None:
        return found
    return Fault(_explained(trial, limits or SignalLimits()), remedy_for(trial.reason))


def _fault_of_sweep(sweep: Sweep, trial: Trial) -> Fault | None:
    emg, acceleration = sweep.channels.get("emg"), sweep.channels.get("acceleration")
    if emg is None or not emg.values.size:
        return Fault("the sweep has no EMG", "Name the channel emg, and record it in every trial.")
    if not np.isfinite(emg.values).all():
        return Fault("the EMG has samples that are no numbers", "Look at how the rig converts what it records.")
    if not is_recording(emg.values):
        return Fault("the EMG is a flat line", "Is the amplifier on, and its cable plugged in?")
    if not of_one_length(sweep):
        return Fault("EMG and acceleration differ in duration", "Check the sampling rates that the channels are given.")
    found = _fault_of_hammer(sweep, emg, acceleration) or _fault_of_start(sweep, trial)
    if trial.reason is not None and found is not None:
        return found
    return _fault_of_rate(emg, trial)


def _fault_of_start(sweep: Sweep, trial: Trial) -> Fault | None:
    """A pulse whose ISI cannot be counted, with nothing that the hit could be found in."""
    is_missing = trial.reason is MistrialReason.MISSING_CHANNEL and sweep.t_tms_ms is not None
    has_impact = "acceleration" in sweep.channels and sweep.t_valve_ms is not None
    if not is_missing or has_impact or trial.isi_ms is not None or trial.commanded_isi_ms is None:
        return None
    return Fault(
        "the sweep has no time of the event that ISIs count from",
        "Where it is the impact, give t_hit_ms, or the acceleration with t_valve_ms; where it is the valve command, "
        "t_valve_ms.",
    )


def _fault_of_hammer(sweep: Sweep, emg: Channel, acceleration: Channel | None) -> Fault | None:
    if acceleration is None or sweep.t_valve_ms is None or sweep.t_hit_ms is not None:
        return None
    if _driven_impact(emg, sweep.t_valve_ms) is not None:
        return Fault("EMG and acceleration are swapped", "The impact is in the channel emg: swap the two inputs.")
    if not np.isfinite(acceleration.values).all():
        return Fault(
            "the acceleration has samples that are no numbers", "Look at how the rig converts what it records."
        )
    if not is_recording(acceleration.values):
        return Fault("the acceleration is a flat line", "Is the accelerometer powered, and its cable plugged in?")
    upright, inverted = (_driven_impact(acceleration, sweep.t_valve_ms, sign) for sign in (1.0, -1.0))
    if inverted is not None and upright is None:
        return Fault("the accelerometer is inverted", "Turn it, or negate its values: towards the tendon is positive.")
    return None


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


def _fault_of_rate(emg: Channel, trial: Trial) -> Fault | None:
    """The steepest edge of an EMG is the pulse's artefact, or belongs to what it evokes, or to the tap."""
    if trial.t_tms_ms is None:
        return None
    steepest_ms = steepest_edge(emg)
    evoked_ms = (trial.t_tms_ms + EVOKED_SPAN_MS[0], trial.t_tms_ms + EVOKED_SPAN_MS[1])
    tap_ms = tap_span_ms(trial)
    if steepest_ms is None or (tap_ms is not None and tap_ms[0] <= steepest_ms <= tap_ms[1]):
        return None
    may_be_evoked = steepest_ms <= trial.t_tms_ms + BLANKED_MS or not _is_sharp(emg)
    if evoked_ms[0] <= steepest_ms <= evoked_ms[1] and may_be_evoked:
        return None
    return Fault(
        f"the steepest edge of the EMG is at {steepest_ms:.0f} ms, but the device reports the pulse at "
        f"{trial.t_tms_ms:.0f} ms",
        "Is that edge the pulse's? Then check the sampling rate, and that all times are on the sweep's own clock.",
    )


def tap_span_ms(trial: Trial) -> tuple[float, float] | None:
    """When the tap may be in the EMG [ms on the sweep's clock]: the valve switches on and off before the hit.

    Args:
        trial: a trial; None is answered where it has no time of a tap.
    """
    begins = [ms for ms in (trial.t_valve_ms, trial.t_hit_ms) if ms is not None]
    if not begins:
        return None
    hit_ms = begins[0] + LATEST_HIT_MS if trial.t_hit_ms is None else trial.t_hit_ms
    return begins[0] - 2.0, hit_ms + JOLT_MS


def steepest_edge(emg: Channel) -> float | None:
    """When the EMG rises or falls most steeply [ms on the sweep's clock]; None where no edge stands out.

    Args:
        emg: the channel; an edge lasts a few samples, and spikes all over are none.
    """
    steps = np.abs(np.diff(emg.values))
    usual = float(np.median(steps)) if steps.size else 0.0
    if usual == 0 or steps.max() <= CLEAR * usual or (steps > 0.5 * steps.max()).mean() >= 0.01:
        return None
    return emg.t0_ms + 1000 * float(steps.argmax()) / emg.rate_hz


def _is_sharp(emg: Channel) -> bool:
    """Whether the EMG is steep within a millisecond only, as an artefact is and no MEP; few samples cannot say."""
    steps = np.abs(np.diff(emg.values))
    steep = np.flatnonzero(steps > 0.3 * steps.max())  # all flanks of an MEP, if it is one
    return emg.rate_hz >= LEAST_RATE_HZ and bool(1000 * (steep[-1] - steep[0] + 1) / emg.rate_hz <= SHARP_MS)


def _emg_unit(answer: Sweep | Measurement) -> str | None:
    """The unit that the EMG is described with; None where the device itself measures."""
    emg = answer.channels.get("emg") if isinstance(answer, Sweep) else None
    return None if emg is None else emg.unit


def _fault_of_level(trial: Trial, unit: str | None) -> Fault | None:
    rest_uv = trial.background_rms_uv
    if rest_uv is not None and rest_uv > TOO_LOUD_UV:
        return Fault(
            f"the EMG before the pulse has {_level(rest_uv)} RMS, more than any muscle's at rest",
            f"{_slip_of_unit(rest_uv, unit)}orrect the gain.",
        )
    if rest_uv is not None and rest_uv < TOO_QUIET_UV:
        return Fault(
            f"the EMG before the pulse has {rest_uv:.1g} µV RMS, less than any amplifier's noise",
            f"{_slip_of_unit(rest_uv, unit)}orrect the gain; is the amplifier on?",
        )
    wrong = None if trial.mep_mv is None else implausible_amplitude(trial.mep_mv)
    if trial.reason is MistrialReason.IMPLAUSIBLE and wrong is not None:
        return Fault(*wrong)
    return None


def _level(rest_uv: float) -> str:
    scale, unit = (1e6, "V") if rest_uv >= 1e6 else (1e3, "mV")
    return f"{float(f'{rest_uv / scale:.2g}'):g} {unit}"


def _slip_of_unit(rest_uv: float, unit: str | None) -> str:
    """Which unit the EMG is likely in, up to the c of "correct the gain"; without a likely one, no question."""
    if unit is None:
        return "Is background_rms_uv, as the device tells it, in µV? Convert it, or c"
    true_unit = _likely_unit(rest_uv, unit)
    if true_unit is None:
        return "C"
    return f"Is it in {true_unit}, and described as {unit}? Give the channel its unit, or c"


def _likely_unit(rest_uv: float, unit: str) -> str | None:
    """The unit in which EMG at rest would be nearest to its usual level; None where none makes it plausible."""
    levels_uv = {true: rest_uv * EMG_UNITS_MV[true] / EMG_UNITS_MV[unit] for true in ("V", "mV", "µV")}
    plausible = {true: uv for true, uv in levels_uv.items() if TOO_QUIET_UV <= uv <= TOO_LOUD_UV}
    return min(plausible, key=lambda true: abs(math.log(plausible[true] / USUAL_UV)), default=None)


def _explained(trial: Trial, limits: SignalLimits) -> str:
    """The reason of a mistrial, with the figure behind it."""
    if trial.reason is MistrialReason.BACKGROUND_ACTIVITY and trial.background_rms_uv is not None:
        return f"the muscle is tense: {trial.background_rms_uv:.0f} µV RMS, at most {limits.background_uv:g} at rest"
    if trial.reason is MistrialReason.ISI_OFF and trial.isi_ms is not None:
        return f"the realised ISI was {trial.isi_ms:.0f} ms, not the commanded {trial.commanded_isi_ms:g} ms"
    return f"{trial.reason}"
