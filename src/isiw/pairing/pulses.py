"""What an intervention delivered: pulses of TMS alone before and after it, and its pairs."""

from __future__ import annotations

from dataclasses import dataclass

from isiw.checks import Amplitude, Checked, Number, Positive, Text


@dataclass(frozen=True)
class TestPulse(Checked):
    """A pulse of TMS alone that measures excitability before or after an intervention.

    Args:
        mep_mv: peak-to-peak amplitude [mV]; 0 where there is no MEP.
        intensity_pct_rmt: its intensity, as given [% RMT].
        after_last_pair_s: time since the last pair was delivered [s]; negative before the intervention.
        block: its block: "before", "after 0 min", "after 15 min".

    Raises:
        InvalidValueError: an amplitude below 0, or a value that is not finite.
    """

    __test__ = False  # for pytest, which takes the name for that of a test

    mep_mv: Amplitude
    intensity_pct_rmt: Positive
    after_last_pair_s: Number
    block: Text


@dataclass(frozen=True)
class Delivered(Checked):
    """A pair of the intervention.

    Args:
        isi_ms: its ISI [ms].
        at_s: when it was delivered, since the first pair [s].
        mep_mv: peak-to-peak amplitude [mV]; None if it was lost.
        probe: whether it was a probe of the window, and no pair at the best ISI.

    Raises:
        InvalidValueError: a value that is not finite, or an amplitude below 0.
    """

    isi_ms: Number
    at_s: Number
    mep_mv: Amplitude | None
    probe: bool
