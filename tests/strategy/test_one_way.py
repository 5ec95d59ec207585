"""However trials come, the same trials teach the same, bit for bit."""

from __future__ import annotations

import dataclasses
import itertools
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from isiw.design import DesignSpace
from isiw.existing.analysis import analysed
from isiw.existing.delivered import Delivered
from isiw.findings import Kind
from isiw.log.headers import Header
from isiw.log.new_verdicts import correction
from isiw.log.record import read_session
from isiw.log.schema import Correction
from isiw.log.writer import LogWriter
from isiw.session.examination import examination_of, relearned
from isiw.session.replay import replay
from isiw.session.sink import Sink
from isiw.strategy.catalogue import make_strategy
from isiw.strategy.course import Known
from isiw.strategy.strategy import Strategy
from isiw.studies import SimulatedSession
from isiw.studies.sessions import _Batch
from isiw.subjects import cohort
from isiw.subjects.subject import Response
from isiw.trials import Status, Trial, TrialTable
from quick import quick

SPACE = DesignSpace(0, 300, 5, reference="impact")
SEED = 11


def made(person: int = 0) -> Strategy:
    return make_strategy("default", SPACE, SEED + person, max_trials=40, **quick("default"))


def said(known: Strategy | Known) -> tuple[Any, ...]:
    """All that an estimate says, and the decision."""
    estimate = known.estimate()
    figures = {field.name: getattr(estimate, field.name) for field in dataclasses.fields(estimate)}
    arrays = {name: value.tobytes() for name, value in figures.items() if isinstance(value, np.ndarray)}
    plain = {name: repr(value) for name, value in figures.items() if name not in arrays}
    return arrays, plain, known.decision()


def folded(trials: TrialTable) -> tuple[Any, ...]:
    strategy = made()
    for trial in trials:
        strategy.learn(trial)
    return said(strategy)


def told(trials: TrialTable) -> tuple[Any, ...] | None:
    """By a lab's own loop without a log, which excludes nothing and measures a tap alone at an ISI."""
    if any(trial.excluded or trial.tap_mv or (trial.tap_alone and trial.isi_ms is None) for trial in trials):
        return None
    strategy = made()
    for trial in trials:
        if trial.reason is not None:
            strategy.count_mistrial()
        elif trial.tap_alone:
            strategy.tell(trial.isi_ms, trial.mep_mv, pulse=False)
        else:
            mep_mv = None if trial.mep_interval_mv else trial.mep_mv
            strategy.tell(trial.isi_ms, mep_mv, isi_sd_ms=trial.isi_sd_ms, mep_interval_mv=trial.mep_interval_mv)
    return said(strategy)


@cache
def header() -> Header:
    return analysed(Delivered(TrialTable(tuple(SEEN[:1])), "impact", subject="P1"), made()).record.header


def examined(trials: TrialTable, corrected: Sequence[int], folder: Path) -> tuple[Any, ...]:
    """As a session learns them, with its log; a correction comes at the end."""
    with LogWriter.create(folder / "P1.mcap", header()) as log:
        examination = examination_of(made(), Sink(log=log))
        for trial in trials:
            examination.came(trial)
            examination.conclude()
        for number in corrected:
            examination.judge(
                lambda table, number=number: correction(table, number, "the tap's own", Correction(mep_mv=0.03))  # type: ignore[misc]
            )
        examination.conclude()
        return said(examination.learner.strategy)


