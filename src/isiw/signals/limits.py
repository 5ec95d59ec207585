"""What a sweep must satisfy to be accepted, and whether its amplitude, ISI and times can be true, of any muscle."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from isiw.checks import Checked, Flag, Positive, ascending, number
from isiw.design import DesignSpace
from isiw.errors import DeviceError, InvalidValueError, IsiwError
from isiw.findings import AMPLITUDE_MV, BACKGROUND_LIMIT_UV, WINDOW_END_MS, Finding, Kind, Severity, refused
from isiw.trials import MOST_ISI_SD_MS, Measurement, Stimulus, Trial

MEP_WINDOW_MS = (15.0, 35.0)
"""Where the MEP of the forearm is sought [ms after the pulse] [Kim2020, 5.2.3]."""

MEP_WINDOWS_MS: Mapping[str, tuple[float, float]] = MappingProxyType({"forearm": MEP_WINDOW_MS, "hand": (15.0, 50.0)})
"""Windows by muscle group. In hand muscles the onset is near 23 ms and the second turn may lie beyond 35 ms."""

TAP_MS: Final = 150.0
"""How long after the hit the tap may move the EMG, its reflexes included [ms]."""

HIT_DELAY_MS: Final = 180.0
"""From the valve command to the hit, usually [ms]."""

ARTEFACT_MS: Final = 3.0
"""How long after the pulse its own artefact lasts, at least [ms]."""


@dataclass(frozen=True)
class SignalLimits(Checked):
    """Conditions that a sweep must satisfy to be accepted.

    Args:
        mep_window_ms: where the MEP is sought [ms after the pulse]; `MEP_WINDOWS_MS` has one for each muscle group.
        background_uv: the most EMG at rest before the pulse [µV RMS]; above it the muscle was not relaxed.
        contracted: whether the muscle is to be contracted, so that no EMG before the pulse is too much.
        full_scale_mv: the largest EMG that the amplifier can show [mV]; None to look for flat tops only, which are
            looked for in any case.
        isi_tolerance_ms: how far the realised ISI may be from the commanded one [ms], where that is less than the
            space's tolerance.

    Raises:
        InvalidValueError: a limit that is not positive, a window without first and last ms, or a slip of unit.
    """

    mep_window_ms: tuple[float, float] = MEP_WINDOW_MS
    background_uv: Positive = 10.0
    full_scale_mv: Positive | None = None
    isi_tolerance_ms: Positive | None = None
    contracted: Flag = False

    def __post_init__(self) -> None:
        super().__post_init__()
        name, window_ms, such_as = "SignalLimits.mep_window_ms", self.mep_window_ms, f"such as {MEP_WINDOW_MS}"
        if not isinstance(window_ms, Sequence) or len(window_ms) != 2:
            raise InvalidValueError(f"{name} must be its first and its last ms", got=window_ms, expected=such_as)
        _, end_ms = ascending(name, window_ms, least=0)
        WINDOW_END_MS.require(
            f"{name} ends before any MEP begins", end_ms, f"ms after the pulse, {such_as}", got=window_ms
        )
        too_quiet = "SignalLimits.background_uv is less than any amplifier's noise"
        BACKGROUND_LIMIT_UV.require(too_quiet, self.background_uv, "µV RMS, such as 10")

    def require_behind_artefact(self) -> None:
        """Raise where the window would hold the pulse's own artefact.

        It is for limits that somebody states: those of earlier logs stay readable.

        Raises:
            InvalidValueError: the MEP window begins less than 3 ms after the pulse, as also where its first ms is in s.
        """
        if self.mep_window_ms[0] < ARTEFACT_MS:
            raise InvalidValueError(
                "SignalLimits.mep_window_ms begins in the pulse's artefact, which would be measured as an MEP",
                got=self.mep_window_ms,
                expected=f"from {ARTEFACT_MS:g} ms after the pulse on, such as {MEP_WINDOW_MS}",
                remedy="Set when MEPs of this muscle begin [ms].",
            )

    @property
    def most_background_uv(self) -> float:
        """The most EMG before the pulse [µV RMS]; infinite if the muscle is to be contracted."""
        return math.inf if self.contracted else self.background_uv

    def tolerance_ms(self, space: DesignSpace) -> float:
        """Largest difference between a realised ISI and the commanded one [ms]."""
        return min(space.tolerance_ms, self.isi_tolerance_ms or math.inf)


EMG_UNITS_MV: Mapping[str, float] = MappingProxyType({"V": 1e3, "mV": 1.0, "uV": 1e-3, "µV": 1e-3, "μV": 1e-3})
"""One of each unit in mV; both of Unicode's micro signs are known."""

