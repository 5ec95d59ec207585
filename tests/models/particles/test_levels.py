"""A law by levels: which pulses make one, what particles carry of it, and where a session begins again with it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy import stats

from isiw.design import VALVE_SPACE
from isiw.models.particles.changes import Change
from isiw.models.particles.levels import Level, drawn, foretold, levels_of
from isiw.models.particles.model import ParticleModel, ParticlePosterior
from isiw.models.particles.noise import NoiseKind
from isiw.models.protocol import Observation
from isiw.models.shared.history import COUNTS, SHIFT, History, neutral
from isiw.native.engine import RESPONSE_LEVELS

MODEL = ParticleModel(particles=100)
EVERY_10 = [0.0, 10.0, 20.0, 30.0, 40.0]
"""By how much pulses are stronger than the pairs' [% RMT]."""


def pulses(shifts_pct_rmt: Sequence[float], log_mep: Sequence[float] | None = None) -> History:
    columns = neutral(len(shifts_pct_rmt))
    columns[:, SHIFT], columns[:, COUNTS], columns[:, 0] = shifts_pct_rmt, 0.3, np.nan
    columns[:, 2:4] = np.reshape(-4.0 + 0.08 * columns[:, SHIFT] if log_mep is None else log_mep, (-1, 1))
    return History(columns[np.newaxis])


def places(shifts_pct_rmt: Sequence[float]) -> list[tuple[float, int]]:
    """Places of the levels that these pulses make, and how many pulses each has."""
    levels = levels_of(pulses(shifts_pct_rmt), 0)
    return [(round(float(level.shifts_pct_rmt.mean()), 2), len(level.log_mep)) for level in levels]


def test_pulses_of_one_intensity_are_a_level() -> None:
    assert places(EVERY_10 * 3) == [(at, 3) for at in EVERY_10]


def test_pulses_that_are_close_are_one_level_and_one_with_too_few_is_one_with_the_next() -> None:
    assert places([0.0, 1.0, 2.0, *[12.0] * 3, *[16.0] * 2, *[30.0] * 3]) == [(1.0, 3), (13.6, 5), (30.0, 3)]


def test_a_level_with_too_few_pulses_and_none_near_is_left_out() -> None:
    assert places([*EVERY_10 * 3, 60.0]) == [(at, 3) for at in EVERY_10]


def test_there_are_no_more_levels_than_the_engine_has() -> None:
    found = places([*np.linspace(0.0, 50.0, 60).tolist()])
    assert len(found) == RESPONSE_LEVELS
    assert sum(count for _, count in found) == 60


@pytest.mark.parametrize(
    "shifts_pct_rmt",
    [
        [],
        EVERY_10 * 2,  # too few of each
        [0.0, 40.0] * 9,  # too few levels
        [10.0, 20.0, 30.0, 40.0] * 3,  # nothing at the pairs' intensity
        [0.0, 5.0, 10.0] * 5,  # not as far as a tap may shift the input
    ],
)
def test_other_pulses_make_no_law(shifts_pct_rmt: list[float]) -> None:
    assert places(shifts_pct_rmt) == []


def test_pulses_without_a_response_have_the_end_of_their_interval() -> None:
    told = pulses([0.0, 10.0, 30.0] * 3, [-4.0] * 9)
    told.columns[0, :3, 2] = -np.inf
    assert [level.log_mep.tolist() for level in levels_of(told, 0)] == [[-4.0] * 3] * 3


