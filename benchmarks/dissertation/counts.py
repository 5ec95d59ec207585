"""Windows from response counts: Fig. 3.11, 3.12, 4.2, and why the text gave them up (3.3.4, 4.1.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import isiw
from benchmarks.dissertation.claims import Claim, put_to_test
from benchmarks.dissertation.counted import STIMULATION, study_counts
from benchmarks.dissertation.parts import Told, verdict
from benchmarks.dissertation.size import Size
from benchmarks.reduction.look import OURS, THEIRS, panels
from isiw.config.sections import own_wrist
from isiw.devices.robot.mechanism import Geometry
from isiw.devices.robot.tapper import preset
from isiw.dissertation.response_counts import EFFECTIVE_SHARE, CountStudy
from isiw.subjects import SimulatedSubject, cohort
from isiw.subjects.measured import MEASURED_KIM, WIDTHS_KIM_MS
from isiw.types import FloatArray

__all__ = ["tell"]

COHORT: Final = "kim11-measured"
THRESHOLDS_MV: Final = tuple(person.threshold_mv for person in MEASURED_KIM)
"""Of the eleven people (4.1.1)."""

TRIALS: Final = 12
ALONE: Final = 100
ARTEFACT_MS: Final = 8.0
"""How long the tap shows in the EMG."""

FIXED_MV: Final = 0.03
EXAMPLE_MV: Final = (0.0, 0.08)
ISI_MS: Final = np.arange(0.0, 140.0, 5.0)
SWEPT_MS: Final = np.arange(0.0, 320.0, 5.0)
WIDTHS_MS: Final = {"electrical": 20.0, "mechanical": 50.0}
"""Fig. 3.12."""

TOLERANCE_MS: Final = 5.0
"""One step of the sweep."""

UNBLANKED: Final = "the tap's own artefact counts as EMG"
_PEOPLE: Final = f"by construction: the people of `{COHORT}` were chosen so"
PUT_IN: Final = {
    "A response is counted": "by construction: the two MEPs were put in",
    "A tap has the wider window": "by construction: the two simulated people have the text's widths",
    "TMS alone does not cross": _PEOPLE,
}
"""What holds because it was put in."""

NOTE: Final = (
    "Simulated people. Fig. 3.12 has one person with both kinds of stimulation, Fig. 4.2 the eleven of the cohort "
    f"`{COHORT}`. A person's own threshold is the amplitude that at most 5 % of their "
    f"{ALONE} trials of TMS alone exceed; the window is the run of effective ISIs about the largest share."
)


@dataclass(frozen=True)
class _Evoked:
    mep_mv: float = 0.0


def tell(size: Size, seed: int) -> Told:
    """This part of the gallery."""
    kinds = {kind: _sweeps(kind, size.sweeps, seed) for kind in STIMULATION}
    fixed, own, higher = (_people(seed, rule) for rule in ("text", "own", "higher"))
    claims = [claim for kind, studies in kinds.items() for claim in _kind_claims(kind, studies, seed)]
    claims += [
        _counted(seed),
        _wider(kinds),
        _alone(fixed, own),
        _taps_alone(own, seed),
        _sensitive(fixed, higher),
        _against(fixed),
    ]
    pictures = {
        "Fig. 3.11": _example(seed),
        "Fig. 3.12": _bars({kind: studies[0] for kind, studies in kinds.items()}),
        "Fig. 4.2": _eleven(fixed, own),
    }
    wrong = {UNBLANKED: [_taps_alone(own, seed, blank=False)]}
    return Told(NOTE, put_to_test(claims, wrong, PUT_IN), pictures)


def _sweeps(kind: str, sweeps: int, seed: int) -> list[CountStudy]:
    """Twelve trials an ISI, each time with the threshold that the person's TMS alone gives."""
    return [
        study_counts(STIMULATION[kind], ISI_MS, trials=TRIALS, threshold_mv=None, alone=ALONE, seed=seed + k)
        for k in range(sweeps)
    ]


def _people(seed: int, rule: str) -> list[CountStudy]:
    """The eleven people, by the text's thresholds, these raised by a quarter, or their own."""
    factor = {"text": 1.0, "higher": 1.25}
    return [
        study_counts(
            person,
            SWEPT_MS,
            trials=TRIALS,
            threshold_mv=None if rule == "own" else factor[rule] * threshold_mv,
            alone=ALONE,
            seed=seed + number,
        )
        for number, (person, threshold_mv) in enumerate(zip(cohort(COHORT, 11, seed), THRESHOLDS_MV, strict=True))
    ]


def _width_ms(study: CountStudy) -> float:
    return 0.0 if study.window is None else study.window.width_ms + 5.0


