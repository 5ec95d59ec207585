"""When the events of a tap happen: Table 3.2, Fig. 3.6–3.10, 4.6, 4.9, 5.2, on the simulated tapping robot."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy.stats import false_discovery_control, ttest_ind

import isiw
from benchmarks.dissertation.claims import Claim, put_to_test
from benchmarks.dissertation.parts import Told, verdict
from benchmarks.dissertation.size import Size
from benchmarks.reduction.look import OURS, THEIRS, panels
from isiw.dissertation.repeatability import TimingStudy, study_preset

__all__ = ["tell"]

NOTE = (
    "Simulated robot. Its mean times and SDs are those of Table 3.2 and Fig. 4.9 by construction; what is tested is "
    "that detection on its noisy waveforms returns them, and what the text derives from them."
)

POUND_FORCE_N: Final = 4.448


class _Text(NamedTuple):
    """Mean, SD, and range of an event in Table 3.2 [ms from the trial's start]."""

    mean: float
    sd: float
    low: float
    high: float


_EVENTS: Final = ("fill", "descent", "hit", "away", "memg")

TABLE: Final[dict[str, tuple[int, tuple[_Text, ...]]]] = {
    "bench": (50, (_Text(523, 0, 523, 523), _Text(621, 2, 617, 626), _Text(688, 1, 686, 690), _Text(690, 1, 689, 692))),
    "subject1": (538, (_Text(523, 0, 523, 523), _Text(631, 5, 613, 640), _Text(683, 4, 669, 688),
                       _Text(698, 4, 688, 704), _Text(701, 4, 689, 712))),
    "subject2": (324, (_Text(523, 0, 523, 523), _Text(626, 4, 614, 650), _Text(672, 2, 666, 678),
                       _Text(681, 2, 673, 688), _Text(695, 2, 689, 703))),
    "subject3": (252, (_Text(523, 0, 523, 523), _Text(615, 2, 609, 625), _Text(676, 1, 674, 679),
                       _Text(693, 1, 691, 696), _Text(695, 1, 692, 699))),
    "subject4": (346, (_Text(523, 0, 523, 523), _Text(629, 2, 619, 653), _Text(682, 1, 677, 687),
                       _Text(697, 1, 690, 699), _Text(704, 2, 698, 714))),
}  # fmt: skip
"""Number of taps and the events of Table 3.2."""

LATER_MS: Final = {7: 683, 8: 682, 9: 673, 10: 677, 11: 688}
"""Fig. 4.9: mean hit of five later people [ms]."""

_TIMES: Final = "by construction: the simulated robot has the text's times"
PUT_IN: Final = {
    **{f"{name}:": _TIMES for name in TABLE},
    "The tap shows": _TIMES,
    "The hammer presses": _TIMES,
    "Mean hit": _TIMES,
    "The mean hits differ": _TIMES,
    "On a wrist:": _TIMES,
    "On the bench": "by construction: one simulated impact moves both",
    "The load cell": "by construction: the simulated load cell has the text's load",
    "In one sweep": "by construction: a hit, a pulse and an MEP were put into the sweep",
}
"""What holds because it was put in."""

MEP_MV: Final = 0.1
MEAN_TOLERANCE_MS, RANGE_TOLERANCE_MS = 1.0, 3.0


@dataclass(frozen=True)
class _Evoked:
    """No MEP beyond the EMG at rest, or one."""

    mep_mv: float = 0.0


def tell(size: Size, seed: int) -> Told:
    """This part of the gallery."""
    studies = {name: _study(name, min(n, 10 * size.taps), seed) for name, (n, _) in TABLE.items()}
    later = {person: _study(f"subject{person}", size.taps, seed) for person in LATER_MS}
    claims = [claim for name, study in studies.items() for claim in _table_claims(name, study)]
    claims += [_pooled(studies), _load_cell(size, seed), *_durations(studies), *_later_people(later)]
    pictures = {
        "Fig. 3.6": _sweep("bench", "force", seed),
        "Fig. 3.7": _sweep("subject2", "emg", seed),
        "Fig. 3.8": _bars(studies),
        "Fig. 3.9": _differences(studies, "hit", "memg"),
        "Fig. 3.10": _differences(studies, "hit", "away"),
        "Fig. 4.9": _hits(later),
        "Fig. 5.2": _sweep("cushion", "emg", seed, evoked_mv=MEP_MV),
    }
    claims += [_signals(seed), _order(studies), _measured(seed)]
    return Told(NOTE, put_to_test(claims, {}, PUT_IN), pictures)


def _order(studies: dict[str, TimingStudy]) -> Claim:
    """Fig. 3.7: every event follows the one before it."""
    people = [study.events.columns() for name, study in studies.items() if name != "bench"]
    times = np.concatenate([np.array([columns[event] for event in _EVENTS]) for columns in people], axis=1)
    ordered = float((np.diff(times, axis=0) > 0).all(axis=0).mean())
    return Claim(
        "Fig. 3.7",
        "On a wrist: pressure, descent, hit, rebound, and then the tap in the EMG.",
        "in this order (one sweep)",
        f"in this order in {ordered:.1%} of {times.shape[1]} taps",
        f"{100 * (ordered - 1):+.1f} percentage points",
        verdict(holds=ordered >= 0.99, otherwise="not, because an event is missed or misplaced in more than 1 %"),
    )


def _measured(seed: int) -> Claim:
    """Fig. 5.2: what is found in one sweep."""
    sweep = _deliver("cushion", seed, MEP_MV)
    emg, moved = sweep.channels["emg"], sweep.channels["acceleration"]
    hit_ms = isiw.signals.impact_time(moved.values, moved.rate_hz, sweep.t_valve_ms)
    mep_mv = isiw.signals.mep_amplitude(emg.values, emg.rate_hz, sweep.t_tms_ms)
    onset_ms = isiw.signals.mep_onset(emg.values, emg.rate_hz, sweep.t_tms_ms)
    found = hit_ms is not None and onset_ms is not None and abs(mep_mv - MEP_MV) < 0.01 and 0 < onset_ms < 35
    return Claim(
        "Fig. 5.2, Fig. 5.5",
        "In one sweep the hit, the pulse and the MEP 15 to 35 ms after it are found.",
        "drawn",
        f"hit at {hit_ms:.1f} ms, pulse at {sweep.t_tms_ms:.1f} ms, MEP of {mep_mv:.3f} mV (simulated with "
        f"{MEP_MV} mV) from {onset_ms:.1f} ms after the pulse on",
        "no number to compare with",
        verdict(holds=bool(found), otherwise="not, because one of them is not found"),
    )


def _study(name: str, taps: int, seed: int) -> TimingStudy:
    return study_preset(name, taps=taps, isi_ms=(), seed=seed)


def _table_claims(name: str, study: TimingStudy) -> list[Claim]:
    """Means and SDs of one row of Table 3.2, and its ranges."""
    found, (_, texts) = study.event_table, TABLE[name]
    rows = [(event, text, found.loc[event]) for event, text in zip(_EVENTS, texts, strict=False)]
    off = max(abs(row["mean_ms"] - text.mean) for _, text, row in rows)
    off_sd = max(abs(row["sd_ms"] - text.sd) for _, text, row in rows)
    beyond = max(_farthest(event, text, found) for event, text, _ in rows)
    event, text = max(
        ((event, text) for event, text, _ in rows if text.sd > 0), key=lambda pair: _farthest(*pair, found)
    )
    below, above = ((text.mean - text.low) / text.sd, (text.high - text.mean) / text.sd)
    return [
        Claim(
            "Table 3.2, Fig. 3.8",
            f"{name}: mean and SD of each event [ms].",
            "; ".join(f"{event} {text.mean:g}, {text.sd:g}" for event, text, _ in rows),
            "; ".join(f"{event} {row['mean_ms']:.1f}, {row['sd_ms']:.1f}" for event, _, row in rows),
            f"means by at most {off:.1f} ms, SDs by at most {off_sd:.1f} ms",
            verdict(
                holds=max(off, off_sd) <= MEAN_TOLERANCE_MS,
                otherwise=f"not, because a mean or an SD is off by more than {MEAN_TOLERANCE_MS:g} ms",
            ),
        ),
        Claim(
            "Table 3.2",
            f"{name}: range of each event [ms].",
            "; ".join(f"{event} {text.low:g}–{text.high:g}" for event, text, _ in rows),
            "; ".join(f"{event} {row['low_ms']:.0f}–{row['high_ms']:.0f}" for event, _, row in rows),
            f"at most {beyond:.0f} ms at an end",
            verdict(
                holds=beyond <= RANGE_TOLERANCE_MS,
                otherwise=f"not, because the simulated events are Gaussian, while the text's {event} reaches "
                f"from {below:.1f} of its SDs below its mean to {above:.1f} above it",
            ),
        ),
    ]


def _farthest(event: str, text: _Text, found: pd.DataFrame) -> float:
    """By how much the range of an event is another than the text's [ms]."""
    row = found.loc[event]
    return max(abs(row["low_ms"] - text.low), abs(row["high_ms"] - text.high))


def _pooled(studies: dict[str, TimingStudy]) -> Claim:
    """4.2.2: the hit's SD over all trials, each person's mean removed."""
    people = [name for name in studies if name != "bench"]
    left = np.concatenate([_centred(studies[name].events.hit_ms) for name in people])
    table = np.sqrt(np.average([TABLE[p][1][2].sd ** 2 for p in people], weights=[TABLE[p][0] for p in people]))
    ours = float(left.std(ddof=len(people)))
    return Claim(
        "4.2.2",
        "With the mean of each person removed, the hit varies with an SD of 2 ms over all trials.",
        "2 ms",
        f"{ours:.1f} ms",
        f"{ours - 2:+.1f} ms",
        verdict(
            holds=abs(ours - 2.0) <= 0.5,
            otherwise=f"not, because Table 3.2's own SDs (4, 2, 1, 1) and trials pool to {table:.1f} ms",
        ),
    )


def _centred(values: np.ndarray) -> np.ndarray:
    return values - np.nanmean(values)


def _load_cell(size: Size, seed: int) -> Claim:
    """3.3.2: the hit from the load cell against that from the accelerometer."""
    device = isiw.SimulatedDevice(isiw.Tapper(lambda _: _Evoked(), "bench", seed=seed))
    device.stage()
    apart = []
    for trial in range(min(50, size.taps)):
        sweep = device.deliver(isiw.Stimulus(trial, None, tap_alone=True), 1.0)
        force, moved = sweep.channels["force"], sweep.channels["acceleration"]
        pressed = isiw.signals.load_cell_times(force.values, force.rate_hz, valve_ms=sweep.t_valve_ms)[0]
        apart.append(pressed - isiw.signals.impact_time(moved.values, moved.rate_hz, sweep.t_valve_ms))
    worst = float(np.abs(apart).max())
    return Claim(
        "Fig. 3.6, 3.3.1, 3.3.2",
        "On the bench the load cell shows the hit when the accelerometer does.",
        "they agree (no number)",
        f"load cell minus accelerometer: {np.mean(apart):+.2f} ms, SD {np.std(apart):.2f} ms, n = {len(apart)}",
        f"at most {worst:.2f} ms",
        verdict(holds=worst <= 0.5, otherwise="not, because they are more than 0.5 ms apart"),
    )


def _durations(studies: dict[str, TimingStudy]) -> list[Claim]:
    """Fig. 3.9 and 3.10, and whether people differ."""
    people = [name for name in studies if name != "bench"]
    memg = {name: _between(studies[name], "hit", "memg") for name in people}
    press = {name: _between(study, "hit", "away") for name, study in studies.items()}
    text_memg = {name: TABLE[name][1][4].mean - TABLE[name][1][2].mean for name in people}
    text_press = {name: TABLE[name][1][3].mean - TABLE[name][1][2].mean for name in studies}
    off = max(abs(memg[name].mean() - text_memg[name]) for name in people)
    off_press = max(abs(press[name].mean() - text_press[name]) for name in studies)
    largest_sd = max(values.std(ddof=1) for values in memg.values())
    alike = [f"{a} and {b}" for (a, b), p in _pairs({name: press[name] for name in people}).items() if p >= 0.001]
    return [
        Claim(
            "Fig. 3.9",
            "The tap shows in the EMG about 20 ms after the hit (by person, from Table 3.2's means).",
            ", ".join(f"{value:g}" for value in text_memg.values()) + " ms; SD below 2 ms",
            ", ".join(f"{values.mean():.1f}" for values in memg.values()) + f" ms; largest SD {largest_sd:.1f} ms",
            f"at most {off:.1f} ms",
            verdict(holds=off <= 1 and largest_sd < 2, otherwise="not, because a mean or an SD is larger than that"),
        ),
        Claim(
            "Fig. 3.10",
            "The hammer presses for 2 ms on the load cell and longer on a wrist (from Table 3.2's means).",
            ", ".join(f"{value:g}" for value in text_press.values()) + " ms",
            ", ".join(f"{values.mean():.1f}" for values in press.values()) + " ms",
            f"at most {off_press:.1f} ms",
            verdict(holds=off_press <= 1, otherwise="not, because a mean is off by more than 1 ms"),
        ),
        Claim(
            "Fig. 3.10, 3.3.3",
            "Each person has a pressing duration of their own (pairwise Welch tests, corrected, p < .001).",
            "each differs",
            "each differs" if not alike else f"all but {', '.join(alike)}",
            "none" if not alike else f"{len(alike)} of 6 pairs alike",
            verdict(
                holds=not alike,
                otherwise="not, because Table 3.2 itself gives subjects 1 and 4 the same 15 ms (698 − 683, 697 − 682)",
            ),
        ),
    ]


def _between(study: TimingStudy, first: str, second: str) -> np.ndarray:
    columns = study.events.columns()
    apart = columns[second] - columns[first]
    return apart[~np.isnan(apart)]


def _pairs(groups: dict[str, np.ndarray]) -> dict[tuple[str, str], float]:
    """Corrected p of each pair's difference (Welch, Benjamini–Hochberg)."""
    names = list(combinations(groups, 2))
    p = [ttest_ind(groups[a], groups[b], equal_var=False).pvalue for a, b in names]
    return dict(zip(names, false_discovery_control(p), strict=True))


def _later_people(later: dict[int, TimingStudy]) -> list[Claim]:
    """Fig. 4.9."""
    hits = {f"subject{person}": study.events.hit_ms for person, study in later.items()}
    off = max(abs(np.mean(hits[f"subject{person}"]) - mean) for person, mean in LATER_MS.items())
    largest_sd = max(values.std(ddof=1) for values in hits.values())
    differ = sum(p < 0.001 for p in _pairs(hits).values())
    return [
        Claim(
            "Fig. 4.9",
            "Mean hit of subjects 7 to 11 [ms], each with an SD below 2 ms.",
            ", ".join(str(mean) for mean in LATER_MS.values()) + "; SD below 2",
            ", ".join(f"{values.mean():.1f}" for values in hits.values()) + f"; largest SD {largest_sd:.1f}",
            f"at most {off:.1f} ms",
            verdict(holds=off <= 1 and largest_sd < 2, otherwise="not, because a mean or an SD is off"),
        ),
        Claim(
            "Fig. 4.9",
            "The mean hits differ between the people (p < .001; the copy used shows *** ten times, for ten pairs).",
            "10 of 10 pairs",
            f"{differ} of 10 pairs, {len(next(iter(hits.values())))} taps a person",
            f"{differ - 10:+d}",
            verdict(
                holds=differ == 10,
                otherwise="not, because means 1 ms apart need more taps than these at an SD of 1.5 ms",
            ),
        ),
    ]


def _deliver(name: str, seed: int, evoked_mv: float = 0.0) -> isiw.Sweep:
    device = isiw.SimulatedDevice(isiw.Tapper(lambda _: _Evoked(evoked_mv), name, seed=seed))
    device.stage()
    return device.deliver(isiw.Stimulus(0, 120.0), 1.0)


def _signals(seed: int) -> Claim:
    """What can be read off the axes of Fig. 3.6."""
    sweep = _deliver("bench", seed)
    cell = sweep.channels["force"]
    force = np.divide(cell.values, POUND_FORCE_N)
    rest, spike = float(np.median(force[-500:])), float(force.max())
    return Claim(
        "Fig. 3.6",
        "The load cell spikes to about 20 lbf and then bears 2.401 lbf (axis and label of the figure).",
        "about 20 lbf, then 2.401 lbf",
        f"{spike:.1f} lbf, then {rest:.2f} lbf",
        f"at rest {rest - 2.401:+.2f} lbf",
        verdict(holds=abs(rest - 2.401) < 0.05 and 15 < spike < 25, otherwise="not, because the load is another"),
    )


def _sweep(name: str, last: str, seed: int, evoked_mv: float = 0.05) -> Figure:
    """The channels of one sweep with its events."""
    sweep = _deliver(name, seed, evoked_mv)
    channels = ("valve", "pressure", "acceleration", last)
    picture, axes = panels(4, 1, width=7.0, height=1.3, sharex=True)
    events = [time[0] for time in isiw.signals.sweep_events(sweep).columns().values() if not np.isnan(time[0])]
    for one, channel in zip(axes[:, 0], channels, strict=True):
        signal = sweep.channels[channel]
        one.plot(np.arange(len(signal.values)) / signal.rate_hz * 1000, signal.values, lw=0.6, color=OURS)
        for time in events:
            one.axvline(time, color="#9e2a2b", lw=0.6, ls="--")
        one.axvline(sweep.t_tms_ms, color="black", lw=0.6, ls=":")
        one.set(ylabel=f"{channel} [{signal.unit}]", xlim=(400, 900))
    axes[-1, 0].set(
        xlabel="time [ms]; dashed: events found, dotted: pulse", ylim=(-0.25, 0.25) if last == "emg" else None
    )
    return picture


def _bars(studies: dict[str, TimingStudy]) -> Figure:
    picture, axes = panels(1, 1, width=7.0, height=3.0)
    for k, (name, study) in enumerate(studies.items()):
        found = study.event_table
        x = np.arange(len(_EVENTS)) + 0.16 * (k - 2)
        ours = [found["mean_ms"].get(event, np.nan) - 500 for event in _EVENTS]
        sds = [found["sd_ms"].get(event, np.nan) for event in _EVENTS]
        axes[0, 0].bar(x, ours, 0.14, yerr=sds, label=name, alpha=0.4 + 0.12 * k, color=OURS, error_kw={"lw": 0.8})
        theirs = [text.mean - 500 for text in TABLE[name][1]]
        axes[0, 0].plot(x[: len(theirs)], theirs, "_", color="black", ms=6)
    axes[0, 0].set_xticks(range(len(_EVENTS)), [f"t_{event}" for event in _EVENTS])
    axes[0, 0].set(ylabel="ms after the valve command", title="lines: Table 3.2")
    axes[0, 0].legend(fontsize=7, frameon=False)
    return picture


def _differences(studies: dict[str, TimingStudy], first: str, second: str) -> Figure:
    picture, axes = panels(1, 1, width=5.0)
    shown = {name: apart for name, study in studies.items() if len(apart := _between(study, first, second))}
    axes[0, 0].boxplot(list(shown.values()), tick_labels=list(shown), showfliers=False)
    positions = dict(zip(_EVENTS, range(5), strict=True))
    theirs = [TABLE[name][1][positions[second]].mean - TABLE[name][1][positions[first]].mean for name in shown]
    axes[0, 0].plot(range(1, len(shown) + 1), theirs, "o", color=THEIRS, mec="black", label="Table 3.2")
    axes[0, 0].set(ylabel=f"t_{second} − t_{first} [ms]")
    axes[0, 0].legend(fontsize=7, frameon=False)
    return picture


def _hits(later: dict[int, TimingStudy]) -> Figure:
    picture, axes = panels(1, 1, width=5.0)
    axes[0, 0].boxplot([study.events.hit_ms for study in later.values()], tick_labels=[str(p) for p in later])
    axes[0, 0].plot(range(1, 6), list(LATER_MS.values()), "o", color=THEIRS, mec="black", label="Fig. 4.9")
    axes[0, 0].set(xlabel="subject", ylabel="t_hit [ms]")
    axes[0, 0].legend(fontsize=7, frameon=False)
    return picture
