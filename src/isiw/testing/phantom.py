"""What the EMG of a phantom shows after the pulse: it has no muscle, so what is larger than before is an artefact."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np

from isiw.signals import SignalLimits
from isiw.signals.limits import EMG_UNITS_MV
from isiw.signals.rig import EVOKED_SPAN_MS
from isiw.testing.device_table import NEAR_PULSE_MS, Delivery, edges_ms
from isiw.trials import RESPONSE_MV, Sweep

FACTOR: Final = 3.0
"""From one stretch of noise to the next of the same length the range differs by less than half; hum adds nothing."""


def artefact_in_window(deliveries: Sequence[Delivery], signals: SignalLimits) -> str | None:
    """What is wrong where TMS alone, or more than one pair, shows an MEP without a muscle; None where nothing is.

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
    """What is wrong where the stimulator's artefact comes after the reported pulse; None where none does.

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
    """The amplitude and that of the EMG before [mV], where the one is clearly above the other."""
    mep_mv, rest_mv = delivery.trial.mep_mv, _at_rest_mv(delivery, signals)
    if mep_mv is None or rest_mv is None or mep_mv < max(RESPONSE_MV, FACTOR * rest_mv):
        return None
    return mep_mv, rest_mv


def _at_rest_mv(delivery: Delivery, signals: SignalLimits) -> float | None:
    """Peak-to-peak of stretches as long as the MEP window, before pulse and tap [mV]; None where there is none."""
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
