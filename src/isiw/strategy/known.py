"""What is known of one person: by their trials, by what the tap alone evokes, and with what is lacking or in doubt."""

from __future__ import annotations

from dataclasses import dataclass

from isiw.decision import StopDecision, StopKind
from isiw.estimate import WindowEstimate
from isiw.findings import Finding, Kind, is_silent, lacking
from isiw.strategy.course import Course
from isiw.strategy.outcomes import Outcomes


@dataclass(frozen=True)
class Known:
    """One person of a course, and their outcomes: the only place where an estimate and a decision are made.

    `mistrials` use up budget; `in_doubt` is whether trials do not count whose realised ISIs are doubted.
    """

    course: Course
    outcomes: Outcomes
    detection_limit_mv: float | None
    person: int = 0
    mistrials: int = 0
    in_doubt: bool = False

    def estimate(self) -> WindowEstimate:
        """The present estimate of the window."""
        estimate = self.course.estimate(self.person)
        noted = self.outcomes.about_the_tap(estimate.window) | {"silent": self._is_silent}
        estimate = estimate.noting(**noted) if any(noted.values()) else estimate
        return estimate.doubted() if self.in_doubt else estimate

    def decision(self) -> StopDecision:
        """The decision to stop now or not, with its reason."""
        silent = self._is_silent
        decision = self.course.decision(self.person, self.mistrials, silent=silent)
        return _for_lack(decision, lacking(None, silent=silent, in_doubt=self.in_doubt))

    @property
    def _is_silent(self) -> bool:
        meps_mv = [one.mep_mv for one in self.outcomes.pulses if one.mep_mv is not None]
        return is_silent(meps_mv, self.detection_limit_mv)


def _for_lack(decision: StopDecision, found: Finding | None) -> StopDecision:
    """The decision if something is lacking to speak of a window; in doubt none but a budget stops."""
    if found is None or (decision.stop and (found.kind is not Kind.ISIS_FAR or decision.kind is StopKind.BUDGET)):
        return decision
    return StopKind.TOO_LITTLE.go_on(f"{found}")
