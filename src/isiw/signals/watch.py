"""Keeps what trials so far show, and says when a person should look: doubts about amplitudes, sweeps and their window.

A finding in one trial counts only after several in a row; each kind of doubt about several trials is raised once.
Responses outside the MEP window, several in a row, equally long after the pulse at ISIs that differ, and none within
it, are taken for the MEP: the time of the pulse is wrong, or the window does not fit the muscle.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile
from typing import Final

import numpy as np

from isiw.design import DesignSpace
from isiw.findings import REMEDIES, Finding, Kind, Severity
from isiw.signals import rig
from isiw.signals.limits import ARTEFACT_MS, EMG_UNITS_MV, SignalLimits
from isiw.signals.mep import SPAN_S, Disturbance, at_rest, disturbance
from isiw.signals.plausible import OF_REST, Counted, Doubts, Response, counted_of, odd_amplitudes
from isiw.signals.rig import Evidence, tap_span_ms, too_early_by_chance
from isiw.sweeps import Measurement, Sweep
from isiw.trials import Trial, TrialTable
from isiw.types import BoolArray, FloatArray

SOUGHT_MS = (ARTEFACT_MS, 80.0)
"""Where a response is looked for [ms after the pulse]: behind the pulse's artefact, and before the person moves."""

CLEAR = 12.0
"""Peak-to-peak amplitude over the RMS at rest from which on there is a response outside the window."""

LEAST_MV = 0.02
SPAN_MS = 10.0
"""How far from its largest deflection a response reaches."""

TAIL = 1.5
"""Before the window nothing counts where the pulse's own artefact is larger by this factor: it may be its end."""

NEAR_MS = 5.0
"""So near the window an artefact that is larger than what is within it has not ended yet."""

IN_A_ROW = 4
ALIKE_MS = 4.0
DIFFERING_MS = 15.0
"""So many come equally long after the pulse, while the tap, and with it its reflexes, comes at times that differ."""

EDGE_SHARE = 0.1
"""The share of its largest deflection at which a response begins and ends."""

ROUND_MS = 5.0
"""A window is proposed in steps of this."""

VARIES = 1.5
"""From the smallest to the largest of several MEPs it is more than this; the end of an artefact is always the same."""


def shown_by(sweep: Sweep, trial: Trial, limits: SignalLimits, before_emg: FloatArray | None = None) -> Counted:
    """A trial as the checks of several trials look at it, with what its sweep shows."""
    rest_uv, emg = trial.background_rms_uv, sweep.channels["emg"]
    repeats = before_emg is not None and np.array_equal(emg.values, before_emg)
    found = disturbance(EMG_UNITS_MV[emg.unit] * emg.values, emg.rate_hz, at_rest(emg, trial))
    told = Counted(trial.mep_mv or 0.0, trial.isi_ms, rest_uv, disturbance=found, repeats=repeats)
    if found is not None:
        quiet = replace(emg, values=emg.values - found.course_mv / EMG_UNITS_MV[emg.unit])
        sweep = replace(sweep, channels={**sweep.channels, "emg": quiet})
    if trial.t_tms_ms is None or not rest_uv:
        return told
    if told.stands_out:
        span_ms = limits.mep_window_ms
        falls = _only_falls(sweep, trial, span_ms, rest_uv)
        return replace(
            told,
            cut_ms=None if falls else _cut_ms(sweep, trial, span_ms, rest_uv),
            is_tail=_is_artefact(sweep, trial, span_ms),
            only_falls=falls,
        )
    response = _outside(sweep, trial, limits.mep_window_ms)
    clear = response is not None and response.size_mv >= max(CLEAR * rest_uv / 1000, LEAST_MV)
    return replace(told, outside=response if clear else None)


def repeated(evidence: Evidence) -> Finding | None:
    """A sweep that is the one before."""
    if not evidence.told[-1].repeats:
        return None
    text = "The EMG of the last trial is that of the one before, sample by sample"
    return Finding(Kind.REPEATED, Severity.DOUBT, text, "Does the rig wait for the new recording?")


