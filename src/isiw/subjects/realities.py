"""People in whose sessions something else than the ISI moves an MEP, or is not as most methods assume.

Half of the people of a cohort have a window, the even numbers, and half have none, unless the cohort says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final, TypeAlias

import numpy as np

from isiw.subjects.changes import Change, TapResponse
from isiw.subjects.subject import SimulatedSubject

_Changed: TypeAlias = Callable[[np.random.Generator, SimulatedSubject], SimulatedSubject]

COARSE_STEPS_MV: Final = (0.005, 0.010, 0.020)
"""Steps of converters and displays [mV]."""


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _step(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    """A coil re-seated, a gain, an electrode: by a factor of LN(4, .4), up or down."""
    trial, log_factor = int(rng.integers(4, 31)), float(np.log(4.0) + 0.4 * rng.standard_normal())
    return replace(subject, change=Change(trial, trial, log_gain=_sign(rng) * log_factor))


def _ramp(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    return replace(subject, change=Change(1, 60, log_gain=_sign(rng) * float(np.log(rng.uniform(2, 5)))))


def _retuned(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    trial, change_pct = int(rng.integers(5, 31)), float(rng.uniform(6, 14))
    return replace(subject, change=Change(trial, trial, intensity_pct_rmt=_sign(rng) * change_pct))


def _fading(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    return replace(subject, change=Change(half_life=float(rng.uniform(15, 60))))


def _moving(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    first, last = int(rng.integers(5, 16)), int(rng.integers(20, 36))
    return replace(subject, change=Change(first, last, shift_ms=25.0 * float(rng.standard_normal())))


def _tap_response(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    start_ms, duration_ms = float(rng.uniform(18, 60)), float(rng.uniform(10, 40))
    median_mv = float(0.1 * np.exp(0.7 * rng.standard_normal()))
    return replace(subject, tap_response=TapResponse(start_ms, duration_ms, median_mv, float(rng.uniform(0.2, 0.9))))


def _coarse(rng: np.random.Generator, subject: SimulatedSubject) -> SimulatedSubject:
    return replace(subject, amplitude_step_mv=float(rng.choice(COARSE_STEPS_MV)))


CHANGED: Final[Mapping[str, _Changed]] = MappingProxyType(
    {
        "step": _step,
        "ramp": _ramp,
        "retuned": _retuned,
        "fading": _fading,
        "moving": _moving,
        "tap-response": _tap_response,
        "coarse": _coarse,
    }
)
"""What makes a usual person one of the cohort, by its name."""
