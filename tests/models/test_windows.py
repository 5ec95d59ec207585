import pickle
from collections.abc import Callable

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.models.windows import Runs, SampledProfiles, edge_samples, profile_grid, sampled_estimate
from isiw.strategy.catalogue import make_strategy
from isiw.window import Window
from known import known

SPACE = DesignSpace(0, 9, reference="impact")


def masks(*rows: str) -> Runs:
    return Runs.of_masks(np.array([[float(c) for c in row] for row in rows]))


def flat(samples: int) -> Callable[[], SampledProfiles]:
    return lambda: SampledProfiles(np.ones((samples, 10)), np.ones(samples))


def test_certain_membership_is_reported_as_it_is() -> None:
    inside, expected_f1 = masks("0111001100", "0111001100").best
    window = Window.from_mask(SPACE.grid_ms, inside)
    assert known(window).segments == ((1.0, 3.0), (6.0, 7.0))
    assert expected_f1 == 1.0


def test_the_reported_window_has_the_largest_expected_f1_of_all_level_sets() -> None:
    rng = np.random.default_rng(0)
    starts, ends = rng.integers(0, 5, 200), rng.integers(5, 10, 200)
    samples = np.array([[float(a <= t <= b) for t in range(10)] for a, b in zip(starts, ends, strict=True)])
    reported, told = Runs.of_masks(samples).best

    def expected_f1(mask: np.ndarray) -> float:
        return float(np.mean(2 * (samples * mask).sum(1) / (samples.sum(1) + mask.sum())))

    membership = samples.mean(0)
    best = max(expected_f1(membership >= level) for level in membership)
    assert expected_f1(reported) > best - 0.005  # the cuts are a grid
    assert told == pytest.approx(expected_f1(reported))


def test_an_edge_at_the_border_of_the_range_lies_beyond_it() -> None:
    edges = edge_samples(masks("1110000000", "0000000000", "0000011111", "0011100000"), SPACE)
    assert edges.tolist() == [[-np.inf, 2.0], [5.0, np.inf], [2.0, 4.0]]


def test_more_than_one_segment_has_a_probability_given_a_window() -> None:
    sampled = masks("0111001100", "1100110000", "0011110000", "0000000011", "0000000000")
    assert sampled_estimate(sampled, flat(5), SPACE).split_probability == 0.5
    assert sampled_estimate(masks("0000000000"), flat(1), SPACE).split_probability is None


def test_runs_of_pairs_are_those_of_masks() -> None:
    pairs = np.array([[1, 4, 6, 8], [0, 2, 0, 0], [0, 0, 0, 0], [2, 10, 0, 0]])
    ours, theirs = Runs(pairs.reshape(-1, 2, 2), 10), masks("0111001100", "1100000000", "0000000000", "0011111111")
    assert theirs.found.tolist() == [0, 1, 3]
    for name in ("sizes", "found", "hulls"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), name)


def test_what_a_stopping_rule_does_not_need_is_worked_out_when_somebody_looks() -> None:
    asked = []

    def profiles() -> SampledProfiles:
        asked.append(1)
        return flat(4)()

    estimate = sampled_estimate(masks("0111000000", "0011000000"), profiles, SPACE).noting(pairs=4, silent=True)
    assert (estimate.probability, estimate.pairs, estimate.silent) == (1.0, 4, True)
    assert known(estimate.expected_f1) > 0.8
    assert not asked
    assert known(estimate.profile_quantiles_mv).shape == (3, 10)
    assert known(estimate.largest_excluded).mep_mv == 0.0
    again = pickle.loads(pickle.dumps(estimate))  # noqa: S301 - made here
    assert again.largest_excluded == estimate.largest_excluded
    assert len(asked) == 1


