import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from operator import itemgetter
from typing import Any, get_args

import numpy as np
import pytest
import torch

from isiw.design import VALVE_SPACE, DesignSpace
from isiw.models.particles import ParticleModel
from isiw.models.particles.changes import Change
from isiw.models.particles.engine import Compiled, EngineName, TorchEngine, engine_for, log_likelihood_of
from isiw.models.particles.jumps import WindowTarget
from isiw.models.particles.latents import Latents
from isiw.models.particles.likelihood import total_log_likelihood
from isiw.models.particles.moves import steps_of
from isiw.models.particles.noise import NoiseKind, Response
from isiw.models.particles.places import Place
from isiw.models.particles.predictions import PersonSample
from isiw.models.particles.prior import Depression, Person, Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.particles.records import columns_of, people_of
from isiw.models.particles.shapes import Shape
from isiw.models.particles.supra.jumps import SupraTarget
from isiw.models.particles.supra.predictions import SupraSample
from isiw.models.particles.supra.prior import SupraPrior
from isiw.models.protocol import Observation
from isiw.models.shared.history import Circumstances, History
from isiw.models.shared.scales import Scale
from isiw.native.engine import UNKNOWN, elementary

PLACES = ProfilePrior(
    places=(Place(0.5, Scale(230.0, 12.0), Scale(80.0, 0.3)), Place(0.2, Scale(90.0, 9.0), Scale(60.0, 0.2)))
)
TARGETS: dict[str, Any] = {
    "default": WindowTarget(Prior(), VALVE_SPACE),
    "places": WindowTarget(Prior(PLACES), VALVE_SPACE),
    "supra": SupraTarget(SupraPrior(), DesignSpace(0, 200, reference="impact")),
}


def generator(seed: int) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def history(person: Person, trials: int, draws: torch.Generator, *, isi_sd_ms: float = 0.0) -> History:
    """Random ISIs, TMS alone among them, and MEPs from the floor to 100 floors; some censored on a side or both."""
    people = len(person.present)
    isi_ms = 500.0 * torch.rand((people, trials), generator=draws)
    isi_ms[torch.rand(isi_ms.shape, generator=draws) < 0.1] = torch.nan
    low = -4.5 + torch.randn((people, trials), generator=draws).abs() * 1.5
    high = low.clone()
    sort = torch.rand(low.shape, generator=draws)
    high[sort < 0.3] = low[sort < 0.3] + 0.5
    low[sort < 0.2] = -torch.inf
    high[(sort > 0.2) & (sort < 0.25)] = torch.inf
    order = torch.arange(float(trials)).expand(people, -1)
    return History(isi_ms, torch.full_like(isi_ms, isi_sd_ms), low, high, order)


def in_double(person: Person) -> Person:
    def double(fields: Any) -> list[torch.Tensor]:
        return [field.double() if field.is_floating_point() else field for field in fields]

    low = person.depression
    depression = None if low is None else Depression(Shape(*double(low.shape)), low.depth.double(), low.present)
    change = None if person.change is None else Change(*double(person.change))
    return Person(Shape(*double(person.shape)), Response(*double(person.response)), person.present, depression, change)


def furthest(target: Any, people: int, particles: int, seed: int, isi_sd_ms: float) -> float:
    """By how much the log likelihoods of both engines differ, at most, torch computing in double precision."""
    draws = generator(seed)
    latents = target.prior.sample(people, particles, draws, target.space)
    person = target.person(latents)
    told = history(person, int(torch.randint(1, 60, (1,), generator=draws)), draws, isi_sd_ms=isi_sd_ms)
    got = engine_for("compiled", target).log_likelihood(latents, told)
    expected = total_log_likelihood(in_double(person), told.to("cpu", torch.double))
    return float((got - expected).abs().max())


@pytest.mark.parametrize("isi_sd_ms", [0.0, 4.0])
@pytest.mark.parametrize("name", TARGETS)
def test_the_likelihood_of_any_history_is_that_of_torch(name: str, isi_sd_ms: float) -> None:
    assert max(furthest(TARGETS[name], 4, 50, seed, isi_sd_ms) for seed in range(3)) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_the_likelihood_of_ten_thousand_histories_is_that_of_torch(name: str) -> None:
    assert max(furthest(TARGETS[name], 100, 10, seed, 4.0 * (seed % 2)) for seed in range(10)) < 1e-3


def test_no_trials_say_nothing() -> None:
    target = TARGETS["default"]
    latents = Prior().sample(2, 20, generator(1), VALVE_SPACE)
    none = History.empty(2, torch.device("cpu"))
    for engine in (engine_for("compiled", target), TorchEngine(target)):
        assert not engine.log_likelihood(latents, none).any()


