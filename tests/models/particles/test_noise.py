import math

import numpy as np
import pytest
import torch
from scipy.special import expit
from scipy.stats import kstest, norm

from isiw.models.particles.noise import (
    OUTLIER_LOG_RANGE,
    OUTLIER_PROBABILITY,
    NoiseKind,
    Response,
    draw_log_mep,
    evoked_mean,
    log_gain,
    log_likelihood,
    outcome_density,
)
from isiw.subjects.responses import EmgFloor, GainResponse, RecruitmentResponse, ResponseCurve, TrialNoise
from isiw.types import ArrayLike, FloatArray

FLOOR = EmgFloor(0.010, 0.2)
LEVELS = torch.tensor([[[0.0, 0.2, 0.6, 1.0]]])


def particle(kind: NoiseKind, **values: float) -> Response:
    defaults = {
        "log_floor": math.log(FLOOR.median_mv),
        "floor_log_sd": FLOOR.log_sd,
        "log_ratio": math.log(8.0),
        "spread": 0.6,
        "output_log_sd": 0.4,
        "boost": 3.6,
        "rest": -4.5,
        "onset": 0.0,
        "max_probability": 0.55,
        "rest_probability": 0.1,
        "drift": 0.0,
        "startup": 0.0,
        "slope": 0.25,
    }
    return Response(torch.tensor([[kind]]), *(torch.tensor([[v]]) for v in (defaults | values).values()))


class AllOrNone:
    """Responses of a usual size, 0.08 mV, at 10–55 % of the trials."""

    floor = FLOOR

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        return 0.08 * (0.1 + 0.45 * np.asarray(facilitation))

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        responds = rng.random() < 0.1 + 0.45 * facilitation
        return 0.08 * rng.gamma(0.6**-2, 0.6**2) * np.exp(noise.log_gain) if responds else 0.0


class Rectified:
    """A logistic curve of 2 mV from a threshold on, 9 % up its height; 0.7 logits below it without a tap."""

    floor = FLOOR

    def _evoked_mv(self, facilitation: ArrayLike, z: ArrayLike) -> FloatArray:
        drive = -3.0 + 1.8 * np.asarray(facilitation) + 0.7 * np.asarray(z)
        evoked_mv: FloatArray = 2.0 * np.maximum(expit(drive) - 0.09, 0.0) / 0.91
        return evoked_mv

    def expected_evoked_mv(self, facilitation: ArrayLike) -> FloatArray:
        z = norm.ppf((np.arange(4000) + 0.5) / 4000)
        mean_mv: FloatArray = self._evoked_mv(np.asarray(facilitation)[..., None], z).mean(-1)
        return mean_mv * math.exp(0.5 * 0.2**2)

    def sample_evoked_mv(self, facilitation: float, noise: TrialNoise, rng: np.random.Generator) -> float:
        output = 0.2 * rng.standard_normal() + noise.log_gain
        return float(self._evoked_mv(facilitation, noise.input_z) * np.exp(output))


PAIRS: list[tuple[Response, ResponseCurve]] = [
    (particle(NoiseKind.CONSTANT_CV, spread=0.4), GainResponse(FLOOR, 0.08, 0.4)),
    (particle(NoiseKind.CONSTANT_CV, spread=0.9), GainResponse(FLOOR, 0.08, 0.9)),
    (particle(NoiseKind.MISSING), GainResponse(FLOOR, 0.08, 0.6, max_response_probability=0.55)),
    (
        particle(NoiseKind.RECRUITMENT, log_ratio=math.log(16.0), spread=2.1),
        RecruitmentResponse(FLOOR, 0.16, 0.30, 105.0, 12.0, 7.0, 0.4),
    ),
    (particle(NoiseKind.ALL_OR_NONE), AllOrNone()),
    (
        particle(
            NoiseKind.RECTIFIED,
            log_ratio=math.log(200.0),
            spread=0.7,
            output_log_sd=0.2,
            boost=1.8,
            rest=-3.0,
            onset=0.09,
        ),
        Rectified(),
    ),
]


