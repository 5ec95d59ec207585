"""How a lab's prior compares with that of people in general."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.lazy import pd
from isiw.models.particles.latents import LATENTS
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.priors.lab import LabPrior
from isiw.priors.population import drawn_from
from isiw.types import FloatArray

DRAWN: Final = 20_000
POINTS: Final = 120


QUANTITIES: Final[Mapping[str, tuple[str, bool]]] = {
    "start [ms]": ("start_ms", False),
    "width [ms]": ("log_width_ms", True),
    "EMG floor [mV]": ("log_floor_mv", True),
    "SD of the log floor": ("log_floor_sd", True),
    "largest MEP / floor": ("log_ceiling", True),
    "slope [1 / % RMT]": ("log_slope", True),
    "noise on the input": ("log_input_sd", True),
    "noise on the output": ("log_sigma_y", True),
    "boost [% RMT]": ("log_boost", True),
    "input at rest [% RMT]": ("rest", False),
    "gain / floor": ("log_gain", True),
    "CV": ("log_cv", True),
}
"""The latent that each is, and if that is a logarithm."""


def compared(lab: LabPrior) -> pd.DataFrame:
    """Median and 90 % range of each quantity in people in general and in the next person of the lab."""
    usual, own = _drawn(lab)
    rows = {
        name: [*_range(usual[latent], log=logarithmic), *_range(own[latent], log=logarithmic)]
        for name, (latent, logarithmic) in QUANTITIES.items()
    }
    columns = [f"{whose} {what}" for whose in ("built-in", "lab") for what in ("median", "5 %", "95 %")]
    return pd.DataFrame.from_dict(rows, orient="index", columns=columns)


def densities(lab: LabPrior) -> pd.DataFrame:
    """Densities of each quantity in people in general and in the next person of the lab.

    Returns:
        One row a value: quantity, value, whether the axis is logarithmic, and the densities `built_in` and `lab`,
        of the logarithm if it is.
    """
    usual, own = _drawn(lab)
    return pd.concat([_density(name, usual, own) for name in QUANTITIES], ignore_index=True)


def _drawn(lab: LabPrior) -> list[dict[str, FloatArray]]:
    """Latents of people in general and of the lab's, by name."""
    space = VALVE_SPACE if lab.place is None or lab.place.reference == "valve" else IMPACT_SPACE
    drawn, own = [], lab.joined()
    for prior in (Prior(ProfilePrior(conditioning=own.profile.conditioning)), own):
        columns = drawn_from(prior, space, DRAWN).T
        drawn.append(dict(zip(LATENTS, columns, strict=True)))
    return drawn


def _range(values: FloatArray, *, log: bool) -> list[float]:
    quantiles = np.quantile(values, [0.5, 0.05, 0.95])
    shown: list[float] = (np.exp(quantiles) if log else quantiles).tolist()
    return shown


def _density(name: str, usual: dict[str, FloatArray], own: dict[str, FloatArray]) -> pd.DataFrame:
    latent, logarithmic = QUANTITIES[name]
    both = [usual[latent], own[latent]]
    low, high = np.quantile(np.concatenate(both), [0.002, 0.998])
    edges = np.linspace(low, high, POINTS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    columns = {
        whose: np.histogram(values, edges)[0] / (len(values) * np.diff(edges))
        for whose, values in zip(("built_in", "lab"), both, strict=True)
    }
    shown = np.exp(middle) if logarithmic else middle
    return pd.DataFrame({"quantity": name, "value": shown, "logarithmic": logarithmic, **columns})