def test_long_histories_are_summed_piece_by_piece() -> None:
    draws = generator(1)
    person = Prior().person(Prior().sample(1, 20, draws, VALVE_SPACE))
    told = history(person, 400, draws)
    got = log_likelihood_of(people_of(person), told).numpy()
    expected = total_log_likelihood(in_double(person), told.to("cpu", torch.double))
    np.testing.assert_allclose(got, expected.numpy(), rtol=1e-5)


@pytest.mark.parametrize("name", TARGETS)
def test_moves_of_both_engines_are_accepted_as_often_and_lead_to_the_same_posterior(name: str) -> None:
    # Twelve trials, 4,000 particles of the prior weighted by nothing, 30 sweeps: means of what both engines come to
    # differ by less than five standard errors of 200 independent particles.
    target, found = TARGETS[name], {}
    for engine in (engine_for("compiled", target), TorchEngine(target)):
        latents = target.prior.sample(1, 4000, generator(3), target.space)
        isi_ms = torch.linspace(20.0, 180.0, 12).unsqueeze(0)
        log_mep = torch.where((isi_ms > 60.0) & (isi_ms < 120.0), math.log(0.2), math.log(0.02))
        order = torch.arange(12.0).unsqueeze(0)
        told = History(isi_ms, torch.zeros_like(isi_ms), log_mep, log_mep, order)
        start = engine.log_likelihood(latents, told)
        found[type(engine)] = engine.sweeps(torch.tensor([30]), latents, start, told, generator(4))
    ours, theirs = found[Compiled], found[TorchEngine]
    assert ours.shifts.item() == pytest.approx(theirs.shifts.item(), abs=0.03)
    assert ours.jumps.item() == pytest.approx(theirs.jumps.item(), abs=0.03)
    spread = theirs.latents.values.std(1)
    apart = (ours.latents.values.mean(1) - theirs.latents.values.mean(1)).abs() / spread
    assert apart.max() < 5.0 / math.sqrt(200)
    assert ours.log_likelihood.mean().item() == pytest.approx(theirs.log_likelihood.mean().item(), abs=0.5)


@pytest.mark.parametrize("name", get_args(EngineName))
def test_each_person_moves_as_often_as_they_need(name: EngineName) -> None:
    target = TARGETS["default"]
    latents = target.prior.sample(3, 100, generator(3), target.space)
    told = history(target.person(latents), 6, generator(4))
    engine = engine_for(name, target)
    start = engine.log_likelihood(latents, told)
    moved = engine.sweeps(torch.tensor([3, 0, 1]), latents, start, told, generator(5))
    changed = (moved.latents.values != latents.values).any(-1).double().mean(-1)
    assert changed[0] > changed[2] > changed[1] == 0.0
    torch.testing.assert_close(moved.log_likelihood, engine.log_likelihood(moved.latents, told), atol=1e-3, rtol=1e-4)


@pytest.mark.parametrize("space", [VALVE_SPACE, DesignSpace(0, 300, 5, reference="valve")], ids=["fine", "coarse"])
def test_a_sample_predicts_what_it_predicts_in_torch(space: DesignSpace) -> None:
    target = WindowTarget(Prior(), space)
    latents = target.prior.sample(2, 300, generator(6), space)
    meant = engine_for("compiled", target).meaning(latents, 1), target.person(latents).after(1)
    ours, theirs = (PersonSample(particles, space, 1) for particles in meant)
    grid_ms, few_ms = torch.tensor(space.grid_ms, dtype=torch.float32), torch.tensor([0.0, 180.0, 233.0, 260.0, 300.0])
    torch.testing.assert_close(ours.window_masks(grid_ms), theirs.window_masks(grid_ms))
    torch.testing.assert_close(ours.outcome_mass(few_ms), theirs.outcome_mass(few_ms), atol=2e-5, rtol=0.0)
    torch.testing.assert_close(ours.expected_mep_mv(few_ms), theirs.expected_mep_mv(few_ms), atol=1e-6, rtol=1e-4)
    torch.testing.assert_close(ours.baselines_mv(), theirs.baselines_mv(), atol=1e-6, rtol=1e-4)
    runs = [sample.runs(grid_ms, 1) for sample in (ours, theirs)]
    np.testing.assert_array_equal(runs[0].membership, runs[1].membership)
    np.testing.assert_array_equal(runs[0].hulls, runs[1].hulls)


