"""Weighted particles of b people: sequential Monte Carlo, whatever a particle's latents mean.

Every trial multiplies the particles' weights by its likelihood. When the effective sample size falls, the particles are
resampled, and moved by Markov chain steps (resample-move: Gilks and Berzuini, J. R. Stat. Soc. B 63, 2001).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import NamedTuple

import numpy as np

from isiw.checks import Checked, Natural, Share
from isiw.lazy import torch
from isiw.models.particles.engine import Engine
from isiw.models.particles.latents import HYPOTHESES, Latents
from isiw.models.particles.noise import recruits
from isiw.models.protocol import Tensor
from isiw.models.shared.history import BY_CURVES, SHIFT, History
from isiw.models.shared.tables import systematic

LEAST_SHARE = 0.03
"""Share of the particles that resampling leaves to a hypothesis, however improbable it has become: it can come back."""

LEAST_PROBABILITY = 1e-9
"""Less probable hypotheses are left fewer particles."""

LEAST_ESS = 0.01
"""Effective sample size before resampling, as a share of the particles: below it a trial contradicted the belief."""

LEAST_ACCEPTED = 0.05
"""Share of the shifts that must be accepted for the particles to explore the posterior."""

LEAST_DISTINCT = 0.4
"""Share of the particles that must differ from each other after the moves."""


class Health(NamedTuple):
    """How b people's particles took a trial; fields of shape (b,)."""

    ess: Tensor  # effective sample size before resampling, as a share of the particles
    shifts: Tensor  # share of the shifts that were accepted; NaN where there were none
    jumps: Tensor  # likewise of the jumps to other kinds


def ess_share(log_weights: Tensor) -> Tensor:
    """Effective sample size as a share of the particles, shape (b,)."""
    share: Tensor = torch.exp(-torch.logsumexp(2.0 * log_weights, dim=-1)) / log_weights.shape[-1]
    return share


def distinct_share(log_likelihood: Tensor) -> Tensor:
    """Share of the particles that differ, shape (b,); equal ones have the same likelihood of the history."""
    ordered = np.sort(log_likelihood.cpu().numpy(), axis=-1)
    distinct = 1 + np.count_nonzero(ordered[:, 1:] != ordered[:, :-1], axis=-1)
    return torch.as_tensor(distinct / ordered.shape[-1], dtype=torch.float32)


