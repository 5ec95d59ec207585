"""From waveforms to numbers: impact, MEP, background, and the judgement of a trial."""

from isiw.signals.events import TapEvents, detect_events, load_cell_times, sweep_events
from isiw.signals.impact import Impact, ImpactDetector, impact_time, impact_times
from isiw.signals.judgement import judge, judge_measurement, wrong_isi
from isiw.signals.limits import SignalLimits
from isiw.signals.mep import (
    MEP_WINDOWS_MS,
    background_rms,
    mep_amplitude,
    mep_amplitudes,
    mep_onset,
    mep_onsets,
    mep_present,
)
from isiw.signals.waveforms import is_saturated

__all__ = [
    "MEP_WINDOWS_MS",
    "Impact",
    "ImpactDetector",
    "SignalLimits",
    "TapEvents",
    "background_rms",
    "detect_events",
    "impact_time",
    "impact_times",
    "is_saturated",
    "judge",
    "judge_measurement",
    "load_cell_times",
    "mep_amplitude",
    "mep_amplitudes",
    "mep_onset",
    "mep_onsets",
    "mep_present",
    "sweep_events",
    "wrong_isi",
]
