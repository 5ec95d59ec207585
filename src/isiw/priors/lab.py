"""A lab's prior, learnt from the sessions of its own people."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, TypeAlias, TypeVar

import numpy as np

import isiw
from isiw.checks import MOST_OF_A_KIND, Checked, share, whole
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError, LogError
from isiw.files import hash_of
from isiw.log.codes import spelling
from isiw.log.reader import ThresholdRecord
from isiw.log.record import SessionRecord, read_any
from isiw.log.salvage import salvage
from isiw.models.particles import ParticleModel
from isiw.models.particles.laws import Floor, Gain, Muscle, NoiseShares
from isiw.models.particles.places import MOST_APART_MS, Place
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior, ShapeShares
from isiw.priors.covariates import Slope, expected, slopes_of
from isiw.priors.days import (
    after_pulses,
    recalled,
    require_each_once,
    require_meps,
    require_whole,
    stated_hit_delay_ms,
    too_far_apart_ms,
)
from isiw.priors.population import (
    Law,
    Population,
    beside,
    floor,
    gain,
    hyper_prior,
    learnt,
    mixed,
    mixed_shares,
    muscle,
    people_of,
    place,
    usual_shares,
)
from isiw.session.given import given_pulses
from isiw.trials import Trial
from isiw.types import Conditioning, Reference
from isiw.visit import MOST_APART_PCT_RMT, Visit, different_muscles

_T = TypeVar("_T")

AnyRecord: TypeAlias = SessionRecord | ThresholdRecord

SCHEMA_VERSION: Final = 2

LEAST_USUAL: Final = 0.1
"""The share that the built-in prior keeps however many people were learnt from, so that an odd one is still found."""

PEOPLE_FOR_HALF: Final = 2
"""From how many people on a lab's own law has half of the probability."""


_MOST_OF_OWN: Final = 1.0 - LEAST_USUAL + 1e-9  # rounded in a file

_EACH_KIND: Final = "Learn a prior from each kind of session."


@dataclass(frozen=True)
class LearntSession(Checked):
    """A session, or a search for the threshold, that was learnt from."""

    sha256: str  # of its log's bytes
    subject: str
    trials: Annotated[int, partial(whole, least=1, most=MOST_OF_A_KIND)]
    simulated: bool = False
    muscle: str = ""  # as the session notes it


@dataclass(frozen=True)
class LabPrior(Checked):
    """A lab's people as a prior, in numbers only. There is no law of what no session has shown.

    Args:
        sessions: the sessions that it was learnt from.
        p_window: probability that there is a window.
        shapes: probabilities of the families of profiles.
        noise: probabilities of the kinds of noise.
        place: start and width of the window.
        floor: the EMG floor.
        gain: responses with noise of a constant CV.
        muscle: recruitment curves.
        slopes: how the start of windows goes with what is noted of people.
        schema_version: of the file.
        isiw_version: the version that learnt it.

    Raises:
        InvalidValueError: no session, an invalid probability, or one that leaves nothing to people in general.
    """

    sessions: tuple[LearntSession, ...]
    p_window: Annotated[float, partial(share, above=0, below=1.0)]
    shapes: ShapeShares
    noise: NoiseShares
    place: Place | None = None
    floor: Floor | None = None
    gain: Gain | None = None
    muscle: Muscle | None = None
    slopes: tuple[Slope, ...] = ()
    schema_version: Annotated[int, partial(whole, least=1, most=SCHEMA_VERSION)] = SCHEMA_VERSION
    isiw_version: str = isiw.__version__

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.sessions:
            raise InvalidValueError("a lab's prior is learnt from at least one session", got=self.sessions)
        laws: tuple[Any, ...] = (self.place, self.floor, self.gain, self.muscle)
        for component in filter(None, laws):
            share(f"{type(component).__name__}.share", component.share, above=0, most=_MOST_OF_OWN)

    @property
    def simulated(self) -> bool:
        """True if it was learnt from simulated people."""
        return any(session.simulated for session in self.sessions)

    @property
    def noted_muscle(self) -> str:
        """Whose EMG was recorded, as the sessions note it; empty if none does."""
        return next((session.muscle for session in self.sessions if session.muscle), "")

    def joined(self, usual: Prior | None = None, visit: Visit | None = None) -> Prior:
        """A prior in which the lab's laws stand beside those of people in general.

        Args:
            usual: that of people in general, by default the built-in one.
            visit: what is noted of the next person, with whose age, height and tap windows may go.
        """
        usual, place = usual or Prior(), self.place
        if place is not None and visit is not None:
            place = expected(place, self.slopes, visit)
        own = usual.profile if self.place is None else usual.profile.after(self.place.conditioning)
        profile = replace(own, p_window=self.p_window, shapes=self.shapes, places=_given(place))
        return replace(
            usual,
            profile=profile,
            noise=self.noise,
            floors=beside(usual.floors, _given(self.floor)),
            gains=beside(usual.gains, _given(self.gain)),
            muscles=beside(usual.muscles, _given(self.muscle)),
        )