def _kind_claims(kind: str, studies: list[CountStudy], seed: int) -> list[Claim]:
    """The width, as the text measured it, and where trials are plenty and the threshold is fixed."""
    theirs = WIDTHS_MS[kind]
    widths = np.array([_width_ms(study) for study in studies])
    known = _width_ms(study_counts(STIMULATION[kind], ISI_MS, trials=300, threshold_mv=FIXED_MV, seed=seed))
    under = f"under reading threshold {FIXED_MV:g} mV, 300 trials an ISI ({known:.0f} ms)"
    because = f"not, because with {TRIALS} trials an ISI and the person's own threshold fewer ISIs exceed 40 %"
    otherwise = under if abs(known - theirs) <= TOLERANCE_MS else because
    return [
        Claim(
            "Fig. 3.12, 3.3.4",
            f"{kind.capitalize()} stimulation: effective (more than 40 % of the trials respond) over so many ms.",
            f"about {theirs:.0f} ms",
            f"{widths.mean():.0f} ± {widths.std():.0f} ms with {TRIALS} trials an ISI and the person's own threshold "
            f"({len(studies)} sweeps); {known:.0f} ms with 300 trials and {FIXED_MV:g} mV",
            f"{widths.mean() - theirs:+.0f} and {known - theirs:+.0f} ms",
            verdict(holds=abs(widths.mean() - theirs) <= TOLERANCE_MS, otherwise=otherwise),
        )
    ]


def _wider(kinds: dict[str, list[CountStudy]]) -> Claim:
    electrical, mechanical = (np.mean([_width_ms(study) for study in kinds[kind]]) for kind in WIDTHS_MS)
    return Claim(
        "Fig. 3.12",
        "A tap has the wider window (mechanical by electrical).",
        "50 ms by 20 ms: 2.5",
        f"{mechanical:.0f} ms by {electrical:.0f} ms: {mechanical / max(electrical, 1e-9):.1f}",
        "the same order",
        verdict(holds=mechanical > 1.5 * electrical, otherwise="not, because the widths are too near to each other"),
    )


def _alone(fixed: list[CountStudy], own: list[CountStudy]) -> Claim:
    """4.4.1: TMS alone evokes nothing."""
    shares = np.array([study.alone_share for study in fixed])
    thresholds = ", ".join(f"{1000 * study.threshold_mv:.0f}" for study in own)
    return Claim(
        "4.1.1, 4.4.1, Fig. 4.2",
        "TMS alone does not cross a person's threshold.",
        "none, at " + ", ".join(f"{1000 * mv:.0f}" for mv in THRESHOLDS_MV) + " µV",
        f"{shares.min():.0%} to {shares.max():.0%} of the trials cross the text's thresholds; own thresholds (5 %) are "
        f"{thresholds} µV",
        f"{shares.mean():.0%} on average",
        verdict(
            holds=shares.max() <= 0.02,
            otherwise=f"not, because the people of `{COHORT}` respond to TMS alone more often",
        ),
    )


def _taps_alone(own: list[CountStudy], seed: int, *, blank: bool = True) -> Claim:
    """The control: taps without a pulse, on the robot's waveforms, measured where an MEP would be."""
    shares = []
    for number, (person, study) in enumerate(zip(cohort(COHORT, 11, seed), own, strict=True)):
        robot = isiw.Tapper(lambda _: _Evoked(), _wrist(person), seed=seed + number)
        taps = [robot.answer(isiw.Stimulus(k, None, tap_alone=True)) for k in range(20)]
        shares.append(np.mean([_false(tap, study, k, blank=blank) for k, tap in enumerate(taps)]))
    return Claim(
        "4.4.1, Fig. 4.2",
        "The tap alone does not cross a person's threshold.",
        "none",
        f"{np.max(shares):.0%} at most, {np.mean(shares):.1%} on average, of 20 taps a person (their own thresholds)",
        f"{np.mean(shares):.1%}",
        verdict(holds=bool(np.max(shares) <= 0.05), otherwise="not, because the EMG floor alone crosses it in some"),
    )


def _wrist(person: SimulatedSubject) -> Geometry:
    """Subject 4 under the robot, with a person's EMG at rest."""
    return replace(preset("subject4"), noise=own_wrist(person).noise)


def _false(sweep: isiw.Sweep, study: CountStudy, number: int, *, blank: bool) -> bool:
    """Whether a tap alone counts as a response, had a pulse come 10, 15, … ms after it."""
    emg, events = sweep.channels["emg"], isiw.signals.sweep_events(sweep)
    would_be_ms = events.hit_ms + 10.0 + 5.0 * number
    artefact_ms = (events.memg_ms, events.memg_ms + ARTEFACT_MS) if blank else None
    amplitude_mv = isiw.signals.mep_amplitudes(emg.values, emg.rate_hz, would_be_ms, blank_ms=artefact_ms)[0]
    return bool(amplitude_mv > study.threshold_mv)


