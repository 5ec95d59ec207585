"""A window that is followed while it is used."""

from __future__ import annotations

import numpy as np
import pytest

from isiw.errors import StrategyError
from isiw.findings import Kind
from isiw.pairing.following import SHARES, SHIFTS_MS, Followed
from isiw.trials import Status, Trial
from isiw.types import Array
from pairing.paired import BASE_MV, BEST_MS, SPACE, KnownWindow, knowing
from scripted import RememberingPosterior

VARIED = np.exp(0.25 * np.random.default_rng(8).standard_normal(60))


def trial(number: int, isi_ms: float | None, mep_mv: float) -> Trial:
    return Trial(number, Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=mep_mv)


def begun() -> Followed:
    return Followed.begin(KnownWindow(SPACE), SPACE, knowing(earlier=6).earlier)


def after(best_ms: float, share: float = 1.0, pairs: int = 60) -> Followed:
    """What is known after TMS alone and pairs around the usual best ISI, of a window elsewhere or one that enhances
    less."""
    followed = begun()
    for number in range(10):
        followed = followed.after(trial(number, None, BASE_MV * VARIED[number]))
    for number in range(pairs):
        isi_ms = BEST_MS + (-25.0, 0.0, 25.0)[number % 3]
        mep_mv = BASE_MV + share * float(np.exp(-0.5 * ((isi_ms - best_ms) / 20.0) ** 2))
        followed = followed.after(trial(number, isi_ms, mep_mv * VARIED[number]))
    return followed


@pytest.mark.parametrize("best_ms", [80.0, 100.0, 125.0])
def test_a_window_that_has_moved_is_found_where_it_is(best_ms: float) -> None:
    median, low, high = after(best_ms).interval(SHIFTS_MS, 2)
    assert low <= best_ms - BEST_MS <= high
    assert abs(median - (best_ms - BEST_MS)) < 8.0
    best = after(best_ms)
    assert abs(best.isi_ms[int(np.argmax(best.enhancement_mv))] - best_ms) < 10.0


def test_an_enhancement_that_is_gone_is_noticed() -> None:
    left, _, high = after(100.0, share=0.0).interval(SHARES, 3)
    assert left <= 0.33
    assert high < 1.0
    assert after(100.0).interval(SHARES, 3)[0] >= 0.67


def test_tms_alone_says_nothing_of_the_place_but_of_the_level() -> None:
    followed = begun()
    for number in range(10):
        followed = followed.after(trial(number, None, 2.0 * BASE_MV))
    assert followed.p_inside == pytest.approx(begun().p_inside)
    assert followed.weights[..., 3:].sum() > 0.8


def test_a_probe_is_where_the_next_mep_says_most_and_among_those_that_are_allowed() -> None:
    unsure = begun()
    for _ in range(40):
        unsure = unsure.moved()
    everywhere = unsure.news(unsure.isi_ms)
    assert 8.0 < abs(everywhere - BEST_MS) < 60.0  # at a flank
    allowed = unsure.isi_ms[(unsure.isi_ms >= 95) & (unsure.isi_ms <= 105)]
    assert 95.0 <= unsure.news(allowed) <= 105.0


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_is_not_followed_where_the_window_stays(seed: int) -> None:
    followed, noise = begun(), np.exp(0.9 * np.random.default_rng(seed).standard_normal(100))
    for number in range(100):
        isi_ms = BEST_MS + (20.0 * (-1) ** (number // 10) if number % 10 == 0 else 0.0)
        expected = BASE_MV + float(np.exp(-0.5 * ((isi_ms - BEST_MS) / 20.0) ** 2))
        followed = followed.after(trial(number, isi_ms, expected * noise[number]))
        assert abs(followed.isi_ms[int(np.argmax(followed.enhancement_mv))] - BEST_MS) < 10.0


def test_meps_vary_as_enhanced_ones_do_and_not_as_those_at_the_floor() -> None:
    floor = [trial(k, 10.0, 0.01) for k in range(30)]
    noise = np.exp(0.9 * np.random.default_rng(1).standard_normal(8))
    enhanced = [trial(30 + k, BEST_MS, (BASE_MV + 1.0) * noise[k]) for k in range(8)]
    assert 0.6 < Followed.begin(KnownWindow(SPACE), SPACE, [*floor, *enhanced]).log_sd < 1.2


def test_a_profile_without_a_window_is_none_that_moves() -> None:
    class Doubtful(KnownWindow):
        def window_masks(self, isi_ms: Array) -> Array:
            masks: Array = super().window_masks(isi_ms) * np.array([[0.0], [1.0]])
            return masks

    followed = Followed.begin(Doubtful(SPACE), SPACE, ())
    assert float(np.interp(BEST_MS, followed.isi_ms, followed.p_inside)) == pytest.approx(1.0)


def test_a_lost_trial_teaches_nothing() -> None:
    followed = begun()
    lost = Trial(0, Status.MISTRIAL, 100.0, Kind.OUTCOME_UNKNOWN)
    assert followed.after(lost) is followed


def test_a_posterior_without_profiles_is_refused() -> None:
    with pytest.raises(StrategyError, match="cannot be used"):
        Followed.begin(RememberingPosterior(SPACE, 0), SPACE, ())
