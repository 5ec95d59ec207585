"""The three things that every format yields: channels with times, events, and what the file says of trials."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from operator import itemgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.layout import UNIT_WORDS
from isiw.lazy import pd
from isiw.types import FloatArray

PIECE: Final = 2**20  # so many samples are in memory at once if a whole channel is looked through
APART_S: Final = 100.0
"""Sweeps without a time of their own, and what a pause of unknown length separates, are so far apart."""

_ROWS: Final = 2**20
"""So many rows are read of a file beside a recording; without a number pandas opens files of the system."""

_SAME: Final = 1.5
"""An event of a channel of codes is one that is noted, too, if both have one name, and so many samples between them."""


class Stretch(NamedTuple):
    """Samples without a gap: the first one, how many, and when the first one was taken [s]."""

    first: int
    samples: int
    start_s: float


def parted(
    cuts: Iterable[int], samples: int, rate_hz: float, missing_s: Mapping[int, float] = MappingProxyType({})
) -> tuple[Stretch, ...]:
    """Samples as stretches: before those at cuts something is missing, for `APART_S` if it is not known how long."""
    found, first, start_s = list[Stretch](), 0, 0.0
    for at in sorted({*cuts, samples}):
        if first < at <= samples:
            found.append(Stretch(first, at - first, start_s))
            first, start_s = at, start_s + (at - first) / rate_hz + (missing_s.get(at) or APART_S)
    return tuple(found)


def time_of(sample: float, stretches: Sequence[Stretch], rate_hz: float) -> float:
    """When a sample was taken, which may be between two of them [s]."""
    stretch = next((one for one in reversed(stretches) if one.first <= sample + 0.5), Stretch(0, 0, 0.0))
    return stretch.start_s + (sample - stretch.first) / rate_hz


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
        known = UNIT_WORDS.get(str(said).strip().casefold())
        if known is None or known == UNIT_WORDS.get(self.unit.strip().casefold(), known):
            return replace(self, unit=self.unit or known or "")
        return replace(self, unit=f"{self.unit} in one place, and {said} in another")

    def at(self, time_s: float) -> Stretch | None:
        """The stretch that a time is in; None in a gap."""
        slack_s = 0.5 / self.rate_hz
        for stretch in self.stretches:
            if stretch.start_s - slack_s <= time_s < stretch.start_s + stretch.samples / self.rate_hz + slack_s:
                return stretch
        return None

    def cut(self, stretch: Stretch, begin_s: float, end_s: float) -> tuple[float, FloatArray]:
        """What one stretch has between two times: when its first sample was taken [s], and its numbers."""
        first = round((begin_s - stretch.start_s) * self.rate_hz)
        last = first + round((end_s - begin_s) * self.rate_hz)
        first, last = max(0, first), max(0, min(last, stretch.samples))
        return stretch.start_s + first / self.rate_hz, self.read(stretch.first + first, stretch.first + last)

    def pieces(self) -> Iterator[tuple[Stretch, int, FloatArray]]:
        """The numbers of all stretches, some at a time: the stretch, which of its samples comes first, and they."""
        for stretch in self.stretches:
            for begin in range(0, stretch.samples, PIECE):
                end = min(begin + PIECE, stretch.samples)
                yield stretch, begin, self.read(stretch.first + begin, stretch.first + end)

    def onsets_s(self) -> list[float]:
        """When a trigger leaves the level at which it mostly is [s]; raise if it is as long at the other one."""
        ends = [(values.min(), values.max()) for _, _, values in self.pieces()]
        middle = (min(low for low, _ in ends) + max(high for _, high in ends)) / 2 if ends else 0.0
        rises, falls, high = list[float](), list[float](), 0
        for stretch, begin, values, before in self._with_last():
            above = values > middle
            high += int(above.sum())
            turns = np.diff(above.astype(np.int8), prepend=np.int8((values[0] if before is None else before) > middle))
            for times, turn in ((rises, 1), (falls, -1)):
                times += [stretch.start_s + (begin + int(at)) / self.rate_hz for at in np.flatnonzero(turns == turn)]
        spans_s = np.diff(sorted([*rises, *falls]))
        if len(spans_s) > 2 and 0.5 < np.median(spans_s[0::2]) / np.median(spans_s[1::2]) < 2:
            raise InvalidValueError(
                f"the trigger {self.name!r} is about as long at one level as at the other, so that it cannot be known "
                "which of its edges are stimuli",
                got=f"{len(rises)} edges up and {len(falls)} down",
                remedy="Export events in its place, or a trigger that is short for each stimulus.",
            )
        return falls if 2 * high > sum(stretch.samples for stretch in self.stretches) else rises

    def codes(self) -> list[tuple[float, int]]:
        """When a channel of codes rises, as a trigger does [s], and to which code.

        One that rises while another lasts adds its bits to it: where these bits have come alone, they are the code.
        """
        found = list[tuple[float, int, int]]()
        for stretch, begin, values, last in self._with_last():
            codes = np.rint(values).astype(np.int64)
            steps = np.diff(codes, prepend=codes[0] if last is None else round(last))
            found += [
                (stretch.start_s + (begin + int(at)) / self.rate_hz, int(codes[at]), int(codes[at] - steps[at]))
                for at in np.flatnonzero(steps > 0)
            ]
        alone = {code for _, code, before in found if before == 0}
        return [
            (at, code ^ before if before & code == before and code not in alone and code ^ before in alone else code)
            for at, code, before in found
            if code > 0
        ]

    def _with_last(self) -> Iterator[tuple[Stretch, int, FloatArray, float | None]]:
        """The numbers of all stretches, some at a time, and the last number before them in the same stretch."""
        last = None
        for stretch, begin, values in self.pieces():
            yield stretch, begin, values, last if begin else None
            last = float(values[-1])


def text_of(*values: Any) -> str:
    """What an event is called, by its texts and codes; a whole number has no decimal sign."""
    each = (value.decode("utf-8", "replace") if isinstance(value, bytes) else value for value in values)
    return " ".join(
        f"{value:.15g}" if isinstance(value, int | float | np.number) else f"{value}" for value in each
    ).strip()


def events_of(rows: Iterable[Sequence[Any]]) -> pd.DataFrame:
    """Events as a table, by their times: what each is called, when it was [s], and how long it lasted [s]."""
    return pd.DataFrame(sorted(map(tuple, rows), key=itemgetter(1)), columns=["name", "onset", "duration"])


def with_codes(rows: Sequence[tuple[str, float, float]], tracks: Iterable[Track]) -> pd.DataFrame:
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
    notes: tuple[str, ...] = ()  # what the operator should know of how it was read

    def with_bids(self, path: Path) -> Contents:
        """The same with the events and the units of channels that BIDS has in files beside a recording."""
        channels, events = (_beside(path, what) for what in ("channels", "events"))
        units = {
            str(name): unit for name, unit in zip(channels.get("name", ()), channels.get("units", ()), strict=False)
        }
        tracks = tuple(one.with_unit(units.get(one.name)) for one in self.tracks)
        if not len(events):
            return replace(self, tracks=tracks)
        if "sample" in events and tracks:
            off = (events["onset"] * tracks[0].rate_hz - events["sample"]).abs().median()
            if off > 0.1 * tracks[0].rate_hz:
                raise InvalidValueError(
                    f"the onsets of events beside {self.source} are not those of their samples",
                    got=f"a difference of {off:.0f} samples",
                    expected=f"seconds, at {tracks[0].rate_hz:g} Hz",
                    remedy="Correct the onsets, or the samples, in the file of events.",
                )
        named = [
            events[column] for column in ("trial_type", "value") if column in events and events[column].notna().any()
        ]
        names = [text_of(each) for each in named[0]] if named else ""
        return replace(self, tracks=tracks, events=events.assign(name=names))


def _beside(path: Path, what: str) -> pd.DataFrame:
    """A table that BIDS has beside a recording; an empty one if there is none."""
    beside = path.with_name(f"{path.stem.rpartition('_')[0]}_{what}.tsv")
    if not (beside.is_file() and "_" in path.stem):
        return pd.DataFrame()
    return pd.read_csv(beside, sep="\t", na_values=["n/a"], nrows=_ROWS)
