"""The incremental sweep: the conventional search, and the dissertation's ground truth [Kim2020, 4.2.1]."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from statistics import NormalDist
from typing import Literal

import numpy as np

from isiw.acquisition.fixed import stops_ms
from isiw.checks import Checked, Count, Natural, NonNegative, Positive, whole
from isiw.design import DesignSpace
from isiw.dissertation.regression import curve_masks
from isiw.errors import InvalidValueError
from isiw.estimate import WindowEstimate
from isiw.excess import EDGE_LEVEL
from isiw.models.protocol import Observation
from isiw.models.shared.history import AmplitudeHistory, FloorTreatment, OfAmplitudes, PersonTrials
from isiw.types import FloatArray, Singles
from isiw.window import Window

SweepRule = Literal["baseline", "share"]


@dataclass(frozen=True)
class SweepModel(Checked):
    """The mean MEP of each ISI in turn.

    Args:
        step_ms: from one ISI to the next [ms]; if that is none of the space's, the next multiple of its step.
        trials_per_isi: trials at each.
        discarded: the first trials at each ISI, which a startle may have enlarged, are left out.
        rule: the window is the run of ISIs about the largest mean whose means exceed the `"baseline"` or the 0.135
            `"share"` of the largest excess (the other methods'). The text's baseline is TMS alone at 100 % of the
            resting motor threshold (4.2.1); here it is the TMS alone that was told, whatever its intensity.
        neighbours: means are averaged over so many ISIs (an odd number) before the rule judges them,
        evidence_se: and a window is reported if the largest exceeds the baseline by so many of its standard errors:
            both stand for the eye of the experimenter, who expected one distribution.
        floor: what the baseline is; without TMS alone, the median of the means.
    """

    step_ms: Positive = 5.0
    trials_per_isi: Count = 12
    discarded: Natural = 2
    rule: SweepRule = "baseline"
    neighbours: Count = 3
    evidence_se: NonNegative = 3.0
    floor: FloorTreatment = field(default_factory=FloorTreatment, metadata={"spread": True})

    def __post_init__(self) -> None:
        super().__post_init__()
        kept = 2  # trials that a mean and its error need
        whole("SweepModel.trials_per_isi", self.trials_per_isi, least=self.discarded + kept)
        if self.neighbours % 2 == 0:
            raise InvalidValueError("SweepModel.neighbours must be odd", got=self.neighbours)

    def begin(self, space: DesignSpace, seed: int, people: int = 1) -> SweepPosterior:  # noqa: ARG002 - no randomness
        """Nothing measured yet."""
        return SweepPosterior(self, space, AmplitudeHistory.nothing(people))

    def update(self, posterior: SweepPosterior, observation: Observation) -> SweepPosterior:
        """One more trial."""
        return replace(posterior, told=posterior.told.appended(observation))


@dataclass(frozen=True, eq=False)
class SweepPosterior(OfAmplitudes):
    """The trials of b people, from which means are worked out when they are looked at."""

    model: SweepModel
    space: DesignSpace
    told: AmplitudeHistory

    @cached_property
    def _stops_ms(self) -> FloatArray:
        return stops_ms(self.space, self.model.step_ms)

    def proposed_isis_ms(self) -> Singles:
        """One sweep, from where it has come to; see `ProposesIsi`."""
        sweep = self._stops_ms.repeat(self.model.trials_per_isi)
        done = (~np.isnan(self.told.isi_ms)).sum(axis=-1, keepdims=True)
        plan_ms: Singles = sweep[(done + np.arange(len(sweep))) % len(sweep)].astype(np.float32)
        return plan_ms

    def _means(self, trials: PersonTrials) -> tuple[FloatArray, FloatArray, FloatArray]:
        """ISIs swept so far, ascending, with mean MEP and standard error, (t,); a trial belongs to the nearest stop."""
        per_isi, discarded = self.model.trials_per_isi, self.model.discarded
        kept = np.arange(len(trials.isi_ms)) % per_isi >= discarded
        mep_mv, last = self.model.floor.excess_mv(trials.mep_mv[kept], 0.0), len(self._stops_ms) - 1
        stop = np.abs(trials.isi_ms[kept][:, None] - self._stops_ms).argmin(axis=-1)
        count = np.bincount(stop, minlength=last + 1)
        # A stop that has only a stray trial or two of its neighbours would be the largest mean too often.
        done = count >= max(2, (per_isi - discarded) // 2)
        total, squares = (np.bincount(stop, weights=values, minlength=last + 1)[done] for values in (mep_mv, mep_mv**2))
        n = count[done]
        mean = total / n
        sem = np.sqrt((squares / n - mean**2).clip(0.0) / (n - 1))
        return self._stops_ms[done], mean, sem

    def estimate(self, person: int = 0) -> WindowEstimate:
        """The window of one person, as far as the sweep has come."""
        trials = self.told.person(person)
        isi_ms, mep_mv, sem_mv = self._means(trials)
        if not len(isi_ms):
            return WindowEstimate(probability=None, window=None)
        baseline_mv = self.model.floor.level_mv(PersonTrials(isi_ms, mep_mv, trials.baseline_mv))
        near = np.ones(min(self.model.neighbours, len(isi_ms)))
        count = np.convolve(np.ones(len(isi_ms)), near, "same")
        excess_mv = np.convolve(mep_mv - baseline_mv, near, "same") / count
        error_mv = np.sqrt(np.convolve(sem_mv**2, near, "same")) / count
        level = EDGE_LEVEL if self.model.rule == "share" else 1e-9  # more than the baseline, and not as much
        best = int(excess_mv.argmax())
        clear = excess_mv[best] >= self.model.evidence_se * error_mv[best]
        inside = curve_masks(excess_mv[None], baseline_mv, level=level)[0] & clear
        reach_mv = NormalDist().inv_cdf(0.95) * sem_mv
        return WindowEstimate(
            probability=None,
            window=Window.from_mask(isi_ms, inside),
            grid_ms=isi_ms,
            profile_quantiles_mv=np.stack((mep_mv - reach_mv, mep_mv, mep_mv + reach_mv)),
        )
