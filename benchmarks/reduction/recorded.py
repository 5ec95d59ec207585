"""The conventional sweep as a recorded data set, from which the methods draw (4.2.1).

ISIs count from the valve command: twelve trials every 5 ms, the first two at each ISI left out. It is recorded beyond
the 500 ms that the text sweeps, so that a range that ends 500 ms after the impact can be searched as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from isiw.design import DesignSpace
from isiw.models.dissertation.incremental import SweepModel, SweepPosterior, SweepRule
from isiw.models.shared.history import AmplitudeHistory
from isiw.strategy.settings.dissertation import SweepSettings
from isiw.strategy.stopping import Progress
from isiw.subjects.subject import SimulatedSubject
from isiw.types import FloatArray
from isiw.window import Window, WindowEstimate

STEP_MS = 5.0
TRIALS_PER_ISI = 12
DISCARDED = 2
LAST_MS = 690.0
BASELINE_TRIALS = 100
"""So many that the baseline is known: its error would enlarge every window, or swallow it. The text gives no number."""

SWEPT = DesignSpace(0, 500, STEP_MS, reference="valve")
"""What the conventional sweep covers, and where windows and profiles are compared."""


@dataclass(frozen=True, eq=False)
class RecordedSweep:
    """One person's recorded sweep.

    Args:
        subject: the person.
        isi_ms: the ISIs [ms], shape (t,).
        trials_mv: all MEPs [mV], in the order of recording, shape (t, 12).
        baseline_mv: MEPs of TMS alone [mV], recorded first.
    """

    subject: SimulatedSubject
    isi_ms: FloatArray
    trials_mv: FloatArray
    baseline_mv: FloatArray

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
        return {
            "true": self.subject.window(SWEPT),
            "measured, .135": self._measured(0, len(SWEPT.grid_ms), "share").window,
            "measured, baseline": self._measured(0, len(SWEPT.grid_ms), "baseline").window,
        }

    def sweep(self, low_ms: float = 0.0) -> ConventionalSweep:
        """The conventional sweep from an ISI [ms] on, as the strategy `incremental` judges it."""
        first, last = self.index(low_ms), len(SWEPT.grid_ms)
        passed = (stop for stop in range(first + 1, last + 1) if self._has_passed(first, stop))
        terminated = next(passed, last)
        return ConventionalSweep(
            trials=TRIALS_PER_ISI * (last - first),
            terminated=TRIALS_PER_ISI * (terminated - first),
            window=self._measured(first, last, "baseline").window,
        )

    def _has_passed(self, first: int, last: int) -> bool:
        estimate = self._measured(first, last, "baseline")
        return SweepSettings().stopping.rule(0)(Progress(0, 0, estimate)).stop

    def _measured(self, first: int, last: int, rule: SweepRule) -> WindowEstimate:
        """What the strategy `incremental` makes of a part of the sweep, TMS alone before it."""
        space = DesignSpace(self.isi_ms[first], self.isi_ms[first] + 500.0, STEP_MS, reference="valve")
        isi_ms = np.concatenate(
            (np.full(len(self.baseline_mv), np.nan), self.isi_ms[first:last].repeat(TRIALS_PER_ISI))
        )
        mep_mv = np.concatenate((self.baseline_mv, self.trials_mv[first:last].ravel()))
        model = SweepModel(rule=rule)
        return SweepPosterior(model, space, AmplitudeHistory(isi_ms[None], mep_mv[None])).estimate()


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
    baseline_mv = np.array([responder.respond(None, "valve").mep_mv for _ in range(BASELINE_TRIALS)])
    isi_ms = np.arange(0.0, LAST_MS + 0.5 * STEP_MS, STEP_MS)
    trials_mv = [[responder.respond(isi, "valve").mep_mv for _ in range(TRIALS_PER_ISI)] for isi in isi_ms.tolist()]
    return RecordedSweep(subject, isi_ms, np.array(trials_mv), baseline_mv)
