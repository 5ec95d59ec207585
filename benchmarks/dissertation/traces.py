"""Enhanced MEPs of one person, sweep by sweep and on average: Fig. 4.21 and 4.22."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from matplotlib.figure import Figure

import isiw
from benchmarks.dissertation.claims import Claim, put_to_test
from benchmarks.dissertation.parts import Told, verdict
from benchmarks.dissertation.size import Size
from benchmarks.reduction.look import OURS, panels
from isiw.design import IMPACT_SPACE
from isiw.devices.robot.mechanism import EventTime
from isiw.devices.robot.tapper import preset
from isiw.subjects import SimulatedSubject, cohort
from isiw.types import FloatArray
from isiw.window import Window

__all__ = ["tell"]

COHORT: Final = "kim11-measured"
RESPONSES_MS: Final = (245.0, 305.0)
"""Fig. 4.21: between which ISIs from the valve command there were responses."""

PUT_IN: Final = {"Subject 4": "fitted: the person was made so that the measured width is Table 4.1's"}

NOTE: Final = (
    f"Simulated people of the cohort `{COHORT}`: subject 1, with the window moved to where the figure has it, on the "
    "robot's waveforms, and subject 4."
)


def tell(size: Size, seed: int) -> Told:  # noqa: ARG001 - one person each, however large the run
    """This part of the gallery."""
    people = cohort(COHORT, 4, seed)
    pictures = {"Fig. 4.21": _stack(people[0], seed), "Fig. 4.22": _means(people[3], seed)}
    claims = put_to_test([_traces(people[0], seed), _fourth(people[3], seed)], {}, PUT_IN)
    return Told(NOTE, claims, pictures)


def _traced(person: SimulatedSubject, seed: int) -> dict[str, tuple[float, isiw.Sweep]]:
    """One sweep at each ISI of Fig. 4.21, and the controls, of a person whose window lies where subject 1's did."""
    centre_ms = 0.5 * sum(RESPONSES_MS) - 183.0
    profile = replace(person.profile, start_ms=centre_ms - 0.5 * person.profile.width_ms)
    responder = replace(person, profile=profile, hit_delay_sd_ms=0.0).begin(seed)
    settings = isiw.TapperSettings(reference="valve", expected_hit_ms=183.0)
    geometry = replace(preset("subject1"), descent=EventTime(131, 2), hit=EventTime(183, 1.0))
    robot = isiw.Tapper(lambda isi_ms: responder.respond(isi_ms, "impact"), geometry, settings, seed=seed)
    stimuli = {f"{isi_ms:g} ms": isiw.Stimulus(k, isi_ms) for k, isi_ms in enumerate(np.arange(310.0, 235.0, -5.0))}
    stimuli |= {"TMS alone": isiw.Stimulus(20, None), "tap alone": isiw.Stimulus(21, None, tap_alone=True)}
    return {name: (s.isi_ms or np.nan, robot.answer(s)) for name, s in stimuli.items()}


def _responds(sweep: isiw.Sweep, threshold_mv: float = 0.026) -> bool:
    emg = sweep.channels["emg"]
    # A tap alone is measured where the MEP of a pulse in the middle of the range would be.
    pulse_ms = sweep.t_valve_ms + 0.5 * sum(RESPONSES_MS) if sweep.t_tms_ms is None else sweep.t_tms_ms
    return bool(isiw.signals.mep_amplitude(emg.values, emg.rate_hz, pulse_ms) > threshold_mv)


def _traces(person: SimulatedSubject, seed: int) -> Claim:
    traced = _traced(person, seed)
    inside = {name for name, (isi_ms, _) in traced.items() if RESPONSES_MS[0] <= isi_ms <= RESPONSES_MS[1]}
    seen = {name for name, (_, sweep) in traced.items() if _responds(sweep)}
    return Claim(
        "Fig. 4.21",
        "One sweep at each ISI: responses from 245 to 305 ms after the valve command, none at 240, 310, nor alone.",
        "13 of 13 inside, 0 of 4 else",
        f"{len(seen & inside)} of {len(inside)} inside, {len(seen - inside)} of {len(traced) - len(inside)} else "
        "(more than 26 µV)",
        f"{len(seen & inside) - 13:+d} inside",
        verdict(
            holds=seen == inside,
            otherwise="not, because single responses of simulated people go missing, as those of recorded ones do",
        ),
    )


def _swept(person: SimulatedSubject, seed: int) -> tuple[FloatArray, FloatArray, float]:
    """Ten MEPs at each 5 ms of ISI from the impact [mV], and the mean of TMS alone at 100 % RMT (4.2.1) [mV]."""
    responder = person.begin(seed)
    at_rmt = replace(person, response=replace(person.response, intensity_pct_rmt=100.0)).begin(seed)
    alone_mv = float(np.mean([at_rmt.respond(None, "impact").mep_mv for _ in range(100)]))
    isi_ms = np.arange(0.0, 160.0, 5.0)
    return isi_ms, np.array([[responder.respond(i, "impact").mep_mv for _ in range(10)] for i in isi_ms]), alone_mv


def _fourth(person: SimulatedSubject, seed: int) -> Claim:
    isi_ms, mep_mv, alone_mv = _swept(person, seed)
    above = Window.from_mask(isi_ms, mep_mv.mean(axis=1) > alone_mv)
    peak_ms = isi_ms[mep_mv.mean(axis=1).argmax()]
    low, high = (0.0, 0.0) if above is None else next(s for s in above.segments if s[0] <= peak_ms <= s[1])
    true = person.window(IMPACT_SPACE)
    cv = float((mep_mv.std(axis=1, ddof=1) / mep_mv.mean(axis=1)).mean())
    return Claim(
        "Fig. 4.22",
        "Subject 4: the means of ten MEPs exceed the baseline over 70 ms; single MEPs vary much.",
        "5 to 75 ms: 70 ms",
        f"{low:g} to {high:g} ms: {high - low:g} ms (true window {true}); mean CV {cv:.1f}",
        f"{high - low - 70:+g} ms",
        verdict(
            holds=abs(high - low - 70) <= 10,
            otherwise="not, because means of ten near the edges are above the baseline or not by chance",
        ),
    )


def _stack(person: SimulatedSubject, seed: int) -> Figure:
    picture, axes = panels(1, 1, width=6.0, height=5.0)
    for row, (name, (_, sweep)) in enumerate(_traced(person, seed).items()):
        emg = sweep.channels["emg"].values
        at = sweep.t_tms_ms or 800.0
        times = np.arange(len(emg)) / sweep.channels["emg"].rate_hz * 1000 - at
        near = (times > -60) & (times < 60)
        colour = "#9e2a2b" if _responds(sweep) else "black"
        axes[0, 0].plot(times[near], np.clip(emg[near], -0.1, 0.1) - 0.2 * row, lw=0.6, color=colour)
        axes[0, 0].text(62, -0.2 * row, name, fontsize=7, va="center")
    axes[0, 0].set(xlabel="ms after the pulse; red: response", yticks=[])
    return picture


def _means(person: SimulatedSubject, seed: int) -> Figure:
    isi_ms, mep_mv, alone_mv = _swept(person, seed)
    picture, axes = panels(1, 1, width=5.5)
    axes[0, 0].errorbar(isi_ms, mep_mv.mean(axis=1), mep_mv.std(axis=1), color=OURS, lw=1, elinewidth=0.6)
    axes[0, 0].axhline(alone_mv, color="black", lw=0.6, ls=":")
    axes[0, 0].set(xlabel="ISI from the impact [ms]; dotted: TMS alone", ylabel="MEP, mean and SD [mV]")
    return picture