def test_a_sample_with_a_depression_predicts_what_it_predicts_in_torch() -> None:
    target = TARGETS["supra"]
    latents = SupraPrior().sample(1, 300, generator(6), target.space)
    meant = engine_for("compiled", target).meaning(latents, 3), target.person(latents)
    ours, theirs = (SupraSample(particles, target.space, 3) for particles in meant)
    isi_ms = torch.arange(0.0, 201.0, 4.0)
    torch.testing.assert_close(ours.outcome_mass(isi_ms), theirs.outcome_mass(isi_ms), atol=0.02, rtol=0.0)
    torch.testing.assert_close(ours.expected_mep_mv(isi_ms), theirs.expected_mep_mv(isi_ms), atol=1e-4, rtol=0.02)
    for masks in ("window_masks", "depressed_masks"):  # tables of other rows put a few edges one ISI further
        apart = (getattr(ours, masks)(isi_ms) != getattr(theirs, masks)(isi_ms)).float().mean()
        assert apart < 0.002, masks


@pytest.mark.parametrize("profile", [ProfilePrior(), PLACES])
def test_both_engines_hold_the_usual_for_as_probable_where_isis_are_chosen(profile: ProfilePrior) -> None:
    model = ParticleModel(Prior(profile))
    latents = model.prior.sample(1, 500, generator(8), VALVE_SPACE)
    targets = [WindowTarget(prior, VALVE_SPACE) for prior in (model.prior_where_asking, model.prior)]
    ours, theirs = (
        one(targets[0]).log_usual(latents) - one(targets[1]).log_usual(latents)
        for one in (partial(engine_for, "compiled"), TorchEngine)
    )
    torch.testing.assert_close(ours, theirs, atol=1e-3, rtol=1e-3)


def test_densities_of_blocks_kept_from_trial_to_trial_are_those_of_the_particles() -> None:
    posterior, kept = ParticleModel(particles=200).begin(VALVE_SPACE, 3, people=2), 0
    for trial, isi_ms in enumerate((230.0, 100.0, 250.0, 400.0, 210.0, 270.0)):
        mep_mv = 0.2 if isi_ms > 200.0 else 0.012
        posterior = posterior.model.update(posterior, Observation.of([isi_ms, 230.0], [mep_mv, 0.015]))
        posterior = posterior.noting_change() if trial == 3 else posterior
        latents, engine = posterior.swarm.latents, posterior.engine
        if latents.log_blocks is not None:
            kept += 1
            assert torch.equal(engine.log_usual(latents), engine.log_usual(Latents(latents.values, latents.kinds)))
            assert (latents.log_blocks < UNKNOWN).any()
    assert kept == 5


def test_people_of_a_batch_have_the_likelihood_that_each_has_alone() -> None:
    draws, target = generator(5), TARGETS["default"]
    latents = Prior().sample(3, 40, draws, VALVE_SPACE)
    told = history(target.person(latents), 30, draws)
    engine = engine_for("compiled", target)
    together = engine.log_likelihood(latents, told)
    for person in range(3):
        one = slice(person, person + 1)
        alone = History(*(column[one] for column in told.columns))
        part = latents.each(itemgetter(one))
        assert torch.equal(engine.log_likelihood(part, alone), together[one])


def test_both_engines_of_one_seed_come_to_the_same_belief_in_different_ways() -> None:
    trials = [(100.0, 0.01), (230.0, 0.2), (260.0, 0.25), (400.0, 0.012), (330.0, 0.01), (210.0, 0.15)]
    posteriors = []
    for engine in get_args(EngineName):
        model = ParticleModel(engine=engine)
        posterior = model.begin(VALVE_SPACE, 1)
        for isi_ms, mep_mv in trials:
            posterior = model.update(posterior, Observation.of([isi_ms], [mep_mv]))
        posteriors.append(posterior)
    ours, theirs = posteriors
    assert ours.log_evidence() != theirs.log_evidence()
    assert ours.estimate().probability == pytest.approx(theirs.estimate().probability, abs=0.05)


# What else bears on a trial: neutral in every history today, and for each field something that it must equal.

KINDS = {kind.name: kind for kind in NoiseKind}


def of_kind(kind: NoiseKind) -> tuple[Person, History]:
    draws = generator(7)
    latents = Prior().sample(2, 60, draws, VALVE_SPACE)
    latents = latents.with_kind("noise", torch.full_like(latents.noise, kind))
    person = Prior().person(latents)
    return person, history(person, 20, draws)


def with_circumstances(told: History, **fields: float) -> History:
    around = told.isi_ms.new_tensor(Circumstances(**fields)).expand(*told.isi_ms.shape, -1)
    return replace(told, circumstances=around)


def log_likelihood(person: Person, told: History) -> Any:
    return log_likelihood_of(people_of(person), told).numpy()