ACCELERATION_UNITS = frozenset({"m/s^2", "m/s²", "g", "V", "mV"})
"""Units of the acceleration; the impact is found in any of them."""


AT_REST_MV = 2e-3
"""EMG at rest has hardly ever less, since the noise of electrodes and amplifier alone has a few µV peak-to-peak; an MEP
of up to 2 mV in V has less."""

CUT_OFF_MS: Final = 2.0
"""Pulse, event and ISI, each cut off to whole ms, disagree by less; a rig that is wrong about one of them, by more."""

_OR_NONE: Final = "An amplitude below the detection limit is 0."


def implausible_amplitude(mep_mv: float) -> Finding | None:
    """Why an amplitude [mV] cannot be an MEP's, and the likely slip; None where it can, as 0 always can."""
    if mep_mv == 0 or AMPLITUDE_MV.least <= mep_mv <= AMPLITUDE_MV.most:
        return None
    slip = AMPLITUDE_MV.slip(mep_mv)
    if mep_mv > AMPLITUDE_MV.most:
        return _implausible(f"{mep_mv:.4g} mV is more than any muscle gives", f"{slip}")
    return _implausible(f"{mep_mv:.2g} mV is less than any amplifier's noise", f"{slip} {_OR_NONE}")


def _implausible(why: str, remedy: str) -> Finding:
    return Finding(Kind.IMPLAUSIBLE, Severity.REFUSED, f"the amplitude cannot be an MEP's: {why}", remedy)


def implausible_scale(meps_mv: Sequence[float]) -> Finding | None:
    """Why amplitudes at rest cannot be in mV, and the likely slip; None if one is as large as EMG at rest."""
    largest_mv = max(meps_mv, default=0.0)
    if not 0 < largest_mv < AT_REST_MV:
        return None
    return _implausible(f"{largest_mv:.2g} mV is less than EMG at rest has", f"{AMPLITUDE_MV.slip(0.0)} {_OR_NONE}")


def require_amplitude(mep_mv: float, besides: Finding | None = None) -> None:
    """Refuse an amplitude that no muscle gives."""
    found = implausible_amplitude(mep_mv) or besides
    if found is not None:
        raise refused(found, mep_mv)


def require_plausible_range(sd_mv: float, ends_mv: tuple[float, float] | None) -> None:
    """Refuse an end of an interval that no muscle gives, and an SD that no amplitudes of a muscle have [mV]."""
    for end_mv in ends_mv or ():
        if AMPLITUDE_MV.most < end_mv < math.inf:
            require_amplitude(end_mv)
    if 2 * sd_mv > AMPLITUDE_MV.most:  # the SD of anything is at most half of its range
        slip = AMPLITUDE_MV.slip(2 * sd_mv)
        raise refused(_implausible(f"an SD of {sd_mv:.4g} mV is more than any muscle gives", f"{slip}"), sd_mv)


def off_by(isi_ms: float, asked_ms: float, space: DesignSpace) -> bool:
    """Whether an ISI [ms] is farther than the space's tolerance from the one that was asked [ms]."""
    return abs(isi_ms - asked_ms) > space.tolerance_ms


