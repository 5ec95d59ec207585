"""The trials so far: as intervals of the log MEP, or as amplitudes for models that learn from nothing else."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np

from isiw.checks import Checked, Positive
from isiw.errors import StrategyError
from isiw.models.protocol import Observation
from isiw.types import FloatArray, Singles

_LEAST_MV: Final = 1e-3
"""What is left at least of an amplitude without its known part [mV]."""


class Circumstances(NamedTuple):
    """Known influences on the amplitude of a trial besides its ISI; neutral by default."""

    known_mv: float = 0.0  # a part of the amplitude that is not the pulse's, such as the tap's own response
    known_sd_mv: float = 0.0  # from trial to trial
    known_log_sd: float = 0.0  # of a factor that trials of nearly the same ISI share, natural log
    shift_pct_rmt: float = 0.0  # by how much the pulse is stronger than usual
    log_by_curves: float = math.nan  # log density for kinds of noise without a law of other intensities
    counts: float = 1.0  # as how much of a trial it counts


_OF_A_TRIAL: Final = 5
"""Columns of a trial before its circumstances."""

ORDER: Final = _OF_A_TRIAL - 1
SHIFT, BY_CURVES, COUNTS = (
    _OF_A_TRIAL + Circumstances._fields.index(name) for name in ("shift_pct_rmt", "log_by_curves", "counts")
)


@dataclass(frozen=True, eq=False)
class History:
    """The trials so far; amplitudes are intervals of log mV, which are points if the amplitude is known.

    The columns are those of a trial in the compiled engine: realised ISI (NaN is TMS alone) and its SD [ms], lower and
    upper end of the log MEP, how many trials came before, and the fields of `Circumstances`, shape (b, n, 11).
    """

    columns: Singles

    @classmethod
    def empty(cls, people: int) -> History:
        """No trials."""
        return cls(np.empty((people, 0, _OF_A_TRIAL + len(Circumstances._fields)), dtype=np.float32))

    @property
    def trials(self) -> int:
        """Number of trials of each person."""
        return int(self.columns.shape[1])

    @property
    def isi_ms(self) -> Singles:
        """Realised ISIs [ms], NaN for TMS alone, shape (b, n)."""
        return self.columns[..., 0]

    @property
    def isi_sd_ms(self) -> Singles:
        """Their SDs [ms], shape (b, n)."""
        return self.columns[..., 1]

    @property
    def log_mep(self) -> Singles:
        """Lower and upper ends of the log MEPs [log mV], shape (b, n, 2)."""
        return self.columns[..., 2:4]

    def appended(self, trial: History) -> History:
        """This history and one more trial."""
        return History(np.concatenate((self.columns, trial.columns), axis=1))


def observed(observation: Observation, detection_limit_mv: float, response_threshold_mv: float, order: int) -> History:
    """One trial of each person as a history."""
    limits = math.log(detection_limit_mv), math.log(response_threshold_mv)
    columns = np.empty((len(observation.isi_ms), 1, _OF_A_TRIAL + len(Circumstances._fields)), dtype=np.float32)
    columns[:, 0, ORDER], columns[:, 0, _OF_A_TRIAL:] = order, Circumstances()
    columns[:, 0, 0], columns[:, 0, 1] = observation.isi_ms, observation.isi_sd_ms
    high_mv = [math.nan] * len(columns) if observation.mep_high_mv is None else observation.mep_high_mv.tolist()
    people = zip(observation.mep_mv.tolist(), high_mv, observation.response.tolist(), strict=True)
    columns[:, 0, 2:4] = [_ends(*one, *limits) for one in people]
    if observation.known_mv is not None:
        columns[:, 0, _OF_A_TRIAL : _OF_A_TRIAL + 3] = observation.known_mv
    if observation.shift_pct_rmt is not None:
        columns[:, 0, SHIFT], columns[:, 0, BY_CURVES] = observation.shift_pct_rmt, 0.0  # until curves predict it
    return History(columns)


def _ends(mep_mv: float, high_mv: float, response: float, limit: float, threshold: float) -> tuple[float, float]:
    """Between which log MEPs [log mV] an amplitude lies, or a response that was seen (1) or not (0)."""
    if response == 1:
        return threshold, math.inf
    if response == 0:
        return -math.inf, threshold
    if mep_mv == 0:
        return -math.inf, limit if math.isnan(high_mv) else max(math.log(high_mv), limit)
    low = math.log(mep_mv)
    return low, low if math.isnan(high_mv) else math.log(high_mv)


def neutral(trials: int) -> Singles:
    """Columns of so many trials that nothing but their order is known of, shape (n, 11)."""
    columns = np.zeros((trials, _OF_A_TRIAL + len(Circumstances._fields)), dtype=np.float32)
    columns[:, ORDER], columns[:, _OF_A_TRIAL:] = np.arange(trials), Circumstances()
    return columns


def without_known(observation: Observation) -> Observation:
    """The same without the mean of the known parts, for models that know no such part."""
    if observation.known_mv is None:
        return observation
    known_mv, mep_mv = observation.known_mv[:, 0], observation.mep_mv
    left_mv = np.where(known_mv > 0, np.maximum(mep_mv - known_mv, np.float32(_LEAST_MV)), mep_mv)
    return replace(observation, mep_mv=left_mv, known_mv=None)


@dataclass(frozen=True, eq=False)
class PersonTrials:
    """The trials of one person: ISIs [ms] and MEPs [mV], shape (n,), and MEPs of TMS alone [mV], shape (m,).

    The SDs of the ISIs [ms], shape (n,), are None where all were measured.
    """

    isi_ms: FloatArray
    mep_mv: FloatArray
    baseline_mv: FloatArray
    isi_sd_ms: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class AmplitudeHistory:
    """Trials of b people, in order: ISIs [ms], NaN for TMS alone, MEPs [mV], and SDs of the ISIs [ms], shape (b, n)."""

    isi_ms: FloatArray
    mep_mv: FloatArray
    isi_sd_ms: FloatArray

    @classmethod
    def nothing(cls, people: int) -> AmplitudeHistory:
        """No trials."""
        return cls(*(np.empty((people, 0)) for _ in fields(cls)))

    @property
    def trials(self) -> int:
        """Number of trials of each person."""
        return int(self.isi_ms.shape[1])

    @property
    def people(self) -> int:
        """Number of people."""
        return int(self.isi_ms.shape[0])

    def appended(self, observation: Observation) -> AmplitudeHistory:
        """These and one more trial; of an interval its middle."""
        amplitude = without_known(observation).mep_mv
        if observation.mep_high_mv is not None:
            high = np.nan_to_num(observation.mep_high_mv, nan=0.0, posinf=0.0)
            amplitude = np.where(high > amplitude, (amplitude + high) / 2, amplitude)
        if np.isnan(amplitude).any():
            raise StrategyError(
                "the model learns from amplitudes only",
                got="a response without its amplitude",
                remedy="Tell mep_mv, or choose a model with a likelihood for responses, as the default has.",
            )
        columns = zip(
            (self.isi_ms, self.mep_mv, self.isi_sd_ms),
            (observation.isi_ms, amplitude, observation.isi_sd_ms),
            strict=True,
        )
        return AmplitudeHistory(*(np.hstack((so_far, new.astype(float)[:, None])) for so_far, new in columns))

    def person(self, person: int) -> PersonTrials:
        """The trials of one person."""
        isi_ms, mep_mv = self.isi_ms[person], self.mep_mv[person]
        alone = np.isnan(isi_ms)
        return PersonTrials(isi_ms[~alone], mep_mv[~alone], mep_mv[alone], self.isi_sd_ms[person][~alone])


class OfAmplitudes:
    """A posterior that keeps the amplitudes that it has learnt from."""

    told: AmplitudeHistory

    @property
    def trials(self) -> int:
        """Number of trials of each person that it has learnt from."""
        return self.told.trials


FloorKind: TypeAlias = Literal["subtracted", "median", "lowest", "zeroed", "raw"]

GUESSED_AT: Final = {"subtracted": 0.5, "median": 0.5, "lowest": 0.1}
"""Which quantile of all MEPs is the guess."""


@dataclass(frozen=True)
class FloorTreatment(Checked):
    """Correction of MEPs for their level without an effect of the tap, before a curve is fitted.

    The dissertation's plots have amplitudes of zero outside the window, and it does not say why [Kim2020, 4.3].

    Args:
        floor: `"subtracted"`: the mean MEP of TMS alone is subtracted; without TMS alone, the median of all MEPs.
            `"median"`, `"lowest"`: the median or the lowest tenth of all MEPs is, with or without TMS alone; the
            median is too high if a method asks mostly inside the window. `"zeroed"`: an MEP below the threshold
            is 0. `"raw"`: MEPs as they are; if the floor exceeds 0.135 of the peak, such a curve has no edges.
        threshold_mv: threshold of `"zeroed"` [mV]; in the dissertation 0.015–0.033 mV (4.1.1).
    """

    floor: FloorKind = "subtracted"
    threshold_mv: Positive = 0.025

    def level_mv(self, trials: PersonTrials) -> float:
        """The level that is subtracted from the MEPs of one person [mV]: the mean of TMS alone, or a guess at it."""
        if self.floor not in GUESSED_AT:
            return 0.0
        if self.floor == "subtracted" and len(trials.baseline_mv):
            return float(trials.baseline_mv.mean())
        return float(np.quantile(trials.mep_mv, GUESSED_AT[self.floor])) if len(trials.mep_mv) else 0.0

    def excess_mv(self, mep_mv: FloatArray, level_mv: FloatArray | float = 0.0) -> FloatArray:
        """Excess of MEPs above the floor [mV], broadcast shape."""
        return np.where(mep_mv < self.threshold_mv, 0.0, mep_mv) if self.floor == "zeroed" else mep_mv - level_mv
