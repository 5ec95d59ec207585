"""The judgement of one sweep: an accepted trial with its numbers, or a mistrial with its reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from isiw.signals.mep import background_rms_uv, mep_amplitude
from isiw.trials import MistrialReason, Stimulus, Sweep
from isiw.types import Reference

__all__ = ["Judged", "QualitySettings", "judge"]


@dataclass(frozen=True)
class QualitySettings:
    """What makes a trial trustworthy.

    Args:
        reference: the event that ISIs count from.
        max_background_rms_uv: largest background EMG [µV RMS].
        mep_window_ms: where the MEP is looked for, from the pulse [ms].
    """

    reference: Reference = "impact"
    max_background_rms_uv: float = 10.0
    mep_window_ms: tuple[float, float] = (15.0, 35.0)


@dataclass(frozen=True)
class Judged:
    """What a sweep came to. `reason` is None where the trial is accepted."""

    reason: MistrialReason | None
    isi_ms: float | None = None
    isi_sd_ms: float = 0.0
    mep_mv: float | None = None
    background_rms_uv: float | None = None
    t_valve_ms: float | None = None
    t_hit_ms: float | None = None
    t_tms_ms: float | None = None

    @property
    def accepted(self) -> bool:
        """Whether the trial may be told."""
        return self.reason is None


def judge(sweep: Sweep, stimulus: Stimulus, settings: QualitySettings) -> Judged:
    """Judge one sweep.

    Args:
        sweep: the recorded waveforms and times.
        stimulus: what was commanded.
        settings: what makes a trial trustworthy.
    """
    emg, t_tms_ms = sweep.channels.get("emg"), sweep.t_tms_ms
    if t_tms_ms is None:
        return Judged(MistrialReason.NO_PULSE, t_valve_ms=sweep.t_valve_ms, t_hit_ms=sweep.t_hit_ms)
    first_ms = sweep.t_hit_ms if settings.reference == "impact" else sweep.t_valve_ms
    times = {"t_valve_ms": sweep.t_valve_ms, "t_hit_ms": sweep.t_hit_ms, "t_tms_ms": t_tms_ms}
    if stimulus.isi_ms is not None and first_ms is None:
        return Judged(MistrialReason.NO_IMPACT, **times)
    isi_ms = None if stimulus.isi_ms is None or first_ms is None else t_tms_ms - first_ms
    if emg is None or not np.isfinite(emg.values).all() or np.ptp(emg.values) == 0:
        return Judged(MistrialReason.MISSING_CHANNEL, isi_ms, sweep.isi_sd_ms, **times)
    from_first_sample_ms = t_tms_ms - emg.t0_ms
    background = float(background_rms_uv(emg.values, emg.rate_hz, from_first_sample_ms))
    mep_mv = float(mep_amplitude(emg.values, emg.rate_hz, from_first_sample_ms, settings.mep_window_ms))
    reason = MistrialReason.BACKGROUND_ACTIVITY if background > settings.max_background_rms_uv else None
    return Judged(reason, isi_ms, sweep.isi_sd_ms, mep_mv, background, **times)
