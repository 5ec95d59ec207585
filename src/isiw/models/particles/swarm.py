"""Weighted particles of b people: sequential Monte Carlo, whatever a particle's latents mean.

Every trial multiplies the particles' weights by its likelihood. When the effective sample size falls, the particles are
resampled, and moved by Markov chain steps (resample-move: Gilks and Berzuini, J. R. Stat. Soc. B 63, 2001).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from isiw.checks import Checked, Natural, Share
from isiw.models.particles.latents import Latents
from isiw.models.particles.misfit import Bets, probability_below
from isiw.models.particles.mixture import log_sum
from isiw.models.particles.noise import recruits
from isiw.models.shared.draws import seeds
from isiw.models.shared.history import BY_CURVES, SHIFT, History
from isiw.native.engine import log_likelihoods
from isiw.native.law import Crowd, Law
from isiw.types import FloatArray, Singles

LEAST_ESS = 0.01
"""Effective sample size before resampling, as a share of the particles: below it a trial contradicted the belief."""

LEAST_ACCEPTED = 0.05
"""Share of the shifts that must be accepted for the particles to explore the posterior."""

LEAST_DISTINCT = 0.4
"""Share of the particles that must differ from each other after the moves."""


class Health(NamedTuple):
    """How b people's particles took a trial; fields of shape (b,)."""

    ess: FloatArray  # effective sample size before resampling, as a share of the particles
    shifts: FloatArray  # share of the shifts that were accepted; NaN where there were none
    jumps: FloatArray  # likewise of the jumps to other kinds


def distinct_share(log_likelihood: Singles) -> FloatArray:
    """Share of the particles that differ, shape (b,); equal ones have the same likelihood of the history."""
    ordered = np.sort(log_likelihood, axis=-1)
    distinct: FloatArray = (1 + np.count_nonzero(ordered[:, 1:] != ordered[:, :-1], axis=-1)) / ordered.shape[-1]
    return distinct


def trouble_of(health: Health, distinct_share: FloatArray) -> str | None:
    """What is wrong with the particles of any of the people, in sentences; None where nothing is."""
    worst = (np.nan_to_num(share, nan=1.0).min() for share in (health.ess, health.shifts, distinct_share))
    ess, shifts, distinct = map(float, worst)
    said = []
    if ess < LEAST_ESS:
        said.append(f"The trial contradicts the estimate before it: {ess:.1%} of the particles carry the posterior.")
    if shifts < LEAST_ACCEPTED:
        said.append(f"The particles hardly move: {shifts:.1%} of their shifts were accepted.")
    if distinct < LEAST_DISTINCT:
        said.append(f"The particles are too much alike: {distinct:.0%} of them differ.")
    return " ".join(said) or None


