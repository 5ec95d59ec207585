"""One simulated person, the truth about them, and how they answer stimuli.

A `SimulatedSubject` never changes; `begin` gives a `Responder` that holds what has a memory within a session (drift,
start-up, serial correlation, plasticity).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, get_args

import numpy as np

from isiw.checks import (
    check_choice,
    check_flags,
    check_numbers,
    check_probabilities,
    choice,
    mean_and_sd,
    number,
    whole,
)
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.subjects.plasticity import Plasticity
from isiw.subjects.profiles import OpposedProfile, Profile
from isiw.subjects.responses import RecruitmentResponse, ResponseCurve, TrialNoise
from isiw.types import Conditioning, FloatArray, Reference
from isiw.window import LEAST_DEPRESSED_MV, Window, window_from_excess

__all__ = ["OUTLIERS_MV", "Drift", "Responder", "Response", "SimulatedSubject"]

OUTLIERS_MV: Final = (0.1, 0.5)
"""Between these an artefact's amplitude is uniform [mV]."""


@dataclass(frozen=True)
class Drift:
    """How a person's log gain wanders: an AR(1) walk from zero, and the start-up of the first trials.

    Args:
        persistence: AR(1) coefficient from trial to trial.
        innovation_sd: SD of each step, natural log.
        startup: what the first trials have on top, natural log.

    Raises:
        InvalidValueError: a coefficient outside -1 to 1, a negative SD, or a start-up that is not finite.
    """

    persistence: float = 0.97
    innovation_sd: float = 0.12
    startup: tuple[float, ...] = (0.29, 0.20)

    def __post_init__(self) -> None:
        check_numbers(self, "persistence", least=-1, most=1)
        check_numbers(self, "innovation_sd", least=0)
        object.__setattr__(self, "startup", tuple(number("Drift.startup", each) for each in self.startup))


@dataclass(frozen=True)
class Response:
    """What a stimulus came to.

    Args:
        isi_ms: the ISI as told [ms]: the realised one where it is known, else the commanded; None for TMS alone.
        mep_mv: peak-to-peak amplitude of the MEP [mV].
        isi_sd_ms: SD of the realised ISI about the told one [ms].
    """

    isi_ms: float | None
    mep_mv: float
    isi_sd_ms: float = 0.0


@dataclass(frozen=True)
class SimulatedSubject:
    """One simulated person.

    Args:
        profile: facilitation by ISI from the impact.
        response: from facilitation to the MEP.
        hit_delay_ms: mean time from the valve command to the impact [ms].
        hit_delay_sd_ms: its SD from trial to trial [ms].
        drift: drift of the gain; None where there is none.
        input_correlation: lag-1 correlation of the input noise.
        outlier_probability: share of trials replaced by an artefact of 0.1–0.5 mV.
        isi_jitter_ms: SD of the realised about the commanded ISI, beside the hit delay's [ms].
        jitter_told: whether the jittered ISI is told, or the commanded one with its SD.
        scale: factor on every amplitude.
        stated_hit_delay_ms: mean and SD of the hit delay that the rig states, where it knows itself [ms]; by default
            the tapping robot's, over people.
        conditioning: what is given to them first, a tap or an electrical pulse.
        plasticity: how the pairs that are delivered change the gain; None where they do not. The true window and
            profile are those before the first pair.

    Raises:
        InvalidValueError: an invalid number or choice, or a depressed segment, but a response that has no recruitment
            curve.
    """

    profile: Profile
    response: ResponseCurve
    hit_delay_ms: float
    hit_delay_sd_ms: float
    drift: Drift | None = None
    input_correlation: float = 0.0
    outlier_probability: float = 0.0
    isi_jitter_ms: float = 0.0
    jitter_told: bool = True
    scale: float = 1.0
    stated_hit_delay_ms: tuple[float, float] = (180.0, 6.0)
    conditioning: Conditioning = "tap"
    plasticity: Plasticity | None = None

    def __post_init__(self) -> None:
        check_numbers(self, "hit_delay_ms")
        check_numbers(self, "hit_delay_sd_ms", "isi_jitter_ms", least=0)
        check_numbers(self, "input_correlation", least=-1, most=1)
        check_probabilities(self, "outlier_probability")
        check_numbers(self, "scale", above=0)
        check_flags(self, "jitter_told")
        check_choice(self, "conditioning", get_args(Conditioning))
        stated_ms = mean_and_sd("SimulatedSubject.stated_hit_delay_ms", self.stated_hit_delay_ms)
        object.__setattr__(self, "stated_hit_delay_ms", stated_ms)
        if isinstance(self.profile, OpposedProfile) and not isinstance(self.response, RecruitmentResponse):
            raise InvalidValueError(
                "only an MEP on a recruitment curve can be depressed",
                got=type(self.response).__name__,
                expected=RecruitmentResponse.__name__,
                remedy="Give the person a RecruitmentResponse, or a profile without a depressed segment.",
            )

    def facilitation(self, isi_ms: FloatArray, reference: Reference) -> FloatArray:
        """Facilitation at ISIs on a reference [ms], at the mean hit delay; negative where depressed, same shape.

        Args:
            isi_ms: ISIs [ms], any shape.
            reference: what they count from.
        """
        return self.profile(isi_ms if reference == "impact" else isi_ms - self.hit_delay_ms)

    def expected_mep_mv(self, space: DesignSpace) -> FloatArray:
        """Expected MEP on the space's grid [mV], drift and start-up off, shape (t,)."""
        evoked = self.response.expected_evoked_mv(self.facilitation(space.grid_ms, space.reference))
        return self.scale * (evoked + self.response.floor.mean_mv)

    @property
    def baseline_mv(self) -> float:
        """Expected MEP without a tap [mV]."""
        return self.scale * float(self.response.expected_evoked_mv(0.0) + self.response.floor.mean_mv)

    def window(self, space: DesignSpace) -> Window | None:
        """The true window on the space's grid; None where there is none."""
        return window_from_excess(space.grid_ms, self.expected_mep_mv(space) - self.baseline_mv, self.baseline_mv)

    def depressed(self, space: DesignSpace) -> Window | None:
        """The true ISIs that depress the MEP: the window's rule for the deficit; None where there are none."""
        if self.baseline_mv < LEAST_DEPRESSED_MV:
            return None
        return window_from_excess(space.grid_ms, self.baseline_mv - self.expected_mep_mv(space), self.baseline_mv)

    def begin(self, seed: int) -> Responder:
        """A session with this person, its trial noise from this seed.

        Raises:
            InvalidValueError: a seed that is negative or no whole number.
        """
        return Responder(self, seed)


