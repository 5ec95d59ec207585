"""The same person another day: that day's posterior, widened by what changes from day to day.

The window may have moved a little, or be anyone's (dissertation, appendix B), and electrodes and thresholds change.
The next prior is mixtures of normal laws, fitted to the particles of a model that learns the session's trials once
more.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from functools import partial, reduce
from typing import Annotated, Final, TypeAlias

import numpy as np

from isiw.checks import Checked, Positive, Share, mean_and_sd, share
from isiw.errors import DamagedLogError, InvalidValueError, LogError
from isiw.lazy import sklearn
from isiw.log.continuing import require_search
from isiw.log.reader import ThresholdRecord
from isiw.log.record import SessionRecord, require_records
from isiw.log.verdicts import changed_after
from isiw.models.particles import ParticleModel, ParticlePosterior
from isiw.models.particles.latents import LATENTS, Latents, used_by
from isiw.models.particles.mixture import log_sum
from isiw.models.particles.places import MOST_APART_MS
from isiw.models.particles.prior import Prior
from isiw.priors.population import Component, beside, columns, floor, gain, mixed, mixed_shares, muscle, place
from isiw.signals.plausible import is_silent
from isiw.strategy.outcomes import Outcomes
from isiw.text.sanitize import command
from isiw.trials import Trial
from isiw.types import FloatArray, IntArray
from isiw.visit import MOST_APART_PCT_RMT

LISTED_LOSSES: Final = 3
"""Losses that an error names; isiw show lists them all."""


def recalled(
    record: SessionRecord, prior: Prior, *, given: Sequence[Trial] = (), particles: int = 1000
) -> ParticlePosterior:
    """The posterior after a logged session; the hit delay is what its rig stated, or else what the prior says.

    Pulses of TMS alone that were given before it teach the recruitment curve; the session's level may be another one.
    """
    require_meps(record)
    model = ParticleModel(_of_rig(prior, record), particles=particles)
    if (limit_mv := record.header.detection_limit_mv) is not None:
        model = replace(model, detection_limit_mv=limit_mv)
    posterior = model.begin(record.header.space, seed=record.header.seed)
    step_mv = record.header.strategy.settings.get("amplitude_step_mv")
    before = after_pulses(posterior, given).noting_change()
    told = Outcomes(record.header.space.reference, step_mv, pairs_pct_rmt=model.pairs_pct_rmt)
    changes = changed_after(record.events)
    for trial in record.table:
        told = told.of([trial]).changing() if trial.index in changes else told.of([trial])
    return reduce(lambda one, what: one.noting_change() if what is None else one.after(what), told.observations, before)


def after_pulses(posterior: ParticlePosterior, given: Sequence[Trial]) -> ParticlePosterior:
    """A posterior after pulses of TMS alone at intensities of their own."""
    model = posterior.model
    told = Outcomes(posterior.space.reference, pairs_pct_rmt=model.pairs_pct_rmt).of(given)
    return reduce(model.update, map(told.observation, told.pulses), posterior)


def require_meps(record: SessionRecord) -> None:
    """Check that there is something to learn from a session."""
    record.require_read("seed", "strategy", "device", "visit", "subject")
    require_search(record.path, record.header)
    silent = "no MEP to learn from: every amplitude is 0, below the detection limit"
    told = record.table.told  # whatever was learnt before it
    is_mute = is_silent(told, record.header.detection_limit_mv)
    lacking = silent if is_mute else None if told else "no accepted trial to learn from"
    if lacking is not None:
        raise LogError(f"the session has {lacking}", got=str(record.path), remedy="Leave this log out.")


def require_whole(
    record: SessionRecord | ThresholdRecord, way_on: str = "in Python with isiw.priors.after(..., damaged=True)"
) -> None:
    """Check that nothing is lost of a session that is learnt from: an exclusion may be among it."""
    if record.losses:
        raise DamagedLogError(
            "the log is damaged, so that what a person excluded may count as if nobody had",
            got=f"{record.path}: {' '.join(record.losses[:LISTED_LOSSES])}",
            remedy=f"Leave it out; or, if what {command('show', record.path)} lists is right, let it count "
            f"all the same, {way_on}.",
        )


def require_each_once(records: Sequence[SessionRecord]) -> None:
    """Check that no two logs are of one session, whatever was excluded in one of them afterwards."""
    for first, second in itertools.combinations(records, 2):
        trials = list(zip(first.table, second.table, strict=False))
        of_one = len({first.header.subject, second.header.subject} - {""}) < 2
        if of_one and trials and all(replace(one, excluded=other.excluded) == other for one, other in trials):
            raise InvalidValueError(
                "two logs are of the same session",
                got=f"{first.path} and {second.path}",
                expected="each session once",
                remedy="Leave one out.",
            )


def stated_hit_delay_ms(record: SessionRecord) -> tuple[float, float] | None:
    """Mean and SD of the hit delay stated by a session's strategy or its rig [ms]; None if neither states it."""
    stated = record.header.strategy.settings.get("hit_delay_ms") or record.header.device.hit_delay_ms
    return None if stated is None else mean_and_sd("the session's hit_delay_ms", stated)