def trouble_of(health: Health, distinct_share: Tensor) -> str | None:
    """What is wrong with the particles of any of the people, in sentences; None where nothing is."""
    ess, shifts, distinct = (float(x.nan_to_num(1.0).min()) for x in (health.ess, health.shifts, distinct_share))
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

    latents: Latents  # fields of shape (b, p)
    log_weights: Tensor  # normalised, (b, p)
    log_likelihood: Tensor  # of the history under each of them, (b, p)
    evidence: Tensor  # log marginal likelihood of the history [nat], (b,)
    history: History
    health: Health | None = None  # after the last trial; None before the first

    @classmethod
    def of(cls, latents: Latents) -> Swarm:
        """Particles of the prior, before the first trial."""
        people, particles = latents.values.shape[:-1]
        nothing = latents.values.new_zeros((people, particles))
        history = History.empty(people, nothing.device)
        return cls(latents, nothing - math.log(particles), nothing, nothing[:, 0], history)

    @property
    def trials(self) -> int:
        """Number of trials of each person that it has learnt."""
        return self.history.isi_ms.shape[-1]

    @cached_property
    def trouble(self) -> str | None:
        """What is wrong with the particles; see `isiw.models.protocol.ReportsTrouble`."""
        return None if self.health is None else trouble_of(self.health, distinct_share(self.log_likelihood))

    def times(self, log_ratio: Tensor) -> Swarm:
        """The same particles under another prior."""
        return replace(self, log_weights=torch.log_softmax(self.log_weights + log_ratio, dim=-1))

    def told(self, trial: History, engine: Engine) -> Swarm:
        """The same particles, weighted by one more trial as well."""
        trial = self._as_curves_have_it(trial, engine)
        history = self.history.appended(trial)
        if history.shares_factor:
            gain = engine.log_likelihood(self.latents, history) - self.log_likelihood
        else:
            gain = engine.log_likelihood(self.latents, trial)
        log_weights = self.log_weights + gain
        return replace(
            self,
            log_weights=torch.log_softmax(log_weights, dim=-1),
            log_likelihood=self.log_likelihood + gain,
            evidence=self.evidence + torch.logsumexp(log_weights, dim=-1),
            history=history,
        )

    def _as_curves_have_it(self, trial: History, engine: Engine) -> History:
        """A trial of TMS alone at another intensity, with the density that recruitment curves predict (decision 45)."""
        elsewhere = trial.isi_ms.isnan() & (trial.around[..., SHIFT] != 0)
        if not bool(elsewhere.any()):
            return trial
        log_weights = self.log_weights.masked_fill(~recruits(self.latents.noise), -torch.inf)
        joint = torch.logsumexp(log_weights + engine.log_likelihood(self.latents, trial), dim=-1, keepdim=True)
        predicted = (joint - torch.logsumexp(log_weights, dim=-1, keepdim=True)).nan_to_num(0.0)
        around = trial.around.clone()
        around[..., BY_CURVES] = torch.where(elsewhere, predicted, torch.nan)
        return replace(trial, circumstances=around)

    def moved(self, engine: Engine, moves: Moving, generator: torch.Generator) -> Swarm:
        """The particles after the moves that follow a trial, resampled where too few carried the posterior."""
        ess = ess_share(self.log_weights)
        worn = ess < moves.min_ess
        # Systematic picks are ordered; shuffled, both halves of the particles represent the posterior.
        shuffled = torch.randperm(self.log_weights.shape[-1], generator=generator, device=generator.device)
        fresh = self._resampled(worn, shuffled) if bool(worn.any()) else self
        least, most = (moves.sweeps_after(self.trials, resampled=resampled) for resampled in (False, True))
        sweeps = torch.where(worn, most, least)
        moved = engine.sweeps(sweeps, fresh.latents, fresh.log_likelihood, self.history, generator)
        health = Health(ess, moved.shifts, moved.jumps)
        return replace(fresh, latents=moved.latents, log_likelihood=moved.log_likelihood, health=health)

    def of_person(self, person: int) -> Swarm:
        """The particles of one person."""
        one = slice(person, person + 1)
        return replace(self, latents=self.latents.each(lambda field: field[one]), log_weights=self.log_weights[one])

    def picked(self, size: int) -> Latents:
        """Equally weighted particles that represent the same posterior, fields of shape (b, s)."""
        return self.latents.each(partial(taken, rows=self._rows(systematic(self.log_weights, size))))

    def _rows(self, picks: Tensor) -> Tensor:
        """Picks of each person's particles if those of all people follow each other, shape (b, s)."""
        people, particles = self.log_weights.shape
        return picks + _first_rows(people, particles, picks.device)

    def _resampled(self, worn: Tensor, shuffled: Tensor) -> Swarm:
        """Resample, in this order, those people whose effective sample size has fallen (b,); nobody else notices."""
        size, worn = len(shuffled), worn.unsqueeze(-1)
        kept, log_favour = torch.arange(size, device=shuffled.device), self._log_favour()
        picks = systematic(self.log_weights + log_favour, size)[:, shuffled]
        rows = self._rows(torch.where(worn, picks, kept))
        fresh = torch.log_softmax(-taken(log_favour, rows), dim=-1)
        log_blocks = self.latents.log_blocks
        known = None if log_blocks is None else taken(log_blocks, rows)
        return replace(
            self,
            latents=self.latents.each(partial(taken, rows=rows))._replace(log_blocks=known),
            log_weights=torch.where(worn, fresh, self.log_weights),
            log_likelihood=taken(self.log_likelihood, rows),
        )

    def _log_favour(self) -> Tensor:
        """Log of how much more often particles are picked than their weights say, (b, p); 0 if none is too rare."""
        hypotheses, weights = self.latents.hypothesis, self.log_weights.exp()
        probability = weights.new_zeros((len(weights), HYPOTHESES)).scatter_add_(-1, hypotheses, weights)
        favour = (LEAST_SHARE / probability.clamp_min(LEAST_PROBABILITY)).clamp_min(1.0)
        return favour.log().gather(-1, hypotheses)


@cache
def _first_rows(people: int, particles: int, device: torch.device) -> Tensor:
    """Each person's first particle, shape (b, 1)."""
    return particles * torch.arange(people, device=device).unsqueeze(-1)


def taken(values: Tensor, rows: Tensor) -> Tensor:
    """Some of the particles (b, p, ...), those of all people following each other, shape (b, s, ...)."""
    picked = values.flatten(0, 1).index_select(0, rows.flatten())
    return picked.view(*rows.shape, *values.shape[2:])