def hum(evidence: Evidence) -> Finding | None:
    """Mains hum, which was subtracted; not if there are few trials."""
    waves = _last_disturbed(evidence.told, "hum_mv")
    if len(waves) < IN_A_ROW:
        return None
    size_uv = 1000 * statistics.median(wave.hum_mv for wave in waves)
    text = (
        f"In {len(waves)} trials in a row most of the EMG at rest is a wave of {waves[0].hum_hz:.0f} Hz and "
        f"{size_uv:.0f} µV peak to peak: mains hum, which is subtracted from each MEP"
    )
    remedy = "Check ground and reference electrodes, shorten their cables, and keep power supplies away."
    return Finding(Kind.HUM, Severity.DOUBT, text, remedy)


def drift(evidence: Evidence) -> Finding | None:
    """A baseline that drifts, which was subtracted; not if there are few trials."""
    lines = _last_disturbed(evidence.told, "drift_mv_s")
    if len(lines) < IN_A_ROW:
        return None
    size_uv = 1000 * SPAN_S * statistics.median(abs(line.drift_mv_s) for line in lines)
    text = (
        f"In {len(lines)} trials in a row the level of the EMG drifts, by {size_uv:.0f} µV in {1000 * SPAN_S:.0f} ms "
        "before the pulse, which is subtracted"
    )
    remedy = "Are the electrodes dry or loose, or does a cable move? Otherwise set a high-pass filter of 10 Hz."
    return Finding(Kind.DRIFT, Severity.DOUBT, text, remedy)


def _last_disturbed(told: Sequence[Counted], by: str) -> list[Disturbance]:
    """What disturbs the last trials, back to the first that this does not disturb."""
    found = takewhile(lambda one: one is not None and getattr(one, by), (one.disturbance for one in reversed(told)))
    return [one for one in found if one is not None]


def misplaced(evidence: Evidence) -> Finding | None:
    """Responses outside the window; not where there are few, or another cause is likely."""
    alike = _last_alike(evidence.told) if evidence.told[-1].outside else []
    if len(alike) < IN_A_ROW or not _follow_the_pulse([isi_ms for isi_ms, _ in alike]):
        return None
    at_ms = statistics.median(response.at_ms for _, response in alike)
    first_ms, last_ms = evidence.limits.mep_window_ms
    sizes_mv = [response.size_mv for _, response in alike]
    if at_ms < first_ms and max(sizes_mv) < VARIES * min(sizes_mv):
        return None
    text = (
        f"In {len(alike)} trials the EMG has a response at about {at_ms:.0f} ms after the pulse, outside the MEP "
        f"window of {first_ms:g}–{last_ms:g} ms, and none within it"
    )
    remedy = "Is the time of the pulse right? Does the window fit the muscle? Or is it the stimulator's artefact?"
    return Finding(Kind.MISPLACED, Severity.DOUBT, text, remedy)


def cut_off(evidence: Evidence) -> Finding | None:
    """MEPs that are larger behind the window than within; not where there are few, or they may be of the tap."""
    cut = list(takewhile(lambda told: told.cut_ms is not None, (t for t in reversed(evidence.told) if t.stands_out)))
    if len(cut) < IN_A_ROW or not _follow_the_pulse([told.isi_ms for told in cut]):
        return None
    begin_ms, end_ms = (
        statistics.median(span) for span in zip(*(told.cut_ms for told in cut if told.cut_ms), strict=True)
    )
    first_ms, last_ms = evidence.limits.mep_window_ms
    window = f"the MEP window of {first_ms:g}–{last_ms:g} ms"
    text = f"In {len(cut)} trials in a row the EMG is larger just behind {window} than within it"
    wider = f"[{min(first_ms, ROUND_MS * (begin_ms // ROUND_MS)):g}, {ROUND_MS * -(-end_ms // ROUND_MS):g}]"
    remedy = (
        f"Responses last from about {begin_ms:.0f} to {end_ms:.0f} ms after the pulse. If these are the muscle's MEPs, "
        f"begin a new session with mep_window_ms = {wider} under [signals]."
    )
    return Finding(Kind.CUT_OFF, Severity.DOUBT, text, remedy)


