"""The findings of a device's check, as a table that a person reads before the first session."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from isiw.devices.info import DeviceInfo
from isiw.devices.protocol import Answer, Device, HasMemory, unprotected
from isiw.findings import Kind
from isiw.signals.limits import EMG_UNITS_MV, SignalLimits
from isiw.signals.rig import EVOKED_SPAN_MS, steepest_edge, tap_span_ms
from isiw.sweeps import Sweep
from isiw.trials import RESPONSE_MV, Stimulus, Trial

OF_TIMING = frozenset({Kind.TMS_BEFORE_IMPACT, Kind.ISI_OFF})
"""What comes of a hit delay that is not the one that the rig assumes."""

ALIKE_MS = 8.0
"""The ISIs that are off by the hit delay are off by the same, but for how the hit varies from tap to tap."""

NEAR_PULSE_MS = 3.0
"""How far from the reported pulse its artefact's steepest edge may be."""


REFUSED: Final = 6
"""So many stimuli are tried while the device is disarmed, which must refuse them."""


@dataclass(frozen=True, eq=False)
class Delivery:
    """One stimulus of a check, the device's answer, and the trial that a session would have made of it."""

    stimulus: Stimulus
    answer: Answer
    trial: Trial
    took_s: float


@dataclass(frozen=True)
class DeviceTable:
    """The findings, a row a question."""

    rows: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        width = max(len(what) for what, _ in self.rows)
        return "\n".join(f"{what.ljust(width)}  {found}" for what, found in self.rows)


def device_table(info: DeviceInfo, deliveries: Sequence[Delivery], limits: SignalLimits) -> DeviceTable:
    """The table of a check."""
    trials, late_ms = [delivery.trial for delivery in deliveries], edges_ms(deliveries)
    errors = [f"{trial.isi_error_ms:+.1f}" for trial in trials if trial.isi_error_ms is not None]
    meps_uv = [1e3 * trial.mep_mv for trial in trials if trial.mep_mv is not None]
    artefact = f"steepest edge of the EMG {np.median(late_ms):+.1f} ms from the pulse" if late_ms else "none seen"
    return DeviceTable(
        (
            ("background EMG", _background(trials, limits)),
            ("impact found", _impacts(deliveries)),
            ("realised minus wanted ISI", f"{', '.join(errors)} ms" if errors else "not known"),
            ("acceleration begins", _deflections(deliveries)),
            ("MEP window", _windows(deliveries, limits)),
            ("amplitudes in it", f"{min(meps_uv):.3g} to {max(meps_uv):.3g} µV" if meps_uv else "none"),
            ("pulse artefact", artefact),
            ("units", ", ".join(f"{name} in {unit}" for name, unit in info.channels.items()) or "MEP in mV"),
            ("time per trial", f"{max(delivery.took_s for delivery in deliveries):.2g} s at most"),
            ("judged", ", ".join(f"{trial.reason or 'accepted'}" for trial in trials)),
        )
    )


def _background(trials: Sequence[Trial], limits: SignalLimits) -> str:
    levels_uv = [trial.background_rms_uv for trial in trials if trial.background_rms_uv is not None]
    if not levels_uv:
        return "not known"
    return f"{statistics.median(levels_uv):.3g} µV RMS (a session accepts {limits.background_uv:g} at most)"


def _impacts(deliveries: Sequence[Delivery]) -> str:
    sweeps = [(d.answer, d.trial) for d in deliveries if d.stimulus.isi_ms is not None and isinstance(d.answer, Sweep)]
    sought = [trial for sweep, trial in sweeps if sweep.t_hit_ms is None and "acceleration" in sweep.channels]
    if not sought:
        return "given by the device, or not needed"
    return f"{sum(trial.t_hit_ms is not None for trial in sought)} of {len(sought)}"


DEFLECTED_SD: Final = 6.0
"""So many SDs of its rest an acceleration leaves where it is deflected."""


def deflections_ms(deliveries: Sequence[Delivery]) -> list[float]:
    """When the acceleration is first deflected after the valve command, of each pair with an impact [ms after it]."""
    found = []
    for delivery in deliveries:
        sweep, trial = delivery.answer, delivery.trial
        channel = sweep.channels.get("acceleration") if isinstance(sweep, Sweep) else None
        if channel is None or trial.t_hit_ms is None or trial.t_valve_ms is None:
            continue
        valve = round((trial.t_valve_ms - channel.t0_ms) * channel.rate_hz / 1000)
        rest, since = channel.values[: max(valve, 0)], channel.values[max(valve, 0) :]
        if rest.size < 2:
            continue
        moved = np.flatnonzero(np.abs(since - rest.mean()) > DEFLECTED_SD * rest.std())
        if moved.size:
            found.append(trial.t_valve_ms + 1000 * int(moved[0]) / channel.rate_hz - trial.t_hit_ms)
    return found