def _sensitive(fixed: list[CountStudy], higher: list[CountStudy]) -> Claim:
    change = np.array([_width_ms(b) - _width_ms(a) for a, b in zip(fixed, higher, strict=True)])
    return Claim(
        "4.1.1",
        "The window from counts depends strongly on the threshold.",
        "highly sensitive (no number)",
        f"25 % more changes the width by {change.mean():+.0f} ms on average, {change.min():+.0f} ms at most",
        "the same direction",
        verdict(holds=change.mean() < -5.0, otherwise="not, because the widths hardly change"),
    )


def _against(fixed: list[CountStudy]) -> Claim:
    ours = np.array([_width_ms(study) for study in fixed])
    off = ours - np.array(WIDTHS_KIM_MS)
    return Claim(
        "Fig. 4.2, Table 4.1",
        "Windows from counts (text's thresholds, twelve trials an ISI), person by person, against Table 4.1's widths.",
        ", ".join(str(width) for width in WIDTHS_KIM_MS) + " ms (from amplitudes)",
        ", ".join(f"{width:.0f}" for width in ours) + " ms (from counts)",
        f"{off.mean():+.0f} ± {off.std():.0f} ms",
        verdict(
            holds=bool(np.abs(off).mean() <= 10),
            otherwise="not, because 40 % of responses ask for more than a mean above the baseline, a run of ISIs "
            "breaks where chance leaves few of twelve, and Table 4.1's widths are those of the facilitation here",
        ),
    )


def _counted(seed: int) -> Claim:
    """Fig. 3.11: what is counted as a response."""
    silent, evoked = (isiw.signals.mep_amplitude(*_emg(mep_mv, seed)) for mep_mv in EXAMPLE_MV)
    return Claim(
        "Fig. 3.11, 3.3.4",
        "A response is counted where the MEP is larger than the person's threshold (subject 3: 30 µV).",
        "drawn, one sweep",
        f"{1000 * silent:.0f} µV is not counted, {1000 * evoked:.0f} µV is (simulated with none and with "
        f"{1000 * EXAMPLE_MV[1]:.0f} µV)",
        "no number to compare with",
        verdict(holds=silent < THRESHOLDS_MV[2] < evoked, otherwise="not, because the threshold does not part the two"),
    )


def _emg(mep_mv: float, seed: int) -> tuple[FloatArray, float, float]:
    """EMG of one sweep, its rate, and when the pulse came."""
    sweep = isiw.Tapper(lambda _: _Evoked(mep_mv), "subject3", seed=seed).answer(isiw.Stimulus(0, 60.0))
    emg = sweep.channels["emg"]
    return emg.values, emg.rate_hz, sweep.t_tms_ms


def _example(seed: int) -> Figure:
    """One sweep with a response, and one without."""
    picture, axes = panels(1, 2, width=4.0, height=2.4, sharey=True)
    for one, mep_mv in zip(axes[0], EXAMPLE_MV, strict=True):
        emg_mv, rate_hz, pulse_ms = _emg(mep_mv, seed)
        one.plot(np.arange(len(emg_mv)) / rate_hz * 1000 - pulse_ms, emg_mv, lw=0.7, color=OURS)
        one.axvspan(15, 35, color=THEIRS, alpha=0.4)
        one.set(xlim=(-80, 80), ylim=(-0.2, 0.2), xlabel="ms after the pulse (simulated)", ylabel="EMG [mV]")
    return picture


def _bars(studies: dict[str, CountStudy]) -> Figure:
    picture, axes = panels(len(studies), 1, width=7.0, height=2.0)
    for one, (kind, study) in zip(axes[:, 0], studies.items(), strict=True):
        _draw(one, study)
        one.set(title=f"{kind}: {_width_ms(study):.0f} ms effective in this sweep", ylabel="trials")
    axes[-1, 0].set(xlabel="ISI [ms]; blue: responses")
    return picture


def _draw(axes: Axes, study: CountStudy) -> None:
    counts = study.counts
    axes.bar(counts.index, counts["trials"], 4.4, color=THEIRS)
    axes.bar(counts.index, counts["responses"], 4.4, color=OURS)
    axes.axhline(EFFECTIVE_SHARE * counts["trials"].max(), color="black", lw=0.6, ls=":")


def _eleven(fixed: list[CountStudy], own: list[CountStudy]) -> Figure:
    picture, axes = panels(4, 3, width=2.8, height=1.6, sharex=True)
    for number, (one, a, b) in enumerate(zip(axes.flat, fixed, own, strict=False), 1):
        _draw(one, a)
        one.step(b.counts.index, b.counts["responses"], where="mid", color="#9e2a2b", lw=0.7)
        one.set_title(
            f"{number}: {1000 * a.threshold_mv:.0f} µV (text), {1000 * b.threshold_mv:.0f} µV (own)", fontsize=7
        )
    axes.flat[-1].axis("off")
    axes[-1, 1].set(xlabel="ISI [ms]; blue: text's threshold, red: own")
    return picture
