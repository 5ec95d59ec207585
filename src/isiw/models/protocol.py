"""The protocols of a model of one person's responses and of its posterior.

A model is a frozen settings object with two methods: `begin` gives the posterior before any trial, `update` gives the
posterior after one more. A posterior never changes; it holds `b` people at once, and one person is b = 1. Acquisition
functions and strategies see these protocols only.

What else a posterior can answer is a capability. All capabilities of one posterior speak of the same `s` samples, in
the same order and equally weighted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Final, NamedTuple, Protocol, TypeAlias, runtime_checkable

import numpy as np

from isiw.design import DesignSpace
from isiw.estimate import WindowEstimate
from isiw.types import Array, ArrayLike, FloatArray, Singles
from isiw.window import Window

Values: TypeAlias = Array | Sequence[float | None] | Sequence[bool | None]
"""One value a person, as an array or plain; None is not known."""

GIVEN_COUNTS: Final = 0.3
"""As how much of a trial a pulse over the recruitment curve before the first pair counts (decisions 53 and 61)."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One trial of each of b people, as a model learns it.

    Args:
        isi_ms: the realised ISI [ms], shape (b,); NaN means TMS alone.
        mep_mv: amplitude of the MEP [mV], shape (b,); 0 is left-censored at the detection limit; NaN if only
            `response` is known.
        isi_sd_ms: SD of the realised ISI [ms], shape (b,).
        response: 1 seen, 0 not seen, NaN if the amplitude is given instead, shape (b,).
        mep_high_mv: upper end of the interval that begins at `mep_mv` and holds the amplitude [mV], shape (b,); None
            if all amplitudes are points.
        known_mv: mean and SD of a part of the amplitude that is not the pulse's [mV], and the SD of a factor that
            trials of nearly the same ISI share [natural log], shape (b, 3); None for none.
        shift_pct_rmt: by how much the pulse is stronger than the pairs' [% RMT], shape (b,); None for not at all.
    """

    isi_ms: Singles
    mep_mv: Singles
    isi_sd_ms: Singles
    response: Singles
    mep_high_mv: Singles | None = None
    known_mv: Singles | None = None
    shift_pct_rmt: Singles | None = None

    @classmethod
    def of(
        cls,
        isi_ms: Values,
        mep_mv: Values,
        isi_sd_ms: Values | None = None,
        response: Sequence[bool | None] | None = None,
        mep_high_mv: Values | None = None,
        known_mv: Sequence[tuple[float, float, float]] | None = None,
        shift_pct_rmt: Values | None = None,
    ) -> Observation:
        """One trial of each person.

        Args:
            isi_ms: the realised ISI [ms], one a person; None or NaN means TMS alone.
            mep_mv: amplitude of the MEP [mV], one a person; None or NaN if only the response is known.
            isi_sd_ms: SD of the realised ISI [ms], one a person; by default all were measured.
            response: whether a response was seen, one a person; by default amplitudes are.
            mep_high_mv: if amplitudes are intervals, their upper ends [mV], one a person.
            known_mv: mean and SD of a part of the amplitude that is not the pulse's [mV], and the SD of the factor that
                trials of nearly the same ISI share, one a person.
            shift_pct_rmt: by how much the pulse is stronger than the pairs' [% RMT], one a person.
        """
        isi, mep = _column(isi_ms), _column(mep_mv)
        seen = np.full_like(mep, np.nan) if response is None else _column(response)
        sds = np.zeros_like(isi) if isi_sd_ms is None else _column(isi_sd_ms)
        high = None if mep_high_mv is None else _column(mep_high_mv)
        known = None if known_mv is None else np.array(known_mv, dtype=np.float32).reshape(-1, 3)
        return cls(isi, mep, sds, seen, high, known, None if shift_pct_rmt is None else _column(shift_pct_rmt))

    @classmethod
    def side_by_side(cls, people: Sequence[Observation]) -> Observation:
        """One trial of each of some people, of whom the same is known."""
        columns = [[getattr(one, column.name) for one in people] for column in fields(cls)]
        joined: list[Any] = [None if column[0] is None else np.concatenate(column) for column in columns]
        return cls(*joined)


def _column(values: Values) -> Singles:
    return np.array([math.nan if value is None else float(value) for value in values], dtype=np.float32)


@runtime_checkable
class Posterior(Protocol):
    """The posterior of b people after the trials so far."""

    @property
    def trials(self) -> int:
        """Number of trials of each person that it has learnt."""

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person."""


