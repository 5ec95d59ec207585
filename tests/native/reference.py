"""The law of particles in plain NumPy and double precision, one particle and one trial at a time.

What the compiled engine is tested against: docs/model.md in code, by the names that latents have in the prior.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import scipy.special
import scipy.stats

Latents = Mapping[str, float]
Values = np.ndarray[Any, np.dtype[np.float64]]

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
FACTORS: Final = np.arange(-2.0, 3.0)  # of known parts, in SDs of their log
FACTOR_WEIGHTS: Final = np.exp(-0.5 * FACTORS**2) / np.exp(-0.5 * FACTORS**2).sum()
FIRST_GROUP_MS, GROUP_MS, GROUPS = -150.0, 15.0, 64  # trials that share a factor of their known parts
LEAST_MASS: Final = 1e-9
EDGE_LEVEL, LEAST_MV, LEAST_OF_BASELINE, NOWHERE = 0.135, 0.002, 0.1, 2.0
PEAKS: Final = (0.27, 0.73)
LEVELS, NO_FLOOR_SD = 8, math.exp(-7.0)  # of a law by levels: how many, and the SD of its floor

CONSTANT_CV, MISSING, RECRUITMENT, ALL_OR_NONE, RECTIFIED, BY_LEVELS = range(6)
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
    known_log_sd: float = 0.0
    shift_pct_rmt: float = 0.0
    log_by_curves: float = math.nan  # log likelihood under kinds of noise that know no other intensity
    counts: float = 1.0  # power of the likelihood


@dataclass(frozen=True)
class Particle:
    """A person as one particle has them: latents by name, and kinds in the order of the engine."""

    z: Latents
    shape: int
    noise: int
    present: bool
    depressed: bool
    change: int

    @classmethod
    def of(cls, names: Sequence[str], values: Sequence[float], kinds: Sequence[int]) -> Particle:
        """A particle of a model whose latents have such names; what shifts the input is one latent to both models."""
        z = dict(zip(names, values, strict=True))
        shape, noise, present, depressed, change = kinds
        shift = {"log_boost": z["log_shift"]} if "log_shift" in z else {}
        return cls(z | shift, shape, noise, bool(present), bool(depressed), change)

    def of_curve(self, name: str) -> float:
        """A latent of the particle's recruitment curve."""
        return self.z[f"rectified_{name}" if self.noise == RECTIFIED else name]

    @property
    def curved(self) -> bool:
        """Whether it has a recruitment curve."""
        return self.noise in {RECRUITMENT, RECTIFIED}

    @property
    def knows_intensities(self) -> bool:
        """Whether it knows what pulses of another intensity evoke."""
        return self.curved or self.noise == BY_LEVELS

    def levels(self, name: str) -> Values:
        """Places, means or SDs of its levels, (8,)."""
        return np.array([self.z[f"{name}_{level}"] for level in range(LEVELS)])

    def changed(self, order: int, kind: int) -> float:
        """The size of a change of a kind that has come by a trial, else 0; what is not a curve's is a level."""
        own = self.change
        if own == INTENSITY and not self.knows_intensities:
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
        """Facilitation at an ISI, in 0 to 1; where the tap depresses down to minus the depth."""
        if math.isnan(isi_ms):
            return 0.0
        level = self.enhanced_at((isi_ms - self.z["start_ms"]) / math.exp(self.z["log_width_ms"]))
        if self.depressed:
            width_ms = math.exp(self.z["depressed_log_width_ms"])
            away = (isi_ms - self.z["depressed_start_ms"]) / (0.5 * width_ms) - 1.0
            level -= self.depth * math.exp(-2.0 * away**2)
        return level

    @property
    def depth(self) -> float:
        """The deepest depression, as a share of the largest enhancement."""
        return math.exp(self.z["depressed_log_shift"] - self.z["log_boost"]) if self.depressed else 0.0

    @property
    def form(self) -> float:
        """The form of the profile, -1 to 1."""
        return math.erf(self.z.get("form", 0.0) / math.sqrt(2.0))

    @property
    def peak(self) -> float:
        """Where a profile of one peak has it, as a share of the span."""
        return 0.5 + 0.33 * self.form if self.shape == SKEWED else 0.5

    def enhanced_at(self, share: float) -> float:
        """Facilitation at a share of the span, in 0 to 1."""
        if not self.present:
            return 0.0
        form, peak = self.form, self.peak
        if self.shape == TWO_PEAK:
            apart, size = abs(form) > 0.75, abs(form)
            sd = 1 / 12 if apart else 1 / 7.5
            lower = 1.0 - 0.7 * ((size - 0.75) / 0.25 if apart else size / 0.75)
            heights = (lower, 1.0) if form < 0 else (1.0, lower)
            bells = zip(heights, PEAKS, strict=True)
            return sum(height * math.exp(-0.5 * ((share - at) / sd) ** 2) for height, at in bells)
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


