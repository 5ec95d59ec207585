"""From waveforms to numbers: impact, MEP, background, and the judgement of a trial."""

from isiw.signals.mep import background_rms_uv, mep_amplitude
from isiw.signals.quality import Judged, SignalLimits, judge

__all__ = ["Judged", "SignalLimits", "background_rms_uv", "judge", "mep_amplitude"]
