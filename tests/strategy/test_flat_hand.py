"""A hand muscle above its threshold: its MEPs vary much, and do not depend on the ISI."""

from __future__ import annotations

import numpy as np
import pytest

from isiw.design import DesignSpace
from isiw.strategy.catalogue import make_strategy
from known import known

SPACE = DesignSpace(0, 320, reference="impact")


def mep_mv(drive_pct: float, rng: np.random.Generator) -> float:
    """An MEP on a recruitment curve of 1 mV, at an intensity that is so far from the curve's middle."""
    share = 1 / (1 + np.exp(-0.23 * (drive_pct + 7.2 * rng.standard_normal())))
    return float(share * np.exp(0.4 * rng.standard_normal()) + 0.009 * np.exp(0.2 * rng.standard_normal()))


@pytest.mark.parametrize(
    "drive_pct", [pytest.param(-7.0, marks=pytest.mark.long), pytest.param(-17.0, marks=pytest.mark.slow)]
)
def test_few_with_a_flat_hand_muscle_get_a_sure_window(drive_pct: float) -> None:
    # Of 120, 17 got one at -17 with one engine's draws and 21 with another's. At such a rate one run of 30 has more
    # than 11 of 40; at .38, which it was before any width and intensity were foreseen (decision 25), nine of 10 have.
    sure = 0
    for seed in range(40):
        rng, strategy = np.random.default_rng(seed), make_strategy(space=SPACE, seed=seed, max_trials=40)
        while not strategy.decision().stop:
            alone = seed % 2 and strategy.delivered % 10 == 9
            strategy.tell(None if alone else strategy.ask(), mep_mv(drive_pct, rng))
        sure += known(strategy.estimate().probability) >= 0.9
    assert sure <= 11
