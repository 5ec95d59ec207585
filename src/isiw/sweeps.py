"""What a device answers: a sweep of waveforms, or the outcome that it measured itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np

from isiw.checks import Amplitude, Checked, NonNegative, Number, Positive, Text, number, text
from isiw.errors import InvalidValueError
from isiw.trials import MOST_ISI_SD_MS
from isiw.types import FloatArray


def _samples(_what: str, values: object) -> FloatArray:
    try:
        given = np.asarray(values)
        samples = None if np.iscomplexobj(given) else given.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise InvalidValueError(
            "the samples of a channel are not numbers", got=values, expected="a vector of numbers"
        ) from error
    if samples is None:
        raise InvalidValueError("the samples of a channel are real numbers", got="complex ones")
    if samples.ndim != 1:
        raise InvalidValueError("a channel holds one waveform", got=samples.shape, expected="shape (w,)")
    return samples


@dataclass(frozen=True, eq=False)
class Channel(Checked):
    """One recorded waveform.

    Args:
        values: samples in `unit`, shape (w,).
        rate_hz: sampling rate [Hz].
        unit: unit of the samples, such as "mV" or "m/s^2".
        t0_ms: time of the first sample on the sweep's clock [ms].

    Raises:
        InvalidValueError: samples that are not a vector, a rate that is not positive, or a unit that is no text.
    """

    values: Annotated[FloatArray, _samples]
    rate_hz: Positive
    unit: Text
    t0_ms: Number = 0.0


@dataclass(frozen=True, eq=False)
class Sweep(Checked):
    """The waveforms of one trial, and what the device knows of its timing. All times are on the sweep's own clock.

    Args:
        channels: waveforms by name; isiw knows `emg`, `acceleration`, `pressure`, `force` and `valve`.
        t_valve_ms: the valve command [ms]; None if unknown.
        t_tms_ms: the magnetic pulse [ms]; None if unknown.
        t_hit_ms: the impact, if the device measures it [ms]; None to have it found in the waveforms.
        isi_sd_ms: SD of the realised ISI if the impact is not measured [ms]: of what varies from trial to trial. An
            error that all trials share is none of it; count from the valve command if the impact is not known.

    Raises:
        InvalidValueError: channels that are none, a time that is not finite, or an SD that is negative or larger than
            `MOST_ISI_SD_MS`.
    """

    channels: Mapping[str, Channel]
    t_valve_ms: Number | None = None
    t_tms_ms: Number | None = None
    t_hit_ms: Number | None = None
    isi_sd_ms: Annotated[float, partial(number, least=0, most=MOST_ISI_SD_MS)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.channels, Mapping):
            raise InvalidValueError(
                "a sweep has channels by name",
                got=type(self.channels).__name__,
                expected='such as {"emg": Channel(...)}',
            )
        for name, channel in self.channels.items():
            text("the name of a sweep's channel", name)
            if not isinstance(channel, Channel):
                raise InvalidValueError(
                    f"the sweep's channel {name} says neither its rate nor its unit",
                    got=type(channel).__name__,
                    remedy='Make it one: Channel(values, rate_hz, "mV").',
                )


@dataclass(frozen=True)
class Measurement(Checked):
    """The outcome reported by a device that measures the MEP itself.

    Args:
        mep_mv: peak-to-peak amplitude of the MEP [mV]; 0 means below the detection limit.
        isi_ms: the realised ISI on the space's reference [ms]; None for TMS alone.
        isi_sd_ms: SD of the realised ISI, of what varies from trial to trial [ms]; 0 if it was measured.
        background_rms_uv: EMG before the pulse [µV RMS], if known.
        t_valve_ms: time of the valve command [ms], if known.
        t_hit_ms: time of the impact [ms], if known.
        t_tms_ms: time of the magnetic pulse [ms], if known.

    Raises:
        InvalidValueError: an amplitude or an EMG below 0, an SD outside 0–50 ms, or a value that is not finite.
    """

    mep_mv: Amplitude
    isi_ms: Number | None
    isi_sd_ms: Annotated[float, partial(number, least=0, most=MOST_ISI_SD_MS)] = 0.0
    background_rms_uv: NonNegative | None = None
    t_valve_ms: Number | None = None
    t_hit_ms: Number | None = None
    t_tms_ms: Number | None = None
