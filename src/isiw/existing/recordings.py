"""Recordings of EMG with events: MNE reads them, events say when pulse and tap came, and each sweep is judged."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.delivered import Delivered, anywhere, renumbered
from isiw.existing.frames import named, reading
from isiw.existing.layout import Layout
from isiw.existing.tables import Columns, require_one
from isiw.lazy import pd
from isiw.signals.judgement import judge
from isiw.signals.limits import EMG_UNITS_MV, SignalLimits
from isiw.text.named_code import library
from isiw.trials import Channel, Stimulus, Sweep, Trial
from isiw.types import FloatArray

SUFFIXES: Final = {".vhdr", ".edf", ".bdf", ".fif", ".set", ".cnt", ".gdf", ".mff"}

_KNOWN: Final[Mapping[str, tuple[str, ...]]] = {
    "pulse": ("tms", "pulse", "tmspulse", "magneticpulse"),
    "tap": ("tap", "impact", "hit", "electricalpulse", "conditioning", "pns"),
    "valve": ("valve", "valvecommand"),
}
"""What events are called that need not be named, without blanks."""

_BEFORE_MS: Final = 150.0
_AFTER_MS: Final = 100.0
"""What is cut out of a continuous recording: from so long before the longest ISI to so long after the pulse."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording in memory: EMG and acceleration by name, and events by what they are called [s]."""

    channels: Mapping[str, Channel]
    events: pd.DataFrame
    source: str

    def at_s(self, name: str) -> FloatArray:
        """When the events of a name were [s], ascending."""
        chosen = self.events.loc[self.events["name"] == name, "onset"]
        return np.sort(chosen.to_numpy(dtype=np.float64))


def read_recording(path: Path, layout: Layout, subject: str) -> Delivered:
    """The trials of a recording of one person."""
    mne, is_epochs = library("mne", "import"), re.search(r"epo\.fif(\.gz)?$", path.name)
    read = mne.read_epochs if is_epochs else partial(mne.io.read_raw, preload=True)
    remedy = "Are all of its files in one folder, and is it continuous?"
    with reading(path, "the recording cannot be read", remedy):
        found = read(path, verbose="ERROR")
    if is_epochs:
        return of_epochs(found, layout, subject, path.name)
    return of_raw(found, layout, subject, path.name, _bids_events(path))


def of_raw(
    raw: Any, layout: Layout, subject: str, source: str = "the recording", events: pd.DataFrame | None = None
) -> Delivered:
    """The trials of an `mne.io.Raw`; its annotations say when the stimuli came, or a table of events."""
    recording = Recording(_channels(raw, layout, source), _annotated(raw) if events is None else events, source)
    return delivered_of(recording, sweeps_of(recording, layout), layout, subject)


def of_epochs(epochs: Any, layout: Layout, subject: str, source: str = "the epochs") -> Delivered:
    """The trials of `mne.Epochs` about the pulse, whose metadata have the ISIs."""
    layout.required_reference(source)
    if epochs.metadata is None:
        raise InvalidValueError(f"{source} do not hold the ISIs", expected="a column isi_ms in their metadata")
    told = replace(layout, alone="") if layout.alone is None else layout
    columns = Columns.found(named(epochs.metadata), told, f"the metadata of {source}", needed=("isi",))
    name = _channel_name(epochs, "emg", layout, source)
    values_mv = _factor_mv(epochs, name, layout, source) * epochs.get_data(picks=[name], verbose="ERROR")[:, 0]
    rate_hz, t0_ms = float(epochs.info["sfreq"]), 1e3 * float(epochs.tmin)
    channels = [Channel(emg_mv, rate_hz, "mV", t0_ms) for emg_mv in values_mv]
    return of_sweeps(channels, columns, told, subject, source)


