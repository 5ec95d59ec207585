"""The pneumatic tapping robot with its stimulator, simulated: waveforms out, timing as good as the real one's."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Annotated, Any, Literal, Protocol, TypeAlias

import numpy as np

from isiw.checks import MOST_DELAY_MS, Checked, choice, number
from isiw.devices.info import DeviceInfo
from isiw.devices.robot.mechanism import EventTime, Faults, Geometry, Taps, draw_taps
from isiw.devices.robot.waveforms import UNITS, record_emg, record_robot, sample_times_ms
from isiw.errors import DeviceError, InvalidValueError
from isiw.signals.impact import DETECTION_LATENCY_MS, VALVE_MS, impact_time
from isiw.sweeps import Channel, Sweep
from isiw.trials import Stimulus
from isiw.types import FloatArray, Reference

Trigger: TypeAlias = Literal["open-loop", "impact"]

MOST_RATE_HZ = 100_000.0
LAST_HITS = 21
SWEEP_MS = 1000.0
AFTER_PULSE_MS = 60.0
ALONE_MS = 200.0  # TMS alone comes as late after the valve command, which then moves nothing, as a usual pulse


def _geometry(
    descent_ms: tuple[float, float], hit_ms: tuple[float, float], contact_ms: tuple[float, float], **others: Any
) -> Geometry:
    return Geometry(EventTime(*descent_ms), EventTime(*hit_ms), EventTime(*contact_ms), **others)


PRESETS: Mapping[str, Geometry] = MappingProxyType(
    {
        # Table 3.2; the load cell is hard, so the contact is short.
        "bench": _geometry((121, 2), (188, 1), (2, 0.2), artefact_mv=0, load_cell=True),
        "subject1": _geometry((131, 5), (183, 4), (15, 1.0), memg=EventTime(18, 1.0)),
        "subject2": _geometry((126, 4), (172, 2), (9, 0.5), memg=EventTime(23, 0.5)),
        "subject3": _geometry((115, 2), (176, 1), (17, 0.3), memg=EventTime(19, 0.3)),
        "subject4": _geometry((129, 2), (182, 1), (15, 0.3), memg=EventTime(22, 1.5)),
        # Fig. 4.9: mean hits of five later people, each with an SD "below 2 ms"; the rest is that of an average person.
        **{
            f"subject{number}": _geometry((hit_ms - 53, 3), (hit_ms, 1.5), (14, 0.5))
            for number, hit_ms in enumerate((183, 182, 173, 177, 188), 7)
        },
        # Section 5.3.1: the cushion of the precision study, once as its SD says and once as its mistrials say.
        "cushion": _geometry((125, 3), (180, 1.93), (15, 0.5)),
        "timing-fault": _geometry(
            (125, 3), (180, 1.93), (15, 0.5), faults=Faults(late_probability=0.08, late_ms=(13.0, 22.0))
        ),
    }
)
"""The robot on a load cell, on nine people [Kim2020, Table 3.2, Fig. 4.9], and on the precision study's cushion."""


def preset(name: str) -> Geometry:
    """A geometry by its name."""
    return PRESETS[choice("the preset of the tapping robot", name, PRESETS)]


class Evoked(Protocol):
    """A person's response."""

    @property
    def mep_mv(self) -> float:
        """Peak-to-peak amplitude in the MEP window, EMG at rest included [mV]."""


