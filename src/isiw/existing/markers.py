"""Events of a recording that mark stimuli: which pulse belongs to which tap, and which came alone."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from itertools import chain
from typing import Any, Final

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.cells import Column, says_alone
from isiw.existing.doubts import kinds_at_each
from isiw.existing.layout import ISI_UNITS_MS, MARKS, Layout, plain
from isiw.existing.names import ALL, is_remark, is_verdict
from isiw.existing.quantities import isis_of, require_one
from isiw.lazy import pd
from isiw.text.sanitize import counted
from isiw.types import FloatArray

_TWICE_S: Final = 3e-3  # a trigger that is found twice within so short a time is one, which came at the first edge
_SAME_PULSE_S: Final = 20e-3  # an event of a pulse alone marks the pulse that is marked within so short a time
_SELDOM: Final = 4  # so many times more pulses are there than remarks of one text
_FEW: Final = 3  # so many pulses after an event, at different times, are hardly by chance
EVENT: Final = "event"  # what `where` calls the events of which nothing else is read
_NONE: Final = "no event"
_OF_NONE: Final = re.compile("(?i)bad|sweep$|edge|.*boundary|.*new segment")  # events of no stimuli
_CODE: Final = re.compile(r"[^\W\d]{1,2}|(?=.*\d)\W*([^\W\d_]*[\W\d_]+)?[^\W\d_]*")  # a name that is no remark
_ISI: Final = re.compile(r"(?i)isi[\W_]{0,2}(\d+(?:[.,]\d+)?) ?(ms|s)?(?![^\W_])")  # what a name says
_ODD_MS: Final = 10.0  # a hammer is not so much later or earlier than usual
_EARLY_S: Final = 20e-3  # a pulse at most so long before a tap was meant to follow it, and is TMS before the impact


@dataclass(frozen=True)
class Pulse:
    """A pulse by its events: when [s], how long after the tap, and what the file says of it."""

    at_s: float
    isi_s: float | None = None  # None where no tap is known
    alone: bool = False  # as the file says
    lost: bool = False  # a tap came, and it is not known when
    sweep_s: tuple[float, float] | None = None  # where the file has a sweep of its own
    said: Mapping[str, Any] = field(default_factory=dict)

    @property
    def origin_s(self) -> float | None:
        """When the tap came, or the valve command [s]."""
        return None if self.isi_s is None else self.at_s - self.isi_s


def times_of(events: pd.DataFrame, *names: str | None) -> FloatArray:
    """When the events of some names came, ascending [s]."""
    return np.sort(events.loc[events["name"].astype(str).isin(names), "onset"].to_numpy(dtype=np.float64))


def marked(events: pd.DataFrame, key: str, layout: Layout) -> FloatArray:
    """When the events of a key came, if there are any [s]."""
    return times_of(events, *_fitting(events, key, layout))


def names_of(events: pd.DataFrame) -> list[str]:
    """What events are called, each name once."""
    return list(dict.fromkeys(map(str, events["name"])))


def _fitting(events: pd.DataFrame, key: str, layout: Layout) -> list[str]:
    """The names of the events that mark something."""
    if key in layout.channels:
        return [key]
    names = names_of(events)
    if (stated := layout.markers.get(key)) is None:
        return [name for name in names if _plain(name) in MARKS[key][1].split()]
    number = re.sub(r"\D", "", stated)  # of which MNE may keep no more
    fits = ([stated], [name for name in names if _plain(name) == _plain(stated)], [number])
    return next((each for each in fits if each and {*each} <= {*names}), [])


def _others(events: pd.DataFrame, layout: Layout) -> list[str]:
    """The names of the events of which nothing is read."""
    used = {name for key in MARKS for name in _fitting(events, key, layout)}
    return [name for name in names_of(events) if name not in used and not _OF_NONE.match(name)]


def note_of_others(events: pd.DataFrame, layout: Layout) -> tuple[str, ...]:
    """A sentence about the events of which nothing is read, if there are any."""
    others = [] if EVENT in layout.where else _others(events, layout)
    found = ", ".join(f"{name!r} ({len(times_of(events, name))})" for name in others[:5])
    more = f" and {counted(len(others) - 5, 'other')}" if len(others) > 5 else ""
    return (f"Nothing is read of the events {found}{more}. Do some mark stimuli?",) if others else ()


def _marker(events: pd.DataFrame, key: str, layout: Layout, source: str) -> str | None:
    """The name of the events that mark something; None if none of them does."""
    fitting = _fitting(events, key, layout)
    if key in layout.markers and len(fitting) != 1:
        what = "several events" if fitting else "no event"
        expected = f"one of {', '.join(map(repr, names_of(events)))}"
        raise InvalidValueError(f"{source} has {what} of this name", got=layout.markers[key], expected=expected)
    if len(fitting) > 1:
        what = f"events of {len(fitting)} names in {source} may mark {MARKS[key][0]}"
        remedy = f'Say --marker "{key}={fitting[0]}", or one name with * for all that mark it, such as "{key}=TMS*".'
        raise InvalidValueError(what, got=", ".join(fitting), remedy=remedy)
    return fitting[0] if fitting else None


def _plain(name: str) -> str:
    """An event's name without what BrainVision puts before it and between its parts."""
    return "".join(name.rpartition("/")[2].casefold().split())