def of_sweeps(channels: Sequence[Channel], columns: Columns, layout: Layout, subject: str, source: str) -> Delivered:
    """The trials of sweeps whose clocks begin at the pulse, with columns that say what each one is."""
    begin = "t_hit_ms" if layout.required_reference(source) == "impact" else "t_valve_ms"
    rows = range(columns.rows)
    columns.require_said(rows, layout.alone)
    for key, what in (("subject", "people"), ("day", "days")):
        several = {columns[key].text(row): None for row in rows}
        if len(several) > 1:
            raise InvalidValueError(
                f"the sweeps of {source} are of several {what}",
                got=f"{columns[key].name} {', '.join(several)}",
                remedy="Analyse those of each by themselves.",
            )
    sweeps: list[Found] = []
    for row, emg in zip(rows, channels, strict=True):
        if columns.tap_alone(row):
            raise columns["isi"].refused(row, "is of a tap alone, whose sweep has no pulse", "Leave that sweep out.")
        isi_ms = None if columns.tms_alone(row, layout.alone) else columns["isi"].number(row)
        begins: dict[str, Any] = {begin: None if isi_ms is None else -isi_ms}
        meant = Stimulus(row, None if isi_ms is None else max(isi_ms, 0.0))
        said = {"excluded": columns.lost(row) is not None}
        sweeps.append((meant, Sweep({"emg": emg}, t_tms_ms=0.0, **begins), said))
    person = next(iter({columns["subject"].text(row) for row in rows}), "") or subject
    found = delivered_of(Recording({}, pd.DataFrame(), source), sweeps, layout, person)
    return replace(found, unused=columns.unused)


Found = tuple[Stimulus, Sweep, Mapping[str, Any]]


def delivered_of(recording: Recording, sweeps: Sequence[Found], layout: Layout, subject: str) -> Delivered:
    """The sweeps as trials, judged as in a session."""
    reference = layout.required_reference(recording.source)
    signals = SignalLimits() if layout.mep_window_ms is None else SignalLimits(mep_window_ms=layout.mep_window_ms)
    trials: list[Trial] = []
    for stimulus, sweep, said in sweeps:
        judged = judge(sweep, stimulus, anywhere(reference), signals)
        trials.append(replace(judged, excluded=said.get("excluded") in {True, "true", "True"}))
    if trials and not any(trial.told for trial in trials):
        reasons = sorted({str(trial.reason) for trial in trials if trial.reason})
        raise InvalidValueError(
            f"no sweep of {recording.source} counts",
            got=", ".join(reasons),
            remedy="Is the EMG channel the right one, its unit right, and the marker of the pulse? Is the EMG at rest "
            f"without mains hum, at most {signals.background_uv:g} µV RMS? See docs/timing.md.",
        )
    return Delivered(
        renumbered(trials),
        reference,
        subject=subject,
        source=recording.source,
        signals=signals,
        units=("ms", layout.unit_of(EMG_UNITS_MV) or "mV"),
        sweeps={number: sweep.channels for number, (_, sweep, _) in enumerate(sweeps)},
    )


def _channels(raw: Any, layout: Layout, source: str) -> dict[str, Channel]:
    """EMG in mV, and the acceleration if it is named."""
    name, rate_hz = _channel_name(raw, "emg", layout, source), float(raw.info["sfreq"])
    channels = {"emg": Channel(_factor_mv(raw, name, layout, source) * raw.get_data(picks=[name])[0], rate_hz, "mV")}
    if "acceleration" in layout.channels:
        other = _channel_name(raw, "acceleration", layout, source)
        channels["acceleration"] = Channel(raw.get_data(picks=[other])[0], rate_hz, "V")
    return channels


def _channel_name(raw: Any, key: str, layout: Layout, source: str) -> str:
    names = list(raw.ch_names)
    stated = layout.channels.get(key)
    if stated is not None:
        require_one("channel", source, stated, names)
        return stated
    kinds = dict(zip(names, raw.get_channel_types(), strict=True))
    fitting = [name for name in names if kinds[name] == key] or [name for name in names if key in name.casefold()]
    fitting = fitting or [name for name in names if kinds[name] not in {"stim", "misc"}]
    if len(fitting) != 1:
        raise InvalidValueError(
            f"several channels of {source}, or none, may hold the EMG",
            got=", ".join(names),
            remedy=f'Say --channel "{key}={(fitting or names)[0]}".',
        )
    return str(fitting[0])