def _given(component: _T | None) -> tuple[_T, ...]:
    return () if component is None else (component,)


def learn(
    logs: Sequence[str | Path],
    *,
    again: bool = False,
    damaged: bool = False,
    seed: int = 0,
    on_done: Callable[[SessionRecord], None] = lambda _record: None,
) -> LabPrior:
    """Learn a lab's prior from the logs of its sessions, one a person, and of searches for the threshold.

    The built-in model learns the trials whatever the sessions were run with, so that no person counts twice if
    a session was run with an earlier prior of the lab. Pulses of searches and over recruitment curves teach the floor
    and the curve of the person that their log names, together with a session of that person or alone.

    Args:
        logs: their paths.
        again: whether a person may be in more than one; each session counts as a person of its own.
        damaged: whether to learn what is left of damaged logs.
        seed: seed of the sampler.
        on_done: called after each session.

    Raises:
        LogError: no list, no log in it, one that cannot be read or has no MEP, the same log or person twice, a search
            that does not say of whom it is, or sessions of different events, hit delays, conditioning stimuli, muscles
            or intensities, or some simulated.
        DamagedLogError: a log is damaged.
        InvalidValueError: a seed that is no whole number from 0 on, two logs of one session, or a search for the hot
            spot or without a threshold.
    """
    seed = whole("seed", seed, least=0)
    if isinstance(logs, str | Path):
        raise LogError("logs must be a list of paths", got=str(logs), remedy=f'Write ["{logs}"] for a single one.')
    read = [read_any(salvage(path)) for path in logs]
    records = [record for record in read if isinstance(record, SessionRecord)]
    for record in read:
        if not damaged:
            require_whole(record, "with damaged=True, or isiw prior learn --damaged")
        if isinstance(record, SessionRecord):
            require_meps(record)
    sessions = tuple(_learnt_session(record) for record in read)
    _require_different(read, records, sessions, again=again)
    given = _pulses_of_people([record for record in read if isinstance(record, ThresholdRecord)])
    conditioning, space = (records[0].header.conditioning, records[0].header.space) if records else _NO_SESSION
    prior = Prior(ProfilePrior().after(conditioning))
    posteriors = []
    for record in records:
        posteriors.append(recalled(record, prior, given=given.pop(spelling(record.header.subject), ())))
        on_done(record)
    for number, pulses in enumerate(given.values()):
        posteriors.append(after_pulses(_OF_CURVES.begin(space, seed + number), pulses))
    rng = np.random.default_rng(seed)
    people = people_of(posteriors)
    population = learnt(people, hyper_prior(prior, space), usual_shares(prior), rng)
    stated_ms = next(filter(None, map(stated_hit_delay_ms, records)), None)
    lab = _lab_prior(population, prior, sessions, (space.reference, stated_ms, conditioning))
    if lab.place is None:
        return lab
    visits = [record.header.visit for record in records]
    return replace(lab, slopes=slopes_of(visits, people.blocks["place"], population.laws["place"], rng))


_NO_SESSION: Final[tuple[Conditioning, DesignSpace]] = ("tap", VALVE_SPACE)
"""What windows would be counted from, of which pulses of TMS alone teach nothing."""

_OF_CURVES: Final = ParticleModel(Prior(noise=NoiseShares(0.0, 0.0, 0.95, 0.0, 0.05), other_curve=0.0))
"""Pulses of TMS alone say nothing of kinds of noise without a curve, nor of the curve of pairs that nobody gave."""


def _pulses_of_people(searches: Sequence[ThresholdRecord]) -> dict[str, tuple[Trial, ...]]:
    """The pulses of each person's searches, by the person."""
    people: dict[str, list[ThresholdRecord]] = {}
    for record in searches:
        if not record.header.subject:
            raise LogError(
                "this search for the threshold does not say of whom it is",
                got=str(record.path),
                remedy="Leave it out: its person may be another log's.",
            )
        people.setdefault(spelling(record.header.subject), []).append(record)
    return {subject: given_pulses(sorted(own, key=lambda one: one.header.created)) for subject, own in people.items()}


