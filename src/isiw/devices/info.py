"""What a device says of itself: its description, which logs keep, and its state before a stimulus."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from isiw.checks import Checked, Count, Flag, MeanAndSd, NonNegative, SmallestAmplitude, Text, text
from isiw.errors import InvalidValueError
from isiw.types import Conditioning, Reference

Guard: TypeAlias = Literal["watchdog", "heartbeat"]
"""What disarms a device if isiw dies."""


@dataclass(frozen=True)
class DeviceInfo(Checked):
    """A device's description of itself; the log keeps it.

    Args:
        name: what it is, in a few words.
        reference: the event that its ISIs count from.
        simulated: True if nothing is delivered to anybody; such a session does not wait between trials.
        channels: the unit of each waveform by the channel's name; empty for a device that measures the MEP itself.
        version: firmware or software version, as text.
        detection_limit_mv: amplitudes below it are reported as 0 [mV]; None if there is no such limit.
        hit_delay_ms: from the valve command to the impact, mean and SD over people [ms]; `isiw timing LOG` measures it.
            None if it is not known, or if ISIs count from the impact.
        conditioning: what it delivers first: a tap on the tendon, or an electrical pulse to the nerve, as an impact.
        address: what it is connected to, such as "COM3"; no two sessions of a computer drive a device of one address.
        tap_alone: whether it can deliver a tap without the magnetic pulse, which `Stimulus.tap_alone` asks for.
        sets_intensity: whether it sets the intensity that `Stimulus.intensity_pct_rmt` asks for, before the pulse.
        if_isiw_dies: what disarms it if isiw dies while it is armed: "watchdog", a process beside isiw, such as
            `isiw.Watchdog`, or "heartbeat", a sign of life without which it disarms itself; None if nothing does.
        shortest_iti_s: the shortest time between two stimuli that it gives [s], which binds the limits; None if any.
        most_pulses: the most stimuli that it gives from one start to the next; None if any number.

    Raises:
        InvalidValueError: an unknown reference, conditioning stimulus or guard, a detection limit or a hit delay that
            is not positive, a limit below 0, a name, version, address or unit that is no text, or a word where True or
            False is due.
    """

    name: Text
    reference: Reference
    simulated: Flag = False
    channels: Mapping[str, str] = field(default_factory=dict)
    version: Text = ""
    detection_limit_mv: SmallestAmplitude | None = None
    hit_delay_ms: MeanAndSd | None = None
    address: Text = ""
    tap_alone: Flag = False
    conditioning: Conditioning = "tap"
    if_isiw_dies: Guard | None = None
    shortest_iti_s: NonNegative | None = None
    most_pulses: Count | None = None
    sets_intensity: Flag = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.channels, Mapping):
            raise InvalidValueError(
                "DeviceInfo.channels must be a table of units", got=self.channels, expected='such as {"emg": "mV"}'
            )
        for channel, unit in self.channels.items():
            text("the name of a channel in DeviceInfo.channels", channel)
            text(f"the unit of {channel!r} in DeviceInfo.channels", unit)
