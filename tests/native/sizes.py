"""All that the engine computes, at sizes around each constant, by a library that checks itself: `python sizes.py`.

It has a process of its own because the sanitizers must be loaded first; see `benchmarks.sanitized`. A function that
reads or writes beyond an array ends it.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from benchmarks import sanitized
from isiw.design import DesignSpace
from isiw.models.particles.changes import ChangePrior
from isiw.models.particles.compiled import Asking, Crowd
from isiw.models.particles.latents import Latents
from isiw.models.particles.noise import NoiseKind
from isiw.models.particles.places import Place
from isiw.models.particles.predictions import PersonSample
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.particles.supra.predictions import SupraSample
from isiw.models.particles.supra.prior import SupraPrior
from isiw.models.shared.history import Circumstances, History, neutral
from isiw.models.shared.scales import Scale
from isiw.models.windows import Runs, grid_of
from isiw.native.engine import log_likelihoods, reductions
from native.drawn import Case, seeds, sweeps

TRIALS = (0, 1, 2, 7, 8, 9, 15, 16, 17, 63, 64, 65, 127, 128, 129, 257)
PARTICLES = (2, 3, 15, 16, 17, 65)
ISIS = (2, 3, 15, 16, 17, 23, 24, 25, 63, 64, 65)
COMPONENTS = (1, 15, 16, 17, 63, 64, 65, 130)
SPACE = DesignSpace(0, 300, reference="impact")
FAR_MS = 5000.0


def history(trials: int, seed: int, particular: str = "") -> History:
    """Some trials of a person: points and intervals, TMS alone, uncertain and far ISIs, known parts, other pulses."""
    rng, made = np.random.default_rng(seed), neutral(trials)
    made[:, 0], low = rng.uniform(-60.0, 500.0, trials), rng.normal(-3.0, 1.0, trials)
    made[rng.random(trials) < 0.2, 0] = np.nan
    made[rng.random(trials) < 0.1, 0] = FAR_MS
    high, sort = low.copy(), rng.integers(4, size=trials) if particular != "points" else np.zeros(trials)
    high[sort == 1] += 0.4
    low[sort == 2] = -np.inf
    high[sort == 3] = np.inf
    made[:, 1], made[:, 2], made[:, 3] = np.where(rng.random(trials) < 0.3, 3.0, 0.0), low, high
    if particular == "known":
        made[:, 5:] = Circumstances(0.05, 0.02, 0.6, 5.0)
    return History(made[np.newaxis])


def computed(case: Case, particles: int, told: History) -> Latents:
    """What the engine computes of particles: draws, likelihood, weights, moves, prior and meaning."""
    law, drawn, dice = case.law, case.drawn(particles, particles), seeds(particles)
    if case.by_levels:
        drawn = drawn.with_kind("noise", np.where(np.arange(particles) % 2, NoiseKind.BY_LEVELS, drawn.noise))
    equal, nothing = np.full((1, particles), -np.log(particles)), law.nothing_known(1, particles)
    state = *drawn, log_likelihoods(case.fields(drawn), told.columns), nothing
    sweeps(law, np.array([2]), told.columns, dice, state)
    crowd = Crowd(*drawn, equal, *state[2:])
    if told.trials:
        for min_ess in (0.0, 1.0):  # kept, and resampled
            law.learn(told.columns, min_ess, (1, 2), dice, crowd)
    law.usual_weights(law, crowd)
    law.represent(crowd, particles + 1, told.trials)
    law.estimate(crowd, particles + 1, told.trials)
    for of_window in (False, True):
        for usual in (None, law):
            law.ask(crowd, grid_of(case.space), particles + 1, told.trials, Asking(of_window, usual, 5.0))
    case.fields(drawn, told.trials)
    return drawn


def predicted(case: Case, latents: Latents) -> None:
    """What a sample predicts at the ISIs of a space, and how ISIs are scored by it."""
    sample = (SupraSample if case.supra else PersonSample)(case.fields(latents, 1), case.space, 1)
    isi_ms = grid_of(case.space)
    mass, masks = sample.outcome_mass(isi_ms), sample.window_masks(isi_ms)
    for points in (0, 1, len(isi_ms)):
        inside = masks[..., :points].copy()
        reductions(mass[0], inside[0])
    sample.expected_mep_mv(isi_ms)
    best, _ = Runs.of_masks(masks[0]).best
    assert len(best) == len(isi_ms)


def with_components(number: int) -> Prior:
    """A prior with so many components of when something changes."""
    return Prior(changes=ChangePrior(noted=tuple(range(1, number))))


def with_places(number: int) -> Prior:
    """A prior with so many places of a window."""
    place = Place(0.8 / number, Scale(90.0, 9.0), Scale(60.0, 0.2))
    return Prior(ProfilePrior(places=(place,) * number))


def main() -> None:
    """Compute at all sizes."""
    usual, supra, by_levels = Case(Prior(), SPACE), Case(SupraPrior(), SPACE), Case(Prior(), SPACE, by_levels=True)
    for trials in TRIALS:
        for number, particular in enumerate(("points", "mixed", "known")):
            for case in (usual, by_levels):
                computed(case, 4, history(trials, trials + number, particular))
    for particles in PARTICLES:
        for case in (usual, by_levels):
            predicted(case, computed(case, particles, history(9, particles, "known")))
        computed(supra, particles, history(9, particles))
    for case in (usual, by_levels, supra):
        latents = computed(case, 17, history(9, 1))
        for space in spaces(ISIS):
            predicted(case._replace(space=space), latents)
    for number in COMPONENTS:
        for prior in (with_components(number), with_places(number)):
            computed(Case(prior, SPACE), 8, history(9, number))


def spaces(numbers: Sequence[int]) -> list[DesignSpace]:
    """Spaces of so many ISIs: close to each other, far from each other, and listed."""
    grids = [DesignSpace(20, 20 + step * (n - 1), step, reference="impact") for n in numbers for step in (0.5, 5.0)]
    listed = [[20.0, *(50.0 + 3.0 * k for k in range(n - 1))] for n in numbers]
    return [*grids, *(DesignSpace.of(isis_ms, reference="impact") for isis_ms in listed)]


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    sanitized.take()
    main()
