"""Everything that the engine computes, at sizes around each constant, by a library that checks itself: `python sizes.py`.

It has a process of its own because the sanitizers must be loaded first; see `benchmarks.sanitized`. A function that
reads or writes beyond an array ends it.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from benchmarks import sanitized
from isiw.design import DesignSpace
from isiw.models.particles.changes import ChangePrior
from isiw.models.particles.engine import Compiled
from isiw.models.particles.jumps import WindowTarget
from isiw.models.particles.latents import Latents
from isiw.models.particles.places import Place
from isiw.models.particles.predictions import PersonSample
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.models.particles.supra.jumps import SupraTarget
from isiw.models.particles.supra.predictions import SupraSample
from isiw.models.particles.supra.prior import SupraPrior
from isiw.models.shared.history import Circumstances, History
from isiw.models.shared.scales import Scale
from isiw.native.engine import entropy_reductions, variance_reductions

TRIALS = (0, 1, 2, 15, 16, 17, 63, 64, 65, 127, 128, 129, 257)
PARTICLES = (2, 3, 15, 16, 17, 65)
ISIS = (2, 3, 15, 16, 17, 23, 24, 25, 63, 64, 65)
COMPONENTS = (1, 15, 16, 17, 63, 64, 65, 130)
SPACE = DesignSpace(0, 300, reference="impact")
FAR_MS = 5000.0


def history(trials: int, seed: int, particular: str = "") -> History:
    """Some trials of a person: points and intervals, TMS alone, uncertain and far ISIs, known parts, other pulses."""
    rng = np.random.default_rng(seed)
    isi_ms, low = rng.uniform(-60.0, 500.0, trials), rng.normal(-3.0, 1.0, trials)
    isi_ms[rng.random(trials) < 0.2] = np.nan
    isi_ms[rng.random(trials) < 0.1] = FAR_MS
    high, sort = low.copy(), rng.integers(4, size=trials) if particular != "points" else np.zeros(trials)
    high[sort == 1] += 0.4
    low[sort == 2] = -np.inf
    high[sort == 3] = np.inf
    sd_ms = np.where(rng.random(trials) < 0.3, 3.0, 0.0)
    columns = [torch.tensor(x[None], dtype=torch.float32) for x in (isi_ms, sd_ms, low, high, np.arange(trials))]
    told = History(*columns)
    if particular != "known":
        return told
    around = torch.tensor(Circumstances(0.05, 0.02, 0.6, 0.1, 5.0, 0.7)).expand(1, trials, -1)
    return replace(told, circumstances=around)


def computed(target: Any, particles: int, told: History) -> Latents:
    """What an engine computes of particles: likelihood, moves, prior and meaning."""
    engine, draws = Compiled(target), torch.Generator().manual_seed(particles)
    latents = target.prior.sample(1, particles, draws, target.space)
    found = engine.log_likelihood(latents, told)
    moved = engine.sweeps(torch.tensor([2]), latents, found, told, draws).latents
    moved = engine.sweeps(torch.tensor([1]), moved, found, told, draws).latents  # whose densities of blocks are known
    engine.log_usual(moved)
    engine.log_usual(latents)
    engine.meaning(moved, told.isi_ms.shape[1])
    return moved


def predicted(target: Any, sort: type, space: DesignSpace, latents: Latents) -> None:
    """What a sample predicts at the ISIs of a space, and how ISIs are scored by it."""
    target = replace(target, space=space)
    sample = sort(Compiled(target).meaning(latents, 1), space, 1)
    isi_ms = torch.as_tensor(space.grid_ms, dtype=torch.float32)
    mass, masks = sample.outcome_mass(isi_ms).numpy(), sample.window_masks(isi_ms).numpy()
    entropy_reductions(mass)
    variance_reductions(mass, masks)
    sample.expected_mep_mv(isi_ms)


def with_components(number: int) -> Prior:
    """A prior with so many components of when something changes."""
    return Prior(changes=ChangePrior(noted=tuple(range(1, number))))


def with_places(number: int) -> Prior:
    """A prior with so many places of a window."""
    place = Place(0.8 / number, Scale(90.0, 9.0), Scale(60.0, 0.2))
    return Prior(ProfilePrior(places=(place,) * number))


def main() -> None:
    """Compute at all sizes."""
    target, supra = WindowTarget(Prior(), SPACE), SupraTarget(SupraPrior(), SPACE)
    for trials in TRIALS:
        for number, particular in enumerate(("points", "mixed", "known")):
            computed(target, 4, history(trials, trials + number, particular))
    for particles in PARTICLES:
        latents = computed(target, particles, history(9, particles, "known"))
        predicted(target, PersonSample, SPACE, latents)
        computed(supra, particles, history(9, particles))
    for each, sort in ((target, PersonSample), (supra, SupraSample)):
        latents = computed(each, 17, history(9, 1))
        for space in spaces(ISIS):
            predicted(each, sort, space, latents)
    for number in COMPONENTS:
        for prior in (with_components(number), with_places(number)):
            computed(WindowTarget(prior, SPACE), 8, history(9, number))


def spaces(numbers: Sequence[int]) -> list[DesignSpace]:
    """Spaces of so many ISIs: close to each other, far from each other, and listed."""
    grids = [DesignSpace(20, 20 + step * (n - 1), step, reference="impact") for n in numbers for step in (0.5, 5.0)]
    listed = [[20.0, *(50.0 + 3.0 * k for k in range(n - 1))] for n in numbers]
    return [*grids, *(DesignSpace.of(isis_ms, reference="impact") for isis_ms in listed)]


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    sanitized.take()
    main()
