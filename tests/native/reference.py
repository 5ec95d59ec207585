"""The law of particles in plain NumPy and double precision, one particle and one trial at a time.

What the compiled engine is tested against: docs/model.md in code, by the names that latents have in the prior.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.special

Latents = Mapping[str, float]

NODES: Final = 8
REACH: Final = 2.6  # of the nodes of the noise on the input [SD of what is on them]
BETWEEN: Final = 0.4 * 2.0 * REACH / (NODES - 1)  # SD of what lies between two nodes
ON_NODES: Final = math.sqrt(1.0 - BETWEEN**2)
_AT: Final = np.linspace(-REACH, REACH, NODES)
NODES_AT, WEIGHTS = ON_NODES * _AT, np.exp(-0.5 * _AT**2) / np.exp(-0.5 * _AT**2).sum()
FAR_BELOW: Final = 15.0  # saturation, in logits: where noise of constant CV sits
CORNER: Final = 0.05  # how much of the variance between nodes rounds the corner at a threshold
OUTLIERS, OUTLIER_LOG_RANGE = 0.03, (math.log(2.0), math.log(200.0))
STARTUP, PERSISTENCE = (0.29, 0.20), 0.97
FADING, GROWN_AFTER, INTENSITY_PCT = 0.04, 40.0, 9.0
ISI_NODES: Final = ((-math.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (math.sqrt(3.0), 1 / 6))

CONSTANT_CV, MISSING, RECRUITMENT, ALL_OR_NONE, RECTIFIED = range(5)
GAUSSIAN, SKEWED, PLATEAU, TWO_PEAK = range(4)
NO_CHANGE, LEVEL, INTENSITY, ENHANCEMENT, SCALE = range(5)


@dataclass(frozen=True)
class Trial:
    """What is known of a trial; amplitudes are ends of the log MEP [log mV]."""

    order: int
    isi_ms: float  # NaN is TMS alone
    low: float
    high: float
    isi_sd_ms: float = 0.0
    known_mv: float = 0.0
    known_sd_mv: float = 0.0
    log_offset: float = 0.0
    shift_pct_rmt: float = 0.0
    enhancement: float = 1.0
    log_by_curves: float = math.nan  # what it is to kinds of noise without a curve; NaN for their own law


@dataclass(frozen=True)
class Particle:
    """A person as one particle has them: latents by name, and kinds of profile, noise, enhancement and change."""

    z: Latents
    shape: int
    noise: int
    present: bool
    change: int

    def of_curve(self, name: str) -> float:
        """A latent of the particle's recruitment curve."""
        return self.z[f"rectified_{name}" if self.noise == RECTIFIED else name]

    @property
    def curved(self) -> bool:
        """Whether it has a recruitment curve."""
        return self.noise in {RECRUITMENT, RECTIFIED}

    def changed(self, order: int, kind: int) -> float:
        """The size of a change of a kind that has come by a trial, else 0; what is not a curve's is a level."""
        own = self.change
        if own == INTENSITY and not self.curved:
            own = LEVEL
        there = own == kind and order >= math.exp(self.z["log_changed_after"])
        return self.z["change_size"] if there else 0.0

    def enhancement(self, order: int) -> float:
        """The share of the enhancement that there is at a trial."""
        if self.change != ENHANCEMENT:
            return 1.0
        fading = FADING * self.z["change_size"]
        return math.pow(2.0, -abs(fading) * (order if fading > 0 else max(GROWN_AFTER - order, 0.0)))

    def facilitation(self, isi_ms: float) -> float:
        """Facilitation at an ISI, in 0 to 1."""
        if not self.present or math.isnan(isi_ms):
            return 0.0
        start_ms, width_ms = self.z["start_ms"], math.exp(self.z["log_width_ms"])
        form, share = math.erf(self.z["form"] / math.sqrt(2.0)), (isi_ms - start_ms) / width_ms
        if self.shape == TWO_PEAK:
            apart, size = abs(form) > 0.75, abs(form)
            sd = 1 / 12 if apart else 1 / 7.5
            lower = 1.0 - 0.7 * ((size - 0.75) / 0.25 if apart else size / 0.75)
            heights = (lower, 1.0) if form < 0 else (1.0, lower)
            bells = zip(heights, (0.27, 0.73), strict=True)
            return sum(height * math.exp(-0.5 * ((share - at) / sd) ** 2) for height, at in bells)
        peak = 0.5 + 0.33 * form if self.shape == SKEWED else 0.5
        distance = (peak - share) / peak if share < peak else (share - peak) / (1.0 - peak)
        power = math.exp(0.75 * (form + 1.0)) if self.shape == PLATEAU else 1.0
        return math.exp(-2.0 * math.pow(min(max(distance**2, 1e-12), 1e6), power))


def nodes_of(particle: Particle) -> tuple[np.ndarray, np.ndarray]:
    """Noise on the input at each node, and the variance of what lies between, where the sigmoid is steepest."""
    z = particle.z
    if particle.curved:
        sd = math.exp(particle.of_curve("log_input_sd"))
        return sd * NODES_AT, np.full(NODES, (BETWEEN * sd) ** 2)
    cv = math.exp(z["log_size_cv" if particle.noise == ALL_OR_NONE else "log_cv"])
    root = 1.0 - cv**2 / 9.0 + NODES_AT * cv / 3.0  # Wilson and Hilferty's, of gamma noise
    log_quantiles = 3.0 * np.log(np.maximum(root, 0.02))
    between = (BETWEEN * cv / np.maximum(root, 0.2)) ** 2
    mean = (WEIGHTS * np.exp(log_quantiles + 0.5 * between)).sum()
    return log_quantiles - math.log(mean) - FAR_BELOW, between