def joined(events: pd.DataFrame, layout: Layout) -> pd.DataFrame:
    """Events, of which those have one name that a marker such as `TMS*` says; what each was called is kept."""
    names = events["name"].astype(str)
    for stated in (one for one in layout.markers.values() if "*" in one and not names.eq(one).any()):
        names = names.map(lambda name, one=stated: one if fnmatchcase(_plain(name), _plain(one)) else name)
    return events.assign(name=names, called=events["name"])


def pulses_of(events: pd.DataFrame, key: str, layout: Layout, source: str) -> list[Pulse]:
    """All pulses, each with the tap, or the valve command, that it belongs to."""
    found = {one: _marker(events, one, layout, source) for one in ("pulse", key, "alone", *layout.markers)}
    pulse_name, origin_name, alone_name = (found[one] for one in ("pulse", key, "alone"))
    if missing := [one for one in ("pulse", key) if found[one] is None]:
        names = ", ".join(map(repr, names_of(events)))
        said = " ".join(f"--{'marker' if names else 'channel'} {one}=NAME" for one in missing)
        what = f"no event of {source} is known to mark {', nor '.join(MARKS[one][0] for one in missing)}"
        remedy = f"Say {said}, where NAME may end with *. isiw analyse FILE --look says what is in the file."
        raise InvalidValueError(what, got=names or "no events, so that no event was found", remedy=remedy)
    if origin_name == pulse_name:
        what = f"one event of {source} cannot mark both stimuli"
        raise InvalidValueError(what, got=pulse_name, remedy=f"Say --marker {key}=NAME.")
    every = (times_of(events, name) for name in (pulse_name, origin_name))
    at_s, origins_s = (times_s[np.diff(times_s, prepend=-np.inf) > _TWICE_S] for times_s in every)  # each once
    alone_s = times_of(events, None if alone_name in {pulse_name, origin_name} else alone_name)
    more_s = [at for at in alone_s.tolist() if not np.any(np.abs(at_s - at) <= _SAME_PULSE_S)]
    epochs = events[events["name"].astype(str) == "sweep"]
    pulses = [
        _placed(at, origins_s, epochs, alone=bool(np.any(np.abs(alone_s - at) <= _SAME_PULSE_S)), layout=layout)
        for at in sorted([*at_s.tolist(), *more_s])
    ]
    _require_one_each(pulses, origins_s, layout, source)
    _require_no_verdicts(events, at_s, layout, source)
    _require_named_isis(pulses, events, layout, source)
    return _with_the_unmarked(_of_one_kind(pulses, events, key, layout, source), layout, source)


def _require_no_verdicts(events: pd.DataFrame, at_s: FloatArray, layout: Layout, source: str) -> None:
    """Raise if a remark beside a trial says that it does not count; one that begins with BAD may span it."""
    others, times = _others(events, layout), Counter(events["name"].astype(str))
    seldom = [name for name in others if _SELDOM * times[name] <= len(at_s)]
    said = {name: name.rpartition("/")[2].strip() for name in seldom if times_of(events, name).max() > at_s.min()}
    remarks = {name for name, text in said.items() if is_remark(text) and not _CODE.fullmatch(text)}
    remarks |= {*filter(is_verdict, names_of(events))}
    every = events if EVENT not in layout.where else events[:0]
    for name, onset_s, lasts_s in every[["name", "onset", "duration"]].itertuples(index=False):
        is_bad = re.match("(?i)bad", name) and (lasts_s > 0 or np.any(np.abs(at_s - onset_s) < _EARLY_S))
        if name in remarks and not is_bad and "boundary" not in name.casefold():
            what = f"an event of {source} may say that a trial does not count"
            remedy = "Mark the trial itself by an annotation whose name begins with BAD, or remove its pulse; or say "
            remedy += f'what it marks, such as --marker "alone={name}"; if all count, say --where "{EVENT}={ALL}".'
            raise InvalidValueError(what, got=f"{name!r} at {onset_s:.3f} s", remedy=remedy)


