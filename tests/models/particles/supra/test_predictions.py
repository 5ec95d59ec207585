"""What particles say about both kinds of segment is what is true of the same person in a simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.metrics import f1
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.predictions import drawn_mep_mv
from isiw.models.particles.records import REST
from isiw.models.particles.supra.jumps import law_of
from isiw.models.particles.supra.predictions import SupraSample
from isiw.models.particles.supra.prior import LATENTS, SupraPrior
from isiw.models.windows import grid_of
from isiw.native.engine import facilitations
from isiw.subjects.cohorts import cohort
from isiw.subjects.responses import OpposedProfile, PeakProfile, RecruitmentResponse
from isiw.subjects.subject import SimulatedSubject
from isiw.types import Singles
from isiw.window import Window
from known import instance

SPACE = DesignSpace(0, 120, reference="impact")
GRID_MS = grid_of(SPACE)


def latents_of(subject: SimulatedSubject) -> list[float]:
    """What a particle must believe to be right about a simulated person."""
    r, profile = instance(RecruitmentResponse, subject.response), instance(OpposedProfile, subject.profile)
    places = [_place(peak) for peak in (profile.facilitated, profile.depressed)]
    modelled = {
        "start_ms": places[0][0], "log_width_ms": places[0][1], "log_shift": math.log(r.boost_pct_rmt),
        "depressed_start_ms": places[1][0], "depressed_log_width_ms": places[1][1],
        "depressed_log_shift": math.log(r.boost_pct_rmt * profile.depth),
        "log_floor_mv": math.log(r.floor.median_mv), "log_floor_sd": math.log(r.floor.log_sd),
        "drift": 0.0, "startup": 0.0,
        "log_ceiling": math.log(r.amplitude_mv / r.floor.median_mv), "log_slope": math.log(r.slope_per_pct),
        "log_input_sd": math.log(r.slope_per_pct * r.sigma_x_pct_rmt), "log_sigma_y": math.log(r.sigma_y),
        "rest": r.intensity_pct_rmt - r.x50_pct_rmt,
    }  # fmt: skip
    return [modelled[name] for name in LATENTS]


def _place(peak: PeakProfile) -> tuple[float, float]:
    return peak.start_ms, math.log(peak.width_ms)


def modelled(subjects: list[SimulatedSubject]) -> Singles:
    values = np.array([[latents_of(subject) for subject in subjects]], dtype=np.float32)
    kinds = np.tile([0, NoiseKind.RECRUITMENT, 1, 1, 0], (1, len(subjects), 1))
    return law_of(SupraPrior(), SPACE).meanings(values, kinds, 0)


@pytest.fixture(scope="module")
def subjects() -> list[SimulatedSubject]:
    return cohort("supra-threshold", 20, 5)


def test_segments_and_profiles_are_those_of_the_simulated_person(subjects: list[SimulatedSubject]) -> None:
    sample = SupraSample(modelled(subjects), SPACE)
    kinds = [(sample.window_masks(GRID_MS), "window"), (sample.depressed_masks(GRID_MS), "depressed")]
    for masks, kind in kinds:
        for subject, mask in zip(subjects, masks[0], strict=True):
            assert f1(Window.from_mask(SPACE.grid_ms, mask), getattr(subject, kind)(SPACE), SPACE) > 0.96
    ours_mv = sample.expected_mep_mv(GRID_MS)[0]
    np.testing.assert_allclose(ours_mv, [subject.expected_mep_mv(SPACE) for subject in subjects], rtol=0.05)
    np.testing.assert_allclose(sample.baselines_mv()[0], [s.baseline_mv for s in subjects], rtol=0.05)


def test_nothing_is_depressed_where_tms_alone_gives_no_mep(subjects: list[SimulatedSubject]) -> None:
    silent = modelled(subjects)
    silent[..., REST] -= 20.0
    assert not SupraSample(silent, SPACE).depressed_masks(GRID_MS).any()


def test_predicted_outcomes_are_smallest_in_the_depression(subjects: list[SimulatedSubject]) -> None:
    profile = instance(OpposedProfile, subjects[0].profile)
    middles_ms = [peak.start_ms + 0.5 * peak.width_ms for peak in (profile.depressed, profile.facilitated)]
    mass = SupraSample(modelled(subjects[:1]), SPACE).outcome_mass(np.array([*middles_ms, math.nan], dtype=np.float32))[
        0, 0
    ]
    assert mass.sum(-1) == pytest.approx(1.0, abs=1e-5)
    low, high, rest = (mass * np.arange(mass.shape[-1])).sum(-1).tolist()
    assert low < rest < high


@pytest.mark.slow
def test_meps_drawn_by_the_likelihood_are_depressed(subjects: list[SimulatedSubject]) -> None:
    profile = instance(OpposedProfile, subjects[0].profile)
    inside_ms = profile.depressed.start_ms + 0.5 * profile.depressed.width_ms
    isi_ms = np.array([inside_ms] * 400 + [math.nan] * 400, dtype=np.float32)
    fields = modelled(subjects[:1])
    assert facilitations(fields, isi_ms[:1]).item() == pytest.approx(-profile.depth, rel=1e-4)
    drawn_mv = drawn_mep_mv(fields, isi_ms, np.random.default_rng(1))
    assert np.median(drawn_mv[:400]) < np.median(drawn_mv[400:])
