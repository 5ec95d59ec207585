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
from isiw.models.particles.compiled import Crowd, Law
from isiw.models.particles.latents import Latents, latents_of
from isiw.models.particles.levels import CARRIED, Level, along_curves, drawn, foretold, levels_of
from isiw.models.particles.misfit import Bets
from isiw.models.particles.mixture import log_sum
from isiw.models.particles.noise import NoiseKind, recruits
from isiw.models.protocol import GIVEN_COUNTS
from isiw.models.shared.draws import OTHER_HALF, TAUGHT, seeds, stream, systematic
from isiw.models.shared.history import BY_CURVES, COUNTS, SHIFT, History
from isiw.native.engine import Seeds, log_likelihoods
from isiw.types import BoolArray, FloatArray, Singles

LEAST_ESS = 0.01
"""Effective sample size before resampling, as a share of the particles: below it a trial contradicted the posterior."""

LEAST_ACCEPTED = 0.05
"""Share of the shifts that must be accepted for the particles to explore the posterior."""

LEAST_DISTINCT = 0.4
"""Share of the particles that must differ from each other after the moves."""


UNHEEDED = 50.0
"""Minus the log of the probability that is left to pulses alone which the session has contradicted."""


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
    chosen_by: tuple[Law, Law] | None = None  # their law, and the one that weighs them instead where ISIs are chosen
    halves: int = 1  # 2 where the second half of the particles does not learn from pulses given alone
    given: History | None = None  # pulses given alone that a law by levels stands for, which particles may carry along

    @classmethod
    def of(cls, law: Law, people: int, particles: int, seed: int) -> Swarm:
        """Particles of the prior, before the first trial."""
        values, kinds = law.draws(particles, seeds(seed, 0, people))
        equal = np.full((people, particles), -math.log(particles))
        nothing = np.zeros((people, particles), dtype=np.float32)
        crowd = Crowd(values, kinds, equal, nothing, law.nothing_known(people, particles))
        return cls(crowd, np.zeros(people), History.empty(people), Bets())

    @property
    def latents(self) -> Latents:
        """The particles, fields of shape (b, p)."""
        return self.named(self.crowd)

    def named(self, crowd: Crowd) -> Latents:
        """The latents of particles, without what they carry along."""
        carried = 0 if self.given is None else CARRIED
        return Latents(crowd.values[..., : crowd.values.shape[-1] - carried], crowd.kinds)

    @cached_property
    def log_weights(self) -> FloatArray:
        """Their normalised log weights, (b, p)."""
        if self.chosen_by is None:
            return self.crowd.log_weights
        law, usual = self.chosen_by
        return law.usual_weights(usual, self.crowd)

    @property
    def weighed(self) -> Crowd:
        """The particles with these log weights."""
        return self.crowd._replace(log_weights=self.log_weights)

    def weighing(self, log_weights: FloatArray) -> Swarm:
        """The same with other log weights."""
        return replace(self, crowd=self.crowd._replace(log_weights=log_weights), chosen_by=None)

    @property
    def trials(self) -> int:
        """Number of trials of each person that it has learnt; those that a law by levels stands for are one."""
        return self.history.trials + (self.given is not None)

    @property
    def stood_for(self) -> int:
        """How many more trials were learnt."""
        return 0 if self.given is None else self.given.trials - 1

    @cached_property
    def trouble(self) -> str | None:
        """What is wrong with the particles; see `isiw.models.protocol.ReportsTrouble`."""
        return None if self.health is None else trouble_of(self.health, distinct_share(self.crowd.log_likelihood))

    def doubting(self, share: float) -> Swarm:
        """The same where pulses given alone come, with a probability, from another curve than the pairs.

        Half of the particles learn nothing from such pulses, and so are what they would be without them; the pairs say
        which half is right (decision 53). Each half has rows of its own in the history.
        """
        if self.halves > 1 or not share:
            return self
        doubled = (np.concatenate((each, each), axis=1) for each in self.crowd)
        parts = np.log([1.0 - share, share]).repeat(self.log_weights.shape[1])
        crowd = Crowd._make(doubled)
        crowd = crowd._replace(log_weights=crowd.log_weights + parts)
        return replace(self, crowd=crowd, history=History(self.history.columns.repeat(2, axis=0)), halves=2)

    def by_levels(self, learnt_law: Law, law: Law, seed: int, share: float) -> Swarm | None:
        """Particles that begin again with what pulses given alone have taught, in place of these pulses.

        That is where levels foretell the pulses better than the curves do that they have taught (decision 62). Half of
        the particles then have a law by levels, every second one of these by those of the pulses, the others by those
        along such curves; the other half is what it is with nothing given (decision 60).

        Args:
            learnt_law: what particles mean so far.
            law: the prior of particles that may have a law by levels.
            seed: of the draws.
            share: probability that the pairs are of another curve.

        Returns:
            None where the pulses of any of the people make no law by levels, or a curve foretells them better.
        """
        rows, people = self._rows, len(self.evidence)
        levels = [levels_of(self.history, self.halves * person) for person in range(people)]
        curved = np.where(recruits(rows.kinds[..., 1]), rows.log_weights, -np.inf)
        if not all(levels) or np.isneginf(curved[:: self.halves].max(1)).any():
            return None
        by_curves = [self._foretold_by_curves(learnt_law, rows, *one) for one in enumerate(levels)]
        if any(found >= foretold(own) for found, own in zip(by_curves, levels, strict=True)):
            return None
        half = curved.shape[1]
        begun = Swarm.of(law, people, half, seed).doubting(share)
        crowd, curve = begun.crowd.copied(), np.flatnonzero(latents_of("recruitment"))
        for person, own in enumerate(levels):
            rng, row = stream(seed + person, TAUGHT), self.halves * person
            picks = rng.permutation(systematic(curved[row : row + 1], half)[0])
            taught = rows.values[row : row + 1, picks], rows.kinds[row : row + 1, picks]
            values, kinds = crowd.values[person, :half], crowd.kinds[person, :half]
            values[:, curve] = taught[0][0][:, curve]
            values[:, -CARRIED:] = along_curves(learnt_law.meanings(*taught, -1)[0])
            values[::2, -CARRIED:] = drawn(own, len(values[::2]), rng)
            kinds[:, 1] = NoiseKind.BY_LEVELS
        given = History(self.history.columns[:, self._are_given])
        return replace(begun, crowd=crowd, evidence=self.evidence, bets=self.bets, given=given)

    def _foretold_by_curves(self, law: Law, rows: Crowd, person: int, levels: list[Level]) -> float:
        """Log density of the pulses of levels, each as curves foretell it that the others have taught, summed [nat].

        The curves have learnt that pulse, too, as a part of a trial, which is taken back by weights [Vehtari2017].
        """
        row, at = self.halves * person, np.concatenate([own.shifts_pct_rmt for own in levels])
        pulses = self.history.columns[row, self._are_given]
        pulses = pulses[np.isin(pulses[:, SHIFT], at)]
        pulses[:, [COUNTS, BY_CURVES]] = 1.0, 0.0
        curved = recruits(rows.kinds[row, :, 1])
        fields = law.meanings(rows.values[row : row + 1], rows.kinds[row : row + 1], -1)
        likely = np.array([log_likelihoods(fields, pulse[np.newaxis, np.newaxis])[0, curved] for pulse in pulses])
        weights = rows.log_weights[row, curved]
        found = log_sum(weights + (1.0 - GIVEN_COUNTS) * likely) - log_sum(weights - GIVEN_COUNTS * likely)
        return float(found.sum())

    @property
    def _are_given(self) -> BoolArray:
        """Which trials were pulses alone that were given first, (n,)."""
        given: BoolArray = self.history.columns[0, :, COUNTS] < 1.0
        return given

    @property
    def others(self) -> list[History]:
        """The trials that were not, each as one of each person."""
        columns = self.history.columns[:: self.halves, ~self._are_given]
        return [History(columns[:, at : at + 1]) for at in range(columns.shape[1])]

    @property
    def ends_with_given(self) -> bool:
        """Whether the last trial was a pulse alone that was given first."""
        return bool(self._are_given[-1:].any())

    @property
    def whole_history(self) -> History:
        """The trials, with those first that a law by levels stands for."""
        own = self.history
        return own if self.given is None else History(np.concatenate((self.given.columns, own.columns), axis=1))

    def unheeding(self, who: BoolArray) -> Swarm:
        """The same where hardly a particle learns from pulses given alone, of some people (b,)."""
        if not who.any():
            return self
        heeded = np.where(self.of_given, self.log_weights, -np.inf)
        left = self.log_weights - log_sum(heeded)[:, np.newaxis] - UNHEEDED
        log_weights = np.where(who[:, np.newaxis] & self.of_given, left, self.log_weights)
        log_weights -= log_sum(log_weights)[:, np.newaxis]
        return self.weighing(log_weights)

    @property
    def before_pairs(self) -> bool:
        """True if no pair was learnt yet."""
        return bool(np.isnan(self.history.isi_ms).all())

    @property
    def of_given(self) -> BoolArray:
        """Which particles learn from pulses given alone, (p,)."""
        particles = self.log_weights.shape[1]
        heeds: BoolArray = np.arange(particles) < particles // self.halves
        return heeds

    @property
    def _rows(self) -> Crowd:
        """The particles of each half of each person, to be changed."""
        people, particles = self.log_weights.shape
        rows = people * self.halves, particles // self.halves
        return Crowd._make(each.reshape(*rows, *each.shape[2:]) for each in self.weighed.copied())

    def after(self, trial: History, law: Law, moves: Moving, seed: int) -> Swarm:
        """The particles after one more trial: weighed, resampled where too few carry the posterior, and moved."""
        crowd, trials = self._rows, self.trials + 1
        told = self._as_curves_have_it(trial, law, crowd)
        sweeps = tuple(moves.sweeps_after(trials, resampled=worn) for worn in (False, True))
        step, people = trials + self.stood_for, len(self.evidence)
        dice = [seeds(seed, step + OTHER_HALF * half, people) for half in range(self.halves)]
        learnt, found = self._learnt(told, law, crowd, (moves.min_ess, sweeps, np.stack(dice, axis=1).ravel()))
        with np.errstate(invalid="ignore"):  # where there were no moves, no share of them was accepted
            health = Health(found[:, 1], found[:, 3] / found[:, 2], found[:, 5] / found[:, 4])
        return replace(learnt, bets=self._bets_after(told, found[:, 6:]), health=health)

    def _bets_after(self, told: History, foretold: FloatArray) -> Bets:
        """The bets after one more trial; none is on what counts as a part of one, whose predictions are too wide.

        Args:
            told: the trial as each half has it.
            foretold: probabilities below its ends times weights, and these, summed, by half of each person, (rows, 3).
        """
        if (told.columns[..., COUNTS] < 1).any():
            return self.bets
        sums = foretold.reshape(len(self.evidence), self.halves, 3)
        elsewhere = ~np.isnan(told.columns[:: self.halves, 0, BY_CURVES])
        sums[elsewhere, 1:] = 0.0  # of a pulse at another intensity those say nothing who do not learn from such pulses
        below, weights = np.split(sums.sum(1), [2], axis=1)
        return self.bets.after(below / np.maximum(weights, 1e-300))

    def conditioned(self, trial: History, law: Law) -> Swarm:
        """The same particles, weighed by one more trial as well."""
        crowd = self._rows
        told = self._as_curves_have_it(trial, law, crowd)
        nothing = np.zeros(len(crowd.kinds), dtype=np.uint64)
        return replace(self._learnt(told, law, crowd, (0.0, (0, 0), nothing))[0], health=None)

    def _learnt(
        self, told: History, law: Law, crowd: Crowd, how: tuple[float, tuple[int, ...], Seeds]
    ) -> tuple[Swarm, FloatArray]:
        """The swarm after a trial as each half has it; and what the engine found, by half of each person."""
        history, (min_ess, (kept, resampled), dice) = self.history.appended(told), how
        found = law.learn(history.columns, min_ess, (kept, resampled), dice, crowd)
        people, particles = self.log_weights.shape
        if self.halves == 1:
            evidence = found[:, 0]
        else:  # each half is normalised, and what is found is its share times the likelihood
            by_half = found[:, 0].reshape(people, 2)
            if self.before_pairs and np.isnan(told.isi_ms).all():  # as probable to the half that does not learn it
                by_half[:, 1] += np.nan_to_num(told.columns[::2, 0, BY_CURVES])
            evidence = log_sum(by_half)
            crowd.log_weights[:] += (by_half - evidence[:, np.newaxis]).reshape(-1, 1)
        crowd = Crowd._make(each.reshape(people, particles, *each.shape[2:]) for each in crowd)
        learnt = replace(self, crowd=crowd, evidence=self.evidence + evidence, history=history, chosen_by=None)
        return learnt, found

    def _as_curves_have_it(self, trial: History, law: Law, rows: Crowd) -> History:
        """A trial as each half has it; at another intensity with the density that its curves predict (decision 45)."""
        columns = trial.columns.repeat(self.halves, axis=0)
        elsewhere = ~np.isnan(columns[..., BY_CURVES]) & ((columns[..., SHIFT] != 0) | self.before_pairs)
        if not elsewhere.any():
            columns[..., BY_CURVES] = np.nan
            return History(columns)
        given = elsewhere & np.isnan(columns[..., 0]) & self.before_pairs
        columns[given, COUNTS] = GIVEN_COUNTS
        if self.halves > 1:
            unheeded = given & (np.arange(len(columns)) % 2 > 0)[:, np.newaxis]
            columns[unheeded, 2:4], columns[unheeded, SHIFT] = (-np.inf, np.inf), 0.0
            elsewhere &= ~unheeded
        columns[..., BY_CURVES] = np.where(elsewhere, 0.0, np.nan)
        curved = recruits(rows.kinds[..., 1])
        likely = log_likelihoods(law.meanings(rows.values, rows.kinds, -1), columns)
        joint, among = (
            log_sum(np.where(curved, each, -np.inf)) for each in (rows.log_weights + likely, rows.log_weights)
        )
        predicted = np.where(np.isfinite(among), joint - among, 0.0)
        columns[..., BY_CURVES] = np.where(elsewhere, predicted[:, np.newaxis], np.nan)
        return History(columns)

    def as_usual(self, law: Law, usual: Law) -> Swarm:
        """The same particles under the prior that ISIs are chosen with."""
        return replace(self, chosen_by=(law, usual))

    def picked(self, law: Law, size: int, person: int | None = None) -> tuple[Latents, Singles]:
        """Equally weighted particles that represent the same posterior, and what they mean now, fields of (b, s).

        Args:
            law: what they mean.
            size: how many.
            person: of one person alone.
        """
        crowd = self.weighed if person is None else self.weighed.of_person(person)
        picks, fields = law.represent(crowd, size, self.trials)
        return self.named(crowd).taken(picks), fields
