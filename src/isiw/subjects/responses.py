"""From facilitation to the MEP: two kinds of people, and where their noise enters.

`GainResponse` multiplies: the MEP grows in proportion to the facilitation, with noise of a constant CV. It is the kind
of noise that most methods assume. `RecruitmentResponse` is how MEPs near threshold behave: facilitation and noise both
shift the input of a steep recruitment curve, so responses go missing, are skewed, and vary less as they grow
(the model of [Goetz2014; Goetz2019], with parameters fitted to open single-trial data).

Both add an EMG floor: the peak-to-peak amplitude that a sweep has without any response.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Protocol

import numpy as np

from isiw.checks import Checked, NonNegative, Positive, number
from isiw.lazy import scipy
from isiw.types import ArrayLike, FloatArray

_NODES, _NODE_WEIGHTS = np.polynomial.hermite_e.hermegauss(80)
_NODE_WEIGHTS = _NODE_WEIGHTS / _NODE_WEIGHTS.sum()


@dataclass(frozen=True)
class EmgFloor(Checked):
    """Peak-to-peak amplitude of a sweep without a response: log-normal.

    Args:
        median_mv: its median [mV].
        log_sd: its SD from trial to trial, natural log.
    """

    median_mv: Positive
    log_sd: NonNegative

    @property
    def mean_mv(self) -> float:
        """Its expectation [mV]."""
        return self.median_mv * float(np.exp(0.5 * self.log_sd**2))


@dataclass(frozen=True)
class TrialNoise:
    """Noise that has a memory from trial to trial: kept by the responder, not by the response.

    Args:
        input_z: standard normal noise on the input of the recruitment curve.
        log_gain: drift, start-up and plasticity of the response's amplitude, natural log.
    """

    input_z: float = 0.0
    log_gain: float = 0.0


class ResponseCurve(Protocol):
    """One person's MEP, given how strongly the tap facilitates."""

    @property
    def floor(self) -> EmgFloor:
        """The EMG floor."""

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        """Expected MEP above the EMG floor [mV], without drift, by facilitation of at most 1; same shape."""

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        """One trial's MEP above the EMG floor [mV].

        Args:
            facilitation: at most 1; negative where the tap depresses.
            noise: that of the trial.
            rng: what else is drawn from.
        """


@dataclass(frozen=True)
class GainResponse(Checked):
    """The MEP is the facilitation times a gain, with gamma-distributed noise of constant CV.

    Args:
        floor: the EMG floor.
        gain_mv: expected MEP above the floor at the best ISI [mV].
        cv: coefficient of variation of the gain noise.
        max_response_probability: None where every trial responds; otherwise a trial responds with this probability
            times the square root of the facilitation, and shows only the floor if not.
    """

    floor: EmgFloor
    gain_mv: NonNegative
    cv: Positive
    max_response_probability: Annotated[float, partial(number, least=0, most=1)] | None = None

    def response_probability(self, facilitation: ArrayLike) -> FloatArray:
        """Probability that a trial responds, by facilitation; same shape."""
        level = np.asarray(facilitation, dtype=np.float64)
        if self.max_response_probability is None:
            return np.ones_like(level)
        return self.max_response_probability * np.sqrt(level)

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        """Expected MEP above the EMG floor [mV], without drift, by facilitation in 0–1; same shape."""
        level = np.asarray(facilitation, dtype=np.float64)
        return self.gain_mv * level * self.response_probability(level)

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        """One trial's MEP above the EMG floor [mV]."""
        responds = rng.random() < float(self.response_probability(facilitation))
        gain = rng.gamma(self.cv**-2, self.cv**2) * np.exp(noise.log_gain)
        return float(self.gain_mv * facilitation * gain) if responds else 0.0


@dataclass(frozen=True)
class RecruitmentResponse(Checked):
    """The recruitment curve with noise on its input and its output.

    `s = A / (1 + exp(-k (x + sigma_x z1 - x50))) exp(sigma_y z2)` with `x = intensity + boost * facilitation`.

    Args:
        floor: the EMG floor.
        amplitude_mv: A, the largest MEP [mV].
        slope_per_pct: k [1 / % RMT].
        x50_pct_rmt: intensity of the half-maximal MEP [% RMT].
        boost_pct_rmt: shift of the effective intensity at the best ISI [% RMT].
        sigma_x_pct_rmt: SD of the input noise [% RMT].
        sigma_y: SD of the output noise, natural log.
        intensity_pct_rmt: stimulation intensity [% RMT].
    """

    floor: EmgFloor
    amplitude_mv: Positive
    slope_per_pct: Positive
    x50_pct_rmt: Positive
    boost_pct_rmt: NonNegative
    sigma_x_pct_rmt: NonNegative
    sigma_y: NonNegative
    intensity_pct_rmt: Positive = 90.0

    def evoked_mv(self, facilitation: ArrayLike, input_z: ArrayLike) -> FloatArray:
        """MEP above the floor before output noise [mV], by facilitation and input noise; broadcast shape.

        Args:
            facilitation: at most 1; negative where the tap depresses.
            input_z: input noise in SDs.
        """
        x = self.intensity_pct_rmt + self.boost_pct_rmt * np.asarray(facilitation, dtype=np.float64)
        drive = self.slope_per_pct * (x + self.sigma_x_pct_rmt * np.asarray(input_z) - self.x50_pct_rmt)
        return np.asarray(self.amplitude_mv * scipy.special.expit(drive))

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        """Expected MEP above the EMG floor [mV], without drift, by facilitation of at most 1; same shape."""
        by_node = self.evoked_mv(np.asarray(facilitation, dtype=np.float64)[..., None], _NODES)
        return np.asarray(by_node @ _NODE_WEIGHTS * np.exp(0.5 * self.sigma_y**2))

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        """One trial's MEP above the EMG floor [mV]."""
        output = np.exp(self.sigma_y * rng.standard_normal() + noise.log_gain)
        return float(self.evoked_mv(facilitation, noise.input_z) * output)