def response_with(person: Person, **changes: Callable[[Response], torch.Tensor]) -> Person:
    changed = {name: change(person.response) for name, change in changes.items()}
    return person._replace(response=person.response._replace(**changed))


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_neutral_circumstances_change_nothing(kind: NoiseKind) -> None:
    person, told = of_kind(kind)
    np.testing.assert_array_equal(log_likelihood(person, with_circumstances(told)), log_likelihood(person, told))


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_an_offset_is_a_larger_response(kind: NoiseKind) -> None:
    person, told = of_kind(kind)
    larger = response_with(person, log_ratio=lambda r: r.log_ratio + 0.4)
    got = log_likelihood(person, with_circumstances(told, log_offset=0.4))
    np.testing.assert_allclose(got, log_likelihood(larger, told), atol=1e-3)


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_stronger_pulse_moves_up_a_recruitment_curve_and_is_nothing_to_others(kind: NoiseKind) -> None:
    person, told = of_kind(kind)
    moved = response_with(person, rest=lambda r: r.rest + 5.0 * r.slope)
    got = log_likelihood(person, with_circumstances(told, shift_pct_rmt=5.0))
    np.testing.assert_allclose(got, log_likelihood(moved, told), atol=1e-3)


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_what_curves_alone_have_a_law_of_is_to_other_kinds_as_curves_predict_it(kind: NoiseKind) -> None:
    person, told = of_kind(kind)
    got = log_likelihood(person, with_circumstances(told, shift_pct_rmt=5.0, log_by_curves=-1.5))
    curved = kind in {NoiseKind.RECRUITMENT, NoiseKind.RECTIFIED}
    expected = log_likelihood(person, with_circumstances(told, shift_pct_rmt=5.0)) if curved else -1.5 * 20
    np.testing.assert_allclose(got, expected, rtol=1e-5)


@pytest.mark.parametrize("kind", [NoiseKind.RECRUITMENT, NoiseKind.RECTIFIED])
def test_half_an_enhancement_is_half_a_boost(kind: NoiseKind) -> None:
    person, told = of_kind(kind)
    weaker = response_with(person, boost=lambda r: 0.5 * r.boost)
    got = log_likelihood(person, with_circumstances(told, enhancement=0.5))
    np.testing.assert_allclose(got, log_likelihood(weaker, told), atol=1e-3)


@pytest.mark.parametrize("known_log_sd", [0.0, 0.8])
@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_both_engines_know_the_same_circumstances(kind: NoiseKind, known_log_sd: float) -> None:
    person, told = of_kind(kind)
    draws = generator(11)
    spread = torch.randn((*told.isi_ms.shape, 5), generator=draws)
    log_sd = known_log_sd * torch.rand(spread[..., 0].shape, generator=draws)
    known_mv = torch.stack((0.05 * spread[..., 0].abs(), 0.01 * spread[..., 1].abs(), log_sd), dim=-1)
    around = torch.cat((known_mv, spread[..., 2:3], 5.0 * spread[..., 3:4], torch.rand(spread[..., :1].shape)), dim=-1)
    by_curves = torch.where(spread[..., 4:] > 0.0, -spread[..., 4:], torch.nan)
    around = torch.cat((around, by_curves), dim=-1)
    told = replace(told, circumstances=around)
    expected = total_log_likelihood(in_double(person), told.to("cpu", torch.double))
    np.testing.assert_allclose(log_likelihood(person, told), expected, atol=1e-3)


def test_a_mistaken_known_part_is_paid_for_once_and_not_in_each_trial() -> None:
    # MEPs of TMS alone that are exp(2) times the known part, at one ISI or at ISIs far from each other.
    person, _ = of_kind(NoiseKind.MISSING)
    nobody = person._replace(present=torch.zeros_like(person.present))

    def lost(isi_ms: Sequence[float]) -> tuple[float, float]:
        column = torch.tensor([isi_ms] * len(person.present))
        log_mep, order = torch.full_like(column, math.log(0.25)), torch.arange(len(isi_ms)).expand_as(column).float()
        told = History(column, torch.zeros_like(column), log_mep, log_mep, order)
        right, wrong, open_to = (
            np.median(
                log_likelihood(nobody, with_circumstances(told, known_mv=mv, known_sd_mv=0.2 * mv, known_log_sd=sd))
            )
            for mv, sd in ((0.25, 0.0), (0.25 * math.exp(-2.0), 0.0), (0.25 * math.exp(-2.0), 1.0))
        )
        return float(right - wrong), float(right - open_to)

    closed, at_one_isi = lost([100.0] * 8)
    _, at_eight = lost([100.0 + 20.0 * number for number in range(8)])
    assert 2.0 < at_one_isi < 4.0
    assert at_eight == pytest.approx(8 * at_one_isi, rel=0.1)
    assert closed > 1.2 * at_eight


