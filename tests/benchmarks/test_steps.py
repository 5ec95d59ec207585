"""The detector of steps that knows the person, and the table beside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import steps
from isiw.design import VALVE_SPACE
from isiw.studies.sessions import SimulatedSession
from isiw.subjects.changes import Change


def test_the_detector_adds_up_what_speaks_for_a_step_and_forgets_what_speaks_against_it() -> None:
    assert steps.cusum(np.array([1.0, -3.0, 2.0, 1.0, -1.0])).tolist() == [1.0, 0.0, 2.0, 3.0, 2.0]


def test_the_detector_is_for_the_step_after_it_and_against_it_before() -> None:
    usual = SimulatedSession("default", "step", 0, 1, 60, (60,)).subject()
    person = replace(usual, change=Change(21, 21, log_gain=np.log(6.0)))
    window = usual.window(VALVE_SPACE)
    assert window is not None
    middle_ms = 0.5 * (window.start_ms + window.end_ms)
    isis_ms, responder = np.linspace(middle_ms - 10.0, middle_ms + 10.0, 40), person.begin(3)
    meps_mv = np.array([[responder.respond(float(isi), "valve").mep_mv for isi in isis_ms]])
    ratios = steps.log_ratios(person, isis_ms, meps_mv, np.random.default_rng(1))[0]
    assert ratios[:20].mean() < 0 < ratios[20:].mean()


@pytest.mark.slow
def test_steps_that_are_named_are_counted_beside_the_detector(tmp_path: Path) -> None:
    steps.run("step,gaussian", people=3, seed=5, trials=12, out=tmp_path)
    steps.report(tmp_path, out=tmp_path / "steps", sessions=2)
    text = (tmp_path / "steps.md").read_text(encoding="utf-8")
    assert "named of detected" in text
    assert "| gaussian" in text