def _cut_ms(sweep: Sweep, trial: Trial, window_ms: tuple[float, float], rest_uv: float) -> tuple[float, float] | None:
    """From when to when the EMG responds, if it is clearly larger behind the window than within."""
    emg_mv, since_ms, tap = _since_pulse(sweep, trial)
    within = (since_ms >= window_ms[0]) & (since_ms <= window_ms[1])
    behind = (since_ms > window_ms[1]) & (since_ms <= SOUGHT_MS[1]) & ~tap
    if not behind.any() or np.ptp(emg_mv[behind]) < max(np.ptp(emg_mv[within]), CLEAR * rest_uv / 1000, LEAST_MV):
        return None
    deviation = np.where((within | behind) & ~tap, np.abs(emg_mv), 0.0)
    responds = since_ms[deviation > max(EDGE_SHARE * deviation.max(), 0.5 * OF_REST * rest_uv / 1000)]
    return (float(responds[0]), float(responds[-1])) if responds.size else None


def artefact(evidence: Evidence) -> Finding | None:
    """Artefacts in the MEP window; not where there are few."""
    in_a_row = len(list(takewhile(lambda told: told.is_tail, reversed(evidence.told))))
    if in_a_row < IN_A_ROW:
        return None
    text = (
        f"In {in_a_row} trials in a row the EMG is much larger just before the MEP window, which begins "
        f"{evidence.limits.mep_window_ms[0]:g} ms after the pulse, than within it"
    )
    remedy = "Does the stimulator's artefact reach into the window? Or do MEPs begin earlier?"
    return Finding(Kind.ARTEFACT, Severity.DOUBT, text, remedy)


def _is_artefact(sweep: Sweep, trial: Trial, window_ms: tuple[float, float]) -> bool:
    """Whether what is in the MEP window comes out of something larger before it: the end of the pulse's artefact."""
    emg_mv, since_ms, tap = _since_pulse(sweep, trial)
    before = (since_ms >= max(SOUGHT_MS[0], window_ms[0] - NEAR_MS)) & (since_ms < window_ms[0]) & ~tap
    within = (since_ms >= window_ms[0]) & (since_ms <= window_ms[1])
    return _is_tail(emg_mv, within, before)


def decay(evidence: Evidence) -> Finding | None:
    """Slow decays in the MEP window; not where there are few."""
    in_a_row = len(list(takewhile(lambda told: told.only_falls, reversed(evidence.told))))
    if in_a_row < IN_A_ROW:
        return None
    text = f"In {in_a_row} trials in a row the EMG in the MEP window only falls, without a turn, as no MEP does"
    remedy = "Do skin and electrodes keep the stimulator's charge? Clean the skin, and move cables and ground."
    return Finding(Kind.ARTEFACT, Severity.DOUBT, text, remedy)


def _only_falls(sweep: Sweep, trial: Trial, window_ms: tuple[float, float], rest_uv: float) -> bool:
    """Whether a parabola that falls towards the level at rest leaves nothing larger than EMG at rest in the window."""
    emg_mv, since_ms, _ = _since_pulse(sweep, trial)
    within = (since_ms >= window_ms[0]) & (since_ms <= window_ms[1])
    share = (since_ms[within] - window_ms[0]) / (window_ms[1] - window_ms[0])
    fitted = np.polynomial.Polynomial.fit(share, emg_mv[within], 2, domain=[0, 1], window=[0, 1])
    steps = np.diff(np.abs(fitted(share)))
    return bool((steps <= 0).all() and np.ptp(emg_mv[within] - fitted(share)) <= OF_REST * rest_uv / 1000)


def _last_alike(told: Sequence[Counted]) -> list[tuple[float | None, Response]]:
    """The last responses since an MEP in the window, and their ISIs, back to one at another time after the pulse."""
    found = list[tuple[float | None, Response]]()
    for one in reversed(told):
        if one.rest_uv and one.stands_out:
            break
        if one.outside is not None:
            if found and abs(one.outside.at_ms - found[0][1].at_ms) > ALIKE_MS:
                break
            found.append((one.isi_ms, one.outside))
    return found


