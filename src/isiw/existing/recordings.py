"""Recordings of EMG with events: events say when pulse and tap came, a sweep is cut out for each pulse, and judged."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final

import numpy as np

from isiw.errors import InvalidValueError
from isiw.existing.cells import is_missing, required_unit
from isiw.existing.delivered import Delivered, anywhere, renumbered
from isiw.existing.doubtful_numbers import require_plain_isis
from isiw.existing.doubts import is_rectified, require_one_kind_each
from isiw.existing.formats.columns import require_rate
from isiw.existing.formats.contents import APART_S, Contents, Track, events_of
from isiw.existing.frames import named
from isiw.existing.layout import EMG_UNITS, MARKERS, WORDS, Layout, unit_named
from isiw.existing.markers import Pulse, joined, marked, names_of, note_of_others, pulses_of
from isiw.existing.names import ALL, not_as_recorded, require_reference
from isiw.existing.quantities import Columns, isis_of, require_one, unit_said
from isiw.findings import Kind
from isiw.lazy import pd
from isiw.signals.judgement import judge
from isiw.signals.limits import SignalLimits
from isiw.signals.watch import shown_by
from isiw.sweeps import Channel, Sweep
from isiw.text.sanitize import counted
from isiw.trials import Status, Stimulus, Trial
from isiw.types import FloatArray

_BEFORE_S, _AFTER_S = 0.15, 0.1  # of a continuous recording, before the longest ISI and after the pulse
_APART_MS: Final = 2.0  # an ISI in a table that differs by more from that of the events is another one
_QUIET_UV: Final = 0.03  # no electrode has less noise [RMS]
_SLOW_HZ: Final = 1000.0  # a trigger with fewer samples a second is said
_LATEST_MS, _SPREAD_MS = 60.0, 5.0  # a response is not later; ISIs that are nearer to each other tell nothing
_SLOPE, _FITS = 0.2, 0.9  # so near to 1 is the slope of responses by ISIs if they follow the tap
_CLEAR, _EDGE, _FEW = 25.0, 0.4, 3  # an MEP so many times the EMG at rest is cut off if it has so much at an edge
_IF_NONE_COUNTS: Final = (
    "Is the EMG channel the right one, its unit right, and the marker of the pulse? Is the EMG at rest without mains "
    "hum, at most {:g} µV RMS? See docs/timing.md."
)
OF_SWEEPS: Final[Mapping[str, AbstractSet[str]]] = {
    "columns": {"isi", "status", "exclude", "reason", "tap_alone", "tms_alone", "subject", "day", "condition"},
    "channels": {"emg", "tap", "valve"},
    "markers": {"pulse", "tap", "valve"},
}  # what columns, channels and markers can hold that is used of sweeps whose ISIs are stated


def of_contents(contents: Contents, layout: Layout, subject: str) -> Delivered:
    """The trials of what a file holds, whose sweeps are cut already or yet to be cut out, judged as in a session."""
    source, key = contents.source, origin_key(layout)
    contents, tracks, unit = _with_signals(contents, layout)
    signals = {name: track for name, track in tracks.items() if name not in MARKERS}
    reference, unused, person = layout.required_reference(source), tuple[str, ...](), ""
    if contents.trials is None or contents.pulse_at_s is None:
        tapped = tracks.get(key, signals["emg"])
        pulses = _with_the_cut_off(pulses_of(contents.events, key, layout, source), tapped, layout)
        contents = replace(contents, notes=(*contents.notes, *note_of_others(contents.events, layout)))
    else:
        pulses, unused, person = _pulses_of_rows(contents, signals["emg"], layout)
    if any(after.at_s - before.at_s < _AFTER_S for before, after in pairwise(pulses)):
        what = f"two pulses of {source} are less than {1e3 * _AFTER_S:g} ms apart"
        raise InvalidValueError(what, remedy="Is the marker of the pulse the right one? Say --marker pulse=NAME.")
    limits = SignalLimits() if layout.mep_window_ms is None else SignalLimits(mep_window_ms=layout.mep_window_ms)
    longest_s, trials = max((pulse.isi_s or 0.0 for pulse in pulses), default=0.0), list[Trial]()
    seen, sweeps = list[tuple[Sweep, Trial]](), dict[int, Mapping[str, Channel]]()
    bad = contents.events[contents.events["name"].astype(str).str.lower().str.startswith("bad")]  # as MNE takes them
    for number, pulse in enumerate(pulses):
        sweep = _cut(signals, pulse, pulse.at_s - _BEFORE_S - longest_s, key)
        if sweep.channels:
            sweeps[number] = sweep.channels
        for isi_ms in isis_of(pulse.said) if pulse.isi_s is not None else ():
            _require_same(f"the trial at {pulse.at_s:.3f} s of {source}", isi_ms, pulse.isi_s)
        if pulse.lost:
            trials.append(Trial(number, Status.MISTRIAL, None, reason=Kind.NO_IMPACT))
            continue
        asked_ms: Any = pulse.said.get("commanded_isi_ms")  # what the file says, or else what the events do
        asked_ms = max(1e3 * (pulse.isi_s or 0.0), 0.0) if is_missing(asked_ms) else float(asked_ms)
        judged = judge(sweep, Stimulus(number, None if pulse.isi_s is None else asked_ms), anywhere(reference), limits)
        begin_s, end_s = min(pulse.at_s - _BEFORE_S, pulse.origin_s or pulse.at_s), pulse.at_s + _AFTER_S
        is_bad = bool(((bad["onset"] <= end_s) & (bad["onset"] + bad["duration"] >= begin_s)).any())
        trials.append(replace(judged, excluded=is_bad or pulse.said.get("excluded") in {True, "true", "True"}))
        if trials[-1].told:
            seen.append((sweep, judged))
    cut = sum(trial.reason is Kind.MISSING_CHANNEL for trial in trials)
    said = f"{counted(cut, 'pulse')} of {len(trials)} came where no EMG was recorded up to the end of the MEP."
    contents = replace(contents, notes=(*contents.notes, *([said] if cut else [])))
    if trials and not seen:
        got = ", ".join(sorted({str(trial.reason) for trial in trials if trial.reason})) or "excluded ones"
        remedy = " ".join([*contents.notes, _IF_NONE_COUNTS.format(limits.background_uv)])
        raise InvalidValueError(f"no sweep of {source} counts", got=got, remedy=remedy)
    _require_noise(trials, signals["emg"].name, contents, layout)
    if layout.mep_window_ms is None and any(trial.isi_ms is not None for trial in trials):
        _require_within(seen, limits, source)
    apart = ((one.channels["emg"].values, _since_pulse_ms(one)) for one, _ in seen)  # from the artefact of the pulse
    emg = [values[(since_ms < -1) | (since_ms >= limits.mep_window_ms[0])] for values, since_ms in apart]
    return Delivered(
        renumbered(trials),
        reference,
        subject=person or subject,
        source=source,
        signals=limits,
        units=("ms", unit),
        units_by=("", signals["emg"].name if signals["emg"].unit and not contents.unit_is_usual else ""),
        sweeps=sweeps,
        unused=unused,
        notes=(*contents.notes, *is_rectified(emg)),
    )


def _require_noise(trials: Sequence[Trial], emg: str, contents: Contents, layout: Layout) -> None:
    """Raise if EMG whose unit nothing says has less noise than an amplifier in the usual one."""
    rests_uv = [trial.background_rms_uv or np.inf for trial in trials]
    rest_uv = float(np.median(rests_uv)) if rests_uv else np.inf
    if contents.unit_is_usual and layout.unit_of(EMG_UNITS) is None and rest_uv < _QUIET_UV and emg not in layout.where:
        what = f"the EMG of {contents.source} has less noise at rest than any amplifier, in µV as is usual"
        remedy = f'Say --unit mV or --unit V; if it is in µV, say --unit uV, or --where "{emg}={ALL}".'
        raise InvalidValueError(what, got=f"{rest_uv:.2g} µV RMS", remedy=remedy)


def _require_within(seen: Sequence[tuple[Sweep, Trial]], limits: SignalLimits, source: str) -> None:
    """Raise if most responses are not where MEPs are measured, or go on beyond an edge of it, or if there are none."""
    (first_ms, last_ms), responses_ms, usual = limits.mep_window_ms, list[float | None](), False
    for sweep, trial in seen:
        shown, emg, since_ms = shown_by(sweep, trial, limits), sweep.channels["emg"], _since_pulse_ms(sweep)
        within = np.abs(emg.values - np.median(emg.values))[(since_ms >= first_ms) & (since_ms <= last_ms)]
        if shown.outside is not None:
            responses_ms.append(shown.outside.at_ms)
        elif shown.mep_mv > _CLEAR * (shown.rest_uv or np.inf) / 1e3:
            edges = zip((first_ms, last_ms, None), (*(within[[0, -1]] > _EDGE * within.max()), True), strict=True)
            responses_ms.append(next(at_ms for at_ms, is_large in edges if is_large))
        usual |= shown.stands_out
    _require_at_pulse(seen, limits, source)
    odd_ms = [at_ms for at_ms in responses_ms if at_ms is not None]
    if len(seen) > _FEW and (not usual or (2 * len(odd_ms) > len(responses_ms) and 4 * len(odd_ms) > len(seen))):
        what = f"most responses in {source} are not within {first_ms:g}–{last_ms:g} ms after the pulse, where MEPs are "
        got = f"{len(odd_ms)} of {len(seen)}, about {np.median(odd_ms):.0f} ms after it" if odd_ms else "none at all"
        remedy = "Does its marker, or time 0, come at the pulse? If so, write the muscle's "
        remedy += "mep_window_ms = [FIRST, LAST] into a layout."
        raise InvalidValueError(f"{what}measured", got=got, remedy=remedy)


def _require_at_pulse(seen: Sequence[tuple[Sweep, Trial]], limits: SignalLimits, source: str) -> None:
    """Raise if responses come later by as much as their ISIs are longer, as they do after the tap."""
    isis_ms, peaks_ms = list[float](), list[float]()
    for sweep, trial in seen:
        emg, since_ms = sweep.channels["emg"], _since_pulse_ms(sweep)
        within = np.where((since_ms >= limits.mep_window_ms[0]) & (since_ms <= _LATEST_MS), np.abs(emg.values), 0.0)
        if trial.isi_ms is not None:
            isis_ms.append(trial.isi_ms)
            peaks_ms.append(float(since_ms[np.argmax(within >= within.max() / 2)]))
    if len(isis_ms) > _FEW and np.ptp(isis_ms) > _SPREAD_MS and np.ptp(peaks_ms) > 0:
        slope, fits = np.polyfit(isis_ms, peaks_ms, 1)[0], np.corrcoef(isis_ms, peaks_ms)[0, 1]
        if abs(slope - 1) < _SLOPE and fits > _FITS:
            what = f"the responses in {source} come later by as much as their ISIs are longer"
            remedy = "Is time 0, or the marker of the pulse, that of the tap? Cut the sweeps about the pulse."
            raise InvalidValueError(what, got=f"{slope:.2f} ms a ms", expected="about 0", remedy=remedy)


def _since_pulse_ms(sweep: Sweep) -> FloatArray:
    """When each sample of the EMG was taken, after the pulse [ms]."""
    emg = sweep.channels["emg"]
    return np.arange(len(emg.values), dtype=np.float64) * (1e3 / emg.rate_hz) + emg.t0_ms - (sweep.t_tms_ms or 0.0)


def _with_signals(contents: Contents, layout: Layout) -> tuple[Contents, dict[str, Track], str]:
    """Contents with the events of triggers, the channels, the EMG in mV, and what unit it had."""
    held = {"emg": None, **dict.fromkeys(key for key in layout.channels if key != "events")}
    tracks = {key: _track_of(contents, key, layout) for key in held}
    key = origin_key(layout)
    for kind, names in (("marker", layout.markers), ("channel", layout.channels)):
        require_reference(kind, key, names.get(key, ""), layout.reference, contents.source)
    said = [*map(not_as_recorded, (tracks["emg"].name, tracks["emg"].said)), "bad" if tracks["emg"].bad else None]
    odd = next(filter(None, said), None)
    if odd and tracks["emg"].name not in layout.where:
        what = f"the channel {tracks['emg'].name!r} of {contents.source} is not EMG as it was recorded"
        remedy = f'Say --channel emg=NAME of another; if it is, say --where "{tracks["emg"].name}={ALL}".'
        raise InvalidValueError(what, got=odd, remedy=remedy)
    if layout.rate_hz is not None:
        require_rate(layout.rate_hz, tracks["emg"].rate_hz, contents.source)
    notes = contents.notes
    for slow in [one for name, one in tracks.items() if name in MARKERS and one.rate_hz < _SLOW_HZ]:
        notes = (*notes, f"{slow.name!r} has a sample each {1e3 / slow.rate_hz:g} ms: ISIs are not known better.")
    triggers = events_of((key, at_s, 0.0) for key in MARKERS if key in tracks for at_s in tracks[key].onsets_s())
    events = pd.concat([each for each in (contents.events, triggers) if len(each)] or [triggers], ignore_index=True)
    events = joined(events, layout)
    emg = tracks["emg"].with_unit(unit_said(tracks["emg"].name, EMG_UNITS))
    unit, noted = _unit_of(emg, contents, layout)
    contents = replace(contents, events=events, notes=(*notes, *noted))
    return contents, {**tracks, "emg": emg.scaled(EMG_UNITS[unit])}, unit


def _unit_of(emg: Track, contents: Contents, layout: Layout) -> tuple[str, tuple[str, ...]]:
    """The unit of the EMG, and a note if the file says another one."""
    what, known = f"the channel {emg.name!r} of {contents.source}", unit_named(emg.unit)
    unit = required_unit(layout, EMG_UNITS, known, what, emg.unit or None)
    named = {unit_named(word) for word in re.split(r"[\s,]+", emg.unit)} & EMG_UNITS.keys()  # such as in two places
    is_unknown = is_missing(emg.unit) or emg.unit.strip().casefold() in WORDS["unknown"]
    if known == unit or is_unknown or (len(named) > 1 and known is None):
        return unit, ()
    if not contents.unit_is_usual and emg.name not in layout.where:
        what += " says another unit than the one that is stated"
        remedy = f'Leave --unit out; if the file is wrong, say --where "{emg.name}={ALL}", too.'
        raise InvalidValueError(what, got=unit, expected=emg.unit, remedy=remedy)
    return unit, (f"{contents.source} says {emg.unit}, and {unit} is used, as stated.",)


def _with_the_cut_off(pulses: list[Pulse], tapped: Track, layout: Layout) -> list[Pulse]:
    """Pulses of which those are lost before which no tap can be seen, since the channel that shows it begins later."""
    ends = [(one.start_s, one.start_s + one.samples / tapped.rate_hz) for one in tapped.stretches]
    if all(pulse.isi_s is None for pulse in pulses) or 2 * len(ends) > len(pulses):  # or each sweep was recorded alone
        return pulses
    longest_s = layout.longest_isi_ms / 1e3
    seen = [any(begin_s <= one.at_s - longest_s and one.at_s <= end_s for begin_s, end_s in ends) for one in pulses]
    return [one if known or one.isi_s is not None or one.alone else replace(one, lost=True)
            for one, known in zip(pulses, seen, strict=True)]  # fmt: skip


def _track_of(contents: Contents, key: str, layout: Layout) -> Track:
    """The channel that holds something: the one that is named, or the only one that may."""
    tracks, names = contents.tracks, [track.name for track in contents.tracks]
    if (stated := layout.channels.get(key)) is not None:
        require_one("channel", contents.source, stated, names)
        return tracks[names.index(stated)]
    fitting = [track for track in tracks if track.kind == key]
    fitting = fitting or [track for track in tracks if key in track.name.casefold()]
    fitting = fitting or [track for track in tracks if track.kind not in {"stim", "misc", "markers"}]
    if len(fitting) != 1:
        what = f"several channels of {contents.source}, or none, may hold the EMG"
        remedy = f'Say --channel "{key}={(fitting or tracks)[0].name}".' if tracks else "Is it the right file?"
        raise InvalidValueError(what, got=", ".join(names) or "no channels", remedy=remedy)
    return fitting[0]


def _pulses_of_rows(contents: Contents, emg: Track, layout: Layout) -> tuple[list[Pulse], tuple[str, ...], str]:
    """The pulses of sweeps that a row each says the ISI of, the columns that are not used, and whose they are."""
    stated = replace(layout, where={name: said for name, said in layout.where.items() if name != emg.name})
    stated = replace(stated, alone="") if layout.alone is None and contents.empty_is_alone else stated
    trials = named(contents.trials)
    if len(emg.stretches) != len(trials):
        what = f"{contents.source} does not say the ISI of each sweep"
        raise InvalidValueError(what, got=f"{len(trials)} rows and {len(emg.stretches)} sweeps")
    columns = Columns.found(trials, stated, contents.source, needed=("isi",))
    require_one_kind_each(columns)
    require_plain_isis(columns)
    marks = {key: marked(contents.events, key, layout) for key in (origin_key(layout), "pulse", "alone")}
    pulses = list[Pulse]()
    for row in columns.rows:
        if columns.tap_alone(row):
            raise columns["isi"].refused(row, "is of a tap alone, whose sweep has no pulse", "Leave that sweep out.")
        isi_ms = None if columns.tms_alone(row) else columns["isi"].number(row)
        isi_s, sweep = None if isi_ms is None else isi_ms / 1e3, emg.stretches[row]
        at_tap = _is_tap(contents, marks, sweep.start_s, row, isi_ms)
        at_s = sweep.start_s + (contents.pulse_at_s or 0.0) + ((isi_s or 0.0) if at_tap else 0.0)
        span_s = sweep.start_s, sweep.start_s + sweep.samples / emg.rate_hz
        lost = layout.unmarked == "lost" and not columns["isi"].text(row)
        pulses.append(Pulse(at_s, isi_s, lost=lost, sweep_s=span_s, said={"excluded": columns.lost(row) is not None}))
    return pulses, tuple(columns.beside), _only_one(columns)


def _is_tap(
    contents: Contents, marks: Mapping[str, FloatArray], start_s: float, row: int, isi_ms: float | None
) -> bool:
    """True if a sweep is about the tap, and not about the pulse; raise if its events are not those of its row."""
    zero_s, within = contents.pulse_at_s or 0.0, {name: times_s - start_s for name, times_s in marks.items()}
    within = {name: times_s[(times_s >= 0) & (times_s < APART_S / 2)] for name, times_s in within.items()}
    (key, taps_s), (_, pulses_s), _ = within.items()
    at_zero = [name for name, times_s in within.items() if np.isclose(times_s, zero_s, rtol=0, atol=1e-6).any()]
    if len(contents.events) and not at_zero:
        what = f"it is not known what comes at time 0 of the sweeps of {contents.source}"
        remedy = f"Say which marker is of the pulse and which of the tap: --marker pulse=NAME --marker {key}=NAME."
        raise InvalidValueError(what, got=" or ".join(names_of(contents.events)), remedy=remedy)
    if len(pulses_s) == len(taps_s) == 1:
        _require_same(f"row {row + 1} of {contents.source}", isi_ms, float(pulses_s[0] - taps_s[0]))
    elif len(marks[key]) and not len(taps_s) and isi_ms is not None and 0 < isi_ms <= 1e3 * zero_s:
        _require_same(f"row {row + 1} of {contents.source}", isi_ms, None)
    return key in at_zero


def _require_same(what: str, isi_ms: float | None, seen_s: float | None) -> None:
    """Raise if the ISI in a table is not that of the events; None is TMS alone, or a pulse without a tap."""
    if isi_ms is None or seen_s is None or abs(1e3 * seen_s - isi_ms) > _APART_MS:
        got = "TMS alone" if isi_ms is None else f"{isi_ms:g} ms"
        expected = "no tap, by the events" if seen_s is None else f"{1e3 * seen_s:.1f} ms, by the events"
        what = f"the ISI of {what} is not that of the events in its sweep"
        remedy = "Correct one of them, or leave one out of the file."
        raise InvalidValueError(what, got=got, expected=expected, remedy=remedy)


def _only_one(columns: Columns) -> str:
    """The code of the only person whose sweeps these are; raise if there are several, or several days."""
    for key, kind in (("day", "days"), ("subject", "people")):
        several = {columns[key].text(row): None for row in columns.rows}
        if len(several) > 1:
            what = f"the sweeps of {columns.empty.of} are of several {kind}"
            remedy = f'Analyse those of each by themselves: --where "{columns[key].name}={next(iter(several))}".'
            raise InvalidValueError(what, got=f"{columns[key].name} {', '.join(several)}", remedy=remedy)
    return next(iter(several), "")


def origin_key(layout: Layout) -> str:
    """The key of the marker that ISIs count from."""
    return "tap" if layout.reference == "impact" else "valve"


def _cut(signals: Mapping[str, Track], pulse: Pulse, begin_s: float, key: str) -> Sweep:
    """What all channels have of a stretch without a gap, whose clock begins at the first sample of the EMG."""
    begin_s, end_s = pulse.sweep_s or (begin_s, pulse.at_s + _AFTER_S)
    cut, start_s = dict[str, Channel](), begin_s
    for name, track in signals.items():
        if (found := track.cut(pulse.at_s, begin_s, end_s)) is not None:
            own_s, values = found
            start_s = own_s if name == "emg" else start_s
            cut[name] = Channel(values, track.rate_hz, "mV" if name == "emg" else "V", 1e3 * (own_s - start_s))
    origin_ms = None if pulse.origin_s is None else 1e3 * (pulse.origin_s - start_s)
    begin: dict[str, Any] = {"t_valve_ms" if key == "valve" else "t_hit_ms": origin_ms}
    return Sweep(cut, t_tms_ms=1e3 * (pulse.at_s - start_s), **begin)
