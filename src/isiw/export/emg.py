"""The sweeps of a session as BIDS has EMG: end to end in a BDF file ("epoched"), with what was when in each.

Nothing is made up for the seconds between them. Sweeps of different channels, rates or lengths are different runs.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final, NamedTuple

import numpy as np

from isiw.log.frames import TRIAL_COLUMNS, meanings
from isiw.log.record import SessionRecord
from isiw.sweeps import Channel
from isiw.text.named_code import library
from isiw.text.stimuli import TAP, StimulusWords
from isiw.trials import Stimulus, Trial
from isiw.types import FloatArray

EMG: Final = "emg"
"""The channel whose sweeps are exported, with whatever was recorded along with it."""

_EVENT_COLUMNS: Final[Mapping[str, tuple[str, str]]] = {
    "onset": ("s", "when it was, in the file"),
    "duration": ("s", "how long it lasted; 0 for a moment"),
    "trial_type": ("", "sweep: a trial's waveforms; and in it {valve}{0.name}: the {0.moment}, tms: the {0.pulse}"),
    "trial": ("", "the number of the trial"),
    "condition": ("", "paired, TMS alone or {0.alone}; unknown if its record is lost"),
    **{name: TRIAL_COLUMNS[name] for name in ("commanded_isi_ms", "isi_ms", "status", "reason", "excluded", "mep_mv")},
    "session_s": ("s", "when the trial was, since the first stimulus of the log"),
}
_SHORTEST_RECORD_S: Final = 1e-4
_LARGEST: Final = 1e7
"""More than a BDF file has room for, in whatever unit; what is not finite is not below it either."""

_LABEL: Final = 16
"""Most characters of a channel's name in a BDF file."""

_ASCII_UNITS: Final = {"µV": "uV", "μV": "uV", "m/s²": "m/s^2", "°C": "oC"}


class Layout(NamedTuple):
    """The common layout of the sweeps of one run."""

    rate_hz: float
    samples: int
    channels: tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class Run:
    """Sweeps of one layout, end to end: (trials · samples,) for each channel."""

    layout: Layout
    trials: tuple[Trial, ...]
    starts_ms: tuple[float, ...]  # the first sample of each, on the sweep's own clock
    values: tuple[FloatArray, ...]
    first: StimulusWords = TAP  # what the conditioning stimulus is called

    @property
    def sweep_s(self) -> float:
        """The duration of a sweep [s]."""
        return self.layout.samples / self.layout.rate_hz

    @property
    def channels(self) -> list[dict[str, Any]]:
        """The rows of `_channels.tsv`."""
        return [
            {
                "name": label,
                "type": {EMG: "EMG", "valve": "TRIG"}.get(name, "MISC"),
                "units": _unit(unit),
                "description": name,
                "sampling_frequency": self.layout.rate_hz,
            }
            for label, (name, unit) in zip(_labels(self.layout), self.layout.channels, strict=True)
        ]

    @property
    def event_columns(self) -> dict[str, tuple[str, str]]:
        """Unit and meaning of what is said about a moment of a sweep."""
        has_valve = self.first.by_valve or any(trial.t_valve_ms is not None for trial in self.trials)
        return meanings(_EVENT_COLUMNS, self.first, valve="valve: the valve command, " if has_valve else "")

    def events(self, onsets_s: Mapping[int, float]) -> list[dict[str, Any]]:
        """The rows of `_events.tsv`, as in `event_columns`."""
        rows = [
            moment | _facts(trial, self.first) | {"session_s": onsets_s.get(trial.index)}
            for number, (trial, start_ms) in enumerate(zip(self.trials, self.starts_ms, strict=True))
            for moment in self._moments(number, trial, start_ms)
        ]
        return sorted(rows, key=lambda row: float(row["onset"]))

    def _moments(self, number: int, trial: Trial, start_ms: float) -> Iterable[dict[str, Any]]:
        begin_s = number * self.sweep_s
        yield {"onset": begin_s, "duration": self.sweep_s, "trial_type": "sweep"}
        moments = ("valve", trial.t_valve_ms), (self.first.name, trial.t_hit_ms), ("tms", trial.t_tms_ms)
        for kind, at_ms in moments:
            within_s = math.nan if at_ms is None else (at_ms - start_ms) / 1e3
            if 0 <= within_s < self.sweep_s:
                yield {"onset": begin_s + within_s, "duration": 0, "trial_type": kind}


def _facts(trial: Trial, first: StimulusWords) -> dict[str, Any]:
    kind = "TMS alone" if trial.is_control else "unknown" if trial.commanded_isi_ms is None else "paired"
    return {
        "trial": trial.index,
        "condition": first.alone if trial.tap_alone else kind,
        "commanded_isi_ms": trial.commanded_isi_ms,
        "isi_ms": trial.isi_ms,
        "status": str(trial.status),
        "reason": None if trial.reason is None else str(trial.reason),
        "excluded": trial.excluded,
        "mep_mv": trial.mep_mv,
    }


