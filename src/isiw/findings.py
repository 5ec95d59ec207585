"""Findings about data or a rig: code goes by kind and severity, people by text and remedy; and slips of unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from isiw.errors import InvalidValueError, IsiwError


class Severity(StrEnum):
    """Consequences of a finding: an error; a lost trial; a pause; a pause once, and a line in the log; nothing."""

    REFUSED = "refused"
    MISTRIAL = "mistrial"
    PAUSE = "pause"
    DOUBT = "doubt"
    NOTE = "note"


class Kind(StrEnum):
    """Kinds of findings. Those in `MISTRIALS` are the reasons of lost trials; the log has them by their values."""

    NO_IMPACT = "no impact"
    NO_PULSE = "no pulse"
    TMS_BEFORE_IMPACT = "TMS before impact"
    BACKGROUND_ACTIVITY = "background activity"
    SATURATION = "saturation"
    MISSING_CHANNEL = "missing channel"
    ISI_OFF = "ISI off by more than the tolerance"
    TOO_LITTLE_REST = "too little rest before the pulse"
    IMPLAUSIBLE = "implausible amplitude"
    REJECTED = "rejected"
    OUTCOME_UNKNOWN = "outcome unknown"

    NO_EMG = "no EMG"
    NOT_NUMBERS = "samples that are no numbers"
    FLAT_LINE = "a flat line"
    DURATIONS = "channels of different duration"
    SWAPPED = "swapped channels"
    INVERTED = "an inverted accelerometer"
    NO_ORIGIN = "no time of the event that ISIs count from"
    STRAY_EDGE = "an edge of the EMG away from the pulse"
    DOUBLE_PULSE = "a second pulse"
    LOUD = "too much EMG at rest"
    QUIET = "too little EMG at rest"
    EARLY_AT_ONE_ISI = "pulses too early at one ISI"

    ISI_FAR = "an ISI far from the one asked"
    ISIS_FAR = "realised ISIs far from those asked"
    EQUAL = "equal amplitudes"
    SILENT = "no MEP at all"
    STOPPED = "no more MEPs"
    SMALL = "small amplitudes"
    LARGE = "large amplitudes"
    JUMP = "a jump of the scale"
    MISPLACED = "a response outside the MEP window"
    HUM = "mains hum"
    DRIFT = "a baseline that drifts"
    CUT_OFF = "MEPs that the MEP window cuts off"
    ARTEFACT = "an artefact in the MEP window"
    REPEATED = "the same sweep again"
    CHANGED = "a change at one trial"
    MANY_CHANGES = "more changes than are learnt"

    IN_SECONDS = "an ISI in seconds"
    ORDER = "ISI and amplitude swapped"
    VAGUE_ISI = "an ISI that is too uncertain"
    TIMES = "times that contradict the ISI"
    TAP_UNWANTED = "a tap with TMS alone"
    PULSE_UNWANTED = "a pulse with a tap alone"

    FEW_PAIRS = "too few pairs"

    @classmethod
    def of_mistrial(cls, text: str) -> Kind:
        """The reason of a mistrial of these words; `REJECTED` where the list has none."""
        return next((kind for kind in MISTRIALS if kind == text), cls.REJECTED)


MISTRIALS: Final = tuple(Kind)[: tuple(Kind).index(Kind.OUTCOME_UNKNOWN) + 1]
"""Why a delivered trial is not told. The list is closed."""

REMEDIES: Mapping[Kind, str] = MappingProxyType(
    {
        Kind.NO_IMPACT: "Check the air supply, the valve, and the accelerometer on the hammer.",
        Kind.NO_PULSE: "Check that the stimulator is charged and armed, and that its trigger is recorded.",
        Kind.TMS_BEFORE_IMPACT: "Check the hit delay that the rig assumes, and the sampling rate.",
        Kind.BACKGROUND_ACTIVITY: (
            "Ask the person to relax the muscle; check the electrodes and the ground, and look for mains hum. Where "
            "the tap alone evokes a reflex before the pulse, begin the space at larger ISIs. If the muscle is to be "
            "contracted, say so: contracted = true under [signals]."
        ),
        Kind.SATURATION: "Lower the amplifier's gain, or keep cables away from the coil.",
        Kind.MISSING_CHANNEL: (
            "Check that the EMG is recorded, and not blanked, from 50 ms before to 50 ms after the pulse."
        ),
        Kind.TOO_LITTLE_REST: "Let the sweep begin earlier: the EMG at rest says whether the muscle is relaxed.",
        Kind.ISI_OFF: "Check how the rig times the pulse, the reference of its ISIs, and the sampling rate.",
        Kind.IMPLAUSIBLE: "Check the unit and the gain of the EMG.",
        Kind.REJECTED: "See the notes in the log.",
        Kind.OUTCOME_UNKNOWN: "Check whether the device is connected and answers.",
    }
)
"""What to do about a mistrial of each reason."""


@dataclass(frozen=True)
class Finding:
    """A fault of a sweep, an amplitude, an ISI or a rig; its text has no full stop, its remedy is full sentences."""

    kind: Kind
    severity: Severity
    text: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.text}. {self.remedy}".rstrip()


def refused(
    finding: Finding, got: object, expected: str | None = None, error: type[IsiwError] = InvalidValueError
) -> IsiwError:
    """The error that refuses a value for what was found."""
    return error(finding.text, got=got, expected=expected, remedy=finding.remedy or None, found=finding.kind)


@dataclass(frozen=True)
class UnitScale:
    """A quantity's possible values, its usual one, and the unit and factor that smaller and larger ones were in."""

    least: float = 0.0
    most: float = math.inf
    too_small: tuple[str, float] | None = None
    too_large: tuple[str, float] | None = None
    usual: float = 1.0

    def slip(self, value: float) -> str | None:
        """Which unit a value is probably in, as a question, and what to do; None if it is within the bounds."""
        if value < self.least and self.too_small is not None:
            return f"Is it in {self.too_small[0]}? Multiply by {self.too_small[1]:g}."
        if value > self.most and self.too_large is not None:
            return f"Is it in {self.too_large[0]}? Divide by {self.too_large[1]:g}."
        return None

    def require(self, what: str, value: float, expected: str, got: object = None) -> None:
        """Raise if a value is probably in another unit."""
        if (slip := self.slip(value)) is not None:
            raise InvalidValueError(what, got=value if got is None else got, expected=expected, remedy=slip)