def _deflections(deliveries: Sequence[Delivery]) -> str:
    found_ms = deflections_ms(deliveries)
    if not found_ms:
        return "not recorded"
    usual_ms = float(np.median(found_ms))
    return f"{abs(usual_ms):.1f} ms {'before' if usual_ms <= 0 else 'after'} the impact"


def late_deflection(deliveries: Sequence[Delivery]) -> str | None:
    """The fault if the acceleration begins after the impact, as where the sensor is not on the hammer."""
    found_ms = deflections_ms(deliveries)
    usual_ms = float(np.median(found_ms)) if found_ms else 0.0
    if usual_ms <= NEAR_PULSE_MS:
        return None
    return (
        f"the acceleration is first deflected {usual_ms:.1f} ms after the reported impact, and a hammer moves before "
        "it hits. Is the accelerometer on the hammer? Are both times on the sweep's own clock?"
    )


def _windows(deliveries: Sequence[Delivery], limits: SignalLimits) -> str:
    sweeps = [delivery.answer for delivery in deliveries if isinstance(delivery.answer, Sweep)]
    found = ((sweep.channels.get("emg"), sweep.t_tms_ms) for sweep in sweeps)
    about = [(emg, pulse_ms) for emg, pulse_ms in found if emg is not None and pulse_ms is not None]
    low, high = limits.mep_window_ms
    wanted = f"{low:g} to {high:g} ms after the pulse"
    if not about:
        return f"{wanted}; the device itself measures the MEP" if not sweeps else f"{wanted}; not recorded"
    first = max(emg.t0_ms - pulse_ms for emg, pulse_ms in about)
    last = min(emg.t0_ms + 1000 * (emg.values.size - 1) / emg.rate_hz - pulse_ms for emg, pulse_ms in about)
    return f"{wanted}; the EMG is recorded from {first:.0f} to {last:.0f} ms"


def wrong_hit_delay(deliveries: Sequence[Delivery]) -> str | None:
    """That all pulses are off by what the rig assumes of the hit, and by how much; None if they are not."""
    trials = [delivery.trial for delivery in deliveries]
    off_ms = [-trial.isi_error_ms for trial in trials if trial.isi_error_ms is not None]
    if len(off_ms) < 2 or np.ptp(off_ms) > ALIKE_MS or abs(late_ms := float(np.median(off_ms))) <= NEAR_PULSE_MS:
        return None
    change = f"{'add' if late_ms > 0 else 'take off'} {abs(late_ms):.0f} ms"
    hits_ms = [t.t_hit_ms - t.t_valve_ms for t in trials if t.t_hit_ms is not None and t.t_valve_ms is not None]
    if not hits_ms:
        early = "early" if late_ms > 0 else "late"
        return f"the pulse came {abs(late_ms):.0f} ms too {early}: {change} where your rig assumes the hit delay."
    hit_ms = float(np.median(hits_ms))
    assumed = f"your rig assumes {hit_ms - late_ms:.0f} ms: {change}"
    return f"the impact came {hit_ms:.0f} ms after the valve command; {assumed}."


def edges_ms(deliveries: Sequence[Delivery]) -> list[float]:
    """When the steepest edge of each EMG comes, if one stands out and is not the tap's [ms after the pulse]."""
    found = [_edge_ms(delivery.answer, delivery.trial) for delivery in deliveries if isinstance(delivery.answer, Sweep)]
    return [edge_ms for edge_ms in found if edge_ms is not None]


def _edge_ms(sweep: Sweep, trial: Trial) -> float | None:
    emg = sweep.channels.get("emg")
    edge_ms = None if emg is None else steepest_edge(emg)
    if emg is None or edge_ms is None or trial.t_tms_ms is None:
        return None
    late_ms = edge_ms - trial.t_tms_ms
    edge = round((edge_ms - emg.t0_ms) * emg.rate_hz / 1000)
    moved = np.flatnonzero(emg.values[:edge] != emg.values[edge])
    held = int(moved[-1]) + 1 if moved.size else 0  # since when; an amplifier that blanks the pulse lets go after it
    blanked_ms = emg.t0_ms + 1000 * held / emg.rate_hz - trial.t_tms_ms
    if abs(blanked_ms) <= NEAR_PULSE_MS:
        return blanked_ms
    tap_ms = tap_span_ms(trial)
    is_taps = abs(late_ms) > NEAR_PULSE_MS and tap_ms is not None and tap_ms[0] <= edge_ms <= tap_ms[1]
    return None if is_taps else late_ms