def runs(record: SessionRecord) -> tuple[list[Run], list[str]]:
    """The sweeps of a session by their layout, and a sentence for what is not among them."""
    trials = {trial.index: trial for trial in record.table}
    commanded = {intent.trial: (intent.isi_ms, intent.tap_alone) for intent in record.intents}
    of_layout: dict[Layout, list[tuple[Trial, Mapping[str, Channel]]]] = {}
    left_out: dict[tuple[str, bool], list[int]] = {}
    for number in sorted({number for number, _ in record.waveforms}):
        sweep = record.sweep(number)
        channels, others = _side_by_side(sweep)
        for name in others:
            left_out.setdefault((name, EMG in sweep), []).append(number)
        if channels:
            trial = trials.get(number) or Trial.unknown(Stimulus(number, *commanded.get(number, (None, False))))
            emg, ordered = channels[EMG], sorted(channels, key=lambda name: (name != EMG, name))
            layout = Layout(emg.rate_hz, len(emg.values), tuple((name, channels[name].unit) for name in ordered))
            of_layout.setdefault(layout, []).append((trial, channels))
    return [_run(layout, sweeps, record.header.stimulus) for layout, sweeps in of_layout.items()], _sentences(left_out)


def _side_by_side(sweep: Mapping[str, Channel]) -> tuple[dict[str, Channel], list[str]]:
    """The EMG and what was recorded along with it, sample by sample, and the names of other channels."""
    emg = sweep.get(EMG)
    fitting = {name: channel for name, channel in sweep.items() if emg is not None and _fits(channel, emg)}
    channels = fitting if EMG in fitting else {}
    return channels, [name for name in sweep if name not in channels]


def _fits(channel: Channel, emg: Channel) -> bool:
    shape = (channel.rate_hz, channel.t0_ms, len(channel.values))
    if shape != (emg.rate_hz, emg.t0_ms, len(emg.values)) or not len(emg.values):
        return False
    return (
        bool((np.abs(channel.values) < _LARGEST).all())
        and _record_samples(channel.rate_hz, len(emg.values)) is not None
    )


def _run(layout: Layout, sweeps: Sequence[tuple[Trial, Mapping[str, Channel]]], first: StimulusWords) -> Run:
    values = [np.concatenate([channels[name].values for _, channels in sweeps]) for name, _ in layout.channels]
    starts_ms = tuple(channels[EMG].t0_ms for _, channels in sweeps)
    return Run(layout, tuple(trial for trial, _ in sweeps), starts_ms, tuple(values), first)


def _sentences(left_out: Mapping[tuple[str, bool], Sequence[int]]) -> list[str]:
    """Sentences about what is left out: the numbers of the trials by the channel, and whether the trial has EMG."""
    unlike = "it is not finite or too large, or has not the EMG's rate, begin and length"
    return [
        f"The channel {name} is not in the EMG file in {len(numbers)} trials (first {numbers[0]}): "
        f"{unlike if has_emg else 'there is no EMG'}."
        for (name, has_emg), numbers in left_out.items()
    ]


def bdf(run: Run) -> bytes:
    """A BDF file of the sweeps, end to end; the last sample is repeated if the last record needs filling."""
    edfio = library("edfio", "bids")
    samples = _record_samples(run.layout.rate_hz, run.layout.samples) or run.layout.samples
    duration_s = round(samples / run.layout.rate_hz, 6)
    labels, filled = _labels(run.layout), [np.pad(x, (0, -len(x) % samples), mode="edge") for x in run.values]
    signals = []
    for values, label, (_, unit) in zip(filled, labels, run.layout.channels, strict=True):
        low, high = float(values.min()), float(values.max())
        span = None if low < high else (low - 1.0, high + 1.0)
        signal = edfio.BdfSignal(
            values, samples / duration_s, label=label, physical_dimension=_unit(unit), physical_range=span
        )
        signals.append(signal)
    file = io.BytesIO()
    edfio.Bdf(signals, data_record_duration=duration_s).write(file)
    return file.getvalue()


def _record_samples(rate_hz: float, sweep: int) -> int | None:
    """Samples in a record of the file, whose duration must be written in eight digits; None if that cannot be."""
    rate = Fraction(rate_hz).limit_denominator(1000)
    if abs(float(rate) - rate_hz) > 1e-9 * rate_hz:
        return None
    fewest = rate.numerator // math.gcd(rate.numerator, 10**6 * rate.denominator)
    fewest *= math.ceil(_SHORTEST_RECORD_S * rate_hz / fewest)
    for samples in (sweep, fewest):
        written_s = str(round(float(samples / rate), 6))
        if len(written_s) <= 8 and "e" not in written_s and Fraction(written_s) == samples / rate:
            return samples
    return None


def _unit(unit: str) -> str:
    """A unit as both files have it: in ASCII."""
    ascii_unit = _ASCII_UNITS.get(unit, unit).encode("ascii", "replace").decode()
    return "".join(sign if sign.isprintable() else "?" for sign in ascii_unit.strip())[:8]


def _labels(layout: Layout) -> list[str]:
    """The channels' names, where a BDF file can hold them, else their numbers."""
    names = [name for name, _ in layout.channels]
    return [
        name if name.isascii() and name.isprintable() and len(name) <= _LABEL else f"channel {number}"
        for number, name in enumerate(names)
    ]
