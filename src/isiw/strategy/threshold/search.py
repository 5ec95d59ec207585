"""The search for a threshold: proposes intensities, learns from pulses, and says when it is over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from typing import Any, Final

from isiw.checks import choice, number
from isiw.decision import StopDecision, StopKind
from isiw.errors import InvalidValueError
from isiw.signals.plausible import implausible_scale, require_amplitude
from isiw.strategy.threshold.bayes import BayesThreshold, FiveOfTen, MaximumLikelihood
from isiw.strategy.threshold.curve import CurvePulses
from isiw.strategy.threshold.estimate import IntensityRange, ThresholdEstimate
from isiw.strategy.threshold.hotspot import BayesHotSpot
from isiw.strategy.threshold.pulses import Pulse, ThresholdMethod, hardly_larger, not_growing, one_sided
from isiw.text.toml_files import checked

METHODS: Final[Mapping[str, type[BayesThreshold | MaximumLikelihood | FiveOfTen | CurvePulses]]] = {
    "bayes": BayesThreshold,
    "maximum-likelihood": MaximumLikelihood,
    "five-of-ten": FiveOfTen,
    "curve": CurvePulses,
}

_LOOK: Final = "Do the amplitudes grow with the intensity? If they do not, look for hum or an artefact in the EMG."
"""What to do if the budget is used up and the pulses give no number."""

HOT_SPOT: Final = "hot-spot"
"""The method that seeks the hot spot instead of a threshold."""


def list_threshold_methods() -> dict[str, str]:
    """The named ways to a threshold and what each does in a sentence."""
    return {name: (method.__doc__ or "").split("\n", 1)[0] for name, method in METHODS.items()}


def make_threshold_search(name: str, space: IntensityRange, **settings: Any) -> ThresholdSearch:
    """Make a named search.

    Args:
        name: one of `list_threshold_methods()`, or "hot-spot".
        space: the intensities that may be asked.
        **settings: what differs from the defaults of the method.

    Raises:
        ConfigError: a setting that the method does not have, or an invalid one.
        InvalidValueError: an unknown name.
        LimitExceededError: an intensity of the curve beyond the range, or off its grid.
    """
    methods: Mapping[str, type[Any]] = {**METHODS, HOT_SPOT: BayesHotSpot}
    choice("the method", name, methods)
    method = checked(methods[name], settings, f"the settings of {name}")
    if isinstance(method, CurvePulses):
        method.require_within(space)
    return ThresholdSearch(name, method, space)


class ThresholdSearch:
    """Proposes the next intensity and learns from each pulse. What it knows are the pulses, and nothing else.

    Args:
        name: of the method, for the log.
        method: how the threshold is sought.
        space: the intensities that may be asked.
    """

    def __init__(self, name: str, method: ThresholdMethod, space: IntensityRange) -> None:
        self.name, self.method, self.space = name, method, space
        self.pulses: tuple[Pulse, ...] = ()

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of the method, as plain values; of one's own, which is no dataclass, there are none."""
        method: object = self.method
        return asdict(method) if is_dataclass(method) and not isinstance(method, type) else {}

    def ask(self) -> float:
        """The next intensity [% MSO], on the grid and within the range; the same until the next `tell`."""
        intensity = self.method.ask(self.pulses, self.space)
        self.space.require(intensity)
        return intensity

    @property
    def place_mm(self) -> tuple[float, float] | None:
        """The next place of the coil from the middle of the searched area [mm]; None if a threshold is sought."""
        return self.method.place_mm(self.pulses) if isinstance(self.method, BayesHotSpot) else None

    def tell(self, intensity_pct_mso: float, mep_mv: float | None = None, *, response: bool | None = None) -> None:
        """Learn from one pulse.

        Args:
            intensity_pct_mso: the intensity at which it was given [% MSO].
            mep_mv: peak-to-peak amplitude of the MEP [mV]; 0 is below the detection limit.
            response: whether a response was seen, instead of an amplitude.

        Raises:
            InvalidValueError: NaN, a negative amplitude, one that no muscle gives, one below the EMG at rest before
                any other was told, or not exactly one outcome.
            LimitExceededError: an intensity beyond the range or off its grid.
        """
        self.pulses = (*self.pulses, self.checked(intensity_pct_mso, mep_mv, response=response))

    def checked(self, intensity_pct_mso: float, mep_mv: float | None = None, *, response: bool | None = None) -> Pulse:
        """The pulse that `tell` would learn from, without learning it.

        Args:
            intensity_pct_mso: as for `tell` [% MSO].
            mep_mv: as for `tell` [mV].
            response: as for `tell`.

        Raises:
            InvalidValueError: as for `tell`.
            LimitExceededError: as for `tell`.
        """
        self.space.require(intensity_pct_mso)
        if mep_mv is not None:
            mep_mv = number("mep_mv", mep_mv, least=0)
            earlier_mv = [pulse.mep_mv for pulse in self.pulses if pulse.mep_mv is not None]
            require_amplitude(mep_mv, implausible_scale([*earlier_mv, mep_mv]))
        pulse = Pulse(intensity_pct_mso, mep_mv, response, self.place_mm)
        if pulse.place_mm and mep_mv is None:
            raise InvalidValueError("the hot spot is found by amplitudes", got=response, expected="an amplitude in mV")
        return pulse

    def estimate(self) -> ThresholdEstimate:
        """The estimate now.

        There is no number before a pulse was answered at a higher intensity than one that was not, nor if answered
        pulses are hardly larger than the others.
        """
        refused = self._refused()
        if refused is not None:
            return ThresholdEstimate(None, reason=refused.reason)
        return self.method.estimate(self.pulses, self.space)

    def decision(self) -> StopDecision:
        """The decision to stop or not, with its reason; no number if the range is wrong or the budget used up."""
        refused = None if isinstance(self.method, CurvePulses) else self._refused()
        return refused or self.method.decision(self.pulses, self.space)

    def _refused(self) -> StopDecision | None:
        """Why the pulses give no number, whatever the method says; None if they may."""
        if isinstance(self.method, BayesHotSpot):
            return None
        budget: int | None = getattr(self.method, "budget", None)
        refused = one_sided(self.pulses, self.space) or self._like_hum(budget)
        if refused is None or refused.stop or budget is None or len(self.pulses) < budget:
            return refused
        return StopKind.BUDGET.stop(f"{refused.reason} The budget of {budget} pulses is used up. {_LOOK}")

    def _like_hum(self, budget: int | None) -> StopDecision | None:
        seen = not_growing(self.pulses) or hardly_larger(self.pulses)
        if seen is None or self.method.estimate(self.pulses, self.space).threshold_pct_mso is None:
            return None
        over = budget is None and self.method.decision(self.pulses, self.space).stop
        return StopDecision(over, f"{seen} {_LOOK}" if over else seen, StopKind.THRESHOLD)
