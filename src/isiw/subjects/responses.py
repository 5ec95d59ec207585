"""From the ISI to facilitation, and from facilitation to the MEP: profiles, two kinds of people, and their noise.

A profile maps ISIs counted from the impact to facilitation in 0–1: a Gaussian [Kim2020, 4.2], skewed and flat-topped
ones (8.1, appendix B), and two peaks. Above the motor threshold a tap may depress the MEP too: facilitation is
negative (8.1.3).

`GainResponse` multiplies, with noise of a constant CV, as most methods assume. In `RecruitmentResponse` facilitation
and noise shift the input of a steep recruitment curve, so that responses go missing, are skewed, and vary less as they
grow (the model of [Goetz2014; Goetz2019], fitted to open single-trial data). Both add an EMG floor, which every sweep
has.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Protocol

import numpy as np

from isiw.checks import Checked, NonNegative, Number, Positive, Share, number
from isiw.errors import InvalidValueError
from isiw.lazy import scipy
from isiw.types import ArrayLike, FloatArray

_NODES, _NODE_WEIGHTS = np.polynomial.hermite_e.hermegauss(80)
_NODE_WEIGHTS = _NODE_WEIGHTS / _NODE_WEIGHTS.sum()


class Profile(Protocol):
    """Facilitation by ISI: at most 1, and negative if the tap depresses the MEP."""

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        """Facilitation at ISIs counted from the impact [ms], same shape."""


@dataclass(frozen=True)
class PeakProfile(Checked):
    """One peak whose flanks fall to exp(-2) at both ends of its span.

    Args:
        start_ms: where the rising flank has exp(-2) of the peak [ms from the impact].
        width_ms: from there to the same level of the falling flank [ms].
        peak_at: where the peak lies, as a share of the width; 0.5 is symmetric.
        exponent: 2 is Gaussian (SD = width/4 if symmetric), more is flatter on top with steeper flanks.
    """

    start_ms: Number
    width_ms: Positive
    peak_at: Annotated[float, partial(number, above=0, below=1)] = 0.5
    exponent: Positive = 2.0

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        """Facilitation in 0–1 at ISIs counted from the impact [ms], same shape."""
        share = (np.asarray(isi_ms, dtype=np.float64) - self.start_ms) / self.width_ms - self.peak_at
        flank = np.where(share < 0, self.peak_at, 1.0 - self.peak_at)
        with np.errstate(over="ignore"):  # an ISI may be as far off as a number can be: nothing is facilitated there
            return np.asarray(np.exp(-2.0 * np.abs(share / flank) ** self.exponent))


@dataclass(frozen=True)
class TwoPeakProfile(Checked):
    """Two Gaussians at 0.27 and 0.73 of the span, each with an SD of width/7.5.

    Args:
        start_ms: start of the span [ms from the impact].
        width_ms: width of the span [ms].
        first: height of the first peak.
        second: height of the second peak; the higher of the two has 1.
    """

    start_ms: Number
    width_ms: Positive
    first: Share
    second: Share

    def __post_init__(self) -> None:
        super().__post_init__()
        if 1 not in {self.first, self.second}:
            raise InvalidValueError("the higher peak has height 1", got=(self.first, self.second))

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        """Facilitation in 0–1 at ISIs counted from the impact [ms], same shape."""
        share = (np.asarray(isi_ms, dtype=np.float64) - self.start_ms) / self.width_ms
        peaks = [np.exp(-0.5 * ((share - at) * 7.5) ** 2) for at in (0.27, 0.73)]
        return np.asarray(self.first * peaks[0] + self.second * peaks[1])


@dataclass(frozen=True)
class OpposedProfile(Checked):
    """A segment that facilitates and one that depresses, in either order.

    Args:
        facilitated: the facilitation.
        depressed: where the tap depresses, as a share of the deepest depression.
        depth: the deepest depression, in units of the largest facilitation.
    """

    facilitated: PeakProfile
    depressed: PeakProfile
    depth: Positive

    def __call__(self, isi_ms: ArrayLike) -> FloatArray:
        """Facilitation at ISIs counted from the impact [ms], negative where the tap depresses, same shape."""
        return self.facilitated(isi_ms) - self.depth * self.depressed(isi_ms)


def log_normal(rng: np.random.Generator, median: float, log_sd: float) -> float:
    """One draw of a log-normal law."""
    return float(median * np.exp(log_sd * rng.standard_normal()))


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

    def sample_mv(self, rng: np.random.Generator) -> float:
        """The amplitude of one sweep [mV]."""
        return log_normal(rng, self.median_mv, self.log_sd)


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
            facilitation: at most 1; negative if the tap depresses.
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
        max_response_probability: None if every trial responds; otherwise a trial responds with this probability
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
            facilitation: at most 1; negative if the tap depresses.
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