@runtime_checkable
class CountsPairs(Protocol):
    """Capability: says how many of the trials were pairs of stimuli, as acquisition functions that take turns ask."""

    @property
    def pairs(self) -> int:
        """Number of pairs of stimuli of each person; TMS alone comes to all of them together."""


@runtime_checkable
class PredictsOutcomes(Protocol):
    """Capability: the predictive distribution of the next MEP, sample by sample."""

    def outcome_mass(self, isi_ms: Array) -> Array:
        """Probability of each value of the next MEP, on a grid of values that covers all of them.

        Args:
            isi_ms: candidate ISIs [ms], shape (t,).

        Returns:
            Given each posterior sample, shape (b, s, t, y), summing to 1 over y.
        """


@runtime_checkable
class ForeseesReductions(Protocol):
    """Capability: how much the next MEP is expected to tell, by the same distributions without handing them out."""

    def reductions(self, isi_ms: Array, *, of_window: bool) -> Array:
        """The expected reduction of what is unknown, shape (b, t).

        Args:
            isi_ms: candidate ISIs [ms], shape (t,).
            of_window: the summed variance of each ISI's membership in the window, or in a depression; otherwise the
                entropy of all unknowns [nat].
        """


@runtime_checkable
class PredictsMeps(Protocol):
    """Capability: between which amplitudes the next MEP lies."""

    def prediction_mv(self, level: float, person: int = 0) -> tuple[FloatArray, FloatArray]:
        """The band that holds the next MEP with this probability [mV], at the ISIs of the estimate's profile.

        Args:
            level: the probability.
            person: which person.

        Returns:
            Its low and its high end, each of shape (t,).
        """


@runtime_checkable
class SamplesWindows(Protocol):
    """Capability: windows sampled from the posterior."""

    def window_masks(self, isi_ms: Array) -> Array:
        """Which ISIs [ms] (shape (t,)) each sampled window holds, as 0 or 1, shape (b, s, t); all 0 means no window."""


@runtime_checkable
class SamplesDepression(Protocol):
    """Capability: sampled segments in which the tap depresses the MEP, beside the windows in which it enhances it."""

    def depressed_masks(self, isi_ms: Array) -> Array:
        """Which ISIs [ms] (shape (t,)) each sample depresses, as 0 or 1, shape (b, s, t); all 0 means nowhere."""


@runtime_checkable
class SamplesProfiles(Protocol):
    """Capability: profiles sampled from the posterior."""

    def profiles_mv(self, isi_ms: Array) -> Array:
        """Expected MEP [mV] at some ISIs [ms] (shape (t,)) under each sample, shape (b, s, t)."""

    def baselines_mv(self) -> Array:
        """Expected MEP without a tap [mV] under each sample, shape (b, s)."""


@runtime_checkable
class Conditions(Protocol):
    """Capability: fantasies, for batches and look-ahead."""

    def condition(self, isi_ms: Array, mep_mv: Array) -> Posterior:
        """The posterior after one more trial of each person at these ISIs [ms] with these MEPs [mV].

        It may be rougher than `ResponseModel.update`. Shapes (b,).

        Args:
            isi_ms: one ISI a person [ms], shape (b,).
            mep_mv: one MEP a person [mV], shape (b,).
        """


@runtime_checkable
class HasEvidence(Protocol):
    """Capability: how well the model as a whole predicted the trials."""

    def log_evidence(self) -> Array:
        """Log marginal likelihood of the trials so far [nat], shape (b,)."""