def _require_named_isis(pulses: Sequence[Pulse], events: pd.DataFrame, layout: Layout, source: str) -> None:
    """Raise if names of events, such as ISI 60, say ISIs that are not those of the trials, but for a delay of all."""
    times_s, off_ms, all_ms = events["onset"].to_numpy(), dict[str, float](), set[float]()
    for pulse, before in zip(pulses, _before(pulses, events, layout), strict=True):
        rows = [{str(key): cell for key, cell in row.items()}
                for _, row in events[np.abs(times_s - pulse.at_s) < _TWICE_S].iterrows()]  # fmt: skip
        texts = [*before, *(str(row.get("called", row["name"])) for row in rows)]
        said_ms = {float(found[1].replace(",", ".")) * ISI_UNITS_MS[(found[2] or "ms").casefold()]: found[0].strip()
                   for text in texts if (found := _ISI.search(text))}  # fmt: skip
        said_ms |= {isi_ms: f"ISI {isi_ms:g}" for row in rows for isi_ms in isis_of(row)}
        if pulse.isi_s is not None and len(said_ms) == 1:
            ((isi_ms, text),) = said_ms.items()
            all_ms.add(isi_ms)
            off_ms[f"{text!r} at {pulse.at_s:.3f} s"] = 1e3 * pulse.isi_s - isi_ms
    usual_ms = float(np.median([*off_ms.values()])) if len(off_ms) >= _FEW else 0.0
    are_numbers = sorted(all_ms) == [*range(1, len(all_ms) + 1)]  # of conditions
    is_asked = len(off_ms) >= _FEW and not are_numbers and EVENT not in layout.where
    for name, ms in off_ms.items() if is_asked else ():
        if abs(ms - usual_ms) > _ODD_MS:
            what = f"an event of {source} names another ISI than the one between its tap and its pulse"
            remedy = f'Correct the events; if their names are wrong, say --where "{EVENT}={ALL}".'
            raise InvalidValueError(what, got=name, expected=f"{ms - usual_ms:+.0f} ms", remedy=remedy)


def _before(pulses: Sequence[Pulse], events: pd.DataFrame, layout: Layout) -> list[dict[str, float]]:
    """Events of which nothing is read, by the first pulse after them: how long before it each name came [s]."""
    found: list[dict[str, float]] = [{} for _ in pulses]
    latest_s = np.array([pulse.at_s for pulse in pulses]) + _EARLY_S
    for name in _others(events, layout):
        times_s = times_of(events, name)
        places = np.searchsorted(latest_s, times_s[times_s <= latest_s.max(initial=0.0)]).tolist()
        if len({*places}) == len(places):  # or it comes by itself, as an artefact does
            for place, at_s in zip(places, times_s.tolist(), strict=False):
                found[place][name] = pulses[place].at_s - at_s
    return found


def _of_one_kind(pulses: list[Pulse], events: pd.DataFrame, key: str, layout: Layout, source: str) -> list[Pulse]:
    """The pulses alone, and the pairs after an event of the name that is stated, of which nothing else is read.

    Raises:
        InvalidValueError: pairs of each ISI come after events of several names, or some after one and some not, as
            those of two conditions do; or pulses without a tap come after one, as after a tap of another kind.
    """
    names, wanted = _before(pulses, events, layout), layout.where.get(EVENT, "")
    longest_s = layout.longest_isi_ms / 1e3
    pairs = sorted((pulse.isi_s, n) for n, pulse in enumerate(pulses) if pulse.isi_s is not None)
    near = [{name for name, before_s in own.items() if before_s <= longest_s} or {_NONE} for own in names]
    used = [{*own} for own in names] if all(names[n] for _, n in pairs) else near
    if wanted:
        require_one("event", source, wanted, dict.fromkeys([ALL, *chain.from_iterable(used)]))
        return [one for one, own in zip(pulses, used, strict=True) if one.isi_s is None or wanted in {ALL, *own}]
    column = Column(EVENT, [" + ".join(sorted(own)) for own in used], of=source)
    if kinds := kinds_at_each(pairs, column):
        what, got = f"pairs of each ISI in {source} come after events of several names", ", ".join(kinds[:5])
        remedy = f'Say --where "{EVENT}={min(used[pairs[0][1]])}" for those after one of them, or --where '
        raise InvalidValueError(what, got=got, remedy=f'{remedy}"{EVENT}={ALL}" if all are to be analysed together.')
    of_pairs = set().union(*(near[n] for _, n in pairs))
    bare = [names[n] for n, one in enumerate(pulses) if one.isi_s is None and not (one.alone or one.lost)]
    for name in {*chain.from_iterable(bare)} - of_pairs if layout.unmarked != "lost" else ():
        before_s = [own[name] for own in bare if own.get(name, np.inf) <= longest_s]
        if len(before_s) >= _FEW and np.ptp(before_s) > _TWICE_S:
            what = f"{counted(len(before_s), 'pulse')} of {source} without a marked {key} come after an event {name!r}"
            remedy = f'Say --marker "{key}={name}" for these pairs, or --unmarked lost to leave them out; if all taps '
            remedy += f'are alike, give their events one name; if it is none, say --where "{EVENT}={ALL}".'
            raise InvalidValueError(what, got=f"{1e3 * min(before_s):.0f} to {1e3 * max(before_s):.0f} ms later",
                                    remedy=remedy)  # fmt: skip
    return pulses


