"""The intensities of a session's pulses, where a device sets them: what is set for each."""

from __future__ import annotations

import math

from isiw.errors import InvalidValueError
from isiw.log.headers import Header
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus, Trial
from isiw.visit import Control


def has_several(strategy: Strategy, header: Header) -> bool:
    """True if pulses of the session have several intensities."""
    return bool(strategy.intensities) or header.protocol.alone_pct_rmt is not None


def require_intensities(strategy: Strategy, header: Header) -> None:
    """Raise if an intensity that was named is beyond the limits, or the usual one is not known."""
    if not has_several(strategy, header):
        return
    usual, reckoned = header.visit.intensity_pct_rmt, strategy.usual_pct_rmt
    if usual is None or (reckoned is not None and not math.isclose(usual, reckoned)):
        raise InvalidValueError(
            "a session of several intensities needs the usual one of its pairs, at which the window is",
            got="none in the visit" if usual is None else f"{usual:g} in the visit, {reckoned:g} in the strategy",
            expected="the same intensity_pct_rmt in both",
            remedy="Write intensity_pct_rmt under [visit] (in Python visit=isiw.Visit(intensity_pct_rmt=90), and "
            "make_strategy(..., intensity_pct_rmt=90)).",
        )
    named, most = {usual, *strategy.intensities.named_pct_rmt}, header.limits.max_intensity_pct_rmt
    named |= {header.protocol.alone_pct_rmt or usual}
    if most is None or max(named) > most:
        raise InvalidValueError(
            "an intensity that was named is beyond the limits, so that it could not be set",
            got=f"{', '.join(f'{pct_rmt:g}' for pct_rmt in sorted(named))} % RMT",
            expected="a highest intensity in the limits" if most is None else f"at most {most:g} % RMT",
            remedy="Write max_intensity_pct_rmt under [limits] if your ethics approval allows it, or name others.",
        )


def set_for(control: Control | None, strategy: Strategy, header: Header) -> float | None:
    """The intensity that the device has to set for the next pulse [% RMT]; None for that which is set."""
    usual = header.visit.intensity_pct_rmt
    if control is Control.TAP_ALONE:
        return None
    if not has_several(strategy, header):
        return usual if _sets_usual(header) else None
    if control is None:
        return strategy.intensity_pct_rmt or usual
    return header.protocol.alone_pct_rmt or usual


def _sets_usual(header: Header) -> bool:
    """Whether a device is told the intensity of each pulse although all have one: it may stand at another's.

    Intensities that a plan has of its own are set by hand.
    """
    usual, most = header.visit.intensity_pct_rmt, header.limits.max_intensity_pct_rmt
    by_hand = header.intervention is not None and bool(header.intervention.plan.intensities_pct_rmt)
    sets = header.device.sets_intensity and not by_hand
    return sets and usual is not None and most is not None and usual <= most


def stimulus_of(trial: Trial, strategy: Strategy, header: Header) -> Stimulus:
    """The stimulus that a trial came of."""
    pct_rmt = trial.intensity_pct_rmt
    told = has_several(strategy, header) or _sets_usual(header)
    if pct_rmt is None and told and not trial.tap_alone:
        pct_rmt = header.visit.intensity_pct_rmt
    return Stimulus(trial.index, trial.commanded_isi_ms, trial.tap_alone, pct_rmt)
