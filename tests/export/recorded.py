"""Logs with raw sweeps, written without a device."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from isiw.findings import Kind
from isiw.log.schema import EstimateRecord, Event, Intent, Record, Waveform
from isiw.log.writer import LogWriter
from isiw.sweeps import Channel
from isiw.trials import Status, Trial
from isiw.visit import Visit
from log.written import make_header

RATE_HZ, SAMPLES = 3000.0, 451
"""As of many amplifiers: no duration that a BDF file can write holds a sweep, so that its records are shorter."""

VISIT = Visit(day=2, operator="Anna", muscle="FCR", electrodes="belly-tendon")


def emg_mv(trial: int, samples: int = SAMPLES) -> Any:
    return np.random.default_rng(trial).normal(0.0, 0.4, samples)


def sweep(trial: int, rate_hz: float = RATE_HZ, samples: int = SAMPLES) -> dict[str, Channel]:
    emg = Channel(emg_mv(trial, samples), rate_hz, "mV", -50.0)
    return {"emg": emg, "acceleration": Channel(5.0 * emg.values, rate_hz, "m/s²", -50.0)}


def write_sweeps(
    path: Path, sweeps: Mapping[int, Mapping[str, Channel]], *more: Record, lost: int | None = None, **header: Any
) -> Path:
    """A log with these sweeps, by trial; the pulse comes at 20 ms of the sweep's clock, 30 ms after the impact.

    Of one trial the record may be lost.
    """
    with LogWriter.create(path, make_header(**({"visit": VISIT} | header))) as log:
        for trial, channels in sweeps.items():
            log.append(Intent(trial=trial, isi_ms=30.0, t_s=5.0 + 6.5 * trial))
            for name, channel in channels.items():
                log.append(Waveform.of(trial, channel), name)
            if trial != lost:
                log.append(_trial(trial))
            log.append(EstimateRecord(trial=trial, probability=0.8, segments_ms=(20.0, 60.0), end_high_ms=float("inf")))
            log.sync()
        for record in more:
            log.append(record)
    return path


def _trial(trial: int) -> Trial:
    if trial == 1:
        return Trial(trial, Status.MISTRIAL, 30.0, Kind.NO_IMPACT, t_tms_ms=20.0)
    return Trial(
        trial, Status.ACCEPTED, 30.0, isi_ms=30.0, mep_mv=0.1 + trial / 7, background_rms_uv=2.0, t_hit_ms=-10.0,
        t_tms_ms=20.0,
    )  # fmt: skip


def alone(trial: int) -> tuple[Intent, Trial]:
    """What a log tells of a conditioning stimulus without the magnetic pulse."""
    given = Trial(trial, Status.ACCEPTED, None, tap_alone=True, t_hit_ms=-10.0)
    return Intent(trial=trial, isi_ms=None, t_s=60.0, tap_alone=True), given


def note(text: str) -> Event:
    return Event(kind="note", trial=0, text=text)
