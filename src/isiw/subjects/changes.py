"""Influences on an MEP besides the ISI and chance: changes during a session, the tap's own response, coarse amplitudes.

Coil, gain or intensity change all that is evoked; habituation and plasticity change the enhancement; and a tap may
evoke a response of its own in the muscle that is recorded [Kim2020, 2.2, Fig. 3.7].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from isiw.checks import Checked, Count, NonNegative, Number, Positive, Share
from isiw.errors import InvalidValueError
from isiw.types import FloatArray


@dataclass(frozen=True)
class Plasticity(Checked):
    """Dependence of a person's gain on the pairs that they have had: the after-effect of pairs, for TMS alone, too.

    A pair moves the log gain towards a limit, by a share 1 - exp(-u / pairs) of what is left, u its facilitation: so it
    saturates. Without pairs it returns to what it was, by half in `half_life_min`.

    Args:
        limit: change of the log gain after very many pairs, natural log; above 0 the MEPs grow, below 0 they shrink.
        pairs: after so many pairs at the best ISI, 63 % of the change has come.
        least: facilitation from which on a pair counts as one inside the window; others move the gain to `outside`.
        outside: change of the log gain after very many pairs outside the window, each as strong as one at the best ISI.
        half_life_min: time in which half of the change is lost [min]; None if it stays.
        turns_after: after so many pairs at the best ISI further ones push to the opposite of the limit; None if they
            do not.
    """

    limit: Number
    pairs: Positive = 100.0
    least: Share = 0.0
    outside: Number = 0.0
    half_life_min: Positive | None = None
    turns_after: Positive | None = None

    def after(self, log_gain: float, facilitation: float, dose: float) -> float:
        """The change of the log gain after one more pair.

        Args:
            log_gain: the change before it, natural log.
            facilitation: of the pair, at most 1.
            dose: the facilitation of all pairs inside the window before it, summed.
        """
        inside = facilitation > 0 and facilitation >= self.least
        strength = facilitation if inside else float(self.least > 0)
        limit = self.limit if inside else self.outside
        if inside and self.turns_after is not None and dose >= self.turns_after:
            limit = -limit
        return limit + (log_gain - limit) * math.exp(-strength / self.pairs)

    def left(self, log_gain: float, minutes: float) -> float:
        """What is left of a change of the log gain after some time without pairs.

        Args:
            log_gain: the change before, natural log.
            minutes: the time [min].
        """
        return log_gain if self.half_life_min is None else log_gain * 2.0 ** (-minutes / self.half_life_min)


MEP_WINDOW_MS: Final = (15.0, 35.0)
"""The MEP window [ms after the magnetic pulse] [Kim2020, 5.2.3]."""

_STEP_MS: Final = 0.5
_AFTER_PULSE_MS: Final = np.arange(MEP_WINDOW_MS[0], MEP_WINDOW_MS[1] + _STEP_MS / 2, _STEP_MS)
_MEP_CENTRE_MS, _MEP_LOBE_MS = 25.6, 4.3
"""Middle of a forearm muscle's MEP, and from there to its peak and its trough [ms] (docs/physiology.md)."""

_OSCILLATION_HZ: Final = 80.0
"""Frequency of the tap's response: that of surface EMG."""


@dataclass(frozen=True)
class Change(Checked):
    """A change in the course of a session: none before trial `first`, whole from trial `last` on, linear in between.

    Args:
        first: number of the first trial that is changed, from 1 on.
        last: number of the trial from which on the change is complete; `first` is a step.
        log_gain: change of everything that is evoked, natural log.
        intensity_pct_rmt: change of the intensity [% RMT]; of a person with a recruitment curve.
        shift_ms: by how much the window moves [ms].
        half_life: after so many trials the enhancement is half of what it was at first; None if it stays.
    """

    first: Count = 1
    last: Count = 1
    log_gain: Number = 0.0
    intensity_pct_rmt: Number = 0.0
    shift_ms: Number = 0.0
    half_life: Positive | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.last < self.first:
            raise InvalidValueError("a change ends before it begins", got=(self.first, self.last))

    def share(self, trial: int) -> float:
        """The share of the change that there is at a trial, by its number from 1 on, in 0–1."""
        return float(np.clip((trial - self.first + 1) / (self.last - self.first + 1), 0.0, 1.0))

    def enhancement(self, trial: int) -> float:
        """The factor on the enhancement at a trial, by its number from 1 on."""
        return 1.0 if self.half_life is None else float(2.0 ** (-trial / self.half_life))


@dataclass(frozen=True)
class TapResponse(Checked):
    """The tap's own response in the recorded muscle: a burst of fixed course and varying size.

    Args:
        start_ms: when it begins [ms after the hit].
        duration_ms: how long it lasts [ms].
        median_mv: median of its peak-to-peak amplitude [mV].
        log_sd: SD of the amplitude from trial to trial, natural log.
    """

    start_ms: Number
    duration_ms: Positive
    median_mv: Positive
    log_sd: NonNegative

    def course(self, after_hit_ms: FloatArray) -> FloatArray:
        """The burst at some times after the hit [ms], as a share of its peak-to-peak amplitude; same shape."""
        phase_ms = np.asarray(after_hit_ms, dtype=np.float64) - self.start_ms
        whole = _burst(np.linspace(0.0, self.duration_ms, 401), self.duration_ms)
        return _burst(phase_ms, self.duration_ms) / np.ptp(whole)

    def sample_mv(self, rng: np.random.Generator) -> float:
        """The peak-to-peak amplitude of one trial [mV]."""
        return float(self.median_mv * np.exp(self.log_sd * rng.standard_normal()))


def amplitude_of_both_mv(evoked_mv: float, tap: TapResponse, tap_mv: float, isi_ms: float) -> float:
    """Peak-to-peak amplitude of what is in the MEP window: the MEP, and what the tap evoked [mV]."""
    return float(np.ptp(evoked_mv * _MEP + tap_mv * tap.course(isi_ms + _AFTER_PULSE_MS)))


def _burst(phase_ms: FloatArray, duration_ms: float) -> FloatArray:
    """An oscillation that swells and fades; nothing before its beginning and after its end."""
    inside = (phase_ms >= 0) & (phase_ms <= duration_ms)
    envelope = np.sin(np.pi * phase_ms / duration_ms) ** 2
    wave = np.sin(2e-3 * np.pi * _OSCILLATION_HZ * (phase_ms - duration_ms / 2) + np.pi / 4)
    return np.where(inside, envelope * wave, 0.0)


_LOBES: Final = (_AFTER_PULSE_MS - _MEP_CENTRE_MS) / _MEP_LOBE_MS
_COURSE: Final = -_LOBES * np.exp(0.5 * (1.0 - _LOBES**2))
_MEP: Final = _COURSE / np.ptp(_COURSE)
"""An MEP of peak-to-peak amplitude 1 at `_AFTER_PULSE_MS`."""
