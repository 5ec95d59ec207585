"""A lab's prior beside that of people in general: as a table, and as densities to draw."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from isiw.design import IMPACT_SPACE, VALVE_SPACE
from isiw.lazy import pd, torch
from isiw.models.particles.latents import LATENTS
from isiw.models.particles.prior import Prior
from isiw.models.particles.profile import ProfilePrior
from isiw.priors.lab import LabPrior
from isiw.types import FloatArray

PEOPLE: Final = 20_000
POINTS: Final = 120


class _Quantity(NamedTuple):
    latent: str
    logarithmic: bool = True


QUANTITIES: Final = {
    "start [ms]": _Quantity("start_ms", logarithmic=False),
    "width [ms]": _Quantity("log_width_ms"),
    "EMG floor [mV]": _Quantity("log_floor_mv"),
    "SD of the log floor": _Quantity("log_floor_sd"),
    "largest MEP / floor": _Quantity("log_ceiling"),
    "slope [1 / % RMT]": _Quantity("log_slope"),
    "noise on the input": _Quantity("log_input_sd"),
    "noise on the output": _Quantity("log_sigma_y"),
    "boost [% RMT]": _Quantity("log_boost"),
    "input at rest [% RMT]": _Quantity("rest", logarithmic=False),
    "gain / floor": _Quantity("log_gain"),
    "CV": _Quantity("log_cv"),
}


def compared(lab: LabPrior) -> pd.DataFrame:
    """Median and 90 % range of each quantity in people in general and in the next person of the lab.

    Args:
        lab: the lab's prior.
    """
    usual, own = _drawn(lab)
    rows = {
        name: [*_range(usual[latent], log=logarithmic), *_range(own[latent], log=logarithmic)]
        for name, (latent, logarithmic) in QUANTITIES.items()
    }
    columns = [f"{whose} {what}" for whose in ("built-in", "lab") for what in ("median", "5 %", "95 %")]
    return pd.DataFrame.from_dict(rows, orient="index", columns=columns)


def densities(lab: LabPrior) -> pd.DataFrame:
    """Densities of each quantity in people in general and in the next person of the lab.

    Args:
        lab: the lab's prior.

    Returns:
        One row a value: quantity, value, whether the axis is logarithmic, and the densities `built_in` and `lab`,
        of the logarithm where it is.
    """
    usual, own = _drawn(lab)
    return pd.concat([_density(name, quantity, usual, own) for name, quantity in QUANTITIES.items()], ignore_index=True)


def _drawn(lab: LabPrior) -> list[dict[str, FloatArray]]:
    """Latents of people in general and of the lab's, by name."""
    space = VALVE_SPACE if lab.place is None or lab.place.reference == "valve" else IMPACT_SPACE
    drawn, own = [], lab.joined()
    for prior in (Prior(ProfilePrior(conditioning=own.profile.conditioning)), own):
        latents = prior.sample(1, PEOPLE, torch.Generator().manual_seed(0), space)
        columns = latents.values[0].double().numpy().T
        drawn.append(dict(zip(LATENTS, columns, strict=True)))
    return drawn


def _range(values: FloatArray, *, log: bool) -> list[float]:
    quantiles = np.quantile(values, [0.5, 0.05, 0.95])
    shown: list[float] = (np.exp(quantiles) if log else quantiles).tolist()
    return shown


def _density(name: str, quantity: _Quantity, usual: dict[str, FloatArray], own: dict[str, FloatArray]) -> pd.DataFrame:
    both = [usual[quantity.latent], own[quantity.latent]]
    low, high = np.quantile(np.concatenate(both), [0.002, 0.998])
    edges = np.linspace(low, high, POINTS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    columns = {
        whose: np.histogram(values, edges)[0] / (len(values) * np.diff(edges))
        for whose, values in zip(("built_in", "lab"), both, strict=True)
    }
    shown = np.exp(middle) if quantity.logarithmic else middle
    return pd.DataFrame({"quantity": name, "value": shown, "logarithmic": quantity.logarithmic, **columns})
