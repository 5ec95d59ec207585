from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import isiw
from isiw.errors import InvalidValueError
from isiw.existing.delivered import Delivered
from isiw.existing.replaying import replay

SPACE = isiw.DesignSpace(0, 200, 5, reference="impact")
FEW: dict[str, Any] = {"particles": 100}


@cache  # trials never change
def swept(trials: int = 4) -> Delivered:
    """Every ISI so many times, of a person whose MEPs tell much."""
    responder = isiw.subjects.cohort("gaussian", 1, 3)[0].begin(3)
    isis_ms = np.random.default_rng(1).permutation(np.repeat(SPACE.grid_ms, trials))
    meps_mv = [responder.respond(isi_ms, "impact").mep_mv for isi_ms in isis_ms.tolist()]
    return Delivered(isiw.analyse(isis_ms, meps_mv, space=SPACE, particles=50).record.table, "impact")


@pytest.mark.slow
def test_strategies_are_answered_by_recorded_trials_and_compared_with_all_of_them() -> None:
    replayed = replay(swept(), ["default", "random"], space=SPACE, seeds=2, trials=20, **FEW)
    scores = replayed.f1_by_trial("default")
    assert scores.shape == (2, 20)
    assert np.median(scores[:, -1]) > 0.8
    assert (scores[:, -1] >= scores[:, 0]).all()
    assert set(replayed.strategies) == {"default", "random"}
    said = str(replayed)
    assert "All 164 pairs of stimuli say: the window" in said
    assert "are among those of the answer from all trials" in said
    assert "could not be answered" not in said


@pytest.mark.slow
def test_each_trial_answers_once_and_what_no_trial_is_left_for_is_said() -> None:
    replayed = replay(swept(1), ["incremental"], space=SPACE, seeds=1, trials=41)
    (run,) = replayed.runs
    assert len(run.windows) == 41
    assert max(run.far_ms) > 2.5
    first, *_ = str(replayed).splitlines()  # before the figures that rest on it
    assert "could not be answered: no trial was left within 2.5 ms" in first


def test_what_was_found_is_compared_with_a_window_that_is_known() -> None:
    replayed = replay(swept(), space=SPACE, seeds=1, trials=15, **FEW)
    truth = isiw.subjects.cohort("gaussian", 1, 3)[0].window(SPACE)
    assert replayed.f1_by_trial("default", truth)[0, -1] > 0.7
    assert replayed.f1_by_trial("default", None)[0, -1] == 0.0


@pytest.mark.slow
def test_a_replay_is_drawn(tmp_path: Path) -> None:
    replayed = replay(swept(1), ["random"], space=SPACE, seeds=2, trials=5, **FEW)
    assert replayed.plot(tmp_path / "replay.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("isis_ms", "mep_mv", "says"),
    [
        ([10.0, np.nan], 0.1, r"too few trials.*5 pairs and more"),
        ([10.0, 20.0, 30.0, 40.0], 0.1, r"too few trials.*5 pairs and more"),
        ([10.0, 20.0, 30.0, 40.0, 50.0], 0.0, "No MEP was seen.*about a window; got"),
    ],
)
def test_trials_that_answer_nothing_are_refused(isis_ms: list[float], mep_mv: float, says: str) -> None:
    table = isiw.analyse(isis_ms, [mep_mv] * len(isis_ms), space=SPACE, **FEW).record.table
    with pytest.raises(InvalidValueError, match=says):
        replay(Delivered(table, "impact"), space=SPACE)


@pytest.mark.slow
def test_a_replay_of_few_trials_says_what_it_found_after_the_last() -> None:
    said = str(replay(swept(1), ["incremental"], space=SPACE, seeds=1, trials=3))
    assert "incremental  3: " in said
