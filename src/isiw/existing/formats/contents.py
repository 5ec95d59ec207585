"""The three things that every format yields: channels with times, events, and what the file says of trials."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.layout import COLUMNS, WORDS, letters, unit_named
from isiw.lazy import pd
from isiw.types import FloatArray, IntArray

PIECE: Final = 2**20  # so many samples are in memory at once if a whole channel is looked through
APART_S: Final = 100.0  # between sweeps without a time of their own, and for a pause of unknown length
_ROWS: Final = 2**20  # of a file beside a recording; without a number pandas opens files of the system
_SAME: Final = 1.5  # so many samples apart a code and an event of one name are one event
_GAP_S: Final = 2.5e-3  # samples that are later than expected by so much, for good, come after a gap; others jitter
_AROUND_S: Final = 1.0
_LASTS_S: Final = 1e-3  # what is beside an event that does not count lasts so long at least
_SHORT, _LEVEL = 2, 0.7  # a level that lasts longer [samples] is so near to the highest or lowest one of a trigger
_BETWEEN, _SLOW_S = 0.6, 1e-3  # an edge of a trigger is not longer so near to the middle of its levels
_ENOUGH_S: Final = 10.0  # a stretch that is longer says at which rate its samples were really taken
_SCATTER_S: Final = 2e-3  # times that scatter more are said

Event = tuple[str, float, float]  # what it is called, when it was, and how long it lasted [s]


class Stretch(NamedTuple):
    """Samples without a gap: the first one, how many, and when the first one was taken [s]."""

    first: int
    samples: int
    start_s: float


def parted(
    cuts: Iterable[int], samples: int, rate_hz: float, missing_s: Mapping[int, float] | None = None
) -> tuple[Stretch, ...]:
    """Samples as stretches: before those at cuts something is missing, for `APART_S` if it is not known how long."""
    found, first, start_s = list[Stretch](), 0, 0.0
    for at in sorted({*cuts, samples}):
        if first < at <= samples:
            found.append(Stretch(first, at - first, start_s))
            first, start_s = at, start_s + (at - first) / rate_hz + ((missing_s or {}).get(at) or APART_S)
    return tuple(found)


def timed(noted: Iterable[Event], stretches: Sequence[Stretch], rate_hz: float) -> list[Event]:
    """Events that are noted by their samples, which may be between two, by when these were taken [s]."""
    found = []
    for name, sample, lasts_s in noted:
        stretch = next((one for one in reversed(stretches) if one.first <= sample + 0.5), Stretch(0, 0, 0.0))
        found.append((name, stretch.start_s + (sample - stretch.first) / rate_hz, lasts_s))
    return found


def clocked(
    times_s: FloatArray, nominal_hz: float | None, what: str, index: IntArray | None = None, samples: int = 0
) -> tuple[float, tuple[Stretch, ...], tuple[str, ...]]:
    """By times of samples [s], of those at `index` if not of all: their rate [Hz], stretches, and a note of scatter."""
    index = np.arange(len(times_s)) if index is None else index
    ahead = np.diff(index)
    steps_s = np.diff(times_s) / ahead
    if len(times_s) < 3 or not np.isfinite(times_s).all() or not np.median(steps_s) > 0:
        raise InvalidValueError(f"the times of the samples of {what} do not ascend", got=f"{len(times_s)} samples")
    nominal_s = 1.0 / nominal_hz if nominal_hz else float(np.median(steps_s))
    late_s = times_s - index * nominal_s
    around = max(3, round(_AROUND_S / (nominal_s * float(ahead.mean()))))
    near_s = late_s[: len(late_s) // around * around].reshape(-1, around)  # about which times scatter, whatever gaps
    jitter_s = 1.48 * np.median(np.abs(near_s - np.median(near_s, axis=1, keepdims=True))) if len(near_s) else 0.0
    least_s = max(_GAP_S, 1.5 * nominal_s, 2.0 * float(jitter_s))
    late = (np.flatnonzero(np.diff(late_s) > 0.8 * least_s) + 1).tolist()
    begins = [0, *_gaps(late_s, late, (0, len(times_s)), around, least_s)]
    spans = [slice(*span) for span in pairwise([*begins, len(times_s)])]
    longest = max(spans, key=lambda span: index[span.stop - 1] - index[span.start])
    period_s = nominal_s
    if times_s[longest][-1] - times_s[longest][0] >= _ENOUGH_S:  # by a line through all of them
        centred = index[longest] - index[longest].mean()
        period_s = float(centred @ (times_s[longest] - times_s[longest].mean()) / (centred @ centred))
    stretches, scatter = [], list[FloatArray]()
    for span, last in zip(spans, [*index[begins[1:]].tolist(), samples or len(times_s)], strict=True):
        first = int(index[span.start])
        late_s = times_s[span] - period_s * (index[span] - first)
        stretches.append(Stretch(first, last - first, float(np.median(late_s))))
        scatter.append(np.abs(late_s - stretches[-1].start_s))
    scatter_s = float(np.quantile(np.concatenate(scatter), 0.95))
    note = f"The times of {what} scatter by {1e3 * scatter_s:.1f} ms: MEPs may lie elsewhere."
    return 1.0 / period_s, tuple(stretches), (note,) if scatter_s > _SCATTER_S else ()


def _gaps(late_s: FloatArray, places: list[int], span: tuple[int, int], around: int, least_s: float) -> list[int]:
    """Where samples are later than those before, for good: the surest place, and those on both sides of it."""
    sure = dict[int, float]()
    for at in (place for place in places if span[0] < place < span[1]):
        before, after = late_s[max(span[0], at - around) : at], late_s[at : min(span[1], at + around)]
        if np.median(after) - np.median(before) > least_s:
            sure[at] = float(after.mean() - before.mean())
    if not sure:
        return []
    surest = max(sure, key=lambda place: sure[place])
    sides = [_gaps(late_s, places, side, around, least_s) for side in ((span[0], surest), (surest, span[1]))]
    return [*sides[0], surest, *sides[1]]


def part_of(values: Any, first: int, last: int) -> FloatArray:
    """Numbers that are in memory, or are read when they are chosen, from one sample to before another."""
    return np.asarray(values[first:last], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Track:
    """A channel of a file, whose samples are read when they are needed."""

    name: str
    rate_hz: float
    stretches: tuple[Stretch, ...]  # where it was recorded, ascending
    read: Callable[[int, int], FloatArray]  # its numbers from one sample to before another, scaled as the file says
    unit: str = ""  # of these numbers, as the file writes it; empty if it says none
    kind: str = ""  # such as emg or stim, where the file says so
    said: str = ""  # what else it says, such as of filters
    bad: bool = False  # whether it says that the channel is bad

    @classmethod
    def of_values(
        cls, name: str, rate_hz: float, stretches: Iterable[Stretch], values: Any, unit: str, kind: str = ""
    ) -> Track:
        """A channel in memory."""
        return cls(name, rate_hz, tuple(stretches), partial(part_of, values), unit, kind)

    def scaled(self, gain: float, offset: float = 0.0) -> Track:
        """The same, each number times a gain, and an offset added."""
        return replace(self, read=lambda first, last: gain * self.read(first, last) + offset)

    def with_unit(self, said: Any) -> Track:
        """The same, whose unit is also said elsewhere; two that differ are no unit that is known."""
        known = unit_named(said)
        if known is None or (unit_named(self.unit) or known) == known:
            return replace(self, unit=self.unit or known or "")
        return replace(self, unit=f"{self.unit} in one place, and {said} in another")

    def cut(self, inside_s: float, begin_s: float, end_s: float) -> tuple[float, FloatArray] | None:
        """What the stretch about a time has between two others: when that begins [s], and numbers; None in a gap."""
        for first, samples, start_s in self.stretches:
            if -0.5 <= (inside_s - start_s) * self.rate_hz < samples + 0.5:
                begin = round((begin_s - start_s) * self.rate_hz)
                end = max(0, min(begin + round((end_s - begin_s) * self.rate_hz), samples))
                begin = max(0, begin)
                return start_s + begin / self.rate_hz, self.read(first + begin, first + end)
        return None

    def pieces(self) -> Iterator[tuple[float, FloatArray, float]]:
        """All numbers, some at a time: when the first was taken [s], they, and the one before without a gap, or it."""
        for first, samples, start_s in self.stretches:
            before = None
            for begin in range(0, samples, PIECE):
                values = self.read(first + begin, first + min(begin + PIECE, samples))
                yield start_s + begin / self.rate_hz, values, float(values[0] if before is None else before)
                before = values[-1]

    def onsets_s(self) -> list[float]:
        """When a trigger leaves the level at which it mostly is [s]; raise if it is as long at the other one."""
        ends = [(values.min(), values.max()) for _, values, _ in self.pieces()]
        middle = (min(low for low, _ in ends) + max(high for _, high in ends)) / 2 if ends else 0.0
        rises, falls, high, between, tops = list[float](), list[float](), 0, 0, list[float]()
        near = _BETWEEN * (max(most for _, most in ends) - middle) if ends else 0.0
        for at_s, values, before in self.pieces():
            above = values > middle
            high += int(above.sum())
            between += int((np.abs(values - middle) < near).sum())
            turns = np.diff(above.astype(np.int8), prepend=np.int8(before > middle))
            rises += (at_s + np.flatnonzero(turns > 0) / self.rate_hz).tolist()
            falls += (at_s + np.flatnonzero(turns < 0) / self.rate_hz).tolist()
            if (edges := np.flatnonzero(turns)).size:
                lasts = np.diff([*edges, len(values)])
                tops += np.maximum.reduceat(np.abs(values - middle), edges)[lasts > _SHORT].tolist()
        slow_s = between / self.rate_hz / max(len(rises) + len(falls), 1)
        is_wave = tops and np.quantile(tops, 0.25) < _LEVEL * (max(most for _, most in ends) - middle)
        if is_wave or slow_s > max(_SLOW_S, _SHORT / self.rate_hz):
            what = f"the trigger {self.name!r} has more than two levels, as a wave of force or acceleration has"
            remedy = "Export events in its place that say when it begins, or a trigger of two levels."
            raise InvalidValueError(what, remedy=remedy)
        spans_s = np.diff(sorted([*rises, *falls]))
        if len(spans_s) > 2 and 0.5 < np.quantile(spans_s[0::2], 0.75) / np.quantile(spans_s[1::2], 0.75) < 2:
            what = f"the trigger {self.name!r} is as long at one level as at the other: which of its edges are stimuli?"
            remedy = "Export events in its place, or a trigger that is short for each stimulus."
            raise InvalidValueError(what, got=f"{len(rises)} edges up and {len(falls)} down", remedy=remedy)
        return falls if 2 * high > sum(stretch.samples for stretch in self.stretches) else rises

    def codes(self) -> list[tuple[float, int]]:
        """When a channel of codes rises, as a trigger does [s], and to which code.

        One that rises while another lasts adds its bits to it: where these bits have come alone, they are the code.
        """
        found = list[tuple[float, int, int]]()
        for at_s, values, last in self.pieces():
            codes = np.rint(values).astype(np.int64)
            old = np.append(round(last), codes[:-1])
            up = np.flatnonzero(codes > old)
            found += zip((at_s + up / self.rate_hz).tolist(), codes[up].tolist(), old[up].tolist(), strict=True)
        alone = {code for _, code, before in found if before == 0}
        added = {(code, before) for _, code, before in found if before & code == before and code ^ before in alone}
        added = {both for both in added if both[0] not in alone}
        return [(at, code ^ was if (code, was) in added else code) for at, code, was in found if code > 0]


def text_of(*values: Any) -> str:
    """What an event is called, by its texts and codes; a whole number has no decimal sign."""
    texts = (value.decode("utf-8", "replace") if isinstance(value, bytes) else value for value in values)
    return " ".join(f"{one:.15g}" if isinstance(one, int | float | np.number) else f"{one}" for one in texts).strip()


def events_of(rows: Iterable[Sequence[Any]]) -> pd.DataFrame:
    """Events as a table, by their times: what each is called, when it was [s], and how long it lasted [s]."""
    return pd.DataFrame(sorted(map(tuple, rows), key=itemgetter(1)), columns=["name", "onset", "duration"])


def with_codes(rows: Sequence[Event], tracks: Iterable[Track]) -> pd.DataFrame:
    """Events, and those of channels of codes besides, in the order of their times; one that both have is one."""
    found, times_s = list(rows), dict[str, list[float]]()
    for name, at, _ in rows:
        times_s.setdefault(name, []).append(at)
    for track in tracks:
        for at, code in track.codes() if track.kind == "stim" else ():
            known = times_s.setdefault(str(code), [])
            if not any(abs(at - other) * track.rate_hz <= _SAME for other in known):
                known.append(at)
                found.append((str(code), at, 0.0))
    return events_of(found)


@dataclass(frozen=True, eq=False)
class Contents:
    """What a file holds."""

    source: str  # in words, for messages
    tracks: tuple[Track, ...] = ()  # none of a table
    events: pd.DataFrame = field(default_factory=lambda: events_of(()))  # of each its name, onset and duration [s]
    trials: pd.DataFrame | None = None  # a row for each trial, or for each sweep
    pulse_at_s: float | None = None  # of sweeps whose ISIs are in trials, after the first sample
    empty_is_alone: bool = False  # whether a sweep without an ISI is TMS alone
    unit_is_usual: bool = False  # whether the unit of the channels is that of the format, and not written there
    notes: tuple[str, ...] = ()  # what the operator should know of how it was read

    def with_bids(self, path: Path) -> Contents:
        """The same with the events and the units of channels that BIDS has in files beside a recording."""
        channels, events = (_beside(path, what) for what in ("channels", "events"))
        units = dict(zip(map(str, channels.get("name", ())), channels.get("units", ()), strict=False))
        states = dict(zip(map(str, channels.get("name", ())), channels.get("status", ()), strict=False))
        tracks = tuple(replace(one.with_unit(units.get(one.name)), bad=one.bad or states.get(one.name) == "bad")
                       for one in self.tracks)  # fmt: skip
        if not len(events):
            return replace(self, tracks=tracks)
        off = (events["onset"] * tracks[0].rate_hz - events.get("sample", np.nan)).abs().median() if tracks else 0.0
        if tracks and off > 0.1 * tracks[0].rate_hz:
            what, expected = f"the onsets of events beside {self.source} are not those of their samples", "seconds"
            remedy = "Correct the onsets, or the samples, in the file of events."
            raise InvalidValueError(what, got=f"{off:.0f} samples apart", expected=expected, remedy=remedy)
        named = [events[one] for one in ("trial_type", "value") if one in events and events[one].notna().any()]
        names = [text_of(each) for each in named[0]] if named else ""
        return replace(self, tracks=tracks, events=with_bad(events.assign(name=names), "sweep"))


def with_bad(events: pd.DataFrame, *but: str) -> pd.DataFrame:
    """Events, and one that begins with BAD beside each that a column says not to count, but for some by their names."""
    rows, bad = events[~events["name"].isin(but)], set[Any]()
    for name in map(str, events.columns):
        key = next((key for key in ("exclude", "status") if letters(name) in COLUMNS[key]), None)
        is_verdict = key is not None or not WORDS["counted"].isdisjoint(rows[name].astype(str).str.casefold())
        kinds = WORDS["left out"] | WORDS["yes" if key == "exclude" else "no"] if key else WORDS["left out"]
        bad |= {row for row, cell in rows[name].items() if is_verdict and str(cell).casefold() in kinds}
    held = [events.loc[row] for row in sorted(bad)]
    added = [(f"BAD {one['name']}", one["onset"], max(one["duration"], _LASTS_S)) for one in held]
    return pd.concat([events, events_of(added)], ignore_index=True) if added else events


def _beside(path: Path, what: str) -> pd.DataFrame:
    """A table that BIDS has beside a recording; an empty one if there is none."""
    beside = path.with_name(f"{path.stem.rpartition('_')[0]}_{what}.tsv")
    if not (beside.is_file() and "_" in path.stem):
        return pd.DataFrame()
    return pd.read_csv(beside, sep="\t", na_values=["n/a"], nrows=_ROWS)
