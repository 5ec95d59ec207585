"""A prior's file with an absurd value anywhere: refused in words when it is loaded, or good for a first ask."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from isiw.design import DesignSpace
from isiw.errors import ConfigError
from isiw.models.particles.laws import FOREARM, Floor, Gain, NoiseShares
from isiw.models.particles.places import Place
from isiw.models.particles.profile import ShapeShares
from isiw.models.shared.scales import Scale
from isiw.priors.file import load, write_lab_prior
from isiw.priors.lab import LabPrior, LearntSession
from isiw.strategy.catalogue import make_strategy
from isiw.text.toml_files import read_toml

SPACE = DesignSpace(0, 500, 25, reference="valve")

ABSURD: tuple[Any, ...] = (1e308, -1e308, 1e30, -1, 0, 1, math.nan, math.inf, "x", True, 1e6, 10**30, [], {})


@pytest.fixture(scope="module")
def values(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A file with every component of a lab's prior."""
    scale = Scale(10.0, 0.4)
    lab = LabPrior(
        sessions=(LearntSession("0" * 64, "P1", 25), LearntSession("1" * 64, "P2", 30, muscle="FCR")),
        p_window=0.8,
        shapes=ShapeShares(),
        noise=NoiseShares(),
        place=Place(0.5, Scale(30.0, 12.0), Scale(90.0, 0.3), "valve", (183.0, 6.0)),
        floor=Floor(0.5, Scale(0.01, 0.3), Scale(0.2, 0.4)),
        gain=Gain(0.5, scale, Scale(0.6, 0.3)),
        muscle=FOREARM,
    )
    return read_toml(write_lab_prior(lab, tmp_path_factory.mktemp("lab") / "lab.toml"))


def leaves(values: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The ways to all values that hold no others, and to all sections."""
    if way:
        yield way
    items = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    for key, inner in items:
        yield from leaves(inner, (*way, key))


def with_value(values: dict[str, Any], way: tuple[Any, ...], value: Any) -> str:
    """A prior's file with another value somewhere."""
    changed = copy.deepcopy(values)
    place: Any = changed
    for key in way[:-1]:
        place = place[key]
    place[way[-1]] = value
    return tomli_w.dumps(changed)


@pytest.mark.slow
def test_a_prior_with_an_absurd_value_anywhere_is_refused_or_asks(values: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text(tomli_w.dumps(values))
    assert make_strategy(prior=load(file), particles=20, space=SPACE).ask() >= 0
    refused, asked = 0, 0
    for way in leaves(values):
        for absurd in ABSURD:
            file.write_text(with_value(values, way, absurd))
            try:
                prior = load(file)
            except ConfigError as error:
                assert len(str(error)) < 2000  # noqa: PT017 - of many tries
                refused += 1
                continue
            assert math.isfinite(make_strategy(prior=prior, particles=20, space=SPACE).ask()), (way, absurd)
            asked += 1
    assert refused > 5 * asked


@pytest.mark.parametrize(
    ("way", "absurd"),
    [
        (("place", "width_ms", 0), 1e308),
        (("place", "start_ms", 1), 1e30),
        (("floor", "share"), 1.0),
        (("schema_version",), 1e6),
        (("sessions", 0, "trials"), -1),
        (("sessions",), []),
        (("place", "hit_delay_ms", 0), 1e308),
    ],
)
def test_what_no_person_or_session_has_is_refused_when_the_prior_is_loaded(
    values: dict[str, Any], tmp_path: Path, way: tuple[Any, ...], absurd: Any
) -> None:
    (tmp_path / "lab.toml").write_text(with_value(values, way, absurd))
    with pytest.raises(ConfigError, match="cannot be used"):
        load(tmp_path / "lab.toml")
