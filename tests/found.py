"""What is found in a trial, or in amplitudes, as a session would find it."""

from __future__ import annotations

from collections.abc import Sequence

from isiw.findings import Finding
from isiw.signals.plausible import Counted
from isiw.signals.rig import Evidence
from isiw.signals.watch import findings
from isiw.sweeps import Measurement, Sweep
from isiw.trials import Trial


def fault_of(answer: Sweep | Measurement, trial: Trial) -> Finding | None:
    """The first finding in a trial."""
    return next(findings(Evidence(trial, answer)), None)


def doubt_of(
    meps_mv: Sequence[float], detection_limit_mv: float | None = None, isis_ms: Sequence[float | None] | None = None
) -> Finding | None:
    """The first finding in the amplitudes of several trials."""
    isis_ms = isis_ms or [None] * len(meps_mv)
    told = [Counted(mep_mv, isi_ms) for mep_mv, isi_ms in zip(meps_mv, isis_ms, strict=True)]
    return next(findings(Evidence(told=told, detection_limit_mv=detection_limit_mv)), None)
