"""Whether what a device measured itself agrees with what was commanded, and with its own times."""

from __future__ import annotations

from typing import Final

from isiw.design import DesignSpace
from isiw.errors import DeviceError, IsiwError
from isiw.findings import Finding, Kind, Severity, refused
from isiw.sweeps import Measurement
from isiw.trials import Stimulus, Trial

CUT_OFF_MS: Final = 2.0
"""Pulse, event and ISI, each cut off to whole ms, disagree by less; a rig that is wrong about one of them, by more."""


def timed_isi_ms(source: Measurement | Trial, space: DesignSpace) -> float | None:
    """The ISI by the times of the pulse and of the event that it counts from [ms]; None if one is missing."""
    start_ms = source.t_hit_ms if space.reference == "impact" else source.t_valve_ms
    return None if start_ms is None or source.t_tms_ms is None else source.t_tms_ms - start_ms


def contradicts_its_times(source: Measurement | Trial, space: DesignSpace) -> bool:
    """Whether the realised ISI is another one than the times say."""
    timed_ms = timed_isi_ms(source, space)
    return timed_ms is not None and source.isi_ms is not None and abs(timed_ms - source.isi_ms) >= CUT_OFF_MS


def require_agreement(measurement: Measurement, stimulus: Stimulus, space: DesignSpace) -> None:
    """Refuse a measurement whose times are not those of the trial that was commanded, or of the ISI that it tells."""
    alone = stimulus.isi_ms is None
    if alone and not stimulus.tap_alone and measurement.t_hit_ms is not None:
        raise tap_with_tms_alone(measurement.t_hit_ms)
    if stimulus.tap_alone and measurement.t_tms_ms is not None:
        raise pulse_with_tap_alone(measurement.t_tms_ms)
    if contradicts_its_times(measurement, space):
        event = "impact" if space.reference == "impact" else "valve command"
        raise _of_device(
            Kind.TIMES,
            "the times that the device reports contradict the ISI that it reports",
            f"a pulse {timed_isi_ms(measurement, space):g} ms after the {event}, and a realised ISI of "
            f"{measurement.isi_ms:g} ms",
            "Report the realised ISI, never the wanted one. Are its times in ms, on one clock, of this trial?",
            f"the same to within {CUT_OFF_MS:g} ms",
        )


def tap_with_tms_alone(hit_ms: float) -> IsiwError:
    """That a tap hit at this time with TMS alone: a response to both would be taken for one to the pulse."""
    text, got = "the device reports a tap where TMS alone was commanded", f"an impact at {hit_ms:g} ms"
    remedy = "Does the valve stay open? Leave t_hit_ms and t_valve_ms out where nothing hits."
    return _of_device(Kind.TAP_UNWANTED, text, got, remedy)


def pulse_with_tap_alone(pulse_ms: float) -> IsiwError:
    """That a pulse came at this time with a tap alone."""
    text = "the device reports a magnetic pulse where a tap alone was commanded"
    return _of_device(Kind.PULSE_UNWANTED, text, f"one at {pulse_ms:g} ms")


def _of_device(kind: Kind, text: str, got: str, remedy: str = "", expected: str | None = None) -> IsiwError:
    return refused(Finding(kind, Severity.REFUSED, text, remedy), got, expected, DeviceError)