class Responder:
    """One session with a simulated person: answers stimuli, and drifts as it does.

    Args:
        subject: the person.
        seed: seed of the session's trial noise.

    Raises:
        InvalidValueError: a seed that is negative or no whole number.
    """

    def __init__(self, subject: SimulatedSubject, seed: int) -> None:
        self.subject = subject
        self._seed = whole("the seed", seed, least=0)
        self._rng = np.random.default_rng(self._seed)
        self._trials = 0
        self._input_z = self._rng.standard_normal()
        self._walk = 0.0
        self._dose = 0.0

    def respond(self, isi_ms: float | None, reference: Reference) -> Response:
        """Answer one pair of stimuli.

        Args:
            isi_ms: the commanded ISI on the reference [ms]; None for TMS alone.
            reference: the event that the ISI counts from. From the valve command the hit delay's variation stays
                unseen; from the impact it moves the realised ISI, which is told.

        Raises:
            InvalidValueError: an ISI that is not finite, or an unknown reference.
        """
        isi_ms = None if isi_ms is None else number("an ISI [ms]", isi_ms)
        choice("the reference", reference, get_args(Reference))
        noise = self._next_noise()
        told_ms, facilitation = (None, 0.0) if isi_ms is None else self._stimulate(isi_ms, reference)
        self._dose += max(0.0, facilitation)
        subject, rng = self.subject, self._rng
        floor_mv = subject.response.floor.median_mv * np.exp(subject.response.floor.log_sd * rng.standard_normal())
        mep_mv = subject.response.sample_evoked_mv(facilitation, noise, rng) + floor_mv
        if rng.random() < subject.outlier_probability:
            mep_mv = rng.uniform(*OUTLIERS_MV)
        unseen_ms = 0.0 if subject.jitter_told or isi_ms is None else subject.isi_jitter_ms
        return Response(told_ms, float(subject.scale * mep_mv), unseen_ms)

    def respond_instead(self, isi_ms: float | None, reference: Reference) -> Response:
        """Answer one pair of stimuli that is given because another was lost; see `respond`.

        Its noise is drawn apart, so that what was lost does not move the noise of all later trials. What it does to the
        person, such as drift, goes on.

        Args:
            isi_ms: the commanded ISI on the reference [ms]; None for TMS alone.
            reference: the event that the ISI counts from.
        """
        usual, self._rng = self._rng, np.random.default_rng([self._seed, 1, self._trials])
        try:
            return self.respond(isi_ms, reference)
        finally:
            self._rng = usual

    def _stimulate(self, isi_ms: float, reference: Reference) -> tuple[float, float]:
        subject, rng = self.subject, self._rng
        late_ms = subject.hit_delay_sd_ms * rng.standard_normal()
        realised_ms = isi_ms + subject.isi_jitter_ms * rng.standard_normal()
        told_ms = realised_ms if subject.jitter_told else isi_ms
        from_impact_ms = realised_ms - late_ms
        if reference == "valve":
            return told_ms, float(subject.profile(from_impact_ms - subject.hit_delay_ms))
        return told_ms - late_ms, float(subject.profile(from_impact_ms))

    def _next_noise(self) -> TrialNoise:
        subject, rng = self.subject, self._rng
        correlation = subject.input_correlation
        self._input_z = correlation * self._input_z + np.sqrt(1 - correlation**2) * rng.standard_normal()
        log_gain = 0.0
        if subject.drift is not None:
            self._walk = subject.drift.persistence * self._walk + subject.drift.innovation_sd * rng.standard_normal()
            startup = subject.drift.startup
            log_gain = self._walk + (startup[self._trials] if self._trials < len(startup) else 0.0)
        if subject.plasticity is not None:
            log_gain += subject.plasticity.log_gain(self._dose)
        self._trials += 1
        return TrialNoise(float(self._input_z), float(log_gain))