def log_ratio_of(particle: Particle) -> float:
    """Log of the largest response over the floor."""
    size = {RECRUITMENT: "log_ceiling", RECTIFIED: "rectified_log_ceiling", ALL_OR_NONE: "log_size"}
    return particle.z[size.get(particle.noise, "log_gain")]


def log_floor_of(particle: Particle, order: int) -> float:
    """Log of the median of the EMG floor at a trial [log mV]; of a law by levels it is the lowest level."""
    lowest = particle.levels("level_mean").min() if particle.noise == BY_LEVELS else particle.z["log_floor_mv"]
    return float(lowest + particle.changed(order, SCALE))


def floor_sd_of(particle: Particle) -> float:
    """Log SD of the EMG floor."""
    return NO_FLOOR_SD if particle.noise == BY_LEVELS else math.exp(particle.z["log_floor_sd"])


def levels_at(particle: Particle, level: float, shift_pct_rmt: float) -> tuple[Values, Values, Values]:
    """Share of each level at a facilitation, the nearer of two the more; what they evoke, in floors; their SDs."""
    stronger = math.exp(particle.z["log_boost"]) * level + shift_pct_rmt
    place = np.interp(stronger, particle.levels("level_at"), np.arange(LEVELS))
    evoked = np.exp(particle.levels("level_mean") - particle.levels("level_mean").min()) - 1.0
    return np.maximum(0.0, 1.0 - np.abs(np.arange(LEVELS) - place)), evoked, particle.levels("level_sd")


@dataclass(frozen=True)
class Outcome:
    """The law of a log MEP over the floor: log-normals, of a response one at each node, and artefacts."""

    chance: float  # of a response
    responses: tuple[Values, Values]  # means and SDs, (q,)
    silent: tuple[float, float]  # mean and SD of the floor alone
    weights: Values = field(default_factory=lambda: WEIGHTS)  # of the nodes, or of levels in their place, (q,)

    def density(self, log_mep: float) -> float:
        """Density at a log MEP over the floor."""
        first, last = OUTLIER_LOG_RANGE
        evoked = (self.weights * density_at(*self.responses, log_mep)).sum()
        mixed = self.chance * evoked + (1.0 - self.chance) * density_at(*self.silent, log_mep)
        outlier = (first < log_mep < last) / (last - first) + 1e-6
        return float((1.0 - OUTLIERS) * mixed + OUTLIERS * outlier)

    def mass(self, low: float, high: float) -> float:
        """Probability between two log MEPs over the floor."""
        first, last = OUTLIER_LOG_RANGE
        mixed = self.chance * (self.weights * between_ends(*self.responses, low, high)).sum()
        mixed += (1.0 - self.chance) * between_ends(*self.silent, low, high)
        outlier = np.diff(np.clip((np.array([low, high]) - first) / (last - first), 0.0, 1.0)).item()
        return float(max((1.0 - OUTLIERS) * mixed + OUTLIERS * outlier, LEAST_MASS))


def outcome_of(particle: Particle, trial: Trial, level: float, factor: float = 1.0) -> Outcome:
    """The law of a trial at a facilitation, and at a factor of its known part."""
    z, order = particle.z, trial.order
    per_floor = factor * math.exp(-log_floor_of(particle, order))
    known, known_sd = per_floor * trial.known_mv, per_floor * trial.known_sd_mv
    floor_variance = floor_sd_of(particle) ** 2 + known_sd**2
    silent = math.log1p(known), math.sqrt(floor_variance) / (1.0 + known)
    shift_pct_rmt = trial.shift_pct_rmt + INTENSITY_PCT * particle.changed(order, INTENSITY)
    level *= particle.enhancement(order)
    startle = STARTUP[order] if order < len(STARTUP) else 0.0
    gain = z["drift"] * (1.0 - PERSISTENCE**order) + z["startup"] * startle + particle.changed(order, LEVEL)
    if particle.noise == BY_LEVELS:
        weights, evoked, sds = levels_at(particle, level, shift_pct_rmt)
        total = 1.0 + evoked * math.exp(gain) + known
        return Outcome(1.0, (np.log(total), np.sqrt(sds**2 + floor_variance / total**2)), silent, weights)
    drive, chance = drive_and_chance(particle, level, shift_pct_rmt)
    log_ratio = log_ratio_of(particle) + gain + (0.0 if particle.curved else FAR_BELOW)
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
    responses = np.log(total), np.sqrt(evoked**2 * (varies + output) + floor_variance) / total
    return Outcome(chance, responses, silent)