def _factor_mv(raw: Any, name: str, layout: Layout, source: str) -> float:
    """By what the numbers of MNE are multiplied to be in mV; they are in V, if the file says in which unit it is."""
    known = getattr(raw, "_orig_units", {}).get(name, "V")
    if known and known != "n/a":
        return 1e3
    unit = layout.unit_of(EMG_UNITS_MV)
    if unit is None:
        raise InvalidValueError(
            f"the unit of the channel {name!r} of {source} is not stated", remedy="Say --unit with mV, uV or V."
        )
    return EMG_UNITS_MV[unit]


def _annotated(raw: Any) -> pd.DataFrame:
    mne = library("mne", "import")
    said = raw.annotations
    rows = [(str(one["description"]), float(one["onset"]) - raw.first_time, float(one["duration"])) for one in said]
    if not rows and "stim" in raw.get_channel_types():
        found = mne.find_events(raw, shortest_event=1, verbose="ERROR")
        rate_hz = raw.info["sfreq"]
        rows = [(str(code), (sample - raw.first_samp) / rate_hz, 0.0) for sample, _, code in found.tolist()]
    return pd.DataFrame(rows, columns=["name", "onset", "duration"])


def _bids_events(path: Path) -> pd.DataFrame | None:
    """The events that BIDS has beside a recording; None if there are none."""
    beside = path.with_name(f"{path.stem.rpartition('_')[0]}_events.tsv")
    if not beside.is_file() or beside.name == "_events.tsv":
        return None
    frame = pd.read_csv(beside, sep="\t", na_values=["n/a"])
    return frame.rename(columns={"trial_type": "name"} if "trial_type" in frame else {"value": "name"})


def _marker(recording: Recording, key: str, layout: Layout) -> str | None:
    """The name of the events that mark something; None if none of them does."""
    names = [str(name) for name in dict.fromkeys(recording.events["name"])]
    if (stated := layout.markers.get(key)) is None:
        return next((name for name in names if _plain(name) in _KNOWN[key]), None)
    fitting = [name for name in names if stated == name] or [name for name in names if _plain(stated) == _plain(name)]
    if len(fitting) != 1:
        what = "several events" if fitting else "no event"
        expected = f"one of {', '.join(map(repr, names))}"
        raise InvalidValueError(f"{recording.source} has {what} of this name", got=stated, expected=expected)
    return fitting[0]


def _plain(name: str) -> str:
    """An event's name without what BrainVision puts before it and between its parts."""
    return "".join(name.rpartition("/")[2].casefold().split())


def _required_markers(recording: Recording, marked: Mapping[str, str], layout: Layout) -> list[str]:
    """The names of the events that mark several things."""
    found = {key: _marker(recording, key, layout) for key in marked}
    missing = [key for key, name in found.items() if name is None]
    if missing:
        names = ", ".join(repr(str(name)) for name in dict.fromkeys(recording.events["name"]))
        said = " ".join(f"--marker {key}=NAME" for key in missing)
        raise InvalidValueError(
            f"no event of {recording.source} is known to mark {', nor '.join(marked[key] for key in missing)}",
            got=names or "no events",
            remedy=f"Say {said}." if names else "Is there a file with the events beside it?",
        )
    return [name for name in found.values() if name is not None]