def _follow_the_pulse(isis_ms: Sequence[float | None]) -> bool:
    """Whether they follow the pulse, and not the tap."""
    pairs_ms = [isi_ms for isi_ms in isis_ms if isi_ms is not None]
    return len(pairs_ms) < len(isis_ms) or max(pairs_ms) - min(pairs_ms) >= DIFFERING_MS


def _outside(sweep: Sweep, trial: Trial, window_ms: tuple[float, float]) -> Response | None:
    """The largest response outside the window; None where nothing can be told from pulse and tap."""
    emg_mv, since_ms, tap = _since_pulse(sweep, trial)
    before = (since_ms >= SOUGHT_MS[0]) & (since_ms < window_ms[0]) & ~tap
    behind = (since_ms > window_ms[1]) & (since_ms <= SOUGHT_MS[1]) & ~tap
    artefact = (since_ms >= -1.0) & (since_ms < SOUGHT_MS[0])
    found = [] if _is_tail(emg_mv, before, artefact) else [_largest(emg_mv, since_ms, before)]
    found.append(_largest(emg_mv, since_ms, behind))
    return max((one for one in found if one is not None), key=lambda one: one.size_mv, default=None)


def _since_pulse(sweep: Sweep, trial: Trial) -> tuple[FloatArray, FloatArray, BoolArray]:
    """The EMG about its level at rest [mV], its times [ms after the pulse], and which samples may show the tap."""
    emg = sweep.channels["emg"]
    times_ms = emg.t0_ms + np.arange(emg.values.size) * 1000 / emg.rate_hz
    since_ms, span_ms = times_ms - (trial.t_tms_ms or 0.0), tap_span_ms(trial) or (math.inf, math.inf)
    tap = (times_ms >= span_ms[0]) & (times_ms <= span_ms[1])
    at_rest = (since_ms < -1.0) & ~tap
    level = np.median(emg.values[at_rest] if at_rest.any() else emg.values)
    return EMG_UNITS_MV[emg.unit] * (emg.values - level), since_ms, tap


def _is_tail(emg_mv: FloatArray, before: BoolArray, artefact: BoolArray) -> bool:
    if not before.any() or not artefact.any():
        return False
    return bool(np.abs(emg_mv[artefact]).max() > TAIL * np.abs(emg_mv[before]).max())


def _largest(emg_mv: FloatArray, since_ms: FloatArray, sought: BoolArray) -> Response | None:
    if not emg_mv[sought].any():
        return None
    top_ms = since_ms[sought][np.abs(emg_mv[sought]).argmax()]
    near = sought & (np.abs(since_ms - top_ms) <= SPAN_MS)
    power = emg_mv[near] ** 2
    at_ms = float((since_ms[near] * power).sum() / power.sum())  # wherever noise puts the larger of its turns
    return Response(at_ms, float(np.ptp(emg_mv[near])))


OF_SWEEP: Final = (rig.unusable_emg, rig.wrong_acceleration, rig.no_origin, rig.double_pulse, rig.stray_edge)
"""Checks of the last trial and its sweep, the surest first: the first finding explains the others."""

OF_TRIAL: Final = (rig.wrong_level, rig.lost_trial)
"""Checks of the last trial, be there a sweep or not."""

OF_SWEEPS: Final = (hum, drift, misplaced, cut_off, artefact, decay)
"""Checks of what the sweeps of the trials that count so far show."""


def findings(evidence: Evidence) -> Iterator[Finding]:
    """What is found in some evidence, in the order of the checks."""
    trial, answer = evidence.trial, evidence.answer
    if trial is not None and isinstance(answer, Sweep):
        yield from filter(None, (find(answer, trial) for find in OF_SWEEP))
    if trial is not None:
        yield from filter(None, (find(trial, evidence) for find in OF_TRIAL))
    if evidence.told:
        yield from filter(None, [repeated(evidence)])
        yield from odd_amplitudes(evidence.told, evidence.detection_limit_mv)
        yield from filter(None, (find(evidence) for find in OF_SWEEPS))


EARLY_IN_A_ROW: Final = 9
"""By chance a pulse is early at one ISI a few times in a row; after three, strategies that may choose ask elsewhere."""