def test_a_conditioning_stimulus_without_any_enhancement_is_tms_alone() -> None:
    person, told = of_kind(NoiseKind.MISSING)
    alone = replace(told, isi_ms=torch.full_like(told.isi_ms, torch.nan))
    got = log_likelihood(person, with_circumstances(told, enhancement=0.0))
    np.testing.assert_array_equal(got, log_likelihood(person, alone))


@pytest.mark.parametrize("sd_mv", [0.0, 0.02])
def test_a_known_part_is_added_to_floor_and_response(sd_mv: float) -> None:
    # One particle of a recruitment curve, by its distribution function over 200,000 simulated trials.
    rng = np.random.default_rng(3)
    person, _ = of_kind(NoiseKind.RECRUITMENT)
    shape, response = (Shape(*(f[:1, :1] for f in person.shape)), Response(*(f[:1, :1] for f in person.response)))
    person = Person(shape, response, torch.ones(1, 1, dtype=torch.bool))
    fields = {"log_floor": math.log(0.01), "floor_log_sd": 0.2, "log_ratio": math.log(16.0), "spread": 1.0}
    fields |= {"output_log_sd": 0.3, "rest": -1.0, "boost": 0.0, "drift": 0.0, "startup": 0.0}
    person = response_with(person, **{k: lambda r, v=v: torch.full_like(r.rest, v) for k, v in fields.items()})
    z = rng.standard_normal((4, 200_000))
    evoked_mv = 0.16 / (1.0 + np.exp(1.0 - z[0])) * np.exp(0.3 * z[1])
    mep_mv = 0.01 * np.exp(0.2 * z[2]) + evoked_mv + 0.08 + sd_mv * z[3]
    for end_mv in (0.1, 0.13, 0.16, 0.2):
        end = torch.full((1, 1), math.log(end_mv))
        told = History(
            torch.full((1, 1), torch.nan),
            torch.zeros(1, 1),
            torch.full((1, 1), -torch.inf),
            end,
            torch.full((1, 1), 9.0),
        )
        got = np.exp(log_likelihood(person, with_circumstances(told, known_mv=0.08, known_sd_mv=sd_mv)))
        # Three of a hundred trials are outliers to the model; the rest is its log-normal sum.
        assert got.item() == pytest.approx((mep_mv < end_mv).mean(), abs=0.06)


def test_the_elementary_functions_are_those_of_numpy() -> None:
    x = np.linspace(-30.0, 30.0, 401).astype(np.float32)
    positive = np.exp(x)
    np.testing.assert_allclose(elementary("exp", x), np.exp(x.astype(float)), rtol=3e-6)
    np.testing.assert_allclose(elementary("exp2", x), np.exp2(x.astype(float)), rtol=3e-6)
    np.testing.assert_allclose(elementary("log", positive), np.log(positive.astype(float)), rtol=2e-6, atol=1e-7)
    np.testing.assert_allclose(elementary("per", positive), 1.0 / positive.astype(float), rtol=4e-7)
    np.testing.assert_allclose(elementary("per_root", positive), positive.astype(float) ** -0.5, rtol=4e-7)


@pytest.mark.parametrize("name", TARGETS)
def test_sweeps_one_by_one_lead_where_sweeps_at_once_do(name: str) -> None:
    # Within a call log densities of blocks are kept from sweep to sweep; each call works them out again.
    target, found = TARGETS[name], list[tuple[Any, ...]]()
    latents = target.prior.sample(1, 300, generator(3), target.space)
    told = history(target.person(latents), 8, generator(4))
    engine = Compiled(target)
    start, law = engine.log_likelihood(latents, told).numpy(), engine.law
    for number, calls in ((6, 1), (1, 6)):
        values, kinds = latents.values.numpy().copy(), latents.kinds.numpy().copy()
        log_likelihood, dice, counts = start.copy(), np.full(1, 7, dtype=np.uint64), np.zeros((1, 4), dtype=np.float32)
        for _ in range(calls):
            state = values, kinds, log_likelihood, np.full((1, 300, law.blocks), UNKNOWN)
            counts += law.sweeps(np.array([number]), columns_of(told), steps_of(told), dice, state)
        found.append((values, kinds, log_likelihood, counts))
    for together, one_by_one in zip(*found, strict=True):
        np.testing.assert_array_equal(together, one_by_one)