def _require_one_each(pulses: list[Pulse], origins_s: FloatArray, layout: Layout, source: str) -> None:
    """Raise if a tap has two pulses after it, or a pulse two taps before it."""
    last_s, last_came_s = -np.inf, None
    for pulse in pulses:
        begin_s = max(pulse.at_s - layout.longest_isi_ms / 1e3, last_s)
        taps = int(((origins_s > begin_s) & (origins_s <= pulse.at_s)).sum())
        came_s = None if pulse.origin_s is None else round(pulse.origin_s, 9)
        shared = came_s is not None and came_s == last_came_s
        if taps > 1 or shared:
            what = f"two pulses of {source} have one tap"
            if not shared:
                what = f"{taps} taps of {source} come before one pulse"
            expected = f"one of each within {layout.longest_isi_ms:g} ms"
            remedy = "Leave out the events that mark no stimulus, such as a second edge, or give them another name."
            raise InvalidValueError(what, got=f"at {pulse.at_s:.3f} s", expected=expected, remedy=remedy)
        last_s, last_came_s = pulse.at_s + _EARLY_S, came_s


def _placed(at_s: float, origins_s: FloatArray, epochs: pd.DataFrame, *, alone: bool, layout: Layout) -> Pulse:
    """A pulse with the tap before it, or one shortly after it."""
    epoch = epochs[(epochs["onset"] <= at_s) & (at_s < epochs["onset"] + epochs["duration"])]
    said = {str(key): value for key, value in epoch.iloc[0].items()} if len(epoch) else {}
    sweep_s = (float(said["onset"]), float(said["onset"] + said["duration"])) if said else None
    if sweep_s is not None:
        origins_s = origins_s[(origins_s >= sweep_s[0] - 1e-9) & (origins_s < sweep_s[1])]
    before = origins_s[(origins_s <= at_s) & (origins_s >= at_s - layout.longest_isi_ms / 1e3)]
    after = origins_s[(origins_s > at_s) & (origins_s <= at_s + _EARLY_S)]
    nearest, condition = [*before[-1:], *after[:1]], said.get("condition")
    isi_s = float(at_s - nearest[0]) if nearest else None  # below 0 if the tap came shortly after
    lost = isi_s is None and isinstance(condition, str) and plain(condition) in {"paired", "unknown"}
    return Pulse(at_s, isi_s, alone or says_alone(condition, None), lost, sweep_s, said)


def _with_the_unmarked(pulses: list[Pulse], layout: Layout, source: str) -> list[Pulse]:
    """Pulses of which the file says whether a tap came, or the operator does."""
    paired = [pulse for pulse in pulses if pulse.isi_s is not None]
    if both := [pulse for pulse in paired if pulse.alone]:
        came_ms = 1e3 * (both[0].isi_s or 0.0)
        what = f"an event of {source} says TMS alone, and a tap came {came_ms:.0f} ms before the pulse"
        remedy = "Are both markers the right ones? Say --marker alone=NAME and --marker tap=NAME."
        raise InvalidValueError(what, got=f"at {both[0].at_s:.3f} s", remedy=remedy)
    if (early := sum((pulse.isi_s or 0.0) < 0 for pulse in paired)) > 2 and 2 * early > len(paired):
        what = f"most pulses of {source} come before the tap, so that they are probably swapped"
        remedy = "Say which marker is of the tap and which of the pulse: --marker tap=NAME --marker pulse=NAME."
        raise InvalidValueError(what, got=f"{early} of {len(paired)}", remedy=remedy)
    unmarked = [pulse for pulse in pulses if pulse.isi_s is None and not (pulse.alone or pulse.lost)]
    if not unmarked or not paired:
        return pulses
    if layout.unmarked is None:
        what = f"{counted(len(unmarked), 'pulse')} of {len(pulses)} in {source} have no tap within "
        what += f"{layout.longest_isi_ms:g} ms before them, and nothing says whether none came or its marker is missing"
        remedy = "Say --unmarked alone if they are TMS alone, or --unmarked lost to leave them out; or name the events "
        remedy += "that mark TMS alone: --marker alone=NAME."
        raise InvalidValueError(what, got=f"the first at {unmarked[0].at_s:.3f} s", remedy=remedy)
    return [replace(one, lost=layout.unmarked == "lost") if one in unmarked else one for one in pulses]