def isi_far(isi_ms: float | None, asked_ms: float | None, space: DesignSpace) -> Finding | None:
    """That a realised ISI is far from the one asked, which may be right; None where it is not."""
    if isi_ms is None or asked_ms is None or not off_by(isi_ms, asked_ms, space):
        return None
    text = f"The realised ISI of {isi_ms:g} ms is far from the {asked_ms:g} ms that were asked"
    return Finding(Kind.ISI_FAR, Severity.DOUBT, text, f"Is it counted from the {space.reference}, and in ms?")


def require_plausible(
    isi_ms: float | None,
    mep_mv: float | None,
    asked_ms: float | None,
    space: DesignSpace,
    isi_sd_ms: float = 0.0,
) -> None:
    """Refuse what cannot be true of one trial, or is a mistrial."""
    if isi_ms is not None and asked_ms is not None and off_by(isi_ms, asked_ms, space):
        found = _misplaced_value(isi_ms, mep_mv, asked_ms, space)
        if found is not None:
            raise refused(found, (isi_ms, mep_mv), f"an ISI near the {asked_ms:g} ms that were asked")
    if mep_mv is not None:
        require_amplitude(mep_mv)
    if isi_ms is not None and before_impact(isi_ms, space.low_ms if asked_ms is None else asked_ms, space):
        raise refused(_EARLY, f"{isi_ms:g} ms")
    if number("isi_sd_ms", isi_sd_ms, least=0) > MOST_ISI_SD_MS:
        raise refused(_VAGUE, f"an SD of {isi_sd_ms:g} ms", f"at most {MOST_ISI_SD_MS:g} ms")


_EARLY: Final = Finding(
    Kind.TMS_BEFORE_IMPACT,
    Severity.REFUSED,
    "the magnetic pulse came before the impact, so the trial is a mistrial",
    'Count it as one: session.mistrial("TMS before impact"), or strategy.count_mistrial(). If this happens often, '
    "begin the design space at a larger ISI.",
)

_VAGUE: Final = Finding(
    Kind.VAGUE_ISI,
    Severity.REFUSED,
    "the realised ISI is too uncertain to learn from",
    "Measure the impact; or count the trial as a mistrial.",
)


def before_impact(isi_ms: float, commanded_isi_ms: float, space: DesignSpace) -> bool:
    """Whether a pulse came before the impact that it should have followed; such a trial is a mistrial."""
    return space.reference == "impact" and isi_ms < 0 <= commanded_isi_ms


def _misplaced_value(isi_ms: float, mep_mv: float | None, asked_ms: float, space: DesignSpace) -> Finding | None:
    """That the ISI that was asked is in the amplitude's place, or in seconds; None where it is not."""
    if mep_mv is not None and mep_mv > abs(isi_ms) and not off_by(mep_mv, asked_ms, space):
        remedy = "Tell the ISI first: tell(isi_ms, mep_mv)."
        return Finding(Kind.ORDER, Severity.REFUSED, "the ISI and the amplitude seem to be swapped", remedy)
    if not off_by(1000 * isi_ms, asked_ms, space):
        remedy = "Tell it in ms: multiply by 1000."
        return Finding(Kind.IN_SECONDS, Severity.REFUSED, "the realised ISI seems to be in seconds", remedy)
    return None


def timed_isi_ms(told: Measurement | Trial, space: DesignSpace) -> float | None:
    """The ISI by the times of the pulse and of the event that it counts from [ms]; None where one is not told."""
    start_ms = told.t_hit_ms if space.reference == "impact" else told.t_valve_ms
    return None if start_ms is None or told.t_tms_ms is None else told.t_tms_ms - start_ms


def contradicts_its_times(told: Measurement | Trial, space: DesignSpace) -> bool:
    """Whether the realised ISI is another one than the times say."""
    timed_ms = timed_isi_ms(told, space)
    return timed_ms is not None and told.isi_ms is not None and abs(timed_ms - told.isi_ms) >= CUT_OFF_MS


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