@pytest.mark.parametrize(("believed", "true"), PAIRS)
def test_the_expected_mep_is_the_simulated_persons(believed: Response, true: ResponseCurve) -> None:
    expected = true.expected_evoked_mv(LEVELS[0, 0].numpy()) / FLOOR.median_mv
    got = evoked_mean(believed, LEVELS)[0, 0].numpy()
    corner = 0.02 if bool((believed.onset > 0).any()) else 0.0  # a threshold lies somewhere between two nodes
    np.testing.assert_allclose(got, expected, rtol=0.03 + corner, atol=2e-3)


@pytest.mark.parametrize(("believed", "true"), PAIRS)
def test_the_predicted_distribution_is_that_of_simulated_trials(believed: Response, true: ResponseCurve) -> None:
    # Kolmogorov distance to 20,000 trials. The outliers that the model allows for account for 0.03 of it; sampling
    # for 0.01 (99.9 %); the rest is the log-normal approximation of floor plus response.
    rng = np.random.default_rng(5)
    ends_mv = np.geomspace(0.006, 0.6, 24)
    for level in (0.0, 0.2, 0.6, 1.0):
        floor = FLOOR.median_mv * np.exp(FLOOR.log_sd * rng.standard_normal(20_000))
        evoked = [true.sample_evoked_mv(level, TrialNoise(z), rng) for z in rng.standard_normal(20_000)]
        empirical = (floor + np.array(evoked) <= ends_mv[:, None]).mean(1)
        high = torch.tensor(np.log(ends_mv), dtype=torch.float32)[None, None]
        levels = torch.full((1, 1, 24), level)
        believed_cdf = log_likelihood(believed, levels, torch.full_like(high, -torch.inf), high).exp()[0, 0].numpy()
        assert np.abs(believed_cdf - empirical).max() < OUTLIER_PROBABILITY + 0.04


@pytest.mark.parametrize("believed", [pair[0] for pair in PAIRS])
def test_the_density_integrates_to_one(believed: Response) -> None:
    log_mep = torch.linspace(math.log(0.001), math.log(5.0), 4001)[None, None]
    density = outcome_density(believed, LEVELS, log_mep)
    total = torch.trapezoid(density, log_mep[0, 0], dim=-1)
    torch.testing.assert_close(total, torch.ones_like(total), rtol=0, atol=5e-3)