def drive_and_chance(particle: Particle, level: float, shift_pct_rmt: float) -> tuple[float, float]:
    """The drive in logits at a facilitation, and the probability of a response."""
    z = particle.z
    if particle.curved:
        slope = math.exp(particle.of_curve("log_slope"))
        rest = slope * particle.of_curve("rest")
        if particle.noise == RECTIFIED:
            rest += scipy.special.logit(onset_of(particle))
        return rest + slope * math.exp(particle.of_curve("log_boost")) * level + slope * shift_pct_rmt, 1.0
    if particle.noise == ALL_OR_NONE:
        most, least = scipy.special.expit([z["switched_on"], z["switched_off"]])
        return 0.0, least + (most - least) * level
    chance = scipy.special.expit(z["reliability"]) * math.sqrt(level) if particle.noise == MISSING else 1.0
    return math.log(max(level, 1e-9)), chance


def onset_of(particle: Particle) -> float:
    """The sigmoid at the threshold of a curve; 0 where there is none."""
    return min(math.exp(particle.z["log_onset"]), 0.9) if particle.noise == RECTIFIED else 0.0


def likelihood(particle: Particle, trial: Trial, isi_ms: float) -> float:
    """Density of a log MEP, or the probability of an interval, at an ISI."""
    z, order = particle.z, trial.order
    log_scale = particle.changed(order, SCALE)
    log_floor, floor_variance = z["log_floor_mv"] + log_scale, math.exp(z["log_floor_sd"]) ** 2
    known, known_sd = (mv * math.exp(-z["log_floor_mv"] - log_scale) for mv in (trial.known_mv, trial.known_sd_mv))
    floor_variance += known_sd**2
    level = particle.facilitation(isi_ms) * trial.enhancement * particle.enhancement(order)
    shift_pct_rmt = trial.shift_pct_rmt + INTENSITY_PCT * particle.changed(order, INTENSITY)
    drive, chance = drive_and_chance(particle, level, shift_pct_rmt)
    size = {RECRUITMENT: "log_ceiling", RECTIFIED: "rectified_log_ceiling", ALL_OR_NONE: "log_size"}
    log_ratio = z[size.get(particle.noise, "log_gain")] + (0.0 if particle.curved else FAR_BELOW)
    startle = STARTUP[order] if order < len(STARTUP) else 0.0
    log_ratio += z["drift"] * (1.0 - PERSISTENCE**order) + z["startup"] * startle + trial.log_offset
    log_ratio += particle.changed(order, LEVEL)
    spread, between = nodes_of(particle)
    share, onset = scipy.special.expit(drive + spread), onset_of(particle)
    varies = (1.0 - share) ** 2 * between
    if onset > 0:
        steep = share**2 * varies
        reach = np.maximum((share - onset) ** 2 + CORNER * steep, 1e-12)
        share, varies = 0.5 * (np.sqrt(reach) + share - onset) / (1.0 - onset), steep / reach
    output = math.exp(2.0 * particle.of_curve("log_sigma_y")) if particle.curved else 0.0
    evoked = share * math.exp(log_ratio)
    total = 1.0 + evoked + known
    laws = np.log(total), np.sqrt(evoked**2 * (varies + output) + floor_variance) / total
    silent = math.log1p(known), math.sqrt(floor_variance) / (1.0 + known)
    low, high, (first, last) = trial.low - log_floor, trial.high - log_floor, OUTLIER_LOG_RANGE
    if trial.low == trial.high:
        outlier = (first < low < last) / (last - first) + 1e-6
        mixed = chance * (WEIGHTS * density(*laws, low)).sum() + (1.0 - chance) * density(*silent, low)
        return float((1.0 - OUTLIERS) * mixed + OUTLIERS * outlier)
    outlier = np.diff(np.clip((np.array([low, high]) - first) / (last - first), 0.0, 1.0)).item()
    mixed = chance * (WEIGHTS * mass(*laws, low, high)).sum() + (1.0 - chance) * mass(*silent, low, high)
    return float(max((1.0 - OUTLIERS) * mixed + OUTLIERS * outlier, 1e-9))


def density(mean: np.ndarray | float, sd: np.ndarray | float, at: float) -> np.ndarray:
    """Densities of normal laws."""
    return np.asarray(np.exp(-0.5 * ((at - mean) / sd) ** 2) / (sd * math.sqrt(2.0 * math.pi)))


def mass(mean: np.ndarray | float, sd: np.ndarray | float, low: float, high: float) -> np.ndarray:
    """Probabilities of normal laws between two ends, by the tail that has the digits."""
    first, last = (low - mean) / sd, (high - mean) / sd
    right = scipy.special.ndtr(-first) - scipy.special.ndtr(-last)
    return np.where(np.asarray(first) > 0, right, scipy.special.ndtr(last) - scipy.special.ndtr(first))


def log_likelihood(particle: Particle, trials: Sequence[Trial]) -> float:
    """Log likelihood of trials; an ISI that is known with an SD only is integrated out."""
    total = 0.0
    for trial in trials:
        if not (particle.curved or math.isnan(trial.log_by_curves)):
            total += trial.log_by_curves
            continue
        nodes = ISI_NODES if trial.isi_sd_ms > 0 else ((0.0, 1.0),)
        total += math.log(sum(w * likelihood(particle, trial, trial.isi_ms + at * trial.isi_sd_ms) for at, w in nodes))
    return total
