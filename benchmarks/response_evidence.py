"""What each kind of noise says of a recorded bank: draws of its laws, from which any prior's evidence follows.

Draws come from adaptive importance sampling: proposals follow the tempered posterior under today's prior, some of
them the prior itself. For another prior the same draws get other weights.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp

from benchmarks.recorded_people import PAIRS_PCT_RMT, Bank
from benchmarks.response_laws import NAMES, Mixture, log_likelihood, pulses_of
from isiw.models.particles.laws import Muscle, RectifiedPrior
from isiw.models.particles.prior import Prior
from isiw.models.shared.scales import Scale
from isiw.types import FloatArray

ROUNDS, DRAWS = 5, 4000
LEAST_ESS, WIDER, TWICE = 150.0, 1.15, 2.0
SHARES: Final = np.array([0.15, 0.65, 0.2])
"""Of the prior, and of the narrower and the wider law around what a bank says."""
BEND: Final = (0.0, 0.7)
"""Mean and SD of the log of a bend: windows half or twice as wide are in reach."""

_Part = tuple[float, list[tuple[float, float]]]


def mixtures(prior: Prior) -> dict[str, Mixture]:
    """The prior's laws of responses by kind of noise, at a known intensity.

    Args:
        prior: of the default.
    """
    floors = [(f.share, [f.median_mv.log_law, f.log_sd.log_law]) for f in prior.floors]
    gains = [(g.share, [g.ratio.log_law, g.cv.log_law, BEND]) for g in prior.gains]
    sizes = [(g.share, [g.ratio.log_law, g.cv.log_law, BEND]) for g in prior.switch.sizes]
    switch = [(1.0, [prior.switch.switched_on.law, prior.switch.switched_off.law])]
    rectified = (1.0, [*_of_curve(prior.rectified), prior.rectified.onset.log_law])
    return {
        "constant_cv": _product(floors, gains),
        "missing": _product(floors, gains, [(1.0, [prior.switch.reliability.law])]),
        "recruitment": _product(floors, [(m.share, _of_curve(m)) for m in prior.possible_muscles]),
        "all_or_none": _product(floors, sizes, switch),
        "rectified": _product(floors, [rectified]),
    }


def _of_curve(law: Muscle | RectifiedPrior) -> list[tuple[float, float]]:
    scales = (law.ratio, law.slope_per_pct, law.input_sd, law.sigma_y)
    off = 0.0 if law.at_pct_rmt is None else PAIRS_PCT_RMT - law.at_pct_rmt
    rest: Scale = law.rest_pct
    return [*(scale.log_law for scale in scales), (rest.median + off, rest.sd)]


def _product(*blocks: Iterable[_Part]) -> Mixture:
    """The mixture of all combinations of independent blocks."""
    parts: list[_Part] = [(1.0, [])]
    for block in blocks:
        parts = [(share * more, [*laws, *others]) for share, laws in parts for more, others in block]
    laws = np.array([laws for _, laws in parts])
    shares = np.array([share for share, _ in parts])
    return Mixture(shares / shares.sum(), laws[..., 0], laws[..., 1])


@dataclass(frozen=True, eq=False)
class Draws:
    """Laws of one kind, drawn for one bank.

    Args:
        laws: numbers in the order of `NAMES`, shape (n, d).
        log_weights: log likelihood less the log density that they were drawn from, shape (n,).
    """

    laws: FloatArray
    log_weights: FloatArray

    def log_evidence(self, prior: Mixture) -> float:
        """Log density of the bank's amplitudes under a prior of the kind."""
        return float(logsumexp(self.log_weights + prior.log_density(self.laws)) - np.log(len(self.laws)))

    def shares(self, prior: Mixture) -> FloatArray:
        """How probable each of the laws is under a prior, shape (n,)."""
        logs = self.log_weights + prior.log_density(self.laws)
        return np.exp(logs - logsumexp(logs))

    def ess(self, prior: Mixture) -> float:
        """How many equal draws they are worth under a prior."""
        return float(1.0 / (self.shares(prior) ** 2).sum())


@dataclass(frozen=True, eq=False)
class Proposal:
    """What laws are drawn from: the prior, and two normal laws around what the bank says, one wider.

    Args:
        prior: of the kind.
        mean: of the laws around, shape (d,).
        root: Cholesky factor of the covariance of the narrower, shape (d, d).
    """

    prior: Mixture
    mean: FloatArray
    root: FloatArray

    def sample(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Laws, shape (count, d)."""
        which = rng.choice(3, size=count, p=SHARES)
        around = rng.standard_normal((count, len(self.mean))) @ self.root.T * np.where(which == 1, 1.0, TWICE)[:, None]
        return np.where((which == 0)[:, None], self.prior.sample(count, rng), self.mean + around)

    def log_density(self, laws: FloatArray) -> FloatArray:
        """Log density at laws (n, d), shape (n,)."""
        squares = (solve_triangular(self.root, (laws - self.mean).T, lower=True) ** 2).sum(0)
        scale = np.log(np.diag(self.root)).sum() + 0.5 * np.log(2.0 * np.pi) * len(self.mean)
        wider = -0.5 * squares / TWICE**2 - scale - np.log(TWICE) * len(self.mean)
        parts = np.stack([self.prior.log_density(laws), -0.5 * squares - scale, wider])
        return np.asarray(logsumexp(np.log(SHARES)[:, None] + parts, axis=0))


def drawn(kind: str, bank: Bank, prior: Mixture, rng: np.random.Generator) -> Draws:
    """Draw laws for a bank.

    Args:
        kind: of the noise.
        bank: what was recorded.
        prior: of the kind.
        rng: what is drawn from.
    """
    pulses = pulses_of(bank)
    proposal: Mixture | Proposal = prior
    for _ in range(ROUNDS):
        laws = proposal.sample(DRAWS, rng)
        logs = log_likelihood(kind, laws, pulses) + prior.log_density(laws) - proposal.log_density(laws)
        proposal = _around(laws, logs, prior)
    laws = proposal.sample(DRAWS, rng)
    return Draws(laws, log_likelihood(kind, laws, pulses) - proposal.log_density(laws))


def _around(laws: FloatArray, logs: FloatArray, prior: Mixture) -> Proposal:
    """A proposal around laws of log weights, tempered so far that it rests on enough of them."""
    temper, weights = 1.0, np.exp(logs - logsumexp(logs))
    while 1.0 / (weights**2).sum() < LEAST_ESS:
        temper *= 0.8
        weights = np.exp(temper * logs - logsumexp(temper * logs))
    mean = weights @ laws
    covariance = ((laws - mean).T * weights) @ (laws - mean) + 1e-6 * np.eye(len(mean))
    return Proposal(prior, mean, np.linalg.cholesky(WIDER**2 * covariance))


def all_drawn(banks: Iterable[Bank], prior: Prior, seed: int) -> list[Mapping[str, Draws]]:
    """Draws of every kind for every bank.

    Args:
        banks: what was recorded.
        prior: of the default.
        seed: of the draws.
    """
    by_kind = mixtures(prior)
    return [
        {
            kind: drawn(kind, bank, by_kind[kind], np.random.default_rng([seed, number, place]))
            for place, kind in enumerate(NAMES)
        }
        for number, bank in enumerate(banks)
    ]