def test_what_particles_carry_is_the_posterior_of_each_levels_law() -> None:
    rng = np.random.default_rng(5)
    told = pulses([0.0, 10.0, 30.0] * 200, (rng.normal(size=600) * np.tile([0.2, 0.7, 0.4], 200)).tolist())
    carried = drawn(levels_of(told, 0), 4000, np.random.default_rng(6)).reshape(4000, 3, RESPONSE_LEVELS)
    at, mean, sd = carried.transpose(1, 0, 2)
    assert (np.diff(at, axis=1) > 0).all()
    assert at[0, :3].tolist() == [0.0, 10.0, 30.0]
    np.testing.assert_array_equal(mean[:, 3:], mean[:, 2:3].repeat(RESPONSE_LEVELS - 3, axis=1))
    np.testing.assert_allclose(sd[:, :3].mean(0), [0.2, 0.7, 0.4], rtol=0.12)
    np.testing.assert_allclose(mean[:, :3].std(0), sd[:, :3].mean(0) / np.sqrt(200), rtol=0.1)
    few = drawn(levels_of(pulses([0.0, 10.0, 30.0] * 3), 0), 4000, rng).reshape(4000, 3, RESPONSE_LEVELS)
    assert few[:, 1, 0].std() > 0.1  # three equal amplitudes do not make a law certain


def posterior_after(shifts_pct_rmt: Sequence[float], people: int = 1, seed: int = 3) -> ParticlePosterior:
    posterior = MODEL.begin(VALVE_SPACE, seed, people)
    for shift in shifts_pct_rmt:
        amplitudes = [0.02 * float(np.exp(0.08 * shift))] * people
        posterior = posterior.after(Observation.of([None] * people, amplitudes, shift_pct_rmt=[shift] * people))
    return posterior


def pair(posterior: ParticlePosterior, isi_ms: float, *mep_mv: float) -> ParticlePosterior:
    return posterior.after(Observation.of([isi_ms] * len(mep_mv), mep_mv))


def test_a_session_begins_again_with_the_levels_at_the_first_pair() -> None:
    given = posterior_after(EVERY_10 * 3)
    assert (given.swarm.latents.noise != NoiseKind.BY_LEVELS).all()
    learnt = pair(given, 300.0, 0.1)
    assert (learnt.trials, learnt.pairs) == (16, 1)
    assert learnt.swarm.trials == 2  # all pulses are one
    by_levels = learnt.swarm.latents.noise[0] == NoiseKind.BY_LEVELS
    np.testing.assert_array_equal(by_levels, learnt.swarm.of_given)
    assert pair(learnt, 320.0, 0.1).trials == 17


def test_pulses_that_make_no_law_leave_the_curve_that_they_taught() -> None:
    learnt = pair(posterior_after(EVERY_10 * 2), 300.0, 0.1)
    assert learnt.trials == learnt.swarm.trials == 11
    assert (learnt.swarm.latents.noise != NoiseKind.BY_LEVELS).all()


@pytest.mark.parametrize("jagged", [False, True])
def test_levels_are_a_law_where_they_foretell_the_pulses_better_than_curves(*, jagged: bool) -> None:
    rng, model = np.random.default_rng(4), ParticleModel(particles=400)
    posterior = model.begin(VALVE_SPACE, 3)
    for number, shift in enumerate([*EVERY_10, 50.0] * 8):
        drive = 0.25 * (shift - 25.0 + 6.0 * rng.standard_normal())
        log_mep = np.log(0.01 + 1.5 / (1.0 + np.exp(-drive))) + 0.3 * rng.standard_normal()
        log_mep += (0.8 if number % 2 else -0.8) * jagged  # every second level is higher than a curve has it
        posterior = posterior.after(Observation.of([None], [float(np.exp(log_mep))], shift_pct_rmt=[shift]))
    learnt = pair(posterior, 300.0, 0.1)
    assert (learnt.swarm.latents.noise == NoiseKind.BY_LEVELS).any() == jagged
    assert learnt.swarm.trials == (2 if jagged else 49)


def test_a_pulse_is_foretold_by_the_others_of_its_level() -> None:
    log_mep = np.array([-1.0, -0.4, -0.7, 0.2])
    levels = [Level(np.zeros(4), log_mep), Level(np.ones(4), log_mep + 3.0)]
    by_hand = 0.0
    for at in range(4):
        others = np.delete(log_mep, at)
        scale = np.sqrt((2.0 * 0.3**2 + ((others - others.mean()) ** 2).sum()) / 5.0 * (1.0 + 1.0 / 3.0))
        by_hand += float(stats.t.logpdf(log_mep[at], 5.0, others.mean(), scale))
    assert foretold(levels) == pytest.approx(2.0 * by_hand)