@dataclass(frozen=True)
class TapperSettings(Checked):
    """Settings of the robot.

    Args:
        reference: the event that commanded ISIs count from.
        trigger: "open-loop" schedules the pulse from the predicted impact, "impact" triggers it by the detected one.
        accelerometer: whether the hammer has one; without it ISIs count from the valve command.
        rate_hz: sampling rate of all channels [Hz].
        expected_hit_ms: what is known of a person's hit delay before the first tap [ms].
        expected_hit_sd_ms: its SD from person to person [ms].
        expected_tap_sd_ms: its SD from tap to tap [ms].
        pulse_jitter_ms: SD by which the triggering software misses the pulse's time, which is recorded anyway [ms].

    Raises:
        InvalidValueError: an unknown reference or trigger, a value that is not positive, a negative jitter, or without
            an accelerometer ISIs that count from the impact, or a pulse that it triggers.
    """

    reference: Reference = "impact"
    trigger: Trigger = "open-loop"
    accelerometer: bool = True
    rate_hz: Annotated[float, partial(number, above=0, most=MOST_RATE_HZ)] = 5000.0
    expected_hit_ms: Annotated[float, partial(number, above=0, most=MOST_DELAY_MS)] = 180.0
    expected_hit_sd_ms: Annotated[float, partial(number, above=0, most=MOST_DELAY_MS)] = 6.0
    expected_tap_sd_ms: Annotated[float, partial(number, above=0, most=MOST_DELAY_MS)] = 2.5
    pulse_jitter_ms: Annotated[float, partial(number, least=0, most=MOST_DELAY_MS)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.trigger == "impact" and not self.accelerometer:
            raise InvalidValueError("the impact cannot trigger a pulse without an accelerometer to find it")
        if self.reference == "impact" and not self.accelerometer:
            raise InvalidValueError(
                "without an accelerometer ISIs cannot count from the impact: when the hammer hits this person is not "
                "known, and every ISI would be wrong by the same",
                remedy='Count from the valve command: TapperSettings(reference="valve", accelerometer=False).',
            )


class Tapper:
    """A simulation of the tapping robot, its stimulator, and a person who answers.

    Args:
        respond: answers the ISI that truly came about [ms from the impact; None for TMS alone] with an MEP.
        geometry: the person's wrist under the robot, or the name of a preset.
        settings: how the robot is run.
        seed: of the taps and the sensors' noise.

    Raises:
        InvalidValueError: an unknown preset.
    """

    def __init__(
        self,
        respond: Callable[[float | None], Evoked],
        geometry: Geometry | str = "subject1",
        settings: TapperSettings | None = None,
        *,
        seed: int = 0,
    ) -> None:
        self.geometry = preset(geometry) if isinstance(geometry, str) else geometry
        self.settings = settings or TapperSettings()
        self._hits_ms: deque[float] = deque(maxlen=LAST_HITS)
        self._respond, self._seed = respond, seed

    @property
    def info(self) -> DeviceInfo:
        """The robot's description of itself."""
        absent = {name for name, there in self._has.items() if not there}
        channels = {name: unit for name, unit in UNITS.items() if name not in absent}
        known = self.settings.expected_hit_ms, self.settings.expected_hit_sd_ms
        return DeviceInfo(
            "simulated tapping robot",
            self.settings.reference,
            simulated=True,
            channels=channels,
            hit_delay_ms=known if self.settings.reference == "valve" else None,
            tap_alone=True,
        )

    @property
    def hit_delay_ms(self) -> float:
        """The next hit delay to expect [ms]: the median of the last ones, which a few late valves do not move."""
        return float(np.median(self._hits_ms)) if self._hits_ms else self.settings.expected_hit_ms

    @property
    def _has(self) -> dict[str, bool]:
        return {"acceleration": self.settings.accelerometer, "force": self.geometry.load_cell}

    def answer(self, stimulus: Stimulus) -> Sweep:
        """Tap, pulse, and record; a DeviceError if the ISI is too short to be triggered by the impact."""
        if stimulus.isi_ms is not None:
            self.require_possible(stimulus.isi_ms)
        rng = np.random.default_rng([self._seed, stimulus.trial])
        taps = draw_taps(self.geometry, 1, rng)
        if stimulus.isi_ms is None and not stimulus.tap_alone:
            nothing, times = taps.none(), self._times_ms(ALONE_MS)
            channels = self._channels(times, nothing, rng)
            channels["emg"] = self._emg(times, nothing, ALONE_MS, rng)
            return Sweep(channels, t_tms_ms=VALVE_MS + ALONE_MS)
        return self._tap(taps, stimulus.isi_ms, rng)

    def _after_impact_ms(self, isi_ms: float) -> float:
        """The commanded ISI, counted from the impact as predicted [ms]."""
        return isi_ms if self.settings.reference == "impact" else isi_ms - self.hit_delay_ms

    def require_possible(self, isi_ms: float) -> None:
        """Raise DeviceError if an ISI is too short to be triggered by the impact."""
        after_impact_ms = self._after_impact_ms(isi_ms)
        if self.settings.trigger == "impact" and after_impact_ms < DETECTION_LATENCY_MS:
            raise DeviceError(
                "the pulse cannot come so soon after the impact that triggers it",
                got=f"{after_impact_ms:.1f} ms after the impact",
                expected=f"at least {DETECTION_LATENCY_MS:g} ms",
                remedy="Start the design space later, or use the open-loop trigger.",
            )

    def _tap(self, taps: Taps, isi_ms: float | None, rng: np.random.Generator) -> Sweep:
        """A tap, and unless it comes alone, a pulse."""
        sd_ms = self.settings.pulse_jitter_ms if isi_ms is not None else 0.0
        jitter_ms = float(sd_ms * rng.standard_normal()) if sd_ms else 0.0  # without jitter nothing is drawn
        after_impact_ms = None if isi_ms is None else self._after_impact_ms(isi_ms) + jitter_ms
        predicted_ms = self.hit_delay_ms
        times = self._times_ms(ALONE_MS if after_impact_ms is None else predicted_ms + after_impact_ms)
        channels = self._channels(times, taps, rng)
        measured_ms = None  # the impact that the accelerometer shows [ms after the valve command]
        if self.settings.accelerometer:
            hit_ms = impact_time(channels["acceleration"].values, self.settings.rate_hz, VALVE_MS)
            measured_ms = None if hit_ms is None else hit_ms - VALVE_MS
        start_ms = predicted_ms if self.settings.trigger == "open-loop" else measured_ms
        pulse_ms = None if start_ms is None or after_impact_ms is None else start_ms + after_impact_ms
        channels["emg"] = self._emg(times, taps, pulse_ms, rng)
        if measured_ms is not None:
            self._hits_ms.append(measured_ms)
        blind = not self.settings.accelerometer
        return Sweep(
            channels,
            t_valve_ms=VALVE_MS,
            t_tms_ms=None if pulse_ms is None else VALVE_MS + pulse_ms,
            t_hit_ms=VALVE_MS + predicted_ms if blind else None,
            isi_sd_ms=self.settings.expected_tap_sd_ms if blind and isi_ms is not None else 0.0,
        )

    def _times_ms(self, pulse_ms: float) -> FloatArray:
        """A sweep of 1 s, or longer if the pulse comes late [ms after the valve command]."""
        return sample_times_ms(
            self.settings.rate_hz, max(SWEEP_MS, VALVE_MS + pulse_ms + AFTER_PULSE_MS), valve_ms=VALVE_MS
        )

    def _channels(self, times_ms: FloatArray, taps: Taps, rng: np.random.Generator) -> dict[str, Channel]:
        waves = {name: wave[0] for name, wave in record_robot(times_ms, taps, rng).items() if self._has.get(name, True)}
        return {name: Channel(wave, self.settings.rate_hz, UNITS[name]) for name, wave in waves.items()}

    def _emg(self, times_ms: FloatArray, taps: Taps, pulse_ms: float | None, rng: np.random.Generator) -> Channel:
        hit_ms = float(taps.hit_ms[0])
        evoked_mv = 0.0
        if pulse_ms is not None:
            evoked_mv = self._respond(None if math.isnan(hit_ms) else pulse_ms - hit_ms).mep_mv
        wave = record_emg(
            times_ms,
            self.settings.rate_hz,
            taps,
            rng,
            pulse_ms=np.array([math.nan if pulse_ms is None else pulse_ms]),
            evoked_mv=np.array([evoked_mv]),
        )
        return Channel(wave[0], self.settings.rate_hz, UNITS["emg"])