@pytest.mark.parametrize("believed", [pair[0] for pair in PAIRS])
def test_the_density_of_a_trial_is_the_density_of_the_outcome(believed: Response) -> None:
    log_mep = torch.log(torch.tensor([[[0.008, 0.02, 0.05, 0.2]]]))
    by_trial = log_likelihood(believed, LEVELS, log_mep, log_mep).exp()
    everywhere = outcome_density(believed, LEVELS, log_mep)
    torch.testing.assert_close(by_trial, torch.diagonal(everywhere, dim1=-2, dim2=-1), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("believed", [pair[0] for pair in PAIRS])
def test_seen_and_not_seen_are_all_that_can_happen(believed: Response) -> None:
    threshold, never, always = (torch.full((1, 1, 4), x) for x in (math.log(0.03), -torch.inf, torch.inf))
    seen = log_likelihood(believed, LEVELS, threshold, always).exp()
    not_seen = log_likelihood(believed, LEVELS, never, threshold).exp()
    torch.testing.assert_close(seen + not_seen, torch.ones_like(seen), rtol=0, atol=1e-5)
    assert bool((seen[..., 1:] > seen[..., :-1]).all())


@pytest.mark.parametrize(("response", "curve"), PAIRS)
def test_draws_have_the_distribution_that_the_likelihood_is_of(response: Response, curve: ResponseCurve) -> None:
    del curve
    level = torch.linspace(0.0, 1.0, 3000).view(1, 1, -1)
    log_mep = draw_log_mep(response, level, torch.Generator().manual_seed(1))
    below = log_likelihood(response, level, torch.full_like(log_mep, -torch.inf), log_mep).exp()
    assert kstest(below.flatten().numpy(), "uniform").pvalue > 0.01


def test_startle_and_drift_belong_to_the_trial_and_not_to_its_isi() -> None:
    believed = particle(NoiseKind.CONSTANT_CV, drift=0.4, startup=0.5)
    gain = log_gain(believed, torch.tensor([0.0, 1.0, 2.0, 500.0]))[0, 0].tolist()
    # Half of the +0.29 and +0.20 that were measured; then 3 % of the way to 0.4 with each trial.
    assert gain == pytest.approx([0.145, 0.100 + 0.4 * 0.03, 0.4 * (1 - 0.97**2), 0.4], abs=1e-6)


@pytest.mark.parametrize(("believed", "true"), PAIRS)
def test_a_gain_is_the_gain_of_the_simulated_persons_trials(believed: Response, true: ResponseCurve) -> None:
    rng, log_gain_of_trial = np.random.default_rng(6), 0.5
    floor = FLOOR.median_mv * np.exp(FLOOR.log_sd * rng.standard_normal(20_000))
    evoked = [true.sample_evoked_mv(0.6, TrialNoise(z, log_gain_of_trial), rng) for z in rng.standard_normal(20_000)]
    log_mep = torch.tensor(np.log(np.quantile(floor + evoked, [0.25, 0.5, 0.75])), dtype=torch.float32)[None, None]
    level, gain = torch.full((1, 1, 3), 0.6), torch.full((1, 1, 3), log_gain_of_trial)
    below = log_likelihood(believed, level, torch.full_like(log_mep, -torch.inf), log_mep, gain).exp()
    assert below[0, 0].tolist() == pytest.approx([0.25, 0.5, 0.75], abs=0.05)


@pytest.mark.parametrize("spread", [1.6, 2.8])
@pytest.mark.parametrize("output_log_sd", [0.3, 0.5])
def test_few_nodes_predict_what_many_do(spread: float, output_log_sd: float) -> None:
    # Divergence [nat a trial]; the means over such responses are in the decision record on nodes and moves.
    believed = particle(NoiseKind.RECRUITMENT, log_ratio=math.log(16.0), spread=spread, output_log_sd=output_log_sd)
    log_mep = torch.linspace(math.log(1e-3), math.log(2.0), 400)
    few = outcome_density(believed, LEVELS, log_mep[None, None])[0, 0]
    many = torch.stack([_by_many_nodes(believed, float(level), log_mep) for level in LEVELS.flatten()])
    step = (log_mep[1] - log_mep[0]).item()
    divergence = (many * (many / few).log()).sum(-1) * step
    assert (many.sum(-1) * step - 1).abs().max() < 0.02
    assert divergence.max() < 0.015


def _by_many_nodes(response: Response, level: float, log_mep: torch.Tensor) -> torch.Tensor:
    """The density of a recruitment curve's log MEP, with all of the input's variance on 300 nodes."""
    r = Response(*(field.flatten()[0] for field in response))
    z = torch.linspace(-5.0, 5.0, 300)
    weights = torch.softmax(-0.5 * z.square(), 0)
    evoked = r.log_ratio.exp() * torch.sigmoid(r.rest + r.boost * level + r.spread * z)
    sd = ((evoked * r.output_log_sd).square() + r.floor_log_sd.square()).sqrt() / (1.0 + evoked)
    off = (log_mep.unsqueeze(-1) - r.log_floor - torch.log1p(evoked)) / sd
    density = (weights * torch.exp(-0.5 * off.square()) / (sd * math.sqrt(2 * math.pi))).sum(-1)
    relative, (low, high) = log_mep - r.log_floor, OUTLIER_LOG_RANGE
    artefacts = ((relative > low) & (relative < high)).float() / (high - low) + 1e-6
    return (1.0 - OUTLIER_PROBABILITY) * density + OUTLIER_PROBABILITY * artefacts


def test_a_curve_that_starts_at_a_threshold_leaves_the_others_as_they_are() -> None:
    plain, steep = particle(NoiseKind.RECRUITMENT), particle(NoiseKind.RECTIFIED, onset=0.09)
    both = Response(*(torch.cat(fields, dim=-1) for fields in zip(plain, steep, strict=True)))
    log_mep = torch.log(torch.tensor([[[0.008, 0.02, 0.05, 0.2]]]))
    together = log_likelihood(both, LEVELS.expand(1, 2, 4), log_mep, log_mep)
    apart = [log_likelihood(each, LEVELS, log_mep, log_mep) for each in (plain, steep)]
    torch.testing.assert_close(together, torch.cat(apart, dim=1))
    assert not torch.allclose(apart[0], apart[1], atol=0.1)