FACTOR: Final = 3.0
"""From one stretch of noise to the next of the same length the range differs by less than half; hum adds nothing."""


def artefact_in_window(deliveries: Sequence[Delivery], signals: SignalLimits) -> str | None:
    """The fault if TMS alone, or more than one pair, shows an MEP without a muscle; None if there is none.

    An amplitude of less than a response is left to the EMG's noise. Where the coil alone is on a phantom, the reflex of
    a tap may lie in the window, but at one of the ISIs only; a tap's artefact may hide the stimulator's at another.
    """
    for alone, least, what in ((True, 1, "TMS alone"), (False, 2, "more than one pair")):
        pulses = [d for d in deliveries if not d.stimulus.tap_alone and (d.stimulus.isi_ms is None) is alone]
        shown = [pair for pair in (_shown(delivery, signals) for delivery in pulses) if pair is not None]
        if len(shown) >= least:
            mep_mv, rest_mv = min(shown)
            sizes = f"{1e3 * mep_mv:.3g} µV in the MEP window, where the EMG before has {1e3 * rest_mv:.2g} µV"
            return (
                f"a phantom has no muscle, and {what} has {sizes}: a stimulator artefact lies in the MEP window. "
                "Is the reported time of the pulse right?"
            )
    return None


def late_artefact(deliveries: Sequence[Delivery]) -> str | None:
    """The fault if the stimulator's artefact comes after the reported pulse; None if there is none.

    One that comes before it, or much later, is the likely fault of each sweep already. Where no edge stands out of the
    EMG, as behind an amplifier that blanks the pulse, nobody can tell.
    """
    late_ms = edges_ms(deliveries)
    usual_ms = float(np.median(late_ms)) if late_ms else 0.0
    if not NEAR_PULSE_MS < usual_ms <= EVOKED_SPAN_MS[1]:
        return None
    return (
        f"a phantom evokes nothing, and the steepest edge of the EMG is {usual_ms:+.1f} ms from the reported pulse: "
        "the stimulator's artefact is not where the pulse is said to be. Is the reported time of the pulse right? "
        "Check the delay of the EMG's trigger, the sampling rate, and that all times are on the sweep's own clock."
    )


def _shown(delivery: Delivery, signals: SignalLimits) -> tuple[float, float] | None:
    """The amplitude and that of the EMG before [mV], if the one is clearly above the other."""
    mep_mv, rest_mv = delivery.trial.mep_mv, _at_rest_mv(delivery, signals)
    if mep_mv is None or rest_mv is None or mep_mv < max(RESPONSE_MV, FACTOR * rest_mv):
        return None
    return mep_mv, rest_mv


def _at_rest_mv(delivery: Delivery, signals: SignalLimits) -> float | None:
    """Peak-to-peak of stretches as long as the MEP window, before pulse and tap [mV]; None if there is none."""
    sweep, trial = delivery.answer, delivery.trial
    if not isinstance(sweep, Sweep):
        return None
    emg = sweep.channels["emg"]
    events_ms = [time for time in (trial.t_tms_ms, trial.t_hit_ms, trial.t_valve_ms) if time is not None]
    end = int((min(events_ms, default=emg.t0_ms) - emg.t0_ms) * emg.rate_hz / 1000)
    length = round((signals.mep_window_ms[1] - signals.mep_window_ms[0]) * emg.rate_hz / 1000)
    edges = range(0, min(max(end, 0), emg.values.size) + 1, max(length, 1))
    ranges = [float(np.ptp(emg.values[first:last])) for first, last in itertools.pairwise(edges)]
    return EMG_UNITS_MV[emg.unit] * float(np.median(ranges)) if ranges else None


def announcement(device: Device, iti_s: float) -> str:
    """How many stimuli a check gives, one every `iti_s` [s], in words, and how long it takes; nothing is delivered."""
    info = device.describe()
    if info.simulated:
        return f"{info.name} is simulated: nothing is delivered to anybody."
    pairs = 8 if isinstance(device, HasMemory) else 3
    alone = ", one magnetic pulse alone and one tap alone" if info.tap_alone else " and one magnetic pulse alone"
    tried = pairs + (2 if info.tap_alone else 1) + REFUSED
    warning = unprotected(info)
    return (
        f"This check stimulates: {pairs} pairs{alone}, {iti_s:g} s apart. It then arms and disarms the device, which "
        f"must refuse {REFUSED} stimuli more; in all about {tried * iti_s:.0f} s. Keep the coil on a phantom."
        f"{f' {warning}' if warning else ''}"
    )