def _learnt_session(record: SessionRecord | ThresholdRecord) -> LearntSession:
    header, digest = record.header, hash_of(record.path)
    if isinstance(record, SessionRecord):
        trials, muscle = len(record.table.told), record.header.visit.muscle
    else:
        trials, muscle = record.given, record.header.muscle
    return LearntSession(digest, header.subject, trials, header.device.simulated, muscle.strip())


def _require_different(
    read: Sequence[AnyRecord], records: Sequence[SessionRecord], sessions: Sequence[LearntSession], *, again: bool
) -> None:
    """Raise if one log or person would count twice, or if logs do not belong together."""
    if not read:
        raise LogError("there is no session to learn from", remedy="Name at least one log.")
    hashes = [session.sha256 for session in sessions]
    _require_once(read, hashes, "two logs are the same", "Name it once.")
    if not again:
        subjects = [spelling(record.header.subject) for record in records]
        remedy = "Leave one out, or count each session as a person of its own: again=True, or --again."
        _require_once(records, subjects, "two logs are of the same person, or do not say of whom", remedy)
    require_each_once(records)
    if len({session.simulated for session in sessions}) > 1:
        simulated = [str(record.path) for record in read if record.header.device.simulated]
        raise LogError("some of the sessions are simulated, others are not", got=simulated, remedy="Leave these out.")
    kinds: dict[str, Collection[str]] = {
        "count ISIs from different events": {record.header.space.reference for record in records},
        "have different conditioning stimuli": {record.header.conditioning for record in records},
        "are of different muscles": different_muscles(session.muscle for session in sessions),
    }
    for differ, kind in kinds.items():
        if len(kind) > 1:
            raise LogError(f"the sessions {differ}", got=sorted(kind), remedy=_EACH_KIND)
    noted_pct_rmt = [r.header.visit.intensity_pct_rmt for r in records if r.header.visit.intensity_pct_rmt is not None]
    if noted_pct_rmt and max(noted_pct_rmt) - min(noted_pct_rmt) > MOST_APART_PCT_RMT:
        raise LogError(
            "the sessions are of different intensities, and each has windows of its own",
            got=f"{min(noted_pct_rmt):g} to {max(noted_pct_rmt):g} % of RMT",
            expected=f"at most {MOST_APART_PCT_RMT:g} % of RMT apart",
            remedy=_EACH_KIND,
        )
    if (apart_ms := too_far_apart_ms(records)) is not None:
        raise LogError(
            "the sessions were run on rigs with different hit delays, so their windows cannot be compared",
            got=f"hit delays from {apart_ms[0]:g} to {apart_ms[1]:g} ms",
            expected=f"at most {MOST_APART_MS:g} ms apart",
            remedy="Learn a prior for each rig.",
        )


def _require_once(records: Sequence[AnyRecord], keys: Sequence[str], what: str, remedy: str) -> None:
    first: dict[str, Path] = {}
    for record, key in zip(records, keys, strict=True):
        if key in first:
            raise LogError(what, got=f"{first[key]} and {record.path}", remedy=remedy)
        first[key] = record.path


def _lab_prior(
    population: Population,
    usual: Prior,
    sessions: tuple[LearntSession, ...],
    rig: tuple[Reference, tuple[float, float] | None, Conditioning],
) -> LabPrior:
    laws, shares = population.laws, population.shares
    return LabPrior(
        sessions=sessions,
        p_window=mixed(float(shares["window"][1]), usual.profile.p_window, LEAST_USUAL),
        shapes=mixed_shares(shares["shape"].tolist(), usual.profile.shapes, LEAST_USUAL),
        noise=mixed_shares(shares["noise"].tolist(), usual.noise, LEAST_USUAL),
        place=_where_known(laws["place"], lambda share, mean, sd: place(share, mean, sd, *rig)),
        floor=_where_known(laws["floor"], floor),
        gain=_where_known(laws["gain"], gain),
        muscle=_where_known(laws["muscle"], lambda share, mean, sd: muscle(share, mean, sd, "as in the lab")),
    )


def share_of(members: float) -> float:
    """The share of a lab's own law beside that of people in general."""
    return 1.0 - max(LEAST_USUAL, PEOPLE_FOR_HALF / (PEOPLE_FOR_HALF + members))


def _where_known(law: Law, component: Callable[..., _T]) -> _T | None:
    """The law as a component of the prior; None if fewer than one person was learnt from."""
    if law.members < 1.0:
        return None
    return component(share_of(law.members), law.mean, law.sd)
