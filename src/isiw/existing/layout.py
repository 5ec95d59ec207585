"""The layout of files of other programs: which column, marker or channel is what, by the words of several languages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

from isiw.checks import Checked, Natural, NonNegative, Positive, Text, choice
from isiw.design import missing_reference
from isiw.errors import InvalidValueError
from isiw.signals.limits import EMG_UNITS_MV
from isiw.text.toml_files import checked, read_toml
from isiw.types import Reference

ISI_UNITS_MS: Final[Mapping[str, float]] = {"ms": 1.0, "s": 1e3, "us": 1e-3, "µs": 1e-3, "μs": 1e-3}
EMG_UNITS: Final[Mapping[str, float]] = {**EMG_UNITS_MV, "nV": 1e-6}  # in mV
_FOUND: Final = {kind: {key: tuple(" ".join(word.split()) for word in text.split(",")) for key, text in texts.items()}
                 for kind, texts in read_toml(Path(__file__).with_name("words.toml")).items()}  # fmt: skip
UNIT_WORDS: Final[Mapping[str, str]] = {word: unit for unit, words in _FOUND["units"].items() for word in words}
_MEP, _SIZE, _WHOLE, _WITH_MEP = _FOUND["amplitudes"].values()


def _joined(ones: Sequence[str], others: Sequence[str]) -> tuple[str, ...]:
    return tuple(word for one in ones for other in others for word in (one + other, other + one))


_BARE: Final = (*_SIZE, *_WHOLE, *_joined(_SIZE, _WHOLE))
_OF_MEPS: Final = (*_MEP, *_joined(_MEP, (*_BARE, *_WITH_MEP, *_joined(_SIZE, _WITH_MEP))),
                   *_joined(_WHOLE, _joined(_MEP, _SIZE)), *_BARE)  # fmt: skip
COLUMNS: Final[Mapping[str, tuple[str, ...]]] = {**_FOUND["columns"], "mep": _OF_MEPS}
_FOUND["words"]["vague"] += _BARE
WORDS: Final[Mapping[str, frozenset[str]]] = {kind: frozenset(words) for kind, words in _FOUND["words"].items()}
MARKS: Final[Mapping[str, tuple[str, str]]] = {
    "pulse": ("the pulse of TMS", "tms pulse tmspulse magneticpulse"),
    "tap": ("the tap (its impact) or the electrical pulse", "tap impact hit schlag electricalpulse conditioning pns"),
    "valve": ("the valve command", "valve valvecommand"),
    "alone": ("TMS alone", "tmsalone tmsonly singlepulse pulsealone unconditioned"),
}
"""What is marked, in words, and what events of it are called that need not be named, without blanks."""
MARKERS: Final = tuple(MARKS)
CHANNELS: Final = ("emg", "acceleration", "events", *MARKERS)
"""What columns and arrays of a recording hold: those of `MARKERS` are triggers, that of events has texts."""


@lru_cache(2**16)  # in a long table most cells are like others
def plain(text: str) -> str:
    """A text in lower case, with blanks for hyphens and underscores."""
    return " ".join(re.split(r"[\s_-]+", text.strip().casefold()))


def letters(name: str) -> str:
    """A column's name in letters alone, without its unit."""
    words = re.findall(r"[^\W_]+", re.sub(r"[\[(][^][()]*[\])]", " ", name.casefold()))
    while len(words) > 1 and (words[-1] in UNIT_WORDS or words[-1] == "in"):
        words.pop()
    return "".join(words)


def unit_named(word: object) -> str | None:
    """The unit that a word is, if it is known."""
    return UNIT_WORDS.get(str(word).strip().casefold())


def unit_in(name: str) -> str | None:
    """The first unit among the words of a name."""
    return next(filter(None, map(unit_named, re.findall(r"[^\W_]+", name))), None)