def too_far_apart_ms(records: Sequence[SessionRecord]) -> tuple[float, float] | None:
    """The least and the largest stated hit delay [ms] if they are not of one rig; None of ISIs from the impact."""
    stated_ms = [stated_hit_delay_ms(record) for record in records if record.header.space.reference == "valve"]
    means_ms = [mean_ms for mean_ms, _ in filter(None, stated_ms)]
    if not means_ms or max(means_ms) - min(means_ms) <= MOST_APART_MS:
        return None
    return min(means_ms), max(means_ms)


def _of_rig(prior: Prior, record: SessionRecord) -> Prior:
    """The prior with the hit delay, the muscle and the intensity that session, strategy or device state."""
    start = prior.profile.start
    delay_ms = stated_hit_delay_ms(record) or start.hit_delay_ms
    profile = replace(prior.profile, start=replace(start, hit_delay_ms=delay_ms)).after(record.header.conditioning)
    stated = record.header.strategy.settings.get("muscle")
    known = stated if stated in {muscle.name for muscle in prior.muscles} else None
    settings, visit = record.header.strategy.settings, record.header.visit
    stated_pct_rmt = settings.get("intensity_pct_rmt") or visit.intensity_pct_rmt or prior.intensity_pct_rmt
    return replace(prior, profile=profile, muscle=prior.muscle or known, intensity_pct_rmt=stated_pct_rmt)


_Normal: TypeAlias = tuple[float, FloatArray, FloatArray]

COMPONENTS: Final = {"place": 6, "floor": 1, "gain": 2, "muscle": 4}
"""Into how many normal laws each part of a posterior is put."""

LEAST_PARTICLES: Final = 50
"""Of fewer particles no laws are made: hardly anything speaks for their kind."""


@dataclass(frozen=True)
class DayToDay(Checked):
    """Differences of the same person from day to day.

    Args:
        p_stays: probability, below 1, that the window is that of the day before, moved as a whole; else it is anyone's.
        shift_sd_ms: SD of the move [ms].
        amplitude_log_sd: SD of the change of MEPs, natural log.
        x50_sd_pct: SD of the change of the input without a tap [% RMT].
        floor_log_sd: SD of the change of the EMG floor, natural log.
        p_other: probability that, beyond these changes, the rest of a person is anyone's.
    """

    p_stays: Annotated[float, partial(share, least=0, below=1)] = 0.7
    shift_sd_ms: Positive = 12.0
    amplitude_log_sd: Positive = 0.4
    x50_sd_pct: Positive = 3.0
    floor_log_sd: Positive = 0.1
    p_other: Share = 0.1


def after(
    *records: SessionRecord, prior: Prior | None = None, law: DayToDay | None = None, damaged: bool = False
) -> Prior:
    """The prior of a person after earlier sessions, for `isiw.make_strategy(prior=...)`.

    Args:
        *records: the person's sessions, the first one first.
        prior: the prior before them; by default the built-in one.
        law: how people differ from day to day.
        damaged: whether to learn what is left of damaged logs.

    Raises:
        LogError: a session without an accepted trial.
        DamagedLogError: a session's log is damaged.
        InvalidValueError: sessions of different people, the same twice, or a later one first; sessions, or a prior,
            that count ISIs from different events, or are of rigs with different hit delays; sessions of which is noted
            that they are of different muscles or intensities.
    """
    _require_days_of_one_person(records)
    if not isinstance(prior, Prior | None):
        raise InvalidValueError("this is not a prior", got=prior, expected="what isiw.priors.load(path) reads")
    prior, law = prior or Prior(), law or DayToDay()
    for record in records if not damaged else ():
        require_whole(record)
    for record in records:
        prior = _another_day(recalled(record, prior), law)
    return prior


def moved(first: SessionRecord, second: SessionRecord, law: DayToDay | None = None) -> float:
    """Probability that a person's window moved between two sessions by more than the usual shift.

    Args:
        first: the earlier session.
        second: the later one.
        law: how people differ from day to day.

    Raises:
        LogError: a session without an accepted trial.
        InvalidValueError: sessions of different people, events, hit delays, muscles or intensities, the same twice, the
            later one first, or one in which there is probably no window.
    """
    _require_days_of_one_person((first, second))
    earlier = recalled(first, Prior())
    _require_window(first, earlier)
    before = _another_day(earlier, law or DayToDay())
    later = recalled(second, before)
    _require_window(second, later)
    weights = (np.exp(later.swarm.log_weights) * later.swarm.latents.present)[0]
    places = later.model.prior.log_places(later.swarm.latents.values, later.space)[0]
    anywhere = np.exp(places[:, 0] - log_sum(places))
    return float((weights * anywhere).sum() / weights.sum())