def density_at(mean: Values | float, sd: Values | float, at: float) -> Values:
    """Densities of normal laws."""
    return np.asarray(np.exp(-0.5 * ((at - mean) / sd) ** 2) / (sd * math.sqrt(2.0 * math.pi)))


def between_ends(mean: Values | float, sd: Values | float, low: float, high: float) -> Values:
    """Probabilities of normal laws between two ends, by the tail that has the digits."""
    first, last = (low - mean) / sd, (high - mean) / sd
    right = scipy.special.ndtr(-first) - scipy.special.ndtr(-last)
    return np.where(np.asarray(first) > 0, right, scipy.special.ndtr(last) - scipy.special.ndtr(first))


def likelihood(particle: Particle, trial: Trial, factor: float = 1.0) -> float:
    """Density of a log MEP, or the probability of an interval, to a power; an ISI known with an SD integrated out."""
    if not (particle.knows_intensities or math.isnan(trial.log_by_curves)):
        return math.exp(trial.log_by_curves)
    floor, found = log_floor_of(particle, trial.order), 0.0
    for at, weight in ISI_NODES if trial.isi_sd_ms > 0 else ((0.0, 1.0),):
        level = particle.facilitation(trial.isi_ms + at * trial.isi_sd_ms)
        law = outcome_of(particle, trial, level, factor)
        exact = trial.low == trial.high
        found += weight * (law.density(trial.low - floor) if exact else law.mass(trial.low - floor, trial.high - floor))
    return math.pow(found, trial.counts)


def group_of(isi_ms: float) -> int:
    """Which trials share a factor of their known parts; TMS alone is as at 0 ms."""
    place = ((0.0 if math.isnan(isi_ms) else isi_ms) - FIRST_GROUP_MS) / GROUP_MS
    return min(max(int(place), 0), GROUPS - 1)


def log_likelihood(particle: Particle, trials: Sequence[Trial]) -> float:
    """Log likelihood of trials, whose known parts have a factor that those of nearly the same ISI share."""
    if not any(trial.known_log_sd > 0 for trial in trials):
        return sum(math.log(likelihood(particle, trial)) for trial in trials)
    sums: dict[int, Values] = defaultdict(lambda: np.zeros(len(FACTORS)))
    for trial in trials:
        factors = np.exp(FACTORS * trial.known_log_sd).tolist()
        sums[group_of(trial.isi_ms)] += [math.log(likelihood(particle, trial, factor)) for factor in factors]
    return sum(float(scipy.special.logsumexp(each, b=FACTOR_WEIGHTS)) for each in sums.values())


def row_levels(particle: Particle, rows: int) -> Values:
    """Facilitations that responses are worked out at: squares of equal steps, or equal steps from below 0."""
    share, depth = np.linspace(0.0, 1.0, rows), particle.depth
    return share * (1.0 + depth) - depth if depth > 0 else share**2


def row_of(level: Values, depth: float, rows: int) -> Values:
    """Where facilitations lie among the rows."""
    share = (level + depth) / (1.0 + depth) if depth > 0 else np.sqrt(np.clip(level, 0.0, 1.0))
    at: Values = np.clip(share, 0.0, 1.0) * (rows - 1)
    return at