def test_tms_alone_without_an_intensity_is_learnt_again_after_the_levels() -> None:
    posterior = MODEL.begin(VALVE_SPACE, 3)
    posterior = posterior.after(Observation.of([None], [0.02]))
    for shift in EVERY_10 * 3:
        posterior = posterior.after(Observation.of([None], [0.02 * np.exp(0.08 * shift)], shift_pct_rmt=[shift]))
    learnt = pair(posterior, 300.0, 0.1)
    assert (learnt.trials, learnt.pairs, learnt.swarm.trials) == (17, 1, 3)
    np.testing.assert_array_equal(np.isnan(learnt.swarm.history.isi_ms[0]), [True, False])


def test_a_change_noted_after_the_pulses_may_lie_between_them_and_the_pairs() -> None:
    noted, plain = posterior_after(EVERY_10 * 3).noting_change(), posterior_after(EVERY_10 * 3)
    for isi_ms in range(0, 400, 50):  # ten times what the pulses evoked
        noted, plain = (pair(each, float(isi_ms), 0.2) for each in (noted, plain))
    assert noted.model.prior.changes.noted == (1,)  # all pulses being one trial
    apart = [float(np.exp(each.swarm.log_weights[0])[~each.swarm.of_given].sum()) for each in (noted, plain)]
    assert apart[0] < apart[1]


def test_a_change_is_told_by_its_trial_among_all() -> None:
    step = Change.of(np.full((1, 9), 1), np.log(np.full((1, 9), 2.5)), np.ones((1, 9)), np.ones((1, 9), dtype=bool))
    plain, after_pulses = step.named(5), step.named(5, stood_for=14)
    assert plain is not None
    assert after_pulses is not None
    assert (plain.trial, after_pulses.trial) == (3, 17)


def test_several_people_are_what_each_is_alone() -> None:
    together = posterior_after(EVERY_10 * 3, people=2)
    alone = [posterior_after(EVERY_10 * 3, seed=3 + person) for person in range(2)]
    for isi_ms, mep_mv in ((200.0, (0.1, 0.02)), (300.0, (0.3, 0.05)), (350.0, (0.02, 0.2))):
        together = pair(together, isi_ms, *mep_mv)
        alone = [pair(one, isi_ms, mv) for one, mv in zip(alone, mep_mv, strict=True)]
    for person, one in enumerate(alone):
        np.testing.assert_array_equal(together.swarm.crowd.values[person], one.swarm.crowd.values[0])
        assert together.estimate(person).window == one.estimate().window


def test_a_window_is_found_by_the_levels_alone() -> None:
    rng, posterior = np.random.default_rng(8), MODEL.begin(VALVE_SPACE, 3)

    def mep_mv(shift_pct_rmt: float) -> float:
        return float(0.02 * np.exp(0.08 * shift_pct_rmt + 0.4 * rng.standard_normal()))

    for shift in EVERY_10 * 8:
        posterior = posterior.after(Observation.of([None], [mep_mv(shift)], shift_pct_rmt=[shift]))
    for isi_ms in np.linspace(100.0, 400.0, 31).tolist():  # a window from 200 to 300 ms
        posterior = pair(posterior, isi_ms, mep_mv(25.0 * np.exp(-0.5 * ((isi_ms - 250.0) / 25.0) ** 2)))
    estimate = posterior.estimate()
    assert estimate.window is not None
    assert estimate.window.start_ms == pytest.approx(200.0, abs=25.0)
    assert estimate.window.end_ms == pytest.approx(300.0, abs=25.0)
    assert float(np.exp(posterior.swarm.log_weights[0])[posterior.swarm.of_given].sum()) > 0.5
