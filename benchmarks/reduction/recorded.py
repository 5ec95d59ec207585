"""The conventional sweep as a recorded data set, from which the methods draw (4.2.1).

ISIs count from the valve command: twelve trials every 5 ms, the first two at each ISI left out. It is recorded beyond
the 500 ms that the text sweeps, so that a range that ends 500 ms after the impact can be searched as well.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.dissertation.incremental import SweepModel, SweepPosterior, SweepRule
from isiw.dissertation.strategies import SWEEP
from isiw.estimate import WindowEstimate
from isiw.models.shared.history import AmplitudeHistory
from isiw.strategy.decisions import Progress
from isiw.subjects.responses import RecruitmentResponse
from isiw.subjects.subject import Responder, SimulatedSubject
from isiw.types import FloatArray
from isiw.window import Window

STEP_MS = 5.0
TRIALS_PER_ISI = 12
DISCARDED = 2
LAST_MS = 690.0
BASELINE_TRIALS = 100
"""So many that the baseline is known: its error would enlarge every window, or swallow it. The text gives no number."""

BASELINES: Final = ("100 % RMT", "90 % RMT")
"""TMS alone whose MEP a measured window is above: at the threshold, as in the text (4.2.1), or as in the pairs."""

OTHER_NOISE = 1_000_000
"""Added to a seed for TMS alone at 100 % RMT, so that it takes nothing from the noise of the sweep."""

SWEPT = DesignSpace(0, 500, STEP_MS, reference="valve")
"""What the conventional sweep covers, and where windows and profiles are compared."""


@dataclass(frozen=True, eq=False)
class RecordedSweep:
    """One person's recorded sweep.

    Args:
        subject: the person.
        isi_ms: the ISIs [ms], shape (t,).
        trials_mv: all MEPs [mV], in the order of recording, shape (t, 12).
        alone_mv: MEPs of TMS alone [mV] by intensity, one of `BASELINES`.
    """

    subject: SimulatedSubject
    isi_ms: FloatArray
    trials_mv: FloatArray
    alone_mv: Mapping[str, FloatArray]

    @property
    def kept_mv(self) -> FloatArray:
        """The MEPs that are not left out [mV], shape (t, 10)."""
        return self.trials_mv[:, DISCARDED:]

    def index(self, isi_ms: float) -> int:
        """Which of the ISIs is nearest to one [ms]."""
        return int(np.clip(round(isi_ms / STEP_MS), 0, len(self.isi_ms) - 1))

    @cached_property
    def measured_mv(self) -> FloatArray:
        """The measured profile on `SWEPT` [mV]."""
        return self.kept_mv.mean(axis=1)[: len(SWEPT.grid_ms)]

    @cached_property
    def true_mv(self) -> FloatArray:
        """The true profile on `SWEPT` [mV]."""
        return self.subject.expected_mep_mv(SWEPT)

    @cached_property
    def windows(self) -> dict[str, Window | None]:
        """The windows that a method can be judged by, by name; see `readings.TRUTHS`."""
        whole = (0, len(SWEPT.grid_ms))
        return {
            "true": self.subject.window(SWEPT),
            "measured, .135": self._measured(*whole, BASELINES[1], "share").window,
            **{f"measured, {baseline}": self._measured(*whole, baseline).window for baseline in BASELINES},
        }

    def sweep(
        self, low_ms: float = 0.0, baseline: str = BASELINES[0], last_ms: float = SWEPT.high_ms
    ) -> ConventionalSweep:
        """The conventional sweep from an ISI on, as the strategy `incremental` judges it.

        Args:
            low_ms: the ISI [ms].
            baseline: one of `BASELINES`.
            last_ms: the last ISI [ms].
        """
        first, last = self.index(low_ms), self.index(last_ms) + 1
        passed = (stop for stop in range(first + 1, last + 1) if self._has_passed(first, stop, baseline))
        terminated = next(passed, last)
        return ConventionalSweep(
            trials=TRIALS_PER_ISI * (last - first),
            terminated=TRIALS_PER_ISI * (terminated - first),
            window=self._measured(first, last, baseline).window,
        )

    def _has_passed(self, first: int, last: int, baseline: str) -> bool:
        estimate = self._measured(first, last, baseline)
        return SWEEP.stopping.rule(0)(Progress(0, 0, estimate)).stop

    def _measured(self, first: int, last: int, baseline: str, rule: SweepRule = "baseline") -> WindowEstimate:
        """What the strategy `incremental` makes of a part of the sweep, TMS alone before it."""
        alone_mv = self.alone_mv[baseline]
        space = DesignSpace(self.isi_ms[first], self.isi_ms[first] + 500.0, STEP_MS, reference="valve")
        isi_ms = np.concatenate((np.full(len(alone_mv), np.nan), self.isi_ms[first:last].repeat(TRIALS_PER_ISI)))
        mep_mv = np.concatenate((alone_mv, self.trials_mv[first:last].ravel()))
        model = SweepModel(rule=rule)
        return SweepPosterior(
            model, space, AmplitudeHistory(isi_ms[None], mep_mv[None], np.zeros((1, len(isi_ms))))
        ).estimate()


@dataclass(frozen=True)
class ConventionalSweep:
    """What a conventional sweep came to.

    Args:
        trials: of the whole sweep.
        terminated: trials until the sweep had left the window behind; all where it never did.
        window: the run of ISIs above the baseline about the largest mean; None where none stands out.
    """

    trials: int
    terminated: int
    window: Window | None


def stops_inside(window: Window | None) -> int:
    """How many stops of the sweep lie in a window, both ends included."""
    return 0 if window is None else int(window.mask(SWEPT.grid_ms).sum())


def record(subject: SimulatedSubject, seed: int) -> RecordedSweep:
    """Record a person's sweep, from TMS alone on.

    Args:
        subject: the person.
        seed: of the trial noise.
    """
    responder = subject.begin(seed)
    alone_mv = _alone_mv(responder)
    isi_ms = np.arange(0.0, LAST_MS + 0.5 * STEP_MS, STEP_MS)
    trials_mv = [[responder.respond(isi, "valve").mep_mv for _ in range(TRIALS_PER_ISI)] for isi in isi_ms.tolist()]
    at_rmt_mv = alone_at_rmt_mv(subject, seed)
    alone = {BASELINES[0]: alone_mv if at_rmt_mv is None else at_rmt_mv, BASELINES[1]: alone_mv}
    return RecordedSweep(subject, isi_ms, np.array(trials_mv), alone)


def alone_at_rmt_mv(subject: SimulatedSubject, seed: int) -> FloatArray | None:
    """MEPs of TMS alone at 100 % RMT [mV]; None of people without a recruitment curve, who know no intensity.

    Args:
        subject: the person.
        seed: of the trial noise.
    """
    if not isinstance(subject.response, RecruitmentResponse):
        return None
    response = replace(subject.response, intensity_pct_rmt=100.0)
    return _alone_mv(replace(subject, response=response).begin(OTHER_NOISE + seed))


def _alone_mv(responder: Responder) -> FloatArray:
    return np.array([responder.respond(None, "valve").mep_mv for _ in range(BASELINE_TRIALS)])
