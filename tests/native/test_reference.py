"""The engine has the law of the reference in plain NumPy: log likelihoods, predictions, windows and prior densities."""

from __future__ import annotations

import re

import numpy as np
import pytest
import scipy.special
from hatch_build import SOURCES

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.excess import LEAST_DEPRESSED_MV, least_excess_mv
from isiw.models.particles import records
from isiw.models.particles.compiled import Crowd
from isiw.models.particles.latents import BLOCKS
from isiw.models.particles.model import ParticleModel
from isiw.models.particles.predictions import PersonSample
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.particles.supra.predictions import SupraSample
from isiw.models.shared.draws import LEVELS
from isiw.models.shared.history import Circumstances
from isiw.native import engine
from isiw.native.engine import COLUMNS, FIELDS, RESPONSE_LEVELS, UNKNOWN, log_likelihoods
from native import reference
from native.drawn import CASES, PLACES, Case, columns, seeds, sweeps, trials

ORDERS = (0, 1, 12)
FEW_MS = np.array([0.0, 40.0, 90.0, 180.0, 233.0, 260.0, 300.0, np.nan], dtype=np.float32)


def furthest(case: Case, number: int, seed: int, known_log_sd: float = 0.0) -> float:
    """By how much log likelihoods of so many particles and as many histories differ, at most [nat]."""
    drawn, rng, apart = case.of_all_kinds(number, seed), np.random.default_rng(seed), 0.0
    fields = case.fields(drawn)
    for i, particle in enumerate(case.particles(drawn)):
        told = trials(int(rng.integers(1, 6)), rng, known_log_sd=known_log_sd)
        got = log_likelihoods(fields[:, i : i + 1].copy(), columns(told)).item()
        apart = max(apart, abs(got - reference.log_likelihood(particle, told)))
    return apart


@pytest.mark.parametrize("known_log_sd", [0.0, 0.8])
@pytest.mark.parametrize("name", CASES)
def test_the_engine_has_the_law_of_the_reference(name: str, known_log_sd: float) -> None:
    assert furthest(CASES[name], 60, 1, known_log_sd) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), [("default", 10_000), ("by levels", 3_000), ("supra", 3_000)])
