"""What is noted of people, such as their height, and how the start of a lab's windows goes with it [Kim2020, 2.1].

A shrinkage regression: covariates explain a share of the variance that the lab's law of starts has, so that one that
explains nothing hardly moves a prediction. People's likelihoods are those by which the law itself is learnt.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Final

import numpy as np

from isiw.checks import Checked, NonNegative, Number, Positive, choice
from isiw.models.particles.places import Place
from isiw.models.shared.scales import Scale
from isiw.priors.population import P_OUTSIDER, LatentBlock, Law
from isiw.types import FloatArray
from isiw.visit import Visit

COVARIATES: Final = ("age_years", "height_cm", "tap_n")

LEAST_PEOPLE: Final = 5
"""Of fewer people who state a covariate nothing is learnt about it."""

P_MATTERS: Final = 0.5
CORRELATION_SD: Final = 0.5
"""How probable it is that a covariate matters, and how large the correlation with the start is then expected to be."""

MOST_EXPLAINED: Final = 0.9
"""The largest share of the variance of starts that covariates may explain."""

DRAWS: Final = 2000
BEYOND_SD: Final = 3.0
"""Of a person who is further from the lab's people nobody knows how a line goes on."""


@dataclass(frozen=True)
class Slope(Checked):
    """How the start of windows goes with a covariate.

    Args:
        covariate: one of `COVARIATES`.
        mean: of the lab's people, in its own unit.
        sd: of the lab's people, in its own unit.
        start_ms: by how much later windows start for each of these SDs [ms].
        error_ms: SD of that [ms].
    """

    covariate: Annotated[str, partial(choice, known=COVARIATES)]
    mean: Number
    sd: Positive
    start_ms: Number
    error_ms: NonNegative

    def __str__(self) -> str:
        return (
            f"Windows start {self.start_ms / self.sd:+.2g} ± {self.error_ms / self.sd:.2g} ms for each 1 more of "
            f"{self.covariate} (people learnt from: {self.mean:.4g} ± {self.sd:.2g})."
        )


def slopes_of(visits: Sequence[Visit], block: LatentBlock, law: Law, rng: np.random.Generator) -> tuple[Slope, ...]:
    """How the starts of a lab's n people go with the covariates that enough of them state.

    Block and law are of start and log width, of their particles, (n, i, 2), and of the lab.
    """
    names, z, scales = _standardised(visits)
    if not names:
        return ()
    drawn = CORRELATION_SD * rng.standard_normal((DRAWS, len(names)))
    drawn *= rng.random(drawn.shape) < P_MATTERS
    drawn = drawn[(drawn**2).sum(1) < MOST_EXPLAINED]
    log_weight = np.sum([_log_likelihoods(block, row, law, z[row], drawn) for row in range(len(z))], axis=0)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    mean = weight @ drawn
    sd = np.sqrt(weight @ (drawn - mean) ** 2)
    start_ms, error_ms = law.sd[0] * mean, law.sd[0] * sd
    return tuple(
        Slope(name, *scales[name], float(slope), float(error))
        for name, slope, error in zip(names, start_ms, error_ms, strict=True)
    )


def _standardised(visits: Sequence[Visit]) -> tuple[list[str], FloatArray, dict[str, tuple[float, float]]]:
    """The covariates that differ between enough people, as z scores, (n, k), NaN where not stated, and their scales."""
    scales: dict[str, tuple[float, float]] = {}
    columns = []
    for name in COVARIATES:
        stated = np.array([math.nan if (x := getattr(visit, name)) is None else x for visit in visits])
        known = stated[~np.isnan(stated)]
        if len(known) >= LEAST_PEOPLE and (sd := float(known.std(ddof=1))) > 0:
            scales[name] = float(known.mean()), sd
            columns.append((stated - known.mean()) / sd)
    return list(scales), np.array(columns).T, scales


def _log_likelihoods(block: LatentBlock, row: int, law: Law, noted: FloatArray, drawn: FloatArray) -> FloatArray:
    """One person's log likelihood under each of the drawn correlations, (m,), as in `population`.

    What is not noted of the person, NaN among the z scores (k,), explains nothing of the start.
    """
    known = ~np.isnan(noted)
    drawn = drawn[:, known]
    left = np.sqrt(1.0 - (drawn**2).sum(1))
    z = (block.values[row] - law.mean) / law.sd  # (i, 2)
    about = (z[:, :1] - drawn @ noted[known]) / left  # (i, m)
    log_law = -0.5 * (about**2 + z[:, 1:] ** 2) - np.log(left) - np.log(law.sd).sum() - np.log(2 * np.pi)
    ratio = log_law - block.log_density[row][:, None] + math.log(1 - P_OUTSIDER)
    weight = np.where(block.used[row][:, None], np.logaddexp(math.log(P_OUTSIDER), ratio), 0.0)
    found: FloatArray = np.logaddexp.reduce(weight, axis=0)
    return found


def expected(place: Place, slopes: Sequence[Slope], visit: Visit) -> Place:
    """The law of the next person's window, of whom something is noted; what is not noted changes nothing."""
    mean_ms, sd_ms = place.start_ms.law
    left = 1.0
    error_ms2 = 0.0
    for slope in slopes:
        if (stated := getattr(visit, slope.covariate)) is not None:
            z = max(-BEYOND_SD, min(BEYOND_SD, (stated - slope.mean) / slope.sd))
            mean_ms += slope.start_ms * z
            left -= (slope.start_ms / sd_ms) ** 2
            error_ms2 += (slope.error_ms * z) ** 2
    sd_ms = math.sqrt(max(left, 1.0 - MOST_EXPLAINED) * sd_ms**2 + error_ms2)
    return replace(place, start_ms=Scale(mean_ms, sd_ms))
