"""What a standard normal latent stands for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest

from isiw.checks import Checked
from isiw.errors import InvalidValueError
from isiw.models.shared.scales import AnyScale, PositiveScale, Scale

Z = np.linspace(-3, 3, 61)


@dataclass(frozen=True)
class Believed(Checked):
    width: PositiveScale = Scale(100.0, 0.4, 0.02)
    rest: AnyScale = Scale(-4.5, 0.4)


def test_the_median_is_that_of_the_quantity_and_the_sd_that_of_its_logarithm() -> None:
    scale = Scale(100.0, 0.4)
    assert math.exp(scale.log.normal(0.0)) == pytest.approx(100.0)
    assert math.exp(scale.log.normal(1.0)) == pytest.approx(100.0 * math.exp(0.4))
    assert scale.normal(-1.0) == pytest.approx(99.6)


def test_a_tail_reaches_further_and_leaves_the_middle_where_it_is() -> None:
    plain, tailed = (Scale(0.0, 1.0, tail).normal(Z) for tail in (0.0, 0.1))
    assert (np.diff(tailed) > 0).all()
    assert tailed[-1] - plain[-1] == pytest.approx(2.7)
    assert np.abs(tailed - plain)[np.abs(Z) < 0.5].max() < 0.02


def test_pairs_and_lists_are_scales() -> None:
    believed = Believed(width=cast("Any", [80, 0.3, 0]), rest=cast("Any", (-4, 1)))
    assert believed == Believed(width=Scale(80.0, 0.3, 0.0), rest=Scale(-4.0, 1.0, 0.0))
    assert isinstance(believed.width, Scale)


@pytest.mark.parametrize(
    "wrong",
    [(math.nan, 0.5), (80.0,), (80.0, 0.3, 0.1, 0.1), (80.0, 0.0), (80.0, 0.3, -0.1), (-80.0, 0.3), ("80", 0.3)],
)
def test_anything_else_is_refused_by_name(wrong: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"Believed\.width"):
        Believed(width=wrong)


def test_only_positive_quantities_need_a_positive_median() -> None:
    assert Believed(rest=Scale(-80.0, 0.3)).rest.median == -80.0