def _require_days_of_one_person(records: Sequence[SessionRecord]) -> None:
    """Raise if sessions are of different people or muscles, one counts twice, or a later one comes first."""
    require_records(records)
    subjects = sorted({record.header.subject for record in records} - {""})
    if len(subjects) > 1:
        raise InvalidValueError("the sessions are of different people", got=subjects, expected="one subject's")
    for first, second in itertools.pairwise(records):
        if first.header.created > second.header.created:  # as text, which ISO 8601 in UTC sorts
            raise InvalidValueError(
                "the sessions are not in the order in which they were run",
                got=[f"{record.path}, {record.header.created}" for record in (first, second)],
                expected="the first one first",
            )
    for first, second in itertools.combinations(records, 2):
        paths = f"{first.path} and {second.path}"
        if unlike := first.header.visit.unlike(second.header.visit):
            raise InvalidValueError(
                f"the sessions are of {unlike}, and each has a window of its own",
                got=paths,
                expected=f"the same muscle, and intensities at most {MOST_APART_PCT_RMT:g} % of RMT apart",
                remedy="Leave one out.",
            )
        if first.header.conditioning != second.header.conditioning:
            raise InvalidValueError(
                "the sessions have different conditioning stimuli, and each has a window of its own",
                got=paths,
                expected="taps in both, or electrical pulses in both",
                remedy="Leave one out.",
            )
    require_each_once(records)


def _require_window(record: SessionRecord, posterior: ParticlePosterior) -> None:
    probability = float((np.exp(posterior.swarm.log_weights) * posterior.swarm.latents.present).sum())
    if probability < 0.5:
        raise InvalidValueError(
            "whether a window moved cannot be said of a session that probably has none",
            got=f"a probability of a window of {probability:.2f} in {record.path}",
            expected="at least 0.5",
        )


def _another_day(posterior: ParticlePosterior, law: DayToDay) -> Prior:
    """The prior of the next day, from a posterior."""
    usual = posterior.model.prior
    latents, _ = posterior.swarm.picked(posterior.law, posterior.model.particles)
    p_window = float(latents.present.mean())
    shapes, kinds = usual.profile.shapes, usual.noise
    start, stimulus, reference = usual.profile.start, usual.profile.stimulus, posterior.space.reference
    own_place = partial(place, reference=reference, hit_delay_ms=start.hit_delay_ms, conditioning=stimulus)
    profile = replace(
        usual.profile,
        p_window=mixed(p_window, usual.profile.p_window, law.p_other),
        shapes=mixed_shares(_shares(latents.shape[latents.present], astuple(shapes)), shapes, law.p_other),
        places=beside(usual.profile.places, _laws(latents, "place", own_place, law)),
    )
    return replace(
        usual,
        profile=profile,
        changes=replace(usual.changes, noted=()),  # which were that day's
        noise=mixed_shares(_shares(latents.noise, astuple(kinds)), kinds, law.p_other),
        floors=beside(usual.floors, _laws(latents, "floor", floor, law)),
        gains=beside(usual.gains, _laws(latents, "gain", gain, law)),
        muscles=beside(usual.muscles, _laws(latents, "muscle", partial(muscle, name="as before"), law)),
    )


def _shares(kinds: IntArray, usual: Sequence[float]) -> list[float]:
    """Shares of the kinds, counting one more particle that is of all kinds; a law by levels leaves them as usual."""
    of, counts = len(usual), np.bincount(kinds.ravel(), minlength=len(usual))
    counted = counts[:of] + 1.0 / of + counts[of:].sum() * np.array(usual)
    shares: list[float] = (counted / counted.sum()).tolist()
    return shares


def _laws(
    latents: Latents, name: str, component: Callable[[float, FloatArray, FloatArray], Component], law: DayToDay
) -> tuple[Component, ...]:
    keeps = law.p_stays if name == "place" else 1.0 - law.p_other
    return tuple(component(keeps * share, mean, sd) for share, mean, sd in _normals(latents, name, law))


def _normals(latents: Latents, name: str, law: DayToDay) -> list[_Normal]:
    """Normal laws of some latents on the next day; none if hardly a particle uses them."""
    own = columns(name)
    used = used_by(latents.noise, latents.present)[0][:, own].all(-1)
    values = latents.values[0][used][:, own].astype(float)
    if len(values) < LEAST_PARTICLES:
        return []
    centre, spread = values.mean(0), values.std(0) + 1e-6
    # The regularisation keeps a law from being narrower than a few of the particles that it stands for.
    fit = sklearn.mixture.GaussianMixture(
        COMPONENTS[name], covariance_type="diag", reg_covar=0.05, max_iter=1000, random_state=0
    )
    fit.fit((values - centre) / spread)
    added = {
        "start_ms": law.shift_sd_ms,
        "log_floor_mv": law.floor_log_sd,
        "log_gain": law.amplitude_log_sd,
        "log_ceiling": law.amplitude_log_sd,
        "rest": law.x50_sd_pct,
    }
    grown = np.array([added.get(LATENTS[column], 0.0) for column in own])
    means, sds = centre + spread * fit.means_, np.hypot(spread * np.sqrt(fit.covariances_), grown)
    return list(zip(fit.weights_.tolist(), means, sds, strict=True))