def sweeps_of(recording: Recording, layout: Layout) -> list[Found]:
    """A stretch of the recording for each pulse, with what came before it."""
    key = "tap" if layout.required_reference(recording.source) == "impact" else "valve"
    what = "the tap (its impact) or the electrical pulse" if key == "tap" else "the valve command"
    pulse, origin = _required_markers(recording, {"pulse": "the pulse of TMS", key: what}, layout)
    if origin == pulse:
        raise InvalidValueError(
            f"one event of {recording.source} cannot mark both stimuli", got=pulse, remedy=f"Say --marker {key}=NAME."
        )
    pulses_s, origins_s = recording.at_s(pulse), recording.at_s(origin)
    epochs = recording.events[recording.events["name"] == "sweep"]
    before_s = _BEFORE_MS / 1e3 + max(
        (_after_s(origins_s, pulse_s, layout) or 0.0 for pulse_s in pulses_s), default=0.0
    )
    found = []
    for number, pulse_s in enumerate(pulses_s.tolist()):
        epoch = epochs[(epochs["onset"] <= pulse_s) & (pulse_s < epochs["onset"] + epochs["duration"])]
        said: Mapping[str, Any] = epoch.iloc[0].to_dict() if len(epoch) else {}
        begin_s = float(said["onset"]) if said else pulse_s - before_s
        last_s = begin_s + float(said["duration"]) if said else pulse_s + _AFTER_MS / 1e3
        isi_s = _after_s(origins_s[origins_s >= begin_s - 1e-9] if said else origins_s, pulse_s, layout)
        origin_s = None if isi_s is None else pulse_s - isi_s
        sweep = _cut(recording.channels, (begin_s, last_s), pulse_s, origin_s, key)
        isi_ms = None if isi_s is None else 1e3 * isi_s
        if _is_bad(recording.events, min(pulse_s - _BEFORE_MS / 1e3, origin_s or pulse_s), pulse_s):
            said = {**said, "excluded": True}
        asked = said.get("commanded_isi_ms")
        commanded_ms = isi_ms if asked is None or isi_ms is None or asked != asked else float(asked)  # noqa: PLR0124
        found.append((Stimulus(number, commanded_ms), sweep, said))
    if any(after - before < _AFTER_MS / 1e3 for before, after in pairwise(pulses_s)):
        raise InvalidValueError(
            f"two pulses of {recording.source} are less than {_AFTER_MS:g} ms apart",
            remedy="Is the marker of the pulse the right one? Say --marker pulse=NAME.",
        )
    return found


def _is_bad(events: pd.DataFrame, begin_s: float, pulse_s: float) -> bool:
    """True if an annotation that MNE takes for one of bad data overlaps what is judged of a sweep."""
    bad = events[events["name"].astype(str).str.lower().str.startswith("bad")]
    last_s = pulse_s + _AFTER_MS / 1e3
    return bool(((bad["onset"] <= last_s) & (bad["onset"] + bad["duration"] >= begin_s)).any())


def _after_s(origins_s: FloatArray, pulse_s: float, layout: Layout) -> float | None:
    """The time from the last tap to a pulse [s]; None if that is longer than an ISI."""
    before = origins_s[(origins_s <= pulse_s) & (origins_s >= pulse_s - layout.longest_isi_ms / 1e3)]
    return float(pulse_s - before[-1]) if len(before) else None


def _cut(
    channels: Mapping[str, Channel], span_s: tuple[float, float], pulse_s: float, origin_s: float | None, key: str
) -> Sweep:
    """A stretch of all channels, whose clock begins at its first sample."""
    cut = {}
    rate_hz = channels["emg"].rate_hz
    first = max(0, round(span_s[0] * rate_hz))
    last = round(span_s[0] * rate_hz) + round((span_s[1] - span_s[0]) * rate_hz)
    for name, channel in channels.items():
        cut[name] = replace(channel, values=channel.values[first:last])
    start_s = first / rate_hz
    origin_ms = None if origin_s is None else 1e3 * (origin_s - start_s)
    begin: dict[str, Any] = {"t_valve_ms" if key == "valve" else "t_hit_ms": origin_ms}
    return Sweep(cut, t_tms_ms=1e3 * (pulse_s - start_s), **begin)
