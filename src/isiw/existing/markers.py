"""Events of a recording that mark stimuli: which pulse belongs to which tap, and which came alone."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.cells import plain, says_alone
from isiw.existing.layout import Layout
from isiw.lazy import pd
from isiw.text.sanitize import counted
from isiw.types import FloatArray

_KNOWN: Final[Mapping[str, tuple[str, ...]]] = {
    "pulse": ("tms", "pulse", "tmspulse", "magneticpulse"),
    "tap": ("tap", "impact", "hit", "electricalpulse", "conditioning", "pns"),
    "valve": ("valve", "valvecommand"),
    "alone": ("tmsalone", "tmsonly", "singlepulse", "pulsealone", "unconditioned"),
}
"""What events are called that need not be named, without blanks."""

_WHAT: Final = {
    "pulse": "the pulse of TMS",
    "tap": "the tap (its impact) or the electrical pulse",
    "valve": "the valve command",
    "alone": "TMS alone",
}

_TWICE_S: Final = 3e-3
"""One trigger that is found twice within so short a time is one, and the first edge is when it was."""

_SAME_PULSE_S: Final = 20e-3  # an event of a pulse alone marks the pulse that is marked within so short a time
_EARLY_S: Final = 20e-3
"""A pulse that comes before a tap by at most so much was meant to follow it, and is TMS before the impact."""


@dataclass(frozen=True)
class Pulse:
    """A pulse by its events: when [s], how long after the tap, and what the file says of it."""

    at_s: float
    isi_s: float | None = None  # None where no tap is known
    alone: bool = False  # as the file says
    lost: bool = False  # a tap came, and it is not known when
    sweep_s: tuple[float, float] | None = None  # where the file has a sweep of its own
    said: Mapping[str, Any] = field(default_factory=dict)


def times_of(events: pd.DataFrame, *names: str | None) -> FloatArray:
    """When the events of some names came, ascending [s]."""
    return np.sort(events.loc[events["name"].astype(str).isin(names), "onset"].to_numpy(dtype=np.float64))


def marked(events: pd.DataFrame, key: str, layout: Layout) -> list[float]:
    """When the events of a key came, if there are any [s]."""
    times_s: list[float] = times_of(events, *_fitting(events, key, layout)).tolist()
    return times_s


def names_of(events: pd.DataFrame) -> list[str]:
    """What events are called, each name once."""
    return list(dict.fromkeys(map(str, events["name"])))


def _fitting(events: pd.DataFrame, key: str, layout: Layout) -> list[str]:
    """The names of the events that mark something."""
    names = names_of(events)
    if key in layout.channels:
        return [key]
    if (stated := layout.markers.get(key)) is None:
        return [name for name in names if _plain(name) in _KNOWN[key]]
    number = re.sub(r"\D", "", stated)  # of which MNE may keep no more
    fits = ([name for name in names if known(name)] for known in
            (stated.__eq__, lambda name: _plain(stated) == _plain(name), number.__eq__))  # fmt: skip
    return next(filter(None, fits), [])


def _marker(events: pd.DataFrame, key: str, layout: Layout, source: str) -> str | None:
    """The name of the events that mark something; None if none of them does."""
    fitting = _fitting(events, key, layout)
    if key in layout.markers and len(fitting) != 1:
        what = "several events" if fitting else "no event"
        expected = f"one of {', '.join(map(repr, names_of(events)))}"
        raise InvalidValueError(f"{source} has {what} of this name", got=layout.markers[key], expected=expected)
    if len(fitting) > 1:
        raise InvalidValueError(
            f"events of {len(fitting)} names in {source} may mark {_WHAT[key]}",
            got=", ".join(fitting),
            remedy=f'Say --marker "{key}={fitting[0]}", or give all that mark it one name.',
        )
    return fitting[0] if fitting else None


def _plain(name: str) -> str:
    """An event's name without what BrainVision puts before it and between its parts."""
    return "".join(name.rpartition("/")[2].casefold().split())


def pulses_of(events: pd.DataFrame, key: str, layout: Layout, source: str) -> list[Pulse]:
    """All pulses, each with the tap, or the valve command, that it belongs to."""
    found = {one: _marker(events, one, layout, source) for one in ("pulse", key, "alone", *layout.markers)}
    pulse_name, origin_name, alone_name = (found[one] for one in ("pulse", key, "alone"))
    missing = [one for one in ("pulse", key) if found[one] is None]
    if missing:
        names = ", ".join(map(repr, names_of(events)))
        said = " ".join(f"--{'marker' if names else 'channel'} {one}=NAME" for one in missing)
        raise InvalidValueError(
            f"no event of {source} is known to mark {', nor '.join(_WHAT[one] for one in missing)}",
            got=names or "no events, so that no event was found",
            remedy=f"Say {said}. isiw analyse FILE --look says what is in the file.",
        )
    if origin_name == pulse_name:
        raise InvalidValueError(
            f"one event of {source} cannot mark both stimuli", got=pulse_name, remedy=f"Say --marker {key}=NAME."
        )
    at_s, origins_s = times_of(events, pulse_name), times_of(events, origin_name)
    origins_s = origins_s[np.diff(origins_s, prepend=-np.inf) > _TWICE_S]
    alone_s = at_s[:0] if alone_name in {pulse_name, origin_name} else times_of(events, alone_name)
    more_s = [at for at in alone_s.tolist() if not np.any(np.abs(at_s - at) <= _SAME_PULSE_S)]
    epochs = events[events["name"].astype(str) == "sweep"]
    pulses = [
        _placed(at, origins_s, epochs, alone=bool(np.any(np.abs(alone_s - at) <= _SAME_PULSE_S)), layout=layout)
        for at in sorted([*at_s.tolist(), *more_s])
    ]
    _require_one_each(pulses, origins_s, layout, source)
    return _with_the_unmarked(pulses, layout, source)