def expected_evoked(particle: Particle, order: int, level: float) -> float:
    """Expected MEP above the floor at a facilitation, in medians of the floor; drift and startle aside."""
    shift_pct_rmt = INTENSITY_PCT * particle.changed(order, INTENSITY)
    if particle.noise == BY_LEVELS:
        shares, evoked, sds = levels_at(particle, level * particle.enhancement(order), shift_pct_rmt)
        above = (shares * (1.0 + evoked) * np.exp(0.5 * sds**2)).sum() - 1.0
        return float(math.exp(particle.changed(order, LEVEL)) * above)
    drive, chance = drive_and_chance(particle, level * particle.enhancement(order), shift_pct_rmt)
    ratio = math.exp(log_ratio_of(particle) + particle.changed(order, LEVEL))
    if not particle.curved:
        return ratio * chance * (1.0 if particle.noise == ALL_OR_NONE else level * particle.enhancement(order))
    onset, noise = onset_of(particle), math.exp(particle.of_curve("log_input_sd")) * _AT
    over = np.maximum(scipy.special.expit(drive + noise) - onset, 0.0) / (1.0 - onset)
    return float(ratio * math.exp(0.5 * math.exp(2.0 * particle.of_curve("log_sigma_y"))) * (WEIGHTS * over).sum())


def expected_mep_mv(particle: Particle, order: int, evoked: float) -> float:
    """Expected MEP [mV], by what is evoked above the floor."""
    mean_floor = math.exp(0.5 * floor_sd_of(particle) ** 2)
    return math.exp(log_floor_of(particle, order)) * (evoked + mean_floor)


def outcome_masses(particle: Particle, order: int, level: float, log_mep: Values, widths: Values) -> Values:
    """Probability of each outcome of the next trial, by their middles [log mV] and widths, (y,)."""
    law, over = outcome_of(particle, Trial(order, math.nan, 0.0, 0.0), level), log_mep - log_floor_of(particle, order)
    mass = widths * np.array([law.density(at) for at in over])
    share: Values = mass / mass.sum()
    return share


def edge_level(particle: Particle, order: int, evoked: Values, isi_ms: Values, *, fine: bool) -> float:
    """Facilitation at a window's edge by the least-excess rule, by what is evoked in each row; 2 without a window."""
    peaks = np.array([particle.peak, *PEAKS]) * math.exp(particle.z["log_width_ms"]) + particle.z["start_ms"]
    at, rows = np.clip(peaks, isi_ms[0], isi_ms[-1]) if fine else isi_ms, np.arange(len(evoked))
    most = max(particle.facilitation(isi) for isi in at)
    excess_mv = math.exp(log_floor_of(particle, order)) * (evoked - evoked[0])
    peak_mv = np.interp(row_of(np.array(most), 0.0, len(rows)), rows, excess_mv)
    baseline_mv = expected_mep_mv(particle, order, evoked[0])
    if not particle.present or peak_mv < max(LEAST_OF_BASELINE * baseline_mv, LEAST_MV):
        return NOWHERE
    return float((np.interp(EDGE_LEVEL * peak_mv, excess_mv, rows) / rows[-1]) ** 2)


def log_mixture(mixture: Any, x: Sequence[float]) -> float:
    """Log density of a mixture of normal components with independent latents."""
    parts = scipy.stats.norm.logpdf(np.array(x), mixture.means, mixture.sds).sum(-1)
    return float(scipy.special.logsumexp(parts, b=mixture.shares))


def log_place(prior: Any, space: Any, z: Latents) -> float:
    """Log density of start and width: anywhere, or in one of the prior's places."""
    knots_ms, start_density, *_ = prior.profile.start.knots(space)
    width = log_mixture(prior.mixtures["width"], [z["log_width_ms"]])
    anywhere = math.log(max(np.interp(z["start_ms"], knots_ms, start_density), 1e-30)) + width
    joint = prior.profile.joint(space)
    if joint is None:
        return anywhere
    there = log_mixture(joint.mixture, [z["start_ms"], z["log_width_ms"]])
    return float(np.logaddexp(math.log1p(-joint.share) + anywhere, math.log(joint.share) + there))


def log_usual(prior: Any, space: Any, particle: Particle, blocks: Mapping[str, Sequence[str]]) -> float:
    """Log prior density of what ISIs are chosen with another law of, as far as it means anything to a particle."""
    named = {RECRUITMENT: ["recruitment"], RECTIFIED: ["rectified"]}.get(particle.noise, [])
    named = ["session", *named, *(["changed"] if particle.change not in {NO_CHANGE, ENHANCEMENT} else [])]
    found = sum(log_mixture(prior.mixtures[name], [particle.z[latent] for latent in blocks[name]]) for name in named)
    found += log_place(prior, space, particle.z) if particle.present else 0.0
    return float(found + math.log(prior.changes.shares[particle.change]))