def test_the_engine_has_the_law_of_the_reference_for_ten_thousand_particles(name: str, number: int) -> None:
    assert furthest(CASES[name], number, 2) < 1e-3
    assert furthest(CASES[name], number // 10, 3, 0.8) < 1e-3


@pytest.mark.parametrize("name", CASES)
def test_profiles_are_those_of_the_reference(name: str) -> None:
    case = CASES[name]
    drawn = case.of_all_kinds(200, 3)
    found = engine.facilitations(case.fields(drawn), FEW_MS[:-1])[0]
    expected = [
        [particle.facilitation(isi_ms) for isi_ms in FEW_MS[:-1].tolist()] for particle in case.particles(drawn)
    ]
    np.testing.assert_allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("name", ["default", "by levels", "supra"])
def test_tables_of_predictions_are_those_of_the_reference(name: str, order: int) -> None:
    case, outcomes = CASES[name], 24
    drawn, rng = case.of_all_kinds(60, 4), np.random.default_rng(4)
    fields, particles = case.fields(drawn, order), case.particles(drawn)
    rows, means = engine.evoked_means(fields, LEVELS)
    np.testing.assert_allclose(rows[0], [reference.row_levels(one, LEVELS) for one in particles], atol=1e-5)
    levels = [row.astype(float).tolist() for row in rows[0]]
    both = list(zip(particles, levels, strict=True))
    evoked = [[reference.expected_evoked(one, order, at) for at in own] for one, own in both]
    np.testing.assert_allclose(means[0], evoked, rtol=3e-4, atol=1e-4)
    cells = np.sort(rng.random(outcomes + 1)).astype(np.float32)
    ((low, high),), (found,) = engine.outcome_tables(fields, rows, means, order, cells)
    log_mep, widths = low + (high - low) * 0.5 * (cells[1:] + cells[:-1]).astype(float), np.diff(cells.astype(float))
    for one, own, masses in zip(particles, levels, found, strict=True):
        for row in (0, 5, LEVELS - 1):
            expected = reference.outcome_masses(one, order, own[row], log_mep, widths)
            np.testing.assert_allclose(masses[row], expected, atol=1e-4)


@pytest.mark.parametrize("name", ["default", "supra"])
def test_between_the_rows_of_a_table_everything_is_straight(name: str) -> None:
    case = CASES[name]
    drawn, rng = case.of_all_kinds(40, 5), np.random.default_rng(5)
    table = rng.random((1, 40, LEVELS, 3)).astype(np.float32)
    levels = rng.uniform(-1.0, 1.1, (1, 40, 9)).astype(np.float32)
    found = engine.rows_between(case.fields(drawn), table, levels)
    for i, one in enumerate(case.particles(drawn)):
        rows = reference.row_of(levels[0, i].astype(float), one.depth, LEVELS)
        expected = [np.interp(rows, np.arange(LEVELS), outcome) for outcome in table[0, i].T]
        np.testing.assert_allclose(found[0, i].T, expected, atol=1e-4)


@pytest.mark.parametrize("name", ["default", "by levels"])
@pytest.mark.parametrize("space", [VALVE_SPACE, DesignSpace(0, 300, 5, reference="valve")], ids=["fine", "coarse"])
def test_windows_expected_meps_and_baselines_are_those_of_the_reference(space: DesignSpace, name: str) -> None:
    order, case = 12, CASES[name]._replace(space=space)
    drawn = case.of_all_kinds(150, 6)
    sample, grid_ms = PersonSample(case.fields(drawn, order), space, order), np.array(space.grid_ms)
    masks, isi_ms = sample.window_masks(grid_ms.astype(np.float32))[0], FEW_MS[:-1]
    means_mv, baselines_mv = sample.expected_mep_mv(isi_ms)[0], sample.baselines_mv()[0]
    runs = engine.window_runs(sample.fields, sample.edge_level, grid_ms.astype(np.float32))[0].reshape(-1, 2, 2)
    for i, one in enumerate(case.particles(drawn)):
        rows = reference.row_levels(one, LEVELS)
        evoked = np.array([reference.expected_evoked(one, order, at) for at in rows])
        edge = reference.edge_level(one, order, evoked, grid_ms, fine=space.step_ms <= 1)
        assert sample.edge_level[0, i] == pytest.approx(edge, abs=2e-4)
        near_ms = slice(None, None, max(1, len(grid_ms) // 60))
        for isi, inside in zip(grid_ms[near_ms].tolist(), masks[i][near_ms], strict=True):
            level = one.facilitation(isi)
            if abs(level - edge) > 1e-3:
                assert inside == (level >= edge)
        at = reference.row_of(np.array([one.facilitation(isi) for isi in isi_ms.tolist()]), 0.0, LEVELS)
        between = np.interp(at, np.arange(LEVELS), evoked)
        np.testing.assert_allclose(means_mv[i], reference.expected_mep_mv(one, order, between), rtol=5e-4)
        assert baselines_mv[i] == pytest.approx(reference.expected_mep_mv(one, order, evoked[0]), rel=5e-4)
    inside = np.zeros(masks.shape)
    for i, own in enumerate(runs.tolist()):
        for first, behind in own:
            inside[i, first:behind] = 1.0
    np.testing.assert_array_equal(inside, masks)


def test_predictions_with_a_depression_are_those_of_the_reference() -> None:
    case, order, isi_ms = CASES["supra"], 3, np.arange(0.0, 201.0, 4.0, dtype=np.float32)
    drawn = case.of_all_kinds(100, 6)
    sample, particles = SupraSample(case.fields(drawn, order), case.space, order), case.particles(drawn)
    levels = [[one.facilitation(isi) for isi in isi_ms.tolist()] for one in particles]

    def mep_mv(one: reference.Particle, at: list[float]) -> list[float]:
        evoked = [reference.expected_evoked(one, order, level) for level in at]
        return [reference.expected_mep_mv(one, order, each) for each in evoked]

    expected_mv = np.array([mep_mv(one, own) for one, own in zip(particles, levels, strict=True)])
    baseline_mv = np.array([mep_mv(one, [0.0]) for one in particles])
    np.testing.assert_allclose(sample.expected_mep_mv(isi_ms)[0], expected_mv, atol=1e-4, rtol=0.02)
    np.testing.assert_allclose(sample.baselines_mv()[0], baseline_mv[:, 0], rtol=0.02)
    grid_ms = np.linspace(0.0, 200.0, 241)
    range_mv = np.array([mep_mv(one, [one.facilitation(isi) for isi in grid_ms]) for one in particles]) - baseline_mv
    above = expected_mv - baseline_mv >= least_excess_mv(range_mv.max(-1, keepdims=True), baseline_mv)
    below = baseline_mv - expected_mv >= least_excess_mv(-range_mv.min(-1, keepdims=True), baseline_mv)
    below &= baseline_mv >= LEAST_DEPRESSED_MV
    assert (sample.window_masks(isi_ms)[0] != above).mean() < 0.005  # tables of rows put a few edges one ISI further
    assert (sample.depressed_masks(isi_ms)[0] != below).mean() < 0.005


@pytest.mark.parametrize("profile", [ProfilePrior(), PLACES, ProfilePrior(early=())], ids=["early", "places", "apart"])
def test_the_usual_is_as_probable_as_by_the_reference_where_isis_are_chosen(profile: ProfilePrior) -> None:
    model = ParticleModel(Prior(profile))
    asking, own = (Case(prior, VALVE_SPACE) for prior in (model.prior_where_asking, model.prior))
    drawn, rng = own.of_all_kinds(120, 8), np.random.default_rng(8)
    log_weights, nothing = rng.standard_normal((1, 120)), np.zeros((1, 120), dtype=np.float32)
    found = own.law.usual_weights(asking.law, Crowd(*drawn, log_weights, nothing, own.law.nothing_known(1, 120)))
    ours, theirs = (
        np.array([reference.log_usual(case.prior, case.space, one, BLOCKS) for one in case.particles(drawn)])
        for case in (own, asking)
    )
    expected = log_weights[0] + theirs - ours
    np.testing.assert_allclose(found[0], expected - scipy.special.logsumexp(expected), atol=1e-3, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["default", "places"])
def test_densities_of_the_priors_blocks_are_those_of_the_reference(name: str) -> None:
    case = CASES[name]
    drawn = case.of_all_kinds(120, 9)
    law, state = case.law, (drawn.values, drawn.kinds, np.zeros((1, 120), dtype=np.float32))
    kept = law.nothing_known(1, 120)
    sweeps(law, np.array([4]), np.zeros((1, 0, COLUMNS), dtype=np.float32), seeds(9), (*state, kept))
    found = case.prior.log_densities(drawn.values, case.space)
    for block, block_name in enumerate(found):
        place = block_name == "place"
        expected = np.array(
            [
                reference.log_place(case.prior, case.space, one.z)
                if place
                else reference.log_mixture(case.prior.mixtures[block_name], [one.z[n] for n in BLOCKS[block_name]])
                for one in case.particles(drawn)
            ]
        )
        np.testing.assert_allclose(found[block_name][0], expected, atol=1e-3, rtol=1e-4, err_msg=block_name)
        known = kept[0, :, block] != UNKNOWN
        apart = kept[0, known, block] - expected[known]  # the engine leaves a constant out
        np.testing.assert_allclose(apart, np.median(apart) if known.any() else 0.0, atol=1e-3, err_msg=block_name)
        assert known.any() == (block_name != "changed"), block_name  # which is drawn again, never moved


@pytest.mark.parametrize(("first", "last", "names"), [("NOISE", "FIELDS", "field"), ("ISI", "COLUMNS", "column")])
def test_fields_and_columns_have_the_order_of_the_c_header(first: str, last: str, names: str) -> None:
    header = (SOURCES / "people.h").read_text("utf-8")
    (listed,) = re.findall(rf"enum \{{\n    ({first},.*?)\n    {last}\b", header, re.DOTALL)
    in_c = re.findall(r"^\s*([A-Z_]+)(?: = \w+ \+ LEVELS)?,", listed, re.MULTILINE)
    if names == "field":
        of_levels = range(records.LEVEL_AT, FIELDS, RESPONSE_LEVELS)
        assert [getattr(records, name) for name in in_c] == [*range(records.LEVEL_AT), *of_levels]
        assert f"LEVELS = {RESPONSE_LEVELS} " in header
    else:
        assert len(in_c) == COLUMNS == 5 + len(Circumstances._fields)