def _require_one_each(pulses: list[Pulse], origins_s: FloatArray, layout: Layout, source: str) -> None:
    """Raise if a tap has two pulses after it, or a pulse two taps before it."""
    came_s = [None if pulse.isi_s is None else round(pulse.at_s - pulse.isi_s, 9) for pulse in pulses]
    last_s = -np.inf
    for number, pulse in enumerate(pulses):
        begin_s = max(pulse.at_s - layout.longest_isi_ms / 1e3, last_s)
        taps = int(((origins_s > begin_s) & (origins_s <= pulse.at_s)).sum())
        shared = number > 0 and came_s[number] is not None and came_s[number] == came_s[number - 1]
        if taps > 1 or shared:
            raise InvalidValueError(
                f"two pulses of {source} have one tap" if shared else f"{taps} taps of {source} come before one pulse",
                got=f"at {pulse.at_s:.3f} s",
                expected=f"one of each within {layout.longest_isi_ms:g} ms",
                remedy="Leave out the events that mark no stimulus, such as a second edge, or give them another name.",
            )
        last_s = pulse.at_s + _EARLY_S


def _placed(at_s: float, origins_s: FloatArray, epochs: pd.DataFrame, *, alone: bool, layout: Layout) -> Pulse:
    """A pulse with the tap before it, or one shortly after it."""
    epoch = epochs[(epochs["onset"] <= at_s) & (at_s < epochs["onset"] + epochs["duration"])]
    said = {str(key): value for key, value in epoch.iloc[0].items()} if len(epoch) else {}
    sweep_s = (float(said["onset"]), float(said["onset"] + said["duration"])) if said else None
    if sweep_s is not None:
        origins_s = origins_s[(origins_s >= sweep_s[0] - 1e-9) & (origins_s < sweep_s[1])]
    condition = said.get("condition")
    alone = alone or says_alone(condition, None)
    before = origins_s[(origins_s <= at_s) & (origins_s >= at_s - layout.longest_isi_ms / 1e3)]
    after = origins_s[(origins_s > at_s) & (origins_s <= at_s + _EARLY_S)]
    nearest = [*before[-1:], *after[:1]]
    isi_s = float(at_s - nearest[0]) if nearest else None  # below 0 if the tap came shortly after
    lost = isi_s is None and isinstance(condition, str) and plain(condition) in {"paired", "unknown"}
    return Pulse(at_s, isi_s, alone, lost, sweep_s, said)


def _with_the_unmarked(pulses: list[Pulse], layout: Layout, source: str) -> list[Pulse]:
    """Pulses of which the file says whether a tap came, or the operator does."""
    for pulse in pulses:
        if pulse.alone and pulse.isi_s is not None:
            raise InvalidValueError(
                f"an event of {source} says TMS alone, and a tap came {1e3 * pulse.isi_s:.0f} ms before the pulse",
                got=f"at {pulse.at_s:.3f} s",
                remedy="Are both markers the right ones? Say --marker alone=NAME and --marker tap=NAME.",
            )
    paired = [pulse for pulse in pulses if pulse.isi_s is not None]
    if (early := sum((pulse.isi_s or 0.0) < 0 for pulse in paired)) > 2 and 2 * early > len(paired):
        raise InvalidValueError(
            f"most pulses of {source} come before the tap, so that they are probably swapped",
            got=f"{early} of {len(paired)}",
            remedy="Say which marker is of the tap and which of the pulse: --marker tap=NAME --marker pulse=NAME.",
        )
    unmarked = [pulse for pulse in pulses if pulse.isi_s is None and not (pulse.alone or pulse.lost)]
    if not unmarked or not paired:
        return pulses
    if layout.unmarked is None:
        raise InvalidValueError(
            f"{counted(len(unmarked), 'pulse')} of {len(pulses)} in {source} have no tap within "
            f"{layout.longest_isi_ms:g} ms before them, and nothing says whether none came or its marker is missing",
            got=f"the first at {unmarked[0].at_s:.3f} s",
            remedy="Say --unmarked alone if they are TMS alone, or --unmarked lost to leave them out; or name the "
            "events that mark TMS alone: --marker alone=NAME.",
        )
    return [replace(one, lost=layout.unmarked == "lost") if one in unmarked else one for one in pulses]
