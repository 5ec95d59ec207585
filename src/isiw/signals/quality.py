"""The judgement of one sweep: an accepted trial with its numbers, or a mistrial with its reason."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from isiw.design import DesignSpace
from isiw.signals.mep import background_rms_uv, mep_amplitude
from isiw.trials import MistrialReason, Status, Stimulus, Sweep

__all__ = ["Judged", "SignalLimits", "judge"]


@dataclass(frozen=True)
class SignalLimits:
    """What a sweep must keep to be accepted.

    Args:
        mep_window_ms: where the MEP is sought [ms after the pulse].
        background_uv: the most EMG at rest before the pulse [µV RMS].
    """

    mep_window_ms: tuple[float, float] = (15.0, 35.0)
    background_uv: float = 10.0


@dataclass(frozen=True)
class Judged:
    """What a sweep came to: accepted, or a mistrial with its reason. All times are on the sweep's clock."""

    status: Status = Status.ACCEPTED
    reason: MistrialReason | None = None
    isi_ms: float | None = None
    isi_sd_ms: float = 0.0
    mep_mv: float | None = None
    background_rms_uv: float | None = None
    t_valve_ms: float | None = None
    t_hit_ms: float | None = None
    t_tms_ms: float | None = None


def judge(sweep: Sweep, stimulus: Stimulus, space: DesignSpace, limits: SignalLimits | None = None) -> Judged:
    """Judge one sweep.

    Args:
        sweep: the recorded waveforms and what the device knows of their timing.
        stimulus: what was commanded.
        space: says which event the ISI counts from, and how far it may be off.
        limits: what the sweep must keep.
    """
    limits = limits or SignalLimits()
    emg, t_tms_ms = sweep.channels.get("emg"), sweep.t_tms_ms
    first_ms = sweep.t_hit_ms if space.reference == "impact" else sweep.t_valve_ms
    timed = Judged(t_valve_ms=sweep.t_valve_ms, t_hit_ms=sweep.t_hit_ms, t_tms_ms=t_tms_ms)
    if emg is None or not np.isfinite(emg.values).all() or np.ptp(emg.values) == 0:
        return _mistrial(timed, MistrialReason.MISSING_CHANNEL)
    if t_tms_ms is None:
        return _mistrial(timed, MistrialReason.NO_PULSE)
    if stimulus.isi_ms is not None:
        if first_ms is None:
            return _mistrial(timed, MistrialReason.NO_IMPACT)
        timed = replace(timed, isi_ms=t_tms_ms - first_ms, isi_sd_ms=sweep.isi_sd_ms)
        if abs(t_tms_ms - first_ms - stimulus.isi_ms) > space.tolerance_ms:
            return _mistrial(timed, MistrialReason.ISI_OFF)
    background = float(background_rms_uv(emg.values, emg.rate_hz, t_tms_ms - emg.t0_ms))
    timed = replace(timed, background_rms_uv=background)
    if background > limits.background_uv:
        return _mistrial(timed, MistrialReason.BACKGROUND_ACTIVITY)
    mep_mv = mep_amplitude(emg.values, emg.rate_hz, t_tms_ms - emg.t0_ms, limits.mep_window_ms)
    return replace(timed, mep_mv=float(mep_mv))


def _mistrial(judged: Judged, reason: MistrialReason) -> Judged:
    return replace(judged, status=Status.MISTRIAL, reason=reason)
