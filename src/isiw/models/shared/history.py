"""The trials so far: as intervals of the log MEP, or as amplitudes for models that learn from nothing else."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np

from isiw.checks import Checked, Positive
from isiw.errors import StrategyError
from isiw.lazy import torch
from isiw.models.protocol import Observation, Tensor
from isiw.types import FloatArray

_LEAST_MV: Final = 1e-3
"""What is left at least of an amplitude without its known part [mV]."""


class Circumstances(NamedTuple):
    """Known influences on the amplitude of a trial besides its ISI; neutral by default."""

    known_mv: float = 0.0  # a part of the amplitude that is not the pulse's, such as the tap's own response
    known_sd_mv: float = 0.0  # from trial to trial
    known_log_sd: float = 0.0  # of a factor that trials of nearly the same ISI share, natural log
    log_offset: float = 0.0  # by how much evoked MEPs are larger than usual, natural log
    shift_pct_rmt: float = 0.0  # by how much the pulse is stronger than usual
    enhancement: float = 1.0  # the share of its usual enhancement that the conditioning stimulus has
    log_by_curves: float = math.nan  # log density for kinds of noise without a law of other intensities


SHIFT, BY_CURVES = (Circumstances._fields.index(name) for name in ("shift_pct_rmt", "log_by_curves"))


@dataclass(frozen=True, eq=False)
class History:
    """The trials so far; amplitudes are intervals of log mV, which are points if the amplitude is known."""

    isi_ms: Tensor  # realised; NaN is TMS alone, (b, n)
    isi_sd_ms: Tensor  # (b, n)
    log_mep: Tensor  # lower end, (b, n)
    log_mep_high: Tensor  # upper end, (b, n)
    order: Tensor  # how many trials came before each, (b, n)
    circumstances: Tensor | None = None  # the fields of `Circumstances`, (b, n, 7); None if all are neutral

    @classmethod
    def empty(cls, people: int, device: torch.device) -> History:
        """No trials."""
        return cls(*(torch.empty((people, 0), dtype=torch.float32, device=device) for _ in range(5)))

    @property
    def columns(self) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """Everything but the circumstances, in order."""
        return self.isi_ms, self.isi_sd_ms, self.log_mep, self.log_mep_high, self.order

    def to(self, device: torch.device | str, dtype: torch.dtype) -> History:
        """The same on another device, or in another precision."""
        circumstances = None if self.circumstances is None else self.circumstances.to(device, dtype)
        columns = History(*(column.to(device, dtype) for column in self.columns))
        return replace(columns, circumstances=circumstances)

    def appended(self, trial: History) -> History:
        """This history and one more trial."""
        both = History(*(torch.cat(pair, dim=-1) for pair in zip(self.columns, trial.columns, strict=True)))
        if self.circumstances is None and trial.circumstances is None:
            return both
        return replace(both, circumstances=torch.cat((self.around, trial.around), dim=1))

    def of_people(self, who: Tensor) -> History:
        """The trials of some of the people, as a mask (b,) says."""
        circumstances = None if self.circumstances is None else self.circumstances[who]
        return replace(History(*(column[who] for column in self.columns)), circumstances=circumstances)

    @property
    def around(self) -> Tensor:
        """The circumstances of all trials, shape (b, n, 7)."""
        if self.circumstances is not None:
            return self.circumstances
        return self.isi_ms.new_tensor(Circumstances()).expand(*self.isi_ms.shape, -1)

    @property
    def shares_factor(self) -> bool:
        """True if an unknown factor of known parts makes the trials depend on each other, given a person."""
        return self.circumstances is not None and bool(self.circumstances[..., 2].any())


def observed(observation: Observation, detection_limit_mv: float, response_threshold_mv: float, order: int) -> History:
    """One trial of each person as a history."""
    seen, unseen = observation.response == 1, observation.response == 0
    log_mep = torch.log(observation.mep_mv)
    limit, threshold = math.log(detection_limit_mv), math.log(response_threshold_mv)
    low = torch.where(seen, threshold, torch.where(unseen, -torch.inf, log_mep))
    high = torch.where(seen, torch.inf, torch.where(unseen, threshold, log_mep))
    high = torch.where(observation.mep_mv == 0, limit, high)
    if observation.mep_high_mv is not None:
        told = torch.log(observation.mep_high_mv)
        high = torch.where(told.isnan(), high, torch.where(observation.mep_mv == 0, told.clamp_min(limit), told))
    columns = (observation.isi_ms, observation.isi_sd_ms, low, high, torch.full_like(log_mep, order))
    trial = History(*(x.unsqueeze(-1) for x in columns))
    if observation.known_mv is None and observation.shift_pct_rmt is None:
        return trial
    around = trial.around.clone()
    if observation.known_mv is not None:
        around[:, 0, :3] = observation.known_mv.to(around)
    if observation.shift_pct_rmt is not None:
        around[:, 0, SHIFT] = observation.shift_pct_rmt.to(around)
    return replace(trial, circumstances=around)


def without_known(observation: Observation) -> Observation:
    """The same without the mean of the known parts, for models that know no such part."""
    if observation.known_mv is None:
        return observation
    known = observation.known_mv[:, 0].to(observation.mep_mv)
    left = torch.where(known > 0, (observation.mep_mv - known).clamp_min(_LEAST_MV), observation.mep_mv)
    return replace(observation, mep_mv=left, known_mv=None)


@dataclass(frozen=True, eq=False)
class PersonTrials:
    """The trials of one person: ISIs [ms] and MEPs [mV], shape (n,), and MEPs of TMS alone [mV], shape (m,)."""

    isi_ms: FloatArray
    mep_mv: FloatArray
    baseline_mv: FloatArray


@dataclass(frozen=True, eq=False)
class AmplitudeHistory:
    """Trials of b people, in order: ISIs [ms], NaN for TMS alone, and MEPs [mV], shape (b, n)."""

    isi_ms: FloatArray
    mep_mv: FloatArray

    @classmethod
    def nothing(cls, people: int) -> AmplitudeHistory:
        """No trials."""
        return cls(np.empty((people, 0)), np.empty((people, 0)))

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
            high = observation.mep_high_mv.nan_to_num(0.0, posinf=0.0)
            amplitude = torch.where(high > amplitude, (amplitude + high) / 2, amplitude)
        isi_ms, mep_mv = (x.detach().cpu().double().numpy()[:, None] for x in (observation.isi_ms, amplitude))
        if np.isnan(mep_mv).any():
            raise StrategyError(
                "the model learns from amplitudes only",
                got="a response without its amplitude",
                remedy="Tell mep_mv, or choose a model with a likelihood for responses, as the default has.",
            )
        return replace(self, isi_ms=np.hstack((self.isi_ms, isi_ms)), mep_mv=np.hstack((self.mep_mv, mep_mv)))

    def person(self, person: int) -> PersonTrials:
        """The trials of one person."""
        isi_ms, mep_mv = self.isi_ms[person], self.mep_mv[person]
        alone = np.isnan(isi_ms)
        return PersonTrials(isi_ms[~alone], mep_mv[~alone], mep_mv[alone])


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
