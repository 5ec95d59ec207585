"""The numbers that a page draws in the browser: estimates, trials and sweeps of a log, rounded and thinned."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from isiw.figures import Edge
from isiw.log.headers import Header
from isiw.log.record import SessionRecord
from isiw.log.schema import EstimateRecord
from isiw.report.tables import trial_row
from isiw.report.words import answer_and_warnings
from isiw.signals.limits import EMG_UNITS_MV
from isiw.summary import lacking, tap_unmeasured
from isiw.sweeps import Channel
from isiw.text.sanitize import plain
from isiw.trials import Trial
from isiw.types import FloatArray

NEAR_MS: Final = (-60.0, 100.0)
"""Around the pulse, where every sample of the EMG is drawn as long as there are not too many."""

MOST_NEAR, MOST_WHOLE, MOST_ISIS = 1000, 300, 260
"""Points that are drawn of the EMG near the pulse, of a whole waveform, and of a profile."""

_MOST_DECIMALS: Final = 12

FINE, COARSE = 4, 3
"""Digits of the largest to which the EMG near the pulse and profiles, and whole waveforms, are rounded."""

LEAST_UV: Final = 50.0
"""The axis of an EMG has room for this amplitude at least, so that noise alone does not look like an MEP."""

_ROOM: Final = 0.35
"""Above and below what the MEP window holds, as a share of it."""


def drawn(record: SessionRecord) -> dict[str, Any]:
    """A session as numbers for the browser."""
    header, told = record.header, record.table.told
    numbers = [trial.index for trial in told]
    wrong = {"silent": record.is_silent, "in_doubt": record.in_doubt}
    estimated = {
        estimate.trial: _estimated(header, estimate, told[: bisect_right(numbers, estimate.trial)], **wrong)
        for estimate in record.estimates
    }
    return {
        "reference": header.space.reference,
        "isiAxis": header.stimulus.isi_axis(header.space.reference),
        "dotted": _dotted(record),
        "range": [header.space.low_ms, header.space.high_ms],
        "mepWindow": list(header.signals.mep_window_ms),
        "acquisition": plain(str(header.strategy.settings.get("acquisition", ""))),
        "scored": any(estimate.scores for estimate in record.estimates),
        "trials": [_trial(record, trial) for trial in record.table],
        "beliefs": estimated,
        "fallbacks": {e.trial: plain(e.text) for e in record.events if e.kind == "fallback" and e.trial is not None},
    }


def _dotted(record: SessionRecord) -> str:
    """The meaning of the dotted lines in a sweep, in a sentence."""
    first = record.header.stimulus
    if any(trial.t_valve_ms is not None for trial in record.table):
        return f"Dotted orange lines: valve command and {first.mark}."
    return f"Dotted orange line: {first.mark}."


def _trial(record: SessionRecord, trial: Trial) -> dict[str, Any]:
    row = trial_row(trial, record.header.stimulus)
    counts = "counts" if trial.intensity_pct_rmt is None else "other"  # the profile is that at the usual intensity
    return {
        "number": trial.index,
        "kind": "mistrial" if trial.reason is not None else "excluded" if trial.excluded else counts,
        "isAlone": trial.is_control and not trial.tap_alone and trial.isi_ms is None,
        "asked": row.asked,
        "realised": row.realised,
        "outcome": row.outcome,
        "askedMs": trial.commanded_isi_ms,
        "isiMs": trial.isi_ms,
        "mepUv": None if trial.mep_mv is None else round(1e3 * trial.mep_mv, 2),
        "tmsMs": trial.t_tms_ms,
        "hitMs": trial.t_hit_ms,
        "valveMs": trial.t_valve_ms,
        "sweep": _sweep(record.sweep(trial.index), trial, record.header.signals.mep_window_ms),
    }


def _estimated(
    header: Header, estimate: EstimateRecord, known: Sequence[Trial], *, silent: bool, in_doubt: bool
) -> dict[str, Any]:
    """An estimate, with the trials that it rests on; a session that is silent or in doubt as a whole found nothing.

    An intervention knows its window from the search before it.
    """
    of_all = (*header.earlier, *known)
    pairs = None if header.intervention else sum(trial.isi_ms is not None for trial in of_all)
    nothing = lacking(pairs, silent=silent, in_doubt=in_doubt)
    window = estimate.window if nothing is None else None
    said = [f"{nothing}"] if nothing is not None else _said(header, estimate, known)
    kept = slice(None, None, max(1, math.ceil(len(estimate.grid_ms) / MOST_ISIS)))
    bands = {
        "profile": estimate.profile_mv,
        "low": estimate.band_low_mv,
        "high": estimate.band_high_mv,
        "predictedLow": estimate.predicted_low_mv,
        "predictedHigh": estimate.predicted_high_mv,
    }
    return {
        "found": said[0],
        "against": said[1:],
        "window": [list(segment) for segment in window.segments] if window else [],
        "start": _drawn_edge(estimate.start),
        "end": _drawn_edge(estimate.end),
        "nextMs": _number(estimate.next_isi_ms),
        "chosenBy": plain(estimate.chosen_by),
        "scoredMs": [_number(isi_ms) for isi_ms in estimate.scored_ms],
        "scores": _rounded(np.asarray(estimate.scores), FINE),
        "stop": estimate.stop,
        "reason": plain(estimate.reason).removeprefix(said[0]).lstrip(),  # which begins with what is lacking
        "isiMs": [_number(isi_ms) for isi_ms in estimate.grid_ms[kept]],
        **{name: _rounded(1e3 * np.asarray(values)[kept], FINE) for name, values in bands.items()},
    }


def _said(header: Header, estimate: EstimateRecord, known: Sequence[Trial]) -> list[str]:
    """The answer of an estimate, and warnings and what is not known of the tap, as the final statement says them."""
    unmeasured = tap_unmeasured(estimate, header.stimulus)
    return [*(one.text for one in answer_and_warnings(estimate, header, known)), *([unmeasured] if unmeasured else [])]


def _sweep(channels: dict[str, Channel], trial: Trial, mep_window_ms: tuple[float, float]) -> list[dict[str, Any]]:
    """The waveforms of a trial: the EMG near the pulse first, then every channel as a whole."""
    emg, pulse_ms = channels.get("emg"), trial.t_tms_ms
    axes = {} if emg is None or pulse_ms is None else {"emg": _emg_axis(_around(emg, pulse_ms, mep_window_ms))}
    waves = [_wave(name, channel, MOST_WHOLE, COARSE, axes.get(name)) for name, channel in sorted(channels.items())]
    near = None if emg is None or pulse_ms is None else _around(emg, pulse_ms, NEAR_MS)
    return waves if near is None else [_wave("emg near the pulse", near, MOST_NEAR, FINE, axes["emg"]), *waves]


def _around(channel: Channel, pulse_ms: float, span_ms: tuple[float, float]) -> Channel | None:
    ends = (pulse_ms + np.asarray(span_ms) - channel.t0_ms) * (channel.rate_hz / 1e3)
    first, last = np.clip(np.round(ends), 0, len(channel.values)).astype(int).tolist()
    values = channel.values[first:last]
    t0_ms = channel.t0_ms + 1e3 * first / channel.rate_hz
    return Channel(values, channel.rate_hz, channel.unit, t0_ms) if len(values) else None


def _emg_axis(inside: Channel | None) -> list[float] | None:
    """The ends of an axis for what the MEP window holds, which the artefact of the pulse is free to leave."""
    values = np.zeros(0) if inside is None else inside.values[np.isfinite(inside.values)]
    if inside is None or inside.unit not in EMG_UNITS_MV or not len(values):
        return None
    least = LEAST_UV / (1e3 * EMG_UNITS_MV[inside.unit])
    middle, reach = float(values.min() + values.max()) / 2, (0.5 + _ROOM) * max(float(np.ptp(values)), least)
    return [middle - reach, middle + reach]


def _wave(name: str, channel: Channel, most: int, digits: int, axis: list[float] | None) -> dict[str, Any]:
    values, samples = _thinned(channel.values, most)
    return {
        "name": plain(name),
        "unit": plain(channel.unit),
        "t0": round(channel.t0_ms, 3),
        "step": _number(1e3 * samples / channel.rate_hz),
        "values": _rounded(values, digits, axis[1] - axis[0] if axis else None),
        "axis": axis,
    }


def _thinned(values: FloatArray, most: int) -> tuple[FloatArray, float]:
    """The smallest and the largest of each stretch of samples, so that no spike is lost, and samples per point."""
    if len(values) <= most:
        return values, 1.0
    stretch = 2 * math.ceil(len(values) / most)
    padded = np.pad(values, (0, -len(values) % stretch), mode="edge").reshape(-1, stretch)
    low, high = padded.min(axis=1), padded.max(axis=1)
    rising = padded.argmin(axis=1) <= padded.argmax(axis=1)
    pairs = np.where(rising[:, None], np.stack([low, high], axis=1), np.stack([high, low], axis=1))
    return pairs.ravel(), stretch / 2


def _rounded(values: FloatArray, digits: int, shown: float | None = None) -> list[float | None]:
    """To so many digits of their range or of what is shown of it; what is not finite is left open."""
    finite = np.isfinite(values)
    known = values[finite] if finite.any() else np.zeros(1)
    extent = shown or float(np.ptp(known) or np.abs(known).max())
    decimals = max(-_MOST_DECIMALS, min(_MOST_DECIMALS, digits - math.ceil(math.log10(extent)))) if extent > 0 else 0
    rounded: list[float | None] = np.round(np.where(finite, values, 0.0), decimals).tolist()
    return [value if is_finite else None for value, is_finite in zip(rounded, finite.tolist(), strict=True)]


def _number(value: float | None) -> float | None:
    """A number as JSON can hold it."""
    return value if value is not None and math.isfinite(value) else None


def _drawn_edge(edge: Edge) -> list[float | str | None]:
    """The ends of an edge's interval as JSON can hold them; of one beyond the range, on which side."""
    ends = (edge.low_ms, edge.high_ms)
    return [("low" if end < 0 else "high") if end is not None and math.isinf(end) else _number(end) for end in ends]
