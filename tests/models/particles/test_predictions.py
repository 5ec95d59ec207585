"""What particles say about the window is what the rule says of their expected MEPs."""

import numpy as np
import pytest

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.excess import window_from_excess
from isiw.metrics import f1
from isiw.models.particles.model import ParticleModel
from isiw.models.particles.predictions import PersonSample, drawn_mep_mv
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.particles.records import LOG_FLOOR
from isiw.models.protocol import Observation
from isiw.models.shared.draws import LEVELS
from isiw.models.shared.start import StartPrior
from isiw.models.windows import Runs, grid_of, profile_grid
from isiw.native import engine
from isiw.window import Window
from native.drawn import Case


@pytest.mark.parametrize(
    "space",
    [
        VALVE_SPACE,
        DesignSpace(0, 300, reference="valve"),
        DesignSpace(240, 300, reference="valve"),
        DesignSpace(0, 500, step_ms=25, reference="valve"),
    ],
    ids=["whole windows", "windows cut off", "inside windows", "a coarse grid"],
)
def test_windows_are_those_of_the_rule_also_where_a_peak_lies_beyond_the_range(space: DesignSpace) -> None:
    # Tables of facilitations are interpolated in windows and in MEPs; they differ where an edge or a peak lies between.
    case = Case(Prior(ProfilePrior(p_window=0.9, start=StartPrior(p_anywhere=0.3))), space)
    sample, grid_ms = PersonSample(case.fields(case.drawn(1000, 3)), space), grid_of(space)
    masks = sample.window_masks(grid_ms)[0]
    meps_mv, baselines_mv = (x[0].astype(float) for x in (sample.expected_mep_mv(grid_ms), sample.baselines_mv()))
    told = [Window.from_mask(space.grid_ms, mask) for mask in masks]
    ruled = [
        window_from_excess(space.grid_ms, mep_mv - baseline_mv, baseline_mv)
        for mep_mv, baseline_mv in zip(meps_mv, baselines_mv.tolist(), strict=True)
    ]
    scores = np.array([f1(ours, rules, space) for ours, rules in zip(told, ruled, strict=True)])
    assert (scores > 0).mean() > 0.995  # none against one: excesses within a hair of the least that counts
    assert np.quantile(scores[scores > 0], 0.01) > 0.98


def test_one_call_finds_the_windows_of_the_particles_that_stand_for_a_persons() -> None:
    posterior = ParticleModel(particles=300).begin(VALVE_SPACE, 3, people=2)
    for person in (0, 1):
        picks, windows = posterior.law.estimate(posterior.swarm.crowd.of_person(person), 200, 0)
        latents, fields = posterior.swarm.picked(posterior.law, 200, person)
        np.testing.assert_array_equal(posterior.swarm.latents.values[person][picks], latents.values)
        masks = PersonSample(fields, VALVE_SPACE).window_masks(grid_of(VALVE_SPACE))[0]
        np.testing.assert_array_equal(windows.found, np.flatnonzero(masks.any(-1)))
        np.testing.assert_array_equal(windows.sizes, masks[windows.found].sum(-1))
        inside, f1 = Runs.of_masks(masks).best
        np.testing.assert_array_equal(windows.best[0], inside)
        assert windows.best[1] == f1
    for nobody in (posterior.swarm.crowd, posterior.swarm.crowd.of_person(2)):
        with pytest.raises(ValueError, match="one person"):
            posterior.law.estimate(nobody, 200, 0)


@pytest.mark.slow
def test_nine_of_ten_meps_of_people_in_general_lie_in_the_predicted_band() -> None:
    model = ParticleModel(particles=2000, thinned=1000)
    isis_ms = profile_grid(VALVE_SPACE).astype(float)
    low_mv, high_mv = model.begin(VALVE_SPACE, seed=5).prediction_mv(0.9)
    assert low_mv.shape == high_mv.shape == isis_ms.shape
    meps_mv = np.stack([model.simulate(VALVE_SPACE, seed, [isis_ms[50]]).mep_mv for seed in range(600)])[:, 0]
    assert 0.85 < ((meps_mv >= low_mv[50]) & (meps_mv <= high_mv[50])).mean() < 0.95
    assert 0.02 < (meps_mv < low_mv[50]).mean() < 0.08


def test_each_person_of_a_batch_has_a_band_of_its_own() -> None:
    model = ParticleModel(particles=200)
    posterior = model.update(model.begin(VALVE_SPACE, seed=5, people=2), Observation.of([100.0] * 2, [0.01, 1.0]))
    (_, small_mv), (_, large_mv) = (posterior.prediction_mv(0.9, person) for person in range(2))
    assert (small_mv < large_mv).all()


@pytest.mark.parametrize("samples", [1, 2, 20, 41, 192])
def test_outcomes_reach_from_below_the_floor_to_above_the_largest_meps(samples: int) -> None:
    case = Case(Prior(), VALVE_SPACE)
    fields = np.concatenate([case.fields(case.drawn(samples, seed)) for seed in (1, 2)])
    log_floor, evoked = fields[..., LOG_FLOOR], engine.evoked_means(fields, LEVELS)[1]
    low = np.quantile(log_floor, 0.05, axis=-1) - 1.0
    high = np.quantile(log_floor + np.log1p(evoked.max(-1)), 0.95, axis=-1) + 1.5
    np.testing.assert_allclose(PersonSample(fields, VALVE_SPACE).outcomes[0], np.stack((low, high), axis=-1), rtol=1e-5)


def test_meps_are_drawn_as_often_below_a_quantile_as_it_says() -> None:
    case, isi_ms, shares = Case(Prior(), VALVE_SPACE), np.float32(100.0), np.array([0.05, 0.5, 0.95])
    fields = case.fields(case.drawn(1, 3))
    drawn_mv = drawn_mep_mv(fields, np.full(400, isi_ms), np.random.default_rng(3))
    quantiles_mv = PersonSample(fields, VALVE_SPACE).mep_quantiles_mv(np.array([isi_ms]), shares)[0, 0]
    assert [(drawn_mv < quantile_mv).mean() for quantile_mv in quantiles_mv] == pytest.approx(shares, abs=0.07)