def test_the_expected_f1_is_that_of_the_decision() -> None:
    # The window itself in three of four samples, and no window in the fourth; then the other way round.
    there, nowhere = "0111000000", "0000000000"
    assert sampled_estimate(masks(there, there, there, nowhere), flat(4), SPACE).expected_f1 == 0.75
    decided = sampled_estimate(masks(there, nowhere, nowhere, nowhere), flat(4), SPACE)
    assert (decided.window, decided.expected_f1) == (None, 0.75)


def test_the_best_isi_is_told_of_samples_that_have_one_and_what_is_excluded_of_all() -> None:
    # Ten samples: peaks of 50 µV at 3 or 4 ms in eight, nothing in two; nine in ten are at most 50 µV.
    mep_mv = np.full((10, 10), 0.01)
    mep_mv[:5, 3], mep_mv[5:8, 4] = 0.06, 0.06
    profiles = SampledProfiles(mep_mv, np.full(10, 0.01))
    estimate = sampled_estimate(masks("0011110000"), lambda: profiles, SPACE)
    assert known(estimate.best_isi) == (3.0, 3.0, 4.0)
    assert known(estimate.largest_excluded).mep_mv == pytest.approx(0.05)
    assert sampled_estimate(masks("0000000000"), flat(1), SPACE).best_isi is None


def test_no_window_is_more_probable_than_came_true() -> None:
    everywhere = masks("0111000000", "0111000000")
    estimate = sampled_estimate(everywhere, flat(2), SPACE, most_probable=0.98)
    assert (estimate.probability, estimate.expected_f1) == (0.98, 0.98)
    sure = make_strategy("gp-straddle", DesignSpace(0, 300, reference="impact"), seed=1)
    for isi_ms in range(0, 300, 25):
        sure.tell(isi_ms, 2.0 + isi_ms / 1000 if 70 < isi_ms < 180 else 0.02 + isi_ms / 1e5)
    assert sure.estimate().probability == 0.98


def test_a_profile_is_reported_up_to_both_ends_of_the_range() -> None:
    for high_ms in (302, 320, 500):
        grid = profile_grid(DesignSpace(0, high_ms, reference="impact"))
        assert (float(grid[0]), float(grid[-1])) == (0, high_ms)
        assert (np.diff(grid) > 0).all()


def test_a_profile_has_no_gaps_that_a_narrow_peak_fits_into_however_wide_the_range() -> None:
    for space in (
        DesignSpace(0, 1000, 0.5, reference="impact"),
        DesignSpace(0, 600, reference="impact"),
        DesignSpace(0, 2100, 3, reference="impact"),
    ):
        assert np.diff(profile_grid(space)).max() <= 4.0
    assert len(profile_grid(DesignSpace(0, 400, 10, reference="impact"))) == 41


def test_the_magnitude_is_that_of_the_largest_expected_mep_given_a_window() -> None:
    space = DesignSpace(0, 100, 10, reference="impact")
    grid = profile_grid(space)
    peaks_mv = np.array([0.2, 0.3, 0.4, 0.1])
    mep_mv = np.full((4, len(grid)), 0.1)
    mep_mv[:, 5] = peaks_mv  # the last one has no window
    masks = np.zeros((4, len(space.grid_ms)))
    masks[:3, 5] = 1
    profiles = SampledProfiles(mep_mv, np.full(4, 0.1))
    estimate = sampled_estimate(Runs.of_masks(masks), lambda: profiles, space)
    assert estimate.magnitude is not None
    (size, low, high), (ratio, *_) = estimate.magnitude
    assert size == pytest.approx(0.2)
    assert ratio == pytest.approx(3.0)
    assert 0.1 <= low < size < high <= 0.3


def test_without_a_window_there_is_no_magnitude() -> None:
    space = DesignSpace(0, 100, 10, reference="impact")
    flat = SampledProfiles(np.full((3, len(profile_grid(space))), 0.1), np.full(3, 0.1))
    nothing = Runs.of_masks(np.zeros((3, len(space.grid_ms))))
    assert sampled_estimate(nothing, lambda: flat, space).magnitude is None
