from __future__ import annotations

import numpy as np
import pytest

import isiw
from isiw.dissertation.profiles import best_fit, profile_fits
from isiw.report.answers import method_answers

SPACE = isiw.DesignSpace(0, 150, 5, reference="impact")


def analysed(alone: int = 12, trials: int = 4) -> isiw.Analysis:
    """Trials of a person with little noise: 0.1 mV, and 0.6 mV more at 75 ms, falling as a Gaussian."""
    rng = np.random.default_rng(2)
    isis_ms = np.tile(SPACE.grid_ms, trials)
    expected_mv = 0.1 + 0.6 * np.exp(-0.5 * ((isis_ms - 75.0) / 17.0) ** 2)
    isis_ms = np.concatenate([isis_ms, np.full(alone, np.nan)])
    meps_mv = np.concatenate([expected_mv, np.full(alone, 0.1)]) * np.exp(0.12 * rng.standard_normal(len(isis_ms)))
    return isiw.analyse(isis_ms, meps_mv, space=SPACE, particles=100)


@pytest.mark.slow
def test_three_methods_and_the_form_of_the_profile_are_told_side_by_side() -> None:
    belief, means, counts, form = method_answers(analysed().record)
    assert "45–105 ms after the impact" in belief.answer  # so little noise is not the law's, which it may say
    assert means.answer.startswith("Window 45–105 ms.")
    assert "of 12 trials with TMS alone" in means.answer
    assert counts.answer.startswith("Window ")
    assert "95 % of the trials with TMS alone" in counts.answer
    assert "means inside the window pass a test of normality" in form.answer
    told = [trial for trial in analysed().record.table.told if trial.isi_ms is not None]
    fits = profile_fits([trial.isi_ms or 0.0 for trial in told], [trial.mep_mv or 0.0 for trial in told])
    assert f"AICc prefers: {best_fit(fits).name}." in form.answer
    assert all(each.needs and each.cannot for each in (belief, means, counts, form))


@pytest.mark.slow
def test_without_tms_alone_the_baseline_is_guessed_and_the_threshold_is_nobodys_own() -> None:
    _, means, counts, _ = method_answers(analysed(alone=0, trials=2).record)
    assert "guessed: the median of all means" in means.answer
    assert "Threshold of a response 50 µV (a usual value" in counts.answer


@pytest.mark.slow
def test_isis_that_hardly_repeat_are_put_into_steps() -> None:
    rng = np.random.default_rng(2)
    isis_ms = rng.uniform(0, 150, 60)
    record = isiw.analyse(isis_ms, rng.uniform(0.1, 0.2, 60), space=SPACE, particles=50).record
    assert "ISIs were used" in method_answers(record)[-1].cannot


@pytest.mark.parametrize("isis_ms", [[10.0, 20.0, 30.0], [10.0, 10.0, 20.0]])
def test_of_few_trials_it_is_said_what_cannot_be_said(isis_ms: list[float]) -> None:
    record = isiw.analyse(isis_ms, [0.1, 0.4, 0.2], space=SPACE, particles=50).record
    assert "No more can be said" in method_answers(record)[-1].answer


@pytest.mark.slow
def test_the_page_of_imported_trials_has_them() -> None:
    page = isiw.report.report_page(analysed(trials=1).record)
    assert 'id="methods"' in page
    assert "Response counts" in page


@pytest.mark.slow
def test_a_statement_says_how_large_the_enhancement_is_in_mv_and_beside_tms_alone() -> None:
    record = analysed().record
    last = record.estimates[-1]
    size, low, high = last.enhancement_mv
    assert low <= size <= high
    assert 0.3 < size < 0.9  # 0.6 mV more than 0.1 mV
    assert 4.0 < last.enhancement_ratio[0] < 10.0
    assert "above TMS alone" in isiw.report.final_statement(record)
    facts = isiw.export.tables.session_facts(record)
    assert facts["enhancement_mv"] == size
    assert facts["enhancement_ratio_low"] == last.enhancement_ratio[1]
