"""Whether the times that are told of a trial agree with the ISI that is told of it."""

from __future__ import annotations

from typing import Final

from isiw.design import DesignSpace
from isiw.errors import DeviceError
from isiw.trials import Measurement, Stimulus, Trial

__all__ = [
    "CUT_OFF_MS",
    "contradicts_its_times",
    "pulse_with_tap_alone",
    "require_agreement",
    "tap_with_tms_alone",
    "timed_isi_ms",
]

CUT_OFF_MS: Final = 2.0
"""Pulse, event and ISI, each cut off to whole ms, disagree by less; a rig that is wrong about one of them, by more."""


def timed_isi_ms(told: Measurement | Trial, space: DesignSpace) -> float | None:
    """The ISI by the times of the pulse and of the event that it counts from [ms]; None where one is not told.

    Args:
        told: what is told of a trial.
        space: says which event the ISI counts from.
    """
    start_ms = told.t_hit_ms if space.reference == "impact" else told.t_valve_ms
    return None if start_ms is None or told.t_tms_ms is None else told.t_tms_ms - start_ms


def contradicts_its_times(told: Measurement | Trial, space: DesignSpace) -> bool:
    """Whether the realised ISI is another one than the times say.

    Args:
        told: what is told of a trial.
        space: says which event the ISI counts from.
    """
    timed_ms = timed_isi_ms(told, space)
    return timed_ms is not None and told.isi_ms is not None and abs(timed_ms - told.isi_ms) >= CUT_OFF_MS


def require_agreement(measurement: Measurement, stimulus: Stimulus, space: DesignSpace) -> None:
    """Refuse a measurement whose times are not those of the trial that was commanded, or of the ISI that it tells.

    Args:
        measurement: what the device reports.
        stimulus: what was commanded.
        space: says which event the ISI counts from.

    Raises:
        DeviceError: an impact with TMS alone, a pulse with a tap alone, or times that contradict the realised ISI.
    """
    alone = stimulus.isi_ms is None
    if alone and not stimulus.tap_alone and measurement.t_hit_ms is not None:
        raise tap_with_tms_alone(measurement.t_hit_ms)
    if stimulus.tap_alone and measurement.t_tms_ms is not None:
        raise pulse_with_tap_alone(measurement.t_tms_ms)
    if contradicts_its_times(measurement, space):
        raise DeviceError(
            "the times that the device reports contradict the ISI that it reports",
            got=f"a pulse {timed_isi_ms(measurement, space):g} ms after the {_event(space)}, "
            f"and a realised ISI of {measurement.isi_ms:g} ms",
            expected=f"the same to within {CUT_OFF_MS:g} ms",
            remedy="Report the realised ISI, never the wanted one. Are its times in ms, on one clock, of this trial?",
        )


def _event(space: DesignSpace) -> str:
    return "impact" if space.reference == "impact" else "valve command"


def tap_with_tms_alone(hit_ms: float) -> DeviceError:
    """That a tap came with TMS alone: a response to both would be taken for one to the pulse.

    Args:
        hit_ms: when it hit [ms].
    """
    return DeviceError(
        "the device reports a tap where TMS alone was commanded",
        got=f"an impact at {hit_ms:g} ms",
        remedy="Does the valve stay open? Leave t_hit_ms and t_valve_ms out where nothing hits.",
    )


def pulse_with_tap_alone(pulse_ms: float) -> DeviceError:
    """That a pulse came with a tap alone.

    Args:
        pulse_ms: when it came [ms].
    """
    return DeviceError(
        "the device reports a magnetic pulse where a tap alone was commanded", got=f"one at {pulse_ms:g} ms"
    )
