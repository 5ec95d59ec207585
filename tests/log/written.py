"""A header, and trials as a session writes them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from isiw.design import DesignSpace
from isiw.devices.info import DeviceInfo
from isiw.devices.limits import Limits
from isiw.log.headers import Header, StrategyRecipe
from isiw.log.schema import Intent, Waveform
from isiw.log.writer import LogWriter
from isiw.signals.limits import SignalLimits
from isiw.sweeps import Channel
from isiw.trials import Status, Trial

SPACE = DesignSpace(0, 200, reference="impact")


def make_header(**changes: Any) -> Header:
    values: dict[str, Any] = {
        "isiw_version": "0.1.0",
        "created": "2026-11-21T10:00:00+00:00",
        "subject": "P07",
        "seed": 4,
        "strategy": StrategyRecipe(name="default", seed=4, settings={"max_trials": 9}),
        "space": SPACE,
        "limits": Limits.of_space(SPACE),
        "device": DeviceInfo("bench", "impact", channels={"emg": "mV"}),
        "signals": SignalLimits(),
        "config": {"nested": {"answer": 42}},
    }
    return Header(**(values | changes))


def write_trials(log: LogWriter, trials: Iterable[int]) -> None:
    """Write as a session does: intent, sync, waveform, trial, sync."""
    rng = np.random.default_rng(0)
    for k in trials:
        log.append(Intent(trial=k, isi_ms=float(k)))
        log.sync()
        log.append(Waveform.of(k, Channel(rng.standard_normal(50), 3000.0, "mV")), "emg")
        log.append(Trial(k, Status.ACCEPTED, float(k), isi_ms=float(k), mep_mv=0.01 * k))
        log.sync()
