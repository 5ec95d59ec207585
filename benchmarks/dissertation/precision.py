"""How precise an ISI is: Fig. 5.4, 5.8, 5.9, Tables 5.1 and 5.2, on the simulated robot and its cushion (5.2, 5.3)."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

import isiw
from benchmarks.dissertation.claims import Claim, put_to_test
from benchmarks.dissertation.parts import Told, verdict
from benchmarks.dissertation.size import Size
from benchmarks.reduction.look import OURS, panels
from isiw.devices.robot.mechanism import EventTime
from isiw.devices.robot.tapper import preset
from isiw.dissertation.repeatability import STUDY_ISI_MS, TimingStudy, study_preset, study_sweeps

__all__ = ["tell"]

POOLED_MS, MISTRIALS, BEYOND_4_MS, LARGEST_MEAN_MS = 1.93, 8, 0.0378, 1.5
JITTER_MS: Final = (1.0, 7.46)
"""SD of the pulse against the valve, least and largest of nine sets, the largest at 52 ms (Fig. 5.9)."""

IDENTICAL, WITHIN_1_PCT, WORST_PCT, SWEEPS = 8, 11, 4.054, 12
"""Table 5.2."""

EYE_MS: Final = (10.0, 60.0)
"""Where somebody who measures by hand looks for the extremes after the pulse [ms]."""

STREAM: Final = Path("benchmarks/results/impact_stream.md")

LATE: Final = "a robot whose hit is believed 2 ms too early"
BELIEVED_MS: Final = 2.0
PUT_IN: Final = {
    "SD of the ISI error": "by construction: the simulated hit has this SD",
    "Probability of an ISI error": "by construction: it follows from the SD",
}
"""What holds because it was put in."""

NOTE: Final = (
    "Simulated robot on a cushion. The hit varies with an SD of 1.93 ms by construction. The text's three statements "
    "on the error (pooled SD 1.93 ms; 8 pulses before the impact at 10 ms; SD of the pulse against the valve up to "
    "7.46 ms) do not go together in open loop, so each comes out under a reading of its own."
)


@dataclass(frozen=True)
class _Evoked:
    mep_mv: float = 0.0


def tell(size: Size, seed: int) -> Told:
    """This part of the gallery."""
    cushion = study_preset("cushion", taps=size.taps, seed=seed)
    faults = study_preset("timing-fault", taps=size.taps, seed=seed)
    jittered = study_preset("cushion", taps=size.taps, seed=seed, pulse_jitter_ms=JITTER_MS[1], isi_ms=(50.0,))
    followed = _followed(size.taps, seed)
    claims = [
        _means(cushion),
        _pooled(cushion),
        _mistrials(cushion, faults, size),
        _table_5_1(cushion),
        *_jitter(jittered, followed),
        *_by_hand(size, seed),
        _streamed(),
    ]
    pictures = {"Fig. 5.8": _errors(cushion), "Fig. 5.9": _pulses(cushion, followed), "Table 5.1": _bands(cushion)}
    return Told(NOTE, put_to_test(claims, {LATE: [_means(_late(cushion))]}, PUT_IN), pictures)


def _late(study: TimingStudy) -> TimingStudy:
    """The same taps, each pulse earlier by what the hit is believed too early."""
    return replace(study, realised_ms=study.realised_ms - BELIEVED_MS)


def _means(study: TimingStudy) -> Claim:
    table = study.error_table
    largest = float(table["mean_ms"].abs().max())
    return Claim(
        "Fig. 5.8",
        "The mean ISI error of each of nine ISIs is small.",
        f"at most {LARGEST_MEAN_MS} ms",
        f"at most {largest:.2f} ms, {len(study.commanded_ms)} taps",
        f"{largest - LARGEST_MEAN_MS:+.1f} ms",
        verdict(holds=largest <= LARGEST_MEAN_MS, otherwise="not, because a mean is larger"),
    )


def _pooled(study: TimingStudy) -> Claim:
    return Claim(
        "5.3.1",
        "SD of the ISI error over all trials, each set's mean removed.",
        f"{POOLED_MS} ms",
        f"{study.pooled_sd_ms:.2f} ms (in the simulated hit by construction)",
        f"{study.pooled_sd_ms - POOLED_MS:+.2f} ms",
        verdict(holds=abs(study.pooled_sd_ms - POOLED_MS) <= 0.2, otherwise="not, because the SD is another"),
    )


def _mistrials(cushion: TimingStudy, faults: TimingStudy, size: Size) -> Claim:
    table = faults.error_table["mistrials"]
    at_10, elsewhere = int(table[10.0]), int(table.drop(10.0).sum())
    alike = elsewhere == 0 and at_10 > 0
    reading = (
        "under reading late valves: 8 % of the valves open 13–22 ms late (preset `timing-fault`), and the pooled SD is "
        f"then {faults.pooled_sd_ms:.1f} ms; a Gaussian of 1.93 ms is below −10 ms once in ten million trials"
    )
    late = f"late valves: {at_10} of {size.taps} and {elsewhere}"
    return Claim(
        "5.3.1, Fig. 5.8",
        f"In the 10 ms set {MISTRIALS} of 100 pulses came before the impact, in the other sets none.",
        f"{MISTRIALS} of 100, and 0 of 800",
        f"Gaussian: {cushion.mistrials} of {len(cushion.commanded_ms)}; {late}",
        f"late valves: {100 * at_10 / size.taps - MISTRIALS:+.0f} of 100",
        verdict(
            holds=cushion.mistrials > 0,
            otherwise=reading if alike else "not, because late valves lose trials at other ISIs as well",
        ),
    )


def _table_5_1(study: TimingStudy) -> Claim:
    table = study.error_probabilities
    gaussian, counted = table.iloc[-1][["gaussian", "counted"]]
    bands = "; ".join(f"{row.from_ms:g}–{row.to_ms:g} ms {row.gaussian:.1%}" for row in table.iloc[:-1].itertuples())
    return Claim(
        "Table 5.1",
        "Probability of an ISI error beyond 4 ms (one row is legible; it has the Gaussian's probability).",
        f"{BEYOND_4_MS:.2%}",
        f"{gaussian:.2%} by a Gaussian, {counted:.2%} counted; {bands}",
        f"{100 * (gaussian - BEYOND_4_MS):+.2f} percentage points",
        verdict(holds=abs(gaussian - BEYOND_4_MS) <= 0.01, otherwise="not, because the SD is another"),
    )


def _followed(taps: int, seed: int) -> TimingStudy:
    """The pulse is triggered by the detected impact; at 52 ms the hit itself varies with 7.2 ms."""
    parts = [(isi_ms, sweep) for isi_ms in STUDY_ISI_MS for sweep in _triggered(isi_ms, taps, seed)]
    return study_sweeps("triggered by the impact", (sweep for _, sweep in parts), [isi_ms for isi_ms, _ in parts])


def _triggered(isi_ms: float, taps: int, seed: int) -> list[isiw.Sweep]:
    cushion = preset("cushion")
    hit_sd_ms = float(np.sqrt(JITTER_MS[1] ** 2 - POOLED_MS**2)) if isi_ms == 52.0 else cushion.hit.sd_ms
    geometry = replace(cushion, hit=EventTime(cushion.hit.mean_ms, hit_sd_ms))
    settings = isiw.TapperSettings(trigger="impact", rate_hz=2000.0, pulse_jitter_ms=POOLED_MS)
    robot = isiw.Tapper(lambda _: _Evoked(), geometry, settings, seed=seed + round(isi_ms))
    return [robot.answer(isiw.Stimulus(trial, isi_ms)) for trial in range(taps)]


def _jitter(jittered: TimingStudy, followed: TimingStudy) -> list[Claim]:
    """Fig. 5.9: in open loop it contradicts the pooled SD; where the pulse follows the hammer it does not."""
    alone_ms = JITTER_MS[1] / np.sqrt(len(STUDY_ISI_MS))
    sds = followed.pulse_table["sd_ms"]
    consistent = abs(sds[52.0] - JITTER_MS[1]) <= 1.5 and sds.drop(52.0).between(*JITTER_MS).all()
    pooled = followed.pooled_sd_ms
    return [
        Claim(
            "Fig. 5.9, 5.3.1",
            "Open loop: the pulse varies against the valve by up to 7.46 ms, and the ISI error by 1.93 ms.",
            f"{JITTER_MS[1]} ms at 52 ms, {POOLED_MS} ms over all sets",
            f"a set with {jittered.pulse_table['sd_ms'].iloc[0]:.1f} ms of jitter has an ISI error of "
            f"{jittered.pooled_sd_ms:.1f} ms",
            f"one such set of nine makes the pooled SD at least {alone_ms:.2f} ms",
            verdict(
                holds=jittered.pooled_sd_ms <= POOLED_MS * np.sqrt(len(STUDY_ISI_MS)),
                otherwise="not, because jitter of the pulse that is independent of the hammer is an ISI error "
                "of the same size",
            ),
        ),
        Claim(
            "Fig. 5.9",
            "The pulse varies against the valve by 1 to 7.46 ms (SD by set, the largest at 52 ms).",
            f"{JITTER_MS[0]:g} to {JITTER_MS[1]} ms, with a pooled ISI error of {POOLED_MS} ms",
            f"{sds.min():.1f} to {sds.max():.1f} ms, largest at {sds.idxmax():g} ms; pooled ISI error {pooled:.2f} ms",
            f"{sds.max() - JITTER_MS[1]:+.1f} ms; {pooled - POOLED_MS:+.2f} ms",
            verdict(
                holds=False,
                otherwise=f"under reading the pulse follows the detected impact, with a jitter of {POOLED_MS} ms, "
                "and the hammer itself varied by 7.2 ms at 52 ms (chosen so)"
                if consistent and abs(pooled - POOLED_MS) <= 0.3
                else "not, because the SDs are others",
            ),
        ),
    ]


def _by_hand(size: Size, seed: int) -> list[Claim]:
    """Table 5.2: the program's window against somebody who takes the extremes of what they see after the pulse."""
    rng = np.random.default_rng(seed)
    amplitudes_mv = rng.uniform(0.033, 0.09, 10 * size.taps)  # the range of the table's twelve
    left = iter(amplitudes_mv.tolist())
    robot = isiw.Tapper(lambda _: _Evoked(next(left)), "subject4", seed=seed)
    program, hand = [], []
    for trial in range(len(amplitudes_mv)):
        sweep = robot.answer(isiw.Stimulus(trial, 60.0))
        emg = sweep.channels["emg"]
        program.append(isiw.signals.mep_amplitude(emg.values, emg.rate_hz, sweep.t_tms_ms))
        hand.append(isiw.signals.mep_amplitude(emg.values, emg.rate_hz, sweep.t_tms_ms, window_ms=EYE_MS))
    off_pct = 100 * np.abs(np.array(program) / np.array(hand) - 1)
    identical, close = float((off_pct < 0.0005).mean()), float((off_pct < 1.0).mean())
    ours = f"{identical:.0%} identical, {close:.0%} within 1 %, worst {off_pct.max():.1f} %, of {len(off_pct)} sweeps"
    return [
        Claim(
            "Table 5.2",
            "MEP amplitude by the program against that by hand.",
            f"{IDENTICAL} of {SWEEPS} identical, {WITHIN_1_PCT} of {SWEEPS} within 1 %, worst {WORST_PCT} %",
            ours,
            f"identical {100 * (identical - IDENTICAL / SWEEPS):+.0f} percentage points, "
            f"within 1 % {100 * (close - WITHIN_1_PCT / SWEEPS):+.0f}",
            verdict(
                holds=abs(identical - IDENTICAL / SWEEPS) <= 0.1,
                otherwise="not, because these MEPs have their extremes inside the window, so that the extremes of the "
                f"EMG {EYE_MS[0]:g}–{EYE_MS[1]:g} ms after the pulse are the same; reading by hand is not simulated",
            ),
        )
    ]