@runtime_checkable
class HasBotorchModel(Protocol):
    """Capability: a model of BoTorch's, for its acquisition functions."""

    @property
    def people(self) -> int:
        """Number of people."""

    def botorch_model(self, person: int = 0) -> Any:
        """The BoTorch model of one person: from ISIs [ms] to MEPs on a scale of its own, in double precision."""


@runtime_checkable
class ProposesIsi(Protocol):
    """Capability: a method with a plan of its own."""

    def proposed_isis_ms(self) -> Array:
        """The ISIs [ms] that it wants for each person, in order, before it learns anything, shape (b, k)."""


@runtime_checkable
class ExpectsTheUsual(Protocol):
    """Capability: a posterior that allows for more than is worth a trial, so that ISIs are chosen with another."""

    @property
    def as_usual(self) -> Posterior:
        """The same trials under a prior that holds the unusual for less probable; ISIs are chosen with it."""


@runtime_checkable
class NotesChanges(Protocol):
    """Capability: a posterior that allows for changes during a session, and can learn that there was one."""

    def noting_change(self) -> Posterior:
        """The same trials after somebody has seen that something changes now, such as the place of the coil."""


@runtime_checkable
class LearnsCurves(Protocol):
    """Capability of a model: TMS alone at other intensities than the pairs' teaches it; to others it means nothing."""

    @property
    def pairs_pct_rmt(self) -> float:
        """The intensity of the pairs' pulse [% RMT], as it is stated, or else as it usually is."""


class AtIntensity(NamedTuple):
    """What a posterior expects of a pulse of another intensity.

    Args:
        posterior: the same samples of the window, and the outcomes of such a pulse; of what says anything of it.
        share: the probability that the person is such that anything is known of it.
    """

    posterior: Any
    share: float


@runtime_checkable
class ForeseesIntensities(Protocol):
    """Capability: foresees outcomes at another intensity than the pairs', as pairs of several intensities need."""

    def at_intensity(self, shift_pct_rmt: float) -> AtIntensity:
        """What it expects of a pulse that is so much stronger than the pairs' [% RMT]."""


@runtime_checkable
class ReportsTrouble(Protocol):
    """Capability: a fit that can fail, and says so."""

    @property
    def trouble(self) -> str | None:
        """The fault of the last fit and what replaces it, as full sentences; None if there was none."""


@runtime_checkable
class ResponseModel(Protocol):
    """A model: settings, from which posteriors are made."""

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> Posterior:
        """The posterior before the first trial.

        Args:
            space: the ISIs that may be asked.
            seed: of all randomness.
            people: how many, b.
        """

    def update(self, posterior: Any, observation: Observation) -> Posterior:
        """The posterior after one more trial.

        Args:
            posterior: the posterior before it.
            observation: the trial.

        Raises:
            StrategyError: an observation of a kind that the model cannot learn from.
        """


def pairs_pct_rmt_of(model: object) -> float | None:
    """The intensity of the pairs' pulse that a model reckons with [% RMT]; None if it has no law of other ones."""
    return model.pairs_pct_rmt if isinstance(model, LearnsCurves) else None


def profile_of(model: object) -> Any:
    """The law of the profile that a model's prior expects; None for a model without one."""
    return getattr(getattr(model, "prior", None), "profile", None)


class PriorPerson(NamedTuple):
    """A person drawn from a model's prior.

    Args:
        window: the true window; None if there is none.
        mep_mv: MEPs at the ISIs asked for [mV], shape (n,).
    """

    window: Window | None
    mep_mv: FloatArray


@runtime_checkable
class SimulatesPeople(Protocol):
    """Capability of a model: people of its own, for whom it must be calibrated."""

    def simulate(self, space: DesignSpace, seed: int, isi_ms: ArrayLike) -> PriorPerson:
        """Draw one person from the prior, and an MEP at each ISI exactly as the likelihood says.

        Args:
            space: the design space.
            seed: of the person; it may be the seed of a posterior as well, for they share no randomness.
            isi_ms: ISIs [ms], NaN for TMS alone, shape (n,).
        """