@dataclass(frozen=True)
class Watch:
    """What was found in the trials so far, and what speaks for a pause."""

    space: DesignSpace
    signals: SignalLimits
    max_in_a_row: int
    detection_limit_mv: float | None = None
    in_a_row: int = 0  # trials that were rejected, or show a faulty rig
    early_ms: float | None = None
    early: int = 0  # pulses in a row, at this ISI, that came before the impact by chance
    told: tuple[Counted, ...] = ()  # the trials that count, with what their sweeps show
    emg: FloatArray | None = field(default=None, compare=False, repr=False)
    doubts: Doubts = field(default_factory=Doubts)
    paused_for: frozenset[Kind] = frozenset()  # what a person has seen: of trials that count, it is said once
    pause: Finding | None = None  # why to pause now, if at all

    def resumed(self, trials: TrialTable, paused_for: Iterable[Kind]) -> Watch:
        """The same after earlier trials; whoever resumes the session has seen their doubts and its pauses."""
        seen, told = frozenset(paused_for), counted_of(trials)
        doubts = Doubts.seen(told, self.detection_limit_mv)
        return replace(self, told=told, doubts=Doubts(doubts.raised | seen), paused_for=seen)

    def seen(self) -> Watch:
        """The same after a person has seen the reason and went on."""
        seen = self.paused_for if self.pause is None else self.paused_for | {self.pause.kind}
        return replace(self, in_a_row=0, early=0, paused_for=seen, pause=None)

    def after(self, trial: Trial, answer: Sweep | Measurement) -> Watch:
        """The same after one more trial."""
        before = replace(self, doubts=self.doubts.after(()))
        if too_early_by_chance(trial, self.space):
            return _after_early(before, trial)
        found = next(findings(Evidence(trial, answer, self.signals)), None)
        if found is None or (found.severity is Severity.NOTE and found.kind in self.paused_for):
            learned = replace(before, in_a_row=0, pause=None)
        else:
            count = self.in_a_row + 1
            trials = "the last trial" if count == 1 else f"{count} trials in a row, in the last one"
            pause = replace(found, severity=Severity.PAUSE, text=f"Something was wrong in {trials}: {found.text}")
            learned = replace(before, in_a_row=count, pause=pause if count >= self.max_in_a_row else None)
        if trial.commanded_isi_ms is not None:  # a control trial says nothing about an ISI
            learned = replace(learned, early_ms=None, early=0)
        return _after_counted(learned, trial, answer)


def _after_counted(watch: Watch, trial: Trial, answer: Sweep | Measurement) -> Watch:
    """After a trial that may count: what is odd about it and those before."""
    if trial.mep_mv is None or not trial.told or trial.intensity_pct_rmt is not None:
        return watch
    if isinstance(answer, Sweep):
        told = shown_by(answer, trial, watch.signals, watch.emg)
        watch = replace(watch, emg=answer.channels["emg"].values.copy())  # a device may fill one buffer again and again
    else:
        told = Counted(trial.mep_mv, trial.isi_ms, trial.background_rms_uv)
    watch = replace(watch, told=(*watch.told, told))
    evidence = Evidence(limits=watch.signals, told=watch.told, detection_limit_mv=watch.detection_limit_mv)
    doubts = watch.doubts.after(findings(evidence))
    return replace(watch, doubts=doubts, pause=watch.pause or doubts.new)


def _after_early(watch: Watch, trial: Trial) -> Watch:
    """After a pulse that came before the impact by chance: at one ISI that does not happen for ever."""
    early = watch.early + 1 if trial.commanded_isi_ms == watch.early_ms else 1
    pause = None
    if early >= EARLY_IN_A_ROW:
        text = f"At {trial.commanded_isi_ms:g} ms the pulse came before the impact {early} times in a row"
        remedy = f"{REMEDIES[Kind.TMS_BEFORE_IMPACT]} Or begin the space at a larger ISI."
        pause = Finding(Kind.EARLY_AT_ONE_ISI, Severity.PAUSE, text, remedy)
    return replace(watch, early_ms=trial.commanded_isi_ms, early=early, pause=pause)