def _streamed() -> Claim:
    """5.2.2 live: what the committed table of `benchmarks.impact_stream` says."""
    rows = re.findall(r"^\| \w+ \| (\d+) \| (\d+) \| ([\d.]+) \| ([\d.]+) \|", STREAM.read_text(), re.MULTILINE)
    sweeps, same = sum(int(row[0]) for row in rows), sum(int(row[1]) for row in rows)
    latest_ms = max(float(row[3]) for row in rows)
    return Claim(
        "Fig. 5.4, 5.2.2",
        "The impact is found while the accelerometer is being read.",
        "done so, no number",
        f"{same} of {sweeps} sweeps as in the whole sweep, known at most {latest_ms:g} ms after the impact "
        "(benchmarks/results/impact_stream.md)",
        "no number to compare with",
        verdict(
            holds=same >= 0.995 * sweeps and latest_ms <= 5, otherwise="not, because it is late or differs too often"
        ),
    )


def _errors(study: TimingStudy) -> Figure:
    picture, axes = panels(1, 1, width=5.5)
    table = study.error_table
    axes[0, 0].bar([f"{isi:g}" for isi in table.index], table["mean_ms"], yerr=table["sd_ms"], color=OURS)
    axes[0, 0].set(xlabel="commanded ISI [ms]", ylabel="mean error, SD [ms]", ylim=(-3, 3))
    return picture


