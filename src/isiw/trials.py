"""One pair of stimuli and what came of it: stimulus, sweep or measurement, trial, and the table of all trials."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import Any, ClassVar, Final

from isiw.checks import Amplitude, AmplitudeInterval, Checked, Natural, NonNegative, Number, Positive, choice
from isiw.errors import InvalidValueError
from isiw.findings import MISTRIALS, Kind
from isiw.text.stimuli import TAP, StimulusWords

MOST_ISI_SD_MS: Final = 50.0
"""The largest SD of a realised ISI that can be learnt from [ms]: a window is hardly wider than two of them."""

RESPONSE_MV: Final = 0.05
"""A larger MEP is a response if a motor threshold is sought [mV] [Rossini2015]."""


class Status(StrEnum):
    """The strategy learns from accepted trials, and not from mistrials."""

    ACCEPTED = "accepted"
    MISTRIAL = "mistrial"


@dataclass(frozen=True)
class Stimulus(Checked):
    """One pair of stimuli to deliver.

    Args:
        trial: number of the trial, from 0.
        isi_ms: inter-stimulus interval on the design space's reference [ms]; None for a control trial, which is TMS
            alone unless it is a tap alone.
        tap_alone: whether the tap comes without the magnetic pulse; only for devices whose `DeviceInfo` says that they
            can.
        intensity_pct_rmt: the intensity to set for this pulse [% RMT], for devices whose `DeviceInfo` says that they
            set it; None for what is set.

    Raises:
        InvalidValueError: a negative trial number, an ISI that is not finite, a tap alone with an ISI or an intensity,
            or an intensity that is not positive.
    """

    trial: Natural
    isi_ms: Number | None
    tap_alone: bool = False
    intensity_pct_rmt: Positive | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tap_alone and self.isi_ms is not None:
            raise InvalidValueError("a tap alone has no ISI", got=self.isi_ms, expected="None")
        require_pulse(self.intensity_pct_rmt, tap_alone=self.tap_alone)


def require_pulse(intensity_pct_rmt: float | None, *, tap_alone: bool) -> None:
    """Raise if an intensity is stated of a tap alone."""
    if intensity_pct_rmt is not None and tap_alone:
        raise InvalidValueError(
            "a tap alone has no magnetic pulse, and so no intensity", got=f"{intensity_pct_rmt:g} % RMT"
        )


@dataclass(frozen=True)
class Trial(Checked):
    """One delivered pair of stimuli and its outcome, as logged.

    Args:
        index: number of the trial, from 0.
        status: the strategy learns from accepted trials and not from mistrials; both count as stimuli.
        commanded_isi_ms: the ISI that was commanded [ms]; None for a control trial.
        reason: why it is a mistrial; None if accepted.
        isi_ms: the realised ISI [ms]; None for a control trial or if unknown. Of a tap alone it is the ISI at which
            the MEP window would lie that its amplitude was taken in.
        isi_sd_ms: SD of the realised ISI [ms].
        mep_mv: peak-to-peak amplitude of the MEP [mV], also of some mistrials, for whoever looks at them; None if
            none was measured.
        background_rms_uv: EMG before the pulse [µV RMS].
        t_valve_ms: time of the valve command [ms].
        t_hit_ms: time of the impact [ms].
        t_tms_ms: time of the magnetic pulse [ms].
        excluded: excluded by an operator afterwards.
        tap_alone: whether it was a tap without the magnetic pulse, which shows what the tap alone does.
        overruled: why it had been a mistrial before an operator accepted it; None otherwise.
        mep_sd_mv: SD of the amplitude [mV]: of the mean of several, or from what is left of the tap's own response.
        mep_interval_mv: the interval that the amplitude lies in, if no more is known [mV]; its end may be infinite.
        tap_mv: what is left of the tap's own response in the amplitude, in the mean [mV]; None if it is unknown.
        intensity_pct_rmt: intensity of the magnetic pulse [% RMT]; None for the usual one of the session's pairs.

    Raises:
        InvalidValueError: a mistrial without a reason, an accepted trial with one or without an amplitude, a tap alone
            with an ISI or an intensity, or a value that is not finite or that no amplifier gives.
    """

    index: Natural
    status: Status
    commanded_isi_ms: Number | None
    reason: Kind | None = None
    isi_ms: Number | None = None
    isi_sd_ms: NonNegative = 0.0
    mep_mv: Amplitude | None = None
    background_rms_uv: NonNegative | None = None
    t_valve_ms: Number | None = None
    t_hit_ms: Number | None = None
    t_tms_ms: Number | None = None
    excluded: bool = False
    tap_alone: bool = False
    overruled: Kind | None = None
    mep_sd_mv: NonNegative = 0.0
    mep_interval_mv: AmplitudeInterval | None = None
    tap_mv: NonNegative | None = None
    intensity_pct_rmt: Positive | None = None
    __pydantic_config__: ClassVar = {"ser_json_inf_nan": "strings"}  # as JSON knows no infinity

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "status", Status(self.status))
        for name in ("reason", "overruled"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, choice("Trial.reason", Kind(getattr(self, name)), MISTRIALS))
        if (self.status is Status.MISTRIAL) != (self.reason is not None):
            raise InvalidValueError("a mistrial needs a reason and an accepted trial has none", got=self.reason)
        if self.tap_alone and self.commanded_isi_ms is not None:
            raise InvalidValueError("a tap alone has no ISI", got=self.commanded_isi_ms, expected="None")
        require_pulse(self.intensity_pct_rmt, tap_alone=self.tap_alone)
        measured = self.mep_mv is not None or self.mep_interval_mv is not None
        if self.status is Status.ACCEPTED and not measured and not self.tap_alone:
            raise InvalidValueError("an accepted trial needs its MEP", got=self.index)

    @classmethod
    def unknown(cls, stimulus: Stimulus) -> Trial:
        """A mistrial of which nothing is known but what was commanded."""
        return cls(
            stimulus.trial,
            Status.MISTRIAL,
            stimulus.isi_ms,
            Kind.OUTCOME_UNKNOWN,
            tap_alone=stimulus.tap_alone,
            intensity_pct_rmt=stimulus.intensity_pct_rmt,
        )

    @classmethod
    def of(cls, isi_ms: float | None, mep_mv: float | None, **known: Any) -> Trial:
        """An accepted trial that was delivered as it was asked.

        Args:
            isi_ms: the realised ISI [ms]; None for TMS alone.
            mep_mv: amplitude of its MEP [mV].
            **known: what else is known of it, as the fields are called; without an `index` it is trial 0.
        """
        return cls(known.pop("index", 0), Status.ACCEPTED, isi_ms, isi_ms=isi_ms, mep_mv=mep_mv, **known)

    @property
    def counts(self) -> bool:
        """True if it was accepted, and not excluded afterwards."""
        return self.status is Status.ACCEPTED and not self.excluded

    @property
    def told(self) -> bool:
        """True if the strategy learns from it."""
        return self.counts and not self.tap_alone

    @property
    def is_control(self) -> bool:
        """True if it was TMS alone or a tap alone; of what nobody knows the outcome of, it may have been a pair."""
        return self.commanded_isi_ms is None and self.reason is not Kind.OUTCOME_UNKNOWN

    @property
    def isi_error_ms(self) -> float | None:
        """Realised minus commanded ISI [ms]; None if one of them is not known."""
        if self.isi_ms is None or self.commanded_isi_ms is None:
            return None
        return self.isi_ms - self.commanded_isi_ms

    @property
    def wanted_isi_ms(self) -> float | None:
        """The commanded ISI [ms], or else the realised one; None for TMS alone."""
        return self.isi_ms if self.commanded_isi_ms is None else self.commanded_isi_ms

    def accepted_anyway(self) -> Trial:
        """The same trial, accepted by an operator after looking at it."""
        return dataclasses.replace(self, status=Status.ACCEPTED, reason=None, overruled=self.reason)


@dataclass(frozen=True)
class TrialTable:
    """All trials of one session, in the order of delivery.

    Args:
        trials: the trials; their indices ascend.

    Raises:
        InvalidValueError: indices that do not ascend.
    """

    trials: tuple[Trial, ...] = field(default=())

    def __post_init__(self) -> None:
        trials = tuple(self.trials)
        indices = [trial.index for trial in trials]
        if indices != sorted(set(indices)):
            raise InvalidValueError("the trials' indices must ascend", got=indices)
        object.__setattr__(self, "trials", trials)

    def __len__(self) -> int:
        return len(self.trials)

    def __iter__(self) -> Iterator[Trial]:
        return iter(self.trials)

    def __getitem__(self, position: int) -> Trial:
        return self.trials[position]

    def __str__(self) -> str:
        return self.counted(TAP)

    def counted(self, first: StimulusWords) -> str:
        """The number of trials of each kind, in words, with those for the conditioning stimulus."""
        mistrials = Counter(str(trial.reason) for trial in self.trials if trial.reason is not None)
        reasons = ", ".join(f"{count} {reason}" for reason, count in mistrials.items())
        excluded = sum(trial.excluded for trial in self.trials)
        return (
            f"{len(self)} delivered, {len(self.told)} told"
            + (f", {alone} of {first.one} alone" if (alone := sum(trial.tap_alone for trial in self.trials)) else "")
            + (f", {mistrials.total()} mistrials ({reasons})" if reasons else "")
            + (f", {excluded} excluded" if excluded else "")
        )

    def appended(self, trial: Trial) -> TrialTable:
        """A table with one more trial at its end; only its index is looked at, so that long sessions stay fast.

        Raises:
            InvalidValueError: an index that is not above the last one.
        """
        if self.trials and trial.index <= self.trials[-1].index:
            raise InvalidValueError("the trials' indices must ascend", got=(self.trials[-1].index, trial.index))
        table = object.__new__(TrialTable)
        object.__setattr__(table, "trials", (*self.trials, trial))
        return table

    def changed(self, change: Callable[[Trial], Trial]) -> TrialTable:
        """A table of the same trials, each as the change makes it."""
        return TrialTable(tuple(change(trial) for trial in self.trials))

    @cached_property
    def told(self) -> tuple[Trial, ...]:
        """The trials that a strategy learns from."""
        return tuple(trial for trial in self.trials if trial.told)