AMPLITUDE_MV: Final = UnitScale(2e-4, 30.0, ("V", 1000), ("µV", 1000))
"""Of an MEP: the noise of the electrodes alone has more than the least, and no muscle gives more than the most."""

SMALLEST_MV: Final = UnitScale(most=1.0, too_large=("µV", 1000))
"""The least amplitude that is measured, or counts as a response; nobody leaves out all that is below a millivolt."""

BACKGROUND_LIMIT_UV: Final = UnitScale(0.2, 5000.0, ("mV", 1000), ("nV", 1000))
"""The most EMG at rest that somebody allows; no amplifier is so quiet as the least, no muscle reaches the most."""

WINDOW_END_MS: Final = UnitScale(1.0, 1000.0, ("seconds", 1000), ("µs", 1000))
DELAY_MS: Final = UnitScale(1.0, too_small=("seconds", 1000))
"""No MEP has ended so soon after the pulse, nor lasts so long; and no hammer hits, nor does a shock travel so fast."""

RATE_HZ: Final = UnitScale(500.0, too_small=("kHz", 1000))
"""Below this nothing of a surface MEP or an impact is seen; recordings use 3–10 kHz."""

INTERVAL_S: Final = UnitScale(most=1000.0, too_large=("ms", 1000))
"""More than anybody waits between two stimuli."""

SHARE: Final = UnitScale(most=1.0, too_large=("%", 100))
INTENSITY_PCT: Final = UnitScale(3.0, 300.0, ("parts of 1", 100), ("per mille", 10))
"""Nobody stimulates with less, 1.2 is meant as 120 %; no stimulator reaches more where a threshold can be found."""


def require_percent(what: str, intensity_pct: float | None) -> None:
    """Raise if an intensity [%] is probably in another unit; None is none."""
    if intensity_pct is not None:
        scale = INTENSITY_PCT
        expected = f"{scale.least:g} to {scale.most:g} %"
        scale.require(f"{what} is probably in another unit", intensity_pct, expected)
