"""Five of ten: the lowest intensity at which at least five of ten pulses evoke an MEP [Rossini2015]."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from isiw.checks import check_numbers, check_wholes
from isiw.strategy.stopping import StopDecision, StopKind
from isiw.strategy.threshold.pulses import IntensityRange, Pulse, ThresholdEstimate


@dataclass(frozen=True)
class FiveOfTen:
    """Goes in large steps until one intensity suffices and the next lower one does not, then down in single steps.

    At each intensity it goes on until the verdict is certain: with five responses, or six pulses without one. Once no
    pulse is needed any more, it asks for the threshold again.

    Args:
        start_pct_mso: the first intensity [% MSO].
        large_step_pct_mso: the large step [% MSO]; the small one is that of the range, which it is never below.
        of: pulses at each intensity.
        enough: responses that suffice.

    Raises:
        InvalidValueError: steps that are not positive, or more responses than pulses.
    """

    start_pct_mso: float = 40.0
    large_step_pct_mso: float = 5.0
    of: int = 10
    enough: int = 5

    def __post_init__(self) -> None:
        check_numbers(self, "start_pct_mso", above=0, most=100)
        check_numbers(self, "large_step_pct_mso", above=0)
        check_wholes(self, "of", least=1)
        check_wholes(self, "enough", least=1, most=self.of)

    def ask(self, pulses: Sequence[Pulse], space: IntensityRange) -> float:
        """The intensity whose verdict is still open."""
        return self._course(pulses, space)[0]

    def estimate(self, pulses: Sequence[Pulse], space: IntensityRange) -> ThresholdEstimate:
        """The lowest intensity that suffices, once the next lower one does not; there is no interval."""
        asked, decision = self._course(pulses, space)
        if not decision.stop or self._verdicts(pulses).get(asked) is not True or asked == space.low_pct_mso:
            return ThresholdEstimate(None, reason=decision.reason)
        return ThresholdEstimate(asked)

    def decision(self, pulses: Sequence[Pulse], space: IntensityRange) -> StopDecision:
        """Stop when the threshold is found, or the range has no more intensities."""
        return self._course(pulses, space)[1]

    def _verdicts(self, pulses: Sequence[Pulse]) -> dict[float, bool]:
        """Whether an intensity suffices, for those whose verdict is certain."""
        told = Counter((pulse.intensity_pct_mso, pulse.responded) for pulse in pulses)
        suffices = {at: True for (at, responded), n in told.items() if responded and n >= self.enough}
        return suffices | {at: False for (at, yes), n in told.items() if not yes and n > self.of - self.enough}

    def _course(self, pulses: Sequence[Pulse], space: IntensityRange) -> tuple[float, StopDecision]:
        """What is asked next, and whether that is needed."""
        verdicts = self._verdicts(pulses)
        enough = min((at for at, suffices in verdicts.items() if suffices), default=None)
        short = max((at for at in verdicts if not verdicts[at] and (enough is None or at < enough)), default=None)
        if enough is None:
            return self._upwards(short, space)
        if enough == space.low_pct_mso:
            return enough, _over(
                f"{enough:g} % MSO is high enough (at least {self.enough} of {self.of} pulses evoke an MEP), "
                "and it is the lowest intensity of the range: begin a new search lower."
            )
        if short is None:
            return space.snap(enough - max(self.large_step_pct_mso, space.step_pct_mso)), _on(
                f"{enough:g} % MSO is high enough."
            )
        if enough - short > 1.5 * space.step_pct_mso:
            return space.snap(enough - space.step_pct_mso), _on(
                f"The threshold is between {short:g} and {enough:g} % MSO."
            )
        return enough, _over(f"{enough:g} % MSO is high enough, and {short:g} % MSO is not.")

    def _upwards(self, short: float | None, space: IntensityRange) -> tuple[float, StopDecision]:
        if short is None:
            return space.snap(self.start_pct_mso), _on("No intensity tested so far is high enough.")
        if short == space.high_pct_mso:
            return short, _over(f"{short:g} % MSO, the highest intensity of the range, is not high enough.")
        return space.snap(short + max(self.large_step_pct_mso, space.step_pct_mso)), _on(
            f"{short:g} % MSO is not high enough."
        )


def _over(reason: str) -> StopDecision:
    return StopKind.THRESHOLD.stop(reason)


def _on(reason: str) -> StopDecision:
    return StopKind.THRESHOLD.go_on(reason)
