"""What a lab's prior learns from age, height and tap, with people whose starts are known with an error."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats
from typer.testing import CliRunner

from isiw import priors
from isiw.cli import app
from isiw.config.run import RunConfig
from isiw.config.session import settings_with_prior
from isiw.devices.info import DeviceInfo
from isiw.errors import InvalidValueError
from isiw.models.particles.places import Place
from isiw.models.shared.scales import Scale
from isiw.priors.covariates import Slope, expected, slopes_of
from isiw.priors.population import LatentBlock, Law
from isiw.visit import Visit
from priors.logged import gaussian_person, write_log

SPREAD_MS, ERROR_MS, USUAL_MS = 15.0, 5.0, 60.0
LAW = Law(np.array([250.0, math.log(90.0)]), np.array([SPREAD_MS, 0.3]), 10.0)
PLACE = Place(0.8, Scale(250.0, SPREAD_MS), Scale(90.0, 0.3))
HEIGHT = Slope("height_cm", 175.0, 10.0, 9.0, 3.0)


def learnt(correlation: float, people: int = 12, seed: int = 0, others: int = 0) -> tuple[Slope, ...]:
    """The slopes of people whose height goes with the start of their window, and others who do not state it."""
    rng = np.random.default_rng(seed)
    height = rng.standard_normal(people)
    other = math.sqrt(1 - correlation**2) * rng.standard_normal(people)
    start_ms = 250.0 + SPREAD_MS * (correlation * height + other)
    measured = start_ms[:, None] + ERROR_MS * (rng.standard_normal((people, 1)) + rng.standard_normal((people, 300)))
    values = np.stack([measured, np.full_like(measured, math.log(90.0))], axis=-1)
    density = stats.norm.logpdf(values[..., 0], 250.0, USUAL_MS)
    visits = [Visit(height_cm=175.0 + 10.0 * z, age_years=30.0) for z in height] + [Visit()] * others
    values, density = (np.concatenate((each, each[:others])) for each in (values, density))
    block = LatentBlock(values, density, np.full(density.shape, fill_value=True))
    return slopes_of(visits, block, LAW, np.random.default_rng(1))


@pytest.mark.slow
def test_a_height_that_windows_go_with_is_learnt_and_nothing_of_an_age_that_all_share() -> None:
    (slope,) = learnt(0.85, people=20)
    assert slope.covariate == "height_cm"
    assert slope.mean == pytest.approx(175.0, abs=6.0)
    assert 0.4 * SPREAD_MS < slope.start_ms < SPREAD_MS
    assert slope.start_ms > 3 * slope.error_ms


@pytest.mark.slow
def test_a_height_that_tells_nothing_hardly_moves_a_prediction() -> None:
    found = [learnt(0.0, seed=seed)[0] for seed in range(6)]
    places = [expected(PLACE, (slope,), Visit(height_cm=slope.mean + slope.sd)) for slope in found]
    shifts_ms = np.array([place.start_ms.law[0] - 250.0 for place in places])
    assert np.sqrt(np.mean(shifts_ms**2)) < 0.3 * SPREAD_MS
    assert all(0.8 * SPREAD_MS < place.start_ms.law[1] < 1.15 * SPREAD_MS for place in places)


@pytest.mark.slow
def test_people_who_state_no_height_say_nothing_of_what_it_explains() -> None:
    assert learnt(0.85, others=8)[0].start_ms == pytest.approx(learnt(0.85)[0].start_ms)


def test_of_few_people_nothing_is_learnt() -> None:
    assert learnt(0.85, people=4) == ()


def test_the_next_persons_window_is_expected_later_and_more_surely_by_their_height() -> None:
    mean_ms, sd_ms = expected(PLACE, (HEIGHT,), Visit(height_cm=185.0)).start_ms.law
    assert mean_ms == pytest.approx(259.0)
    assert sd_ms == pytest.approx(math.sqrt(0.64 * SPREAD_MS**2 + 9.0))
    assert expected(PLACE, (HEIGHT,), Visit()) == PLACE
    giant_ms, giant_sd_ms = expected(PLACE, (HEIGHT,), Visit(height_cm=250.0)).start_ms.law
    assert giant_ms == pytest.approx(277.0)
    assert giant_sd_ms > sd_ms


@pytest.mark.parametrize("notes", [{"height_cm": 1.78}, {"age_years": 0.3}, {"tap_n": 5000}, {"height_cm": "178"}])
def test_what_nobody_has_is_refused(notes: dict[str, Any]) -> None:
    with pytest.raises(InvalidValueError, match=next(iter(notes))):
        Visit(**notes)


@pytest.mark.slow
@pytest.mark.usefixtures("few_sweeps")
def test_heights_in_logs_are_learnt_kept_in_the_file_and_used_for_who_states_one(tmp_path: Path) -> None:
    logs = [
        write_log(
            tmp_path / f"{n}.mcap", gaussian_person(n), subject=f"P{n}", trials=14, visit=Visit(height_cm=165.0 + 4 * n)
        )
        for n in range(5)
    ]
    lab = priors.learn(logs)
    assert [(slope.covariate, slope.mean) for slope in lab.slopes] == [("height_cm", 173.0)]
    path = priors.write_lab_prior(replace(lab, slopes=(HEIGHT,)), tmp_path / "lab.toml")
    assert priors.read_lab_prior(path).slopes == (HEIGHT,)
    short, tall = (priors.load(path, Visit(height_cm=height)).profile.places[0] for height in (165.0, 185.0))
    assert tall.start_ms.law[0] - short.start_ms.law[0] == pytest.approx(18.0)
    assert priors.load(path).profile.places[0].start_ms == known_place(lab).start_ms
    shown = CliRunner().invoke(app, ["prior", "show", str(path)])
    assert "Windows start +0.9 ± 0.3 ms for each 1 more of height_cm (people learnt from: 175 ± 10)." in shown.output
    config = RunConfig(prior=path, visit={"height_cm": 185.0}, space={"reference": "valve"})  # type: ignore[arg-type]
    settings = settings_with_prior(config, DeviceInfo("bench", "valve"), [])
    assert settings["prior"].profile.places[0].start_ms == tall.start_ms


def known_place(lab: priors.LabPrior) -> Place:
    assert lab.place is not None
    return lab.place