def drivers(trials: TrialTable, corrected: Sequence[int] = ()) -> dict[str, tuple[Any, ...]]:
    """What each way to learn the same trials says."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        found = {"session": examined(trials, corrected, folder)}
        record = read_session(folder / "P1.mcap")
        found["resumed"] = said(replay(record, made(), verify=False).strategy)
    table = record.table
    assert [trial.index for trial in table] == [trial.index for trial in trials]
    analysing = made()
    analysed(Delivered(table, "impact", subject="P1"), analysing)
    found |= {"fold": folded(table), "analysis": said(analysing), "again": said(relearned(made(), table))}
    return found if (by_tells := told(table)) is None else found | {"tells": by_tells}


def require_one_answer(trials: TrialTable, corrected: Sequence[int] = ()) -> None:
    found = drivers(trials, corrected)
    for name, answer in found.items():
        assert answer == found["fold"], name


def pairs(name: str, person: int = 0, trials: int = 13) -> list[Trial]:
    responder = cohort(name, person + 1, 3)[person].begin(3)
    isis_ms = np.random.default_rng(5).choice(SPACE.grid_ms, trials).tolist()
    answers = [responder.respond(isi_ms, "impact") for isi_ms in isis_ms]
    return [Trial.of(isi_ms, one.mep_mv, index=k) for k, (isi_ms, one) in enumerate(zip(isis_ms, answers, strict=True))]


SILENT = [Trial.of(20.0 * k, 0.0, index=k) for k in range(12)]
ALONE = {k: Trial.of(None, 0.04, index=k) for k in (2, 7)}
TAPS = {k: Trial(k, Status.ACCEPTED, None, isi_ms=60.0 + k, mep_mv=0.05 + 0.01 * k, tap_alone=True) for k in (3, 4, 9)}
ANYWHERE = {5: Trial(5, Status.ACCEPTED, None, mep_mv=0.2, tap_alone=True)}
LOST = {k: Trial(k, Status.MISTRIAL, 50.0, Kind.NO_PULSE) for k in (1, 6, 8)}
SEEN = pairs("gaussian")
CASES: dict[str, tuple[list[Trial], tuple[int, ...]]] = {
    "a window": (SEEN, ()),
    "none": (pairs("nonresponder"), ()),
    "silent": (SILENT, ()),
    "TMS alone": ([ALONE.get(trial.index, trial) for trial in SEEN], ()),
    "taps alone": ([TAPS.get(trial.index, trial) for trial in SEEN], ()),
    "a tap alone at any time": ([ANYWHERE.get(trial.index, trial) for trial in SEEN], ()),
    "lost": ([LOST.get(trial.index, trial) for trial in SEEN], ()),
    "excluded": ([dataclasses.replace(trial, excluded=trial.index in {4, 10}) for trial in SEEN], ()),
    "corrected": (SEEN, (3, 8)),
    "rounded": ([dataclasses.replace(trial, mep_mv=round(50 * (trial.mep_mv or 0.0)) / 50) for trial in SEEN], ()),
    "pieces of all": ([({**ALONE, **TAPS, **LOST}).get(trial.index, trial) for trial in SEEN], (5, 12)),
}


AT_ONCE = ("a window", "silent", "pieces of all")
"""Cases that are tried each time; the last has most of what the others have alone."""


@pytest.mark.filterwarnings("ignore::isiw.errors.ImplausibleDataWarning")  # a loop of one's own is told what is odd
@pytest.mark.parametrize(
    "case", [case if case in AT_ONCE else pytest.param(case, marks=pytest.mark.slow) for case in CASES]
)
def test_each_way_to_learn_the_same_trials_says_the_same(case: str) -> None:
    trials, corrected = CASES[case]
    require_one_answer(TrialTable(tuple(trials)), corrected)


AMPLITUDES = st.floats(0.01, 2.0) | st.sampled_from([0.0, 0.05, 0.1])
KINDS = st.sampled_from(["pair", "pair", "pair", "alone", "tap", "lost", "excluded", "interval"])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::isiw.errors.ImplausibleDataWarning")
@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(KINDS, st.integers(0, 60), AMPLITUDES), min_size=1, max_size=8))
def test_each_way_to_learn_any_trials_says_the_same(drawn: list[tuple[str, int, float]]) -> None:
    trials = [Trial.of(100.0, 0.2, index=0)]  # one pair at least
    for number, (kind, steps, mep_mv) in enumerate(drawn, start=1):
        isi_ms, known = 5.0 * steps, {"index": number}
        trials.append(
            {
                "pair": lambda: Trial.of(isi_ms, mep_mv, isi_sd_ms=1.0, **known),  # noqa: B023 - called at once
                "alone": lambda: Trial.of(None, mep_mv, **known),  # noqa: B023
                "tap": lambda: Trial(number, Status.ACCEPTED, None, isi_ms=isi_ms, mep_mv=mep_mv, tap_alone=True),  # noqa: B023
                "lost": lambda: Trial(number, Status.MISTRIAL, isi_ms, Kind.SATURATION, isi_ms=isi_ms, mep_mv=mep_mv),  # noqa: B023
                "excluded": lambda: Trial.of(isi_ms, mep_mv, excluded=True, **known),  # noqa: B023
                "interval": lambda: Trial.of(isi_ms, None, mep_interval_mv=(mep_mv, mep_mv + 0.1), **known),  # noqa: B023
            }[kind]()
        )
    require_one_answer(TrialTable(tuple(trials)))


@pytest.mark.parametrize("case", ["a window", "none", "silent", "rounded"])
def test_people_side_by_side_are_each_as_if_alone(case: str) -> None:
    crowd = [CASES[case][0], SILENT, pairs("gaussian", 1), pairs("nonresponder", 1)]
    shown = (*quick("default").items(), ("max_trials", 40))
    plan = SimulatedSession("default", "gaussian", 0, SEED, 12, (12,), SPACE, shown, stopping="noted")
    batch = _Batch([dataclasses.replace(plan, person=person) for person in range(len(crowd))])
    for at_once in itertools.islice(zip(*crowd, strict=False), 12):
        batch.tell([Response(trial.isi_ms, trial.mep_mv or 0.0) for trial in at_once])
    for person, trials in enumerate(crowd):
        strategy = made(person)
        for trial in trials[:12]:
            strategy.learn(trial)
        assert said(batch._known(person)) == said(strategy), person  # noqa: SLF001 - what a study reports of them
