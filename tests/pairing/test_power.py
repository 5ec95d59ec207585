from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isiw.errors import InvalidValueError
from isiw.lazy import scipy
from isiw.pairing import change_of, measuring_log_sd, people_needed, pulses_needed
from pairing.tested import visit


@pytest.mark.parametrize(("factor", "log_sd"), [(1.5, 0.4), (1.2, 0.3), (0.7, 0.5)])
def test_so_many_people_show_the_change_in_four_of_five_studies(factor: float, log_sd: float) -> None:
    people = people_needed(factor, log_sd)
    changes = np.random.default_rng(0).normal(np.log(factor), log_sd, (4000, people))
    shown = np.asarray(scipy.stats.ttest_1samp(changes, 0.0, axis=1).pvalue) < 0.05
    assert 0.78 < shown.mean() < 0.9
    assert people_needed(factor, 2 * log_sd) > people


def test_more_pulses_show_less_of_a_change_and_none_do_where_the_level_drifts() -> None:
    effect = replace(change_of(visit(0).pulses), drift_log_sd=0.05, pulse_log_sd=0.6)
    small, large = pulses_needed(effect, 1.3), pulses_needed(effect, 2.0)
    assert small is not None
    assert large is not None
    assert small > large
    assert pulses_needed(replace(effect, drift_log_sd=0.5), 1.3) is None
    assert pulses_needed(replace(effect, drift_log_sd=0.5), 1.3, steady=True) is not None
    wanted, measured = np.log(1.3), np.sqrt(2 * (0.6**2 / small + 0.05**2))
    assert scipy.stats.norm.cdf(wanted / measured - 1.645) == pytest.approx(0.8, abs=0.01)


def test_one_person_is_known_as_well_as_the_interval_says() -> None:
    effect = change_of(visit(0).pulses)
    factor = effect.pooled.factor
    assert measuring_log_sd(effect) == pytest.approx(np.log(factor.high / factor.low) / 3.29, rel=0.01)


@pytest.mark.parametrize(("factor", "log_sd"), [(1.0, 0.3), (1.5, 0.0), (-1.0, 0.3)])
def test_what_cannot_be_shown_is_refused(factor: float, log_sd: float) -> None:
    with pytest.raises(InvalidValueError):
        people_needed(factor, log_sd)