def _pulses(cushion: TimingStudy, followed: TimingStudy) -> Figure:
    picture, axes = panels(1, 1, width=5.5)
    x = np.arange(len(STUDY_ISI_MS))
    axes[0, 0].bar(x - 0.2, cushion.pulse_table["sd_ms"], 0.38, label="open loop, no jitter", color="black")
    axes[0, 0].bar(x + 0.2, followed.pulse_table["sd_ms"], 0.38, label="pulse follows the impact", color=OURS)
    axes[0, 0].plot([4], [JITTER_MS[1]], "_", color="#9e2a2b", ms=14, label="text at 52 ms")
    axes[0, 0].set_xticks(x, [f"{isi:g}" for isi in STUDY_ISI_MS])
    axes[0, 0].set(xlabel="commanded ISI [ms]", ylabel="SD of pulse − valve [ms]")
    axes[0, 0].legend(fontsize=7, frameon=False)
    return picture


def _bands(study: TimingStudy) -> Figure:
    picture, axes = panels(1, 1, width=5.0)
    table = study.error_probabilities
    labels = [f"{row.from_ms:g}–{row.to_ms:g}" for row in table.itertuples()]
    x = np.arange(len(labels))
    axes[0, 0].bar(x - 0.2, table["gaussian"], 0.38, color="#c9c3b8", label="Gaussian")
    axes[0, 0].bar(x + 0.2, table["counted"], 0.38, color=OURS, label="counted")
    axes[0, 0].set_xticks(x, labels)
    axes[0, 0].set(xlabel="magnitude of the error [ms]", ylabel="probability")
    axes[0, 0].legend(fontsize=7, frameon=False)
    return picture
