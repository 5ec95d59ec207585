"""The posterior above the motor threshold: what it learns, and that it keeps the promises of a model."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.metrics import f1
from isiw.models.particles.latents import Latents
from isiw.models.particles.supra import SupraModel
from isiw.models.particles.supra.jumps import law_of
from isiw.models.particles.supra.model import SupraPosterior
from isiw.models.particles.supra.prior import BLOCKS, LATENTS, Segment, SupraPrior
from isiw.models.protocol import SamplesDepression
from isiw.models.shared.history import History
from isiw.models.shared.scales import Scale
from isiw.subjects.cohorts import cohort
from isiw.testing import check_model
from isiw.window import Window
from known import known
from models.told_trials import Trial, told
from native.drawn import Case, seeds, sweeps

SPACE = DesignSpace(0, 120, reference="impact")
MODEL = SupraModel(particles=300, thinned=96)
SEEDS = (1, 2, 3, 4)


def clear_trials(depressed_mv: float) -> list[Trial]:
    """Trials almost without noise: 0.6 mV at rest, 1.5 mV at 60–90 ms, and another MEP at 15–45 ms."""
    isis_ms = [None, None, *np.linspace(0, 120, 25).tolist()]
    ripple = np.exp(0.1 * np.random.default_rng(1).standard_normal(len(isis_ms)))
    meps_mv = [
        1.5
        if isi_ms is not None and 60 <= isi_ms <= 90
        else depressed_mv
        if isi_ms in {15, 20, 25, 30, 35, 40, 45}
        else 0.6
        for isi_ms in isis_ms
    ]
    return [(isi_ms, float(mep_mv * r)) for isi_ms, mep_mv, r in zip(isis_ms, meps_mv, ripple, strict=True)]


@cache
def posterior_after(depressed_mv: float, seed: int = 1) -> SupraPosterior:
    posterior: SupraPosterior = told(MODEL, clear_trials(depressed_mv), SPACE, seed)
    return posterior


@pytest.mark.slow
def test_the_model_conforms() -> None:
    check_model(lambda: SupraModel(particles=200, thinned=64), SPACE, order_tolerance_ms=40.0)


def test_both_kinds_of_segment_are_found_where_they_are_clear() -> None:
    estimate = posterior_after(0.1).estimate()
    assert known(estimate.depressed_probability) > 0.95
    assert f1(estimate.depressed, Window(13, 47), SPACE) > 0.75
    assert f1(estimate.window, Window(58, 92), SPACE) > 0.75


@pytest.mark.slow
def test_a_depression_becomes_less_probable_where_meps_are_as_large_as_without_a_tap() -> None:
    before = [known(MODEL.begin(SPACE, seed).estimate().depressed_probability) for seed in range(12)]
    after = [told(MODEL, 2 * clear_trials(0.6), SPACE, seed).estimate() for seed in range(12)]
    assert np.mean([known(each.depressed_probability) for each in after]) < np.mean(before) - 0.05
    assert np.mean([f1(each.window, Window(58, 92), SPACE) for each in after]) > 0.75


def test_meps_near_the_floor_are_not_called_depressed() -> None:
    person = cohort("recruitment", 1, 4)[0].begin(4)
    isis_ms = [None] * 10 + 2 * np.linspace(0, 120, 25).tolist()
    trials = [(trial.isi_ms, trial.mep_mv) for trial in (person.respond(isi_ms, "impact") for isi_ms in isis_ms)]
    estimates = [told(MODEL, trials, SPACE, seed).estimate() for seed in SEEDS]
    assert [estimate.depressed for estimate in estimates] == [None] * len(SEEDS)
    assert np.mean([estimate.depressed_probability for estimate in estimates]) < 0.2


def test_what_is_sampled_has_both_kinds_of_segment() -> None:
    posterior = posterior_after(0.1)
    assert isinstance(posterior, SamplesDepression)
    isi_ms = np.array([30.0, 75.0, 110.0])
    enhanced, depressed = posterior.window_masks(isi_ms), posterior.depressed_masks(isi_ms)
    assert enhanced.shape == depressed.shape == (1, MODEL.thinned, 3)
    posteriors = [posterior_after(0.1, seed) for seed in SEEDS]
    shares = [[p.depressed_masks(isi_ms).mean(1)[0, :2], p.window_masks(isi_ms).mean(1)[0, :2]] for p in posteriors]
    means = np.mean([[share.tolist() for share in each] for each in shares], axis=0)
    assert means == pytest.approx(np.array([[1.0, 0.0], [0.0, 1.0]]), abs=0.1)
    mean_mv = posterior.profiles_mv(isi_ms).mean(1)[0]
    assert mean_mv[0] < posterior.baselines_mv().mean() < mean_mv[1]


def test_moves_leave_the_prior_as_it_is() -> None:
    prior, case = SupraPrior(), Case(SupraPrior(), SPACE)
    drawn, fresh = case.drawn(4000, 2), case.drawn(4000, 3)
    moved = Latents(drawn.values.copy(), drawn.kinds.copy())
    state = *moved, np.zeros((1, 4000), dtype=np.float32), case.law.nothing_known(1, 4000)
    counts = sweeps(case.law, np.array([8]), History.empty(1).columns, seeds(4), state)
    assert (moved.values != drawn.values).any(-1).mean() > 0.9
    assert counts[0, 1] / counts[0, 0] > 0.1
    for name, ours, theirs in zip(LATENTS, moved.values[0].T, fresh.values[0].T, strict=True):
        apart = abs(ours.mean() - theirs.mean()) / (theirs.std() * math.sqrt(2 / 4000))
        assert apart < 6, name  # particles that move together are fewer than they look
    for ours, segment in ((moved.present, prior.enhanced), (moved.depressed, prior.depressed)):
        assert ours.mean() == pytest.approx(segment.probability, abs=0.03)


def test_segments_lie_apart_before_the_first_trial_and_after_the_last() -> None:
    fresh = Case(SupraPrior(), SPACE).drawn(1000, 3)
    for latents in (fresh, posterior_after(0.1).swarm.latents):
        z = dict(zip(LATENTS, np.moveaxis(latents.values, -1, 0), strict=True))
        first, second = (
            (z[f"{kind}start_ms"], z[f"{kind}start_ms"] + np.exp(z[f"{kind}log_width_ms"]))
            for kind in ("", "depressed_")
        )
        assert ((first[1] <= second[0]) | (second[1] <= first[0])).all()


def test_a_segment_needs_a_probability_and_a_positive_shift() -> None:
    widths = SupraPrior().enhanced.widths
    with pytest.raises(InvalidValueError, match="probability"):
        Segment(1.5, widths, Scale(8.0, 0.3))
    with pytest.raises(InvalidValueError, match="shift_pct"):
        Segment(0.5, widths, Scale(-8.0, 0.3))


@pytest.mark.parametrize("settings", [{"particles": 1}, {"thinned": 0}, {"detection_limit_mv": 0.0}])
def test_invalid_settings_are_refused(settings: dict[str, float]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(settings))):
        SupraModel(**settings)  # type: ignore[arg-type] # what a user may write


def test_starts_spread_as_much_as_where_nearly_all_are_evenly() -> None:
    assert SupraPrior().spreads[:2] == pytest.approx([np.linspace(0, 95, 10_001).std()] * 2, rel=1e-3)


def test_shifts_move_what_is_there_of_both_segments() -> None:
    shifted = law_of(SupraPrior(), SPACE)._arrays["shifted"]  # noqa: SLF001 - what the engine is given
    both, alone = ([*BLOCKS["enhanced"], *BLOCKS["depressed"]], [*BLOCKS["curve"], *BLOCKS["session"]])
    moved = [{name for name, is_moved in zip(LATENTS, one, strict=False) if is_moved} for one in shifted[:, 0]]
    there = [set(), set(BLOCKS["enhanced"]), set(BLOCKS["depressed"]), set(both)]
    assert moved == [{*alone, *segments} for segments in there]