@dataclass(frozen=True)
class Layout(Checked):
    """The layout of a file; what is not stated is found, or asked for.

    Args:
        reference: the event that ISIs count from, `"impact"` (of the hammer, or an electrical pulse) or `"valve"`.
        columns: the name of a column by what it holds, one of `COLUMNS`.
        where: by the name of a column, what its cells say in the rows to read, such as `FCR` of `muscle`; `*` for any.
            Of a recording, by `event` the name of an event before the pairs to read; `*` by a channel's name if its
            header is wrong.
        units: the units of columns whose names do not say theirs, such as `("ms", "mV")`.
        alone: what stands in the place of the ISI of TMS alone, such as `"single"` or `"-1"`; `""` is an empty cell.
        decimal: the decimal sign, `"."` or `","`.
        separator: what separates two cells of a text file.
        skip_lines: how many lines come before the one with the columns' names.
        names: the columns' names, if no line of the file holds them.
        sheet: the sheet of a workbook; by default the first one.
        markers: of a recording, the name of an event by what it marks: `pulse` (of TMS), `tap`, `valve`, or `alone` (a
            pulse without a tap); `*` in it stands for anything.
        unmarked: of a recording, what pulses are that no tap comes before: TMS `alone`, or `lost`, since its marker is
            missing; asked for if others have one.
        channels: of a recording, the name of a channel by what it holds: `emg`, `acceleration`; of one in columns of
            text also `events`, whose texts are events, and the triggers `pulse`, `tap` and `valve`.
        rate_hz: the sampling rate of a recording in columns of text, or of sweeps in MATLAB [Hz].
        pulse_at_ms: of sweeps in MATLAB, how long after their first sample the pulse comes [ms].
        longest_isi_ms: the longest ISI [ms]. In a recording a pulse that comes later after a tap has no tap; a table of
            which most are longer is in another unit.
        mep_window_ms: where the MEP of a recording is sought [ms after the pulse]; by default as in a session.
    """

    reference: Reference | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    where: Mapping[str, str] = field(default_factory=dict)
    units: tuple[str, ...] = ()
    alone: Text | None = None
    decimal: Literal[".", ","] | None = None
    separator: str | None = None
    skip_lines: Natural = 0
    names: tuple[str, ...] = ()
    sheet: str | None = None
    markers: Mapping[str, str] = field(default_factory=dict)
    unmarked: Literal["alone", "lost"] | None = None
    channels: Mapping[str, str] = field(default_factory=dict)
    rate_hz: Positive | None = None
    pulse_at_ms: NonNegative | None = None
    longest_isi_ms: Positive = 500.0
    mep_window_ms: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for what, table, known in (("column", self.columns, COLUMNS), ("marker", self.markers, MARKERS),
                                   ("channel", self.channels, CHANNELS)):  # fmt: skip
            for key in table:
                choice(f"what a {what} holds", key, sorted(known))
        for unit in self.units:
            choice("a unit", unit, [*ISI_UNITS_MS, *EMG_UNITS])
        for quantity in (ISI_UNITS_MS, EMG_UNITS):
            if len(several := {*self.units} & quantity.keys()) > 1:
                raise InvalidValueError("two units of one quantity are stated", got=sorted(several), expected="one")
        if len(names := {*self.channels.values()}) < len(self.channels):
            raise InvalidValueError("one channel is stated for two things", got=sorted(names), remedy="Leave one out.")
        if both := sorted(self.markers.keys() & self.channels.keys()):
            raise InvalidValueError(f"both a marker and a channel are stated for {both[0]}", remedy="Leave one out.")

    def required_reference(self, source: str) -> Reference:
        """The event that the ISIs of a file count from, which nobody but the lab knows."""
        if self.reference is None:
            what = f"the event from which the ISIs of {source} count is not stated"
            expected = missing_reference().expected
            raise InvalidValueError(what, expected=expected, remedy="Say --reference impact or --reference valve.")
        return self.reference

    def unit_of(self, known: Mapping[str, float]) -> str | None:
        """The unit that is stated, of those of one quantity."""
        return next((unit for unit in self.units if unit in known), None)

    def saying(self, **values: Any) -> Layout:
        """The same, with what is said besides; of tables, the entries that are given."""
        given = {key: value for key, value in values.items() if value not in (None, (), {})}
        for name in ("columns", "where", "markers", "channels"):
            if name in given:
                given[name] = {**getattr(self, name), **given[name]}
        if "units" in given:
            said = [ISI_UNITS_MS if unit in ISI_UNITS_MS else EMG_UNITS for unit in given["units"]]
            kept = (unit for unit in self.units if not any(unit in known for known in said))
            given["units"] = (*given["units"], *kept)
        return replace(self, **given)


def read_layout(path: str | Path) -> Layout:
    """The layout that a TOML file describes."""
    return checked(Layout, read_toml(path), str(path))


def pairs_of(option: str, texts: Sequence[str]) -> dict[str, str]:
    """The values of an option KEY=NAME, of each time that it is given."""
    parts = [text.partition("=") for text in texts]
    for text, (key, sign, name) in zip(texts, parts, strict=True):
        if not (key and sign and name):
            raise InvalidValueError(f"{option} needs KEY=NAME", got=text, remedy=f'Such as {option} "isi=Delay".')
    return {key.strip(): name for key, _, name in parts}
