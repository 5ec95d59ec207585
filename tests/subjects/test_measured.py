"""People with the dissertation's measured windows: where the window lies, how high the peak is, and that TMS alone is
silent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isiw.design import VALVE_SPACE
from isiw.subjects.cohorts import cohort
from isiw.subjects.measured import MEASURED_KIM, STEP_MS, WIDTHS_KIM_MS
from isiw.subjects.responses import PeakProfile
from known import instance

PEOPLE = cohort("kim11-measured", 11, 0)
EVERYBODY = range(11)


@pytest.mark.parametrize("index", EVERYBODY)
def test_the_expected_mep_is_above_that_of_tms_alone_at_rmt_inside_the_window(index: int) -> None:
    person, response = PEOPLE[index], MEASURED_KIM[index].response()
    at_rmt_mv = float(replace(response, intensity_pct_rmt=100.0).expected_evoked_mv(0.0)) + response.floor.mean_mv
    inside = np.flatnonzero(person.expected_mep_mv(VALVE_SPACE) > at_rmt_mv)
    assert np.ptp(inside) == pytest.approx(WIDTHS_KIM_MS[index] + STEP_MS, abs=2)
    profile = instance(PeakProfile, person.profile)
    middle_ms = person.hit_delay_ms + profile.start_ms + 0.5 * profile.width_ms
    assert VALVE_SPACE.grid_ms[inside].mean() == pytest.approx(middle_ms, abs=1)


@pytest.mark.parametrize("index", EVERYBODY)
def test_the_expected_mep_at_the_best_isi_is_the_peak_that_was_read(index: int) -> None:
    assert PEOPLE[index].expected_mep_mv(VALVE_SPACE).max() == pytest.approx(MEASURED_KIM[index].peak_mv, rel=1e-3)


@pytest.mark.parametrize("index", EVERYBODY)
def test_tms_alone_is_silent_and_every_second_one_at_rmt_is_a_response(index: int) -> None:
    response, threshold_mv, rng = (
        MEASURED_KIM[index].response(),
        MEASURED_KIM[index].threshold_mv,
        np.random.default_rng(1),
    )
    z, floor_z, output_z = rng.standard_normal((3, 20_000))
    floor_mv = response.floor.median_mv * np.exp(response.floor.log_sd * floor_z)

    def responses(intensity_pct_rmt: float) -> float:
        evoked_mv = replace(response, intensity_pct_rmt=intensity_pct_rmt).evoked_mv(0.0, z)
        return float(np.mean(evoked_mv * np.exp(response.sigma_y * output_z) + floor_mv > threshold_mv))

    assert responses(90.0) <= 0.02
    assert responses(100.0) == pytest.approx(0.5, abs=0.03)
