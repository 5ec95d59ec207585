"""What a logged session says about its person: its trials told to the particle model once more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from isiw.checks import mean_and_sd
from isiw.errors import DamagedLogError, LogError
from isiw.log.reader import SessionRecord
from isiw.models.particles import ParticleModel, ParticlePosterior
from isiw.models.particles.places import MOST_APART_MS
from isiw.models.particles.prior import Prior
from isiw.strategy.outcomes import Outcomes
from isiw.text.harmless import command

TOLD_LOSSES: Final = 3
"""Losses that an error names; isiw show lists them all."""


def recalled(record: SessionRecord, prior: Prior, *, particles: int = 1000) -> ParticlePosterior:
    """The posterior after a logged session; the hit delay is what its rig stated, or else what the prior says.

    Args:
        record: the session.
        prior: what is believed of people before it.
        particles: how many particles.

    Raises:
        LogError: it has no accepted trial, or none with an MEP.
        InvalidValueError: the prior's places count from another event than the session's ISIs, or are of a rig with
            another hit delay.
    """
    require_meps(record)
    model = ParticleModel(_of_rig(prior, record), particles=particles)
    if (limit_mv := record.header.detection_limit_mv) is not None:
        model = replace(model, detection_limit_mv=limit_mv)
    posterior = model.begin(record.header.space, seed=record.header.seed)
    told = Outcomes(record.header.space.reference, record.header.strategy.settings.get("amplitude_step_mv")).of(
        record.table
    )
    for outcome in told.pulses:
        posterior = model.update(posterior, told.observation(outcome))
    return posterior


def require_meps(record: SessionRecord) -> None:
    """Check that there is something to learn from a session."""
    record.require_read("seed", "strategy", "device", "visit", "subject")
    if not record.table.told:
        raise LogError(
            "the session has no accepted trial to learn from", got=str(record.path), remedy="Leave this log out."
        )
    if record.is_silent:
        raise LogError(
            "the session has no MEP to learn from: every amplitude is 0, below the detection limit",
            got=str(record.path),
            remedy="Leave this log out.",
        )


def require_whole(record: SessionRecord) -> None:
    """Check that nothing is lost of a session that is learnt from: an exclusion may be among it."""
    if record.losses:
        raise DamagedLogError(
            "the log is damaged, so that what a person excluded may count as if nobody had",
            got=f"{record.path}: {' '.join(record.losses[:TOLD_LOSSES])}",
            remedy=f"Leave it out; or, if what {command('show', record.path)} lists is right, let it count "
            "all the same: damaged=True, or isiw prior learn --damaged.",
        )


def stated_hit_delay_ms(record: SessionRecord) -> tuple[float, float] | None:
    """Mean and SD of the hit delay stated by a session's strategy or its rig [ms]; None if neither states it."""
    stated = record.header.strategy.settings.get("hit_delay_ms") or record.header.device.hit_delay_ms
    return None if stated is None else mean_and_sd("the session's hit_delay_ms", stated)


def too_far_apart_ms(records: Sequence[SessionRecord]) -> tuple[float, float] | None:
    """The least and the largest stated hit delay [ms] where they are further apart than one rig's; else None.

    From the valve command, the same window is as much later as a rig's taps are. Of ISIs from the impact it is None.
    """
    stated_ms = [stated_hit_delay_ms(record) for record in records if record.header.space.reference == "valve"]
    means_ms = [mean_ms for mean_ms, _ in filter(None, stated_ms)]
    if not means_ms or max(means_ms) - min(means_ms) <= MOST_APART_MS:
        return None
    return min(means_ms), max(means_ms)


def _of_rig(prior: Prior, record: SessionRecord) -> Prior:
    """The prior, told what came when and whose MEPs these are, as far as prior, strategy or device say."""
    start = prior.profile.start
    delay_ms = stated_hit_delay_ms(record) or start.hit_delay_ms
    profile = replace(prior.profile, start=replace(start, hit_delay_ms=delay_ms)).after(record.header.conditioning)
    told = record.header.strategy.settings.get("muscle")
    known = told if told in {muscle.name for muscle in prior.muscles} else None
    settings, visit = record.header.strategy.settings, record.header.visit
    stated_pct_rmt = settings.get("intensity_pct_rmt") or visit.intensity_pct_rmt or prior.intensity_pct_rmt
    return replace(prior, profile=profile, muscle=prior.muscle or known, intensity_pct_rmt=stated_pct_rmt)