@dataclass(frozen=True)
class Moving(Checked):
    """How often particles move, and when they are resampled.

    Args:
        sweeps: sweeps of Markov chain moves after each resampling; one follows each other trial.
        max_trial_sweeps: sweeps times trials are at most this many, so that a tell stays fast late in a session; where
            there are more trials, one sweep follows every second, third or later one, and each resampling.
        min_ess: effective sample size, as a share of the particles, below which they are resampled.
    """

    sweeps: Natural = 6
    max_trial_sweeps: Natural = 240
    min_ess: Share = 0.5

    def sweeps_after(self, trials: int, *, resampled: bool) -> int:
        """How many sweeps follow a trial: most where it has said much, fewer where the history has become long."""
        if 0 < self.max_trial_sweeps < trials and self.sweeps:
            return int(resampled or trials % math.ceil(2 * trials / self.max_trial_sweeps) == 0)
        most = max(1, self.max_trial_sweeps // max(1, trials)) if resampled else 1
        return min(self.sweeps, most)


@dataclass(frozen=True, eq=False)
class Swarm:
    """Weighted particles of b people."""

    crowd: Crowd  # which nobody changes
    evidence: FloatArray  # log marginal likelihood of the history [nat], (b,)
    history: History
    bets: Bets  # against the law
    health: Health | None = None  # after the last trial; None before the first

    @classmethod
    def of(cls, law: Law, people: int, particles: int, seed: int) -> Swarm:
        """Particles of the prior, before the first trial."""
        values, kinds = law.draws(particles, seeds(seed, 0, people))
        equal = np.full((people, particles), -math.log(particles))
        nothing = np.zeros((people, particles), dtype=np.float32)
        crowd = Crowd(values, kinds, equal, nothing, law.nothing_known(people, particles))
        return cls(crowd, np.zeros(people), History.empty(people), Bets.none(people))

    @property
    def latents(self) -> Latents:
        """The particles, fields of shape (b, p)."""
        return Latents(self.crowd.values, self.crowd.kinds)

    @property
    def log_weights(self) -> FloatArray:
        """Their normalised log weights, (b, p)."""
        return self.crowd.log_weights

    @property
    def trials(self) -> int:
        """Number of trials of each person that it has learnt."""
        return self.history.trials

    @cached_property
    def trouble(self) -> str | None:
        """What is wrong with the particles; see `isiw.models.protocol.ReportsTrouble`."""
        return None if self.health is None else trouble_of(self.health, distinct_share(self.crowd.log_likelihood))

    def after(self, trial: History, law: Law, moves: Moving, seed: int) -> Swarm:
        """The particles after one more trial: weighed, resampled where too few carry the posterior, and moved."""
        trial = self._as_curves_have_it(trial, law)
        history = self.history.appended(trial)
        below = probability_below(trial, self.crowd, law)
        kept, resampled = (moves.sweeps_after(history.trials, resampled=worn) for worn in (False, True))
        crowd, dice = self.crowd.copied(), seeds(seed, history.trials, len(self.evidence))
        found = law.learn(history.columns, moves.min_ess, (kept, resampled), dice, crowd)
        with np.errstate(invalid="ignore"):  # where there were no moves, no share of them was accepted
            health = Health(found[:, 1], found[:, 3] / found[:, 2], found[:, 5] / found[:, 4])
        return Swarm(crowd, self.evidence + found[:, 0], history, self.bets.after(below), health)

    def weighed(self, trial: History, law: Law) -> Swarm:
        """The same particles, weighed by one more trial as well."""
        history, crowd = self.history.appended(self._as_curves_have_it(trial, law)), self.crowd.copied()
        found = law.learn(history.columns, 0.0, (0, 0), np.zeros(len(self.evidence), dtype=np.uint64), crowd)
        return Swarm(crowd, self.evidence + found[:, 0], history, self.bets)

    def _as_curves_have_it(self, trial: History, law: Law) -> History:
        """A trial at another intensity, with the density that recruitment curves predict (decision 45)."""
        elsewhere = trial.columns[..., SHIFT] != 0
        if not elsewhere.any():
            return trial
        curved = recruits(self.latents.noise)
        likely = log_likelihoods(law.meanings(*self.latents, -1), trial.columns)
        joint, among = (
            log_sum(np.where(curved, each, -np.inf)) for each in (self.log_weights + likely, self.log_weights)
        )
        columns = trial.columns.copy()
        predicted = np.where(np.isfinite(among), joint - among, 0.0)
        columns[..., BY_CURVES] = np.where(elsewhere, predicted[:, np.newaxis], np.nan)
        return History(columns)

    def as_usual(self, law: Law, usual: Law) -> Swarm:
        """The same particles under the prior that ISIs are chosen with."""
        return replace(self, crowd=self.crowd._replace(log_weights=law.usual_weights(usual, self.crowd)))

    def picked(self, law: Law, size: int, person: int | None = None) -> tuple[Latents, Singles]:
        """Equally weighted particles that represent the same posterior, and what they mean now, fields of (b, s).

        Args:
            law: what they mean.
            size: how many.
            person: of one person alone.
        """
        some = slice(None) if person is None else slice(person, person + 1)
        latents = Latents(self.crowd.values[some], self.crowd.kinds[some])
        picks, fields = law.represent(*latents, self.log_weights[some], size, self.trials)
        return latents.taken(picks), fields
