"""One simulated person, the truth about them, and how they answer stimuli.

A `SimulatedSubject` never changes; a `Responder` holds what has a memory within a session.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Final, get_args

import numpy as np

from isiw.checks import Checked, Flag, MeanAndSd, NonNegative, Number, Numbers, Positive, Share, choice, number, whole
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.excess import EDGE_LEVEL, LEAST_DEPRESSED_MV, window_from_excess
from isiw.subjects.changes import Change, Plasticity, TapResponse, amplitude_of_both_mv
from isiw.subjects.responses import OpposedProfile, Profile, RecruitmentResponse, ResponseCurve, TrialNoise
from isiw.types import Conditioning, FloatArray, Reference
from isiw.window import Window

OUTLIERS_MV: Final = (0.1, 0.5)
"""Between these an artefact's amplitude is uniform [mV]."""


@dataclass(frozen=True)
class Drift(Checked):
    """Drift of a person's log gain: an AR(1) walk from zero, and the start-up of the first trials.

    Args:
        persistence: AR(1) coefficient from trial to trial.
        innovation_sd: SD of each step, natural log.
        startup: what the first trials have on top, natural log.
    """

    persistence: Annotated[float, partial(number, least=-1, most=1)] = 0.97
    innovation_sd: NonNegative = 0.12
    startup: Numbers = (0.29, 0.20)


@dataclass(frozen=True)
class Response:
    """The response to a stimulus.

    Args:
        isi_ms: the ISI as reported [ms]: the realised one if it is known, else the commanded; None for TMS alone.
        mep_mv: peak-to-peak amplitude of the MEP [mV].
        isi_sd_ms: SD of the realised ISI about the reported one [ms].
    """

    isi_ms: float | None
    mep_mv: float
    isi_sd_ms: float = 0.0


@dataclass(frozen=True)
class SimulatedSubject(Checked):
    """One simulated person.

    Args:
        profile: facilitation by ISI from the impact.
        response: from facilitation to the MEP.
        hit_delay_ms: mean time from the valve command to the impact [ms].
        hit_delay_sd_ms: its SD from trial to trial [ms].
        drift: drift of the gain; None if there is none.
        input_correlation: lag-1 correlation of the input noise.
        outlier_probability: share of trials replaced by an artefact of 0.1–0.5 mV.
        isi_jitter_ms: SD of the realised about the commanded ISI, beside the hit delay's [ms].
        jitter_reported: whether the jittered ISI is reported, or the commanded one with its SD.
        scale: factor on every amplitude.
        stated_hit_delay_ms: mean and SD over people of the hit delay that the rig states [ms]; by default the robot's.
        stated_intensity_pct_rmt: intensity of the pulse as the visit states it [% RMT]; None if it does not.
        conditioning: what is given to them first, a tap or an electrical pulse.
        plasticity: how pairs change the gain; None if they do not. The true window is that before the first pair.
        change: what else changes during a session; None if nothing does.
        tap_response: what the tap alone evokes in the muscle; None if it evokes nothing.
        amplitude_step_mv: step to which amplitudes are rounded [mV]; 0 if they are not.

    Raises:
        InvalidValueError: an invalid number or choice, or no recruitment curve to depress or to give other intensities.
    """

    profile: Profile
    response: ResponseCurve
    hit_delay_ms: Number
    hit_delay_sd_ms: NonNegative
    drift: Drift | None = None
    input_correlation: Annotated[float, partial(number, least=-1, most=1)] = 0.0
    outlier_probability: Share = 0.0
    isi_jitter_ms: NonNegative = 0.0
    jitter_reported: Flag = True
    scale: Positive = 1.0
    stated_hit_delay_ms: MeanAndSd = (180.0, 6.0)
    stated_intensity_pct_rmt: Positive | None = None
    conditioning: Conditioning = "tap"
    plasticity: Plasticity | None = None
    change: Change | None = None
    tap_response: TapResponse | None = None
    amplitude_step_mv: NonNegative = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        retuned = self.change is not None and self.change.intensity_pct_rmt != 0
        if (retuned or isinstance(self.profile, OpposedProfile)) and not isinstance(self.response, RecruitmentResponse):
            raise InvalidValueError(
                "only an MEP on a recruitment curve can be depressed, or depends on the intensity",
                got=type(self.response).__name__,
                expected=RecruitmentResponse.__name__,
                remedy="Give the person a RecruitmentResponse, or neither a depressed segment nor another intensity.",
            )

    def facilitation(self, isi_ms: FloatArray, reference: Reference, trial: int = 0) -> FloatArray:
        """Facilitation at ISIs on a reference [ms], at the mean hit delay; negative where depressed, same shape.

        Args:
            isi_ms: ISIs [ms], any shape.
            reference: what they count from.
            trial: after how many trials, in a person who changes.
        """
        from_impact_ms = np.asarray(isi_ms if reference == "impact" else isi_ms - self.hit_delay_ms)
        if self.change is None:
            return self.profile(from_impact_ms)
        moved_ms = self.change.share(trial) * self.change.shift_ms
        return self.change.enhancement(trial) * self.profile(from_impact_ms - moved_ms)

    def expected_mep_mv(self, space: DesignSpace, trial: int = 0) -> FloatArray:
        """Expected MEP on the space's grid [mV], shape (t,); drift, start-up and changes of level and intensity off.

        Args:
            space: the design space.
            trial: after how many trials, in a person whose window fades or moves.
        """
        evoked = self.response.expected_evoked_mv(self.facilitation(space.grid_ms, space.reference, trial))
        return self.scale * (evoked + self.response.floor.mean_mv)

    @property
    def baseline_mv(self) -> float:
        """Expected MEP without a tap [mV]."""
        return self.scale * float(self.response.expected_evoked_mv(0.0) + self.response.floor.mean_mv)

    def window(self, space: DesignSpace, trial: int = 0) -> Window | None:
        """The true window on the space's grid; None if there is none.

        Args:
            space: the design space.
            trial: after how many trials, in a person whose window fades or moves.
        """
        excess_mv = self.expected_mep_mv(space, trial) - self.baseline_mv
        return window_from_excess(space.grid_ms, excess_mv, self.baseline_mv)

    def depressed(self, space: DesignSpace) -> Window | None:
        """The true ISIs that depress the MEP: the window's rule for the deficit; None if there are none."""
        if self.baseline_mv < LEAST_DEPRESSED_MV:
            return None
        return window_from_excess(space.grid_ms, self.baseline_mv - self.expected_mep_mv(space), self.baseline_mv)

    def begin(self, seed: int) -> Responder:
        """A session with this person, its trial noise from this seed, a whole number from 0 on."""
        return Responder(self, seed)


class Responder:
    """One session with a simulated person: answers stimuli, and drifts as it does.

    Args:
        subject: the person.
        seed: seed of the session's trial noise, a whole number from 0 on.
    """

    def __init__(self, subject: SimulatedSubject, seed: int) -> None:
        self.subject = subject
        self._seed = whole("the seed", seed, least=0)
        self._rng = np.random.default_rng(self._seed)
        self._trials = 0
        self._input_z = self._rng.standard_normal()
        self._walk = 0.0
        self._dose, self._after_effect = 0.0, 0.0

    @property
    def after_effect(self) -> float:
        """The change of the log gain by the pairs so far, natural log."""
        return self._after_effect

    def is_inside(self, isi_ms: float, reference: Reference) -> bool:
        """Whether an ISI is inside the window now: whether its facilitation is that of an edge at least.

        Args:
            isi_ms: the ISI [ms].
            reference: the event that it counts from.
        """
        return bool(self.subject.facilitation(np.asarray(isi_ms), reference, self._trials + 1) >= EDGE_LEVEL)

    def wait(self, minutes: float) -> None:
        """Let time go by without a stimulus, in which an after-effect may be lost [min]."""
        if self.subject.plasticity is not None:
            minutes = number("minutes", minutes, least=0)
            self._after_effect = self.subject.plasticity.left(self._after_effect, minutes)

    @property
    def trials(self) -> int:
        """Number of stimuli that were answered."""
        return self._trials

    def respond(
        self, isi_ms: float | None, reference: Reference, *, pulse: bool = True, intensity_pct_rmt: float | None = None
    ) -> Response:
        """Answer one pair of stimuli, or one of them alone.

        Args:
            isi_ms: the commanded ISI on the reference [ms]; None for TMS alone.
            reference: the event that the ISI counts from. From the valve command the hit delay's variation stays
                unseen; from the impact it moves the realised ISI, which is reported.
            pulse: whether the magnetic pulse is given; without it, the amplitude is of what the MEP window would hold.
            intensity_pct_rmt: intensity of the pulse, of a person with a recruitment curve [% RMT]; by default that of
                their pairs.

        Raises:
            InvalidValueError: an ISI that is not finite, an unknown reference, or an intensity of somebody who has no
                recruitment curve.
        """
        isi_ms = None if isi_ms is None else number("an ISI [ms]", isi_ms)
        choice("the reference", reference, get_args(Reference))
        noise = self._next_noise()
        subject, rng, facilitation = self.subject, self._rng, 0.0
        reported_ms, from_impact_ms = (None, None) if isi_ms is None else self._stimulate(isi_ms, reference)
        if from_impact_ms is not None and pulse:
            facilitation = float(subject.facilitation(np.asarray(from_impact_ms), "impact", self._trials))
            self._remember(facilitation)
        floor_mv = subject.response.floor.sample_mv(rng)
        evoked_mv = self._response(intensity_pct_rmt).sample_evoked_mv(facilitation, noise, rng) if pulse else 0.0
        mep_mv = self._with_tap_mv(evoked_mv, noise, from_impact_ms) + floor_mv
        if rng.random() < subject.outlier_probability:
            mep_mv = rng.uniform(*OUTLIERS_MV)
        mep_mv *= subject.scale
        if step_mv := subject.amplitude_step_mv:
            mep_mv = step_mv * np.round(mep_mv / step_mv)
        unseen_ms = 0.0 if subject.jitter_reported or isi_ms is None else subject.isi_jitter_ms
        return Response(reported_ms, float(mep_mv), unseen_ms)

    def _remember(self, facilitation: float) -> None:
        """What a pair leaves behind."""
        plasticity = self.subject.plasticity
        if plasticity is not None:
            self._after_effect = plasticity.after(self._after_effect, facilitation, self._dose)
            self._dose += max(0.0, facilitation) if facilitation >= plasticity.least else 0.0

    def _response(self, intensity_pct_rmt: float | None) -> ResponseCurve:
        """The response at the intensity of this trial."""
        change, response = self.subject.change, self.subject.response
        if intensity_pct_rmt is not None:
            if not isinstance(response, RecruitmentResponse):
                raise InvalidValueError(
                    "only an MEP on a recruitment curve depends on the intensity",
                    got=type(response).__name__,
                    expected=RecruitmentResponse.__name__,
                )
            response = replace(response, intensity_pct_rmt=intensity_pct_rmt)
        if change is None or not isinstance(response, RecruitmentResponse):
            return response
        added_pct = change.share(self._trials) * change.intensity_pct_rmt
        return replace(response, intensity_pct_rmt=response.intensity_pct_rmt + added_pct)

    def _with_tap_mv(self, evoked_mv: float, noise: TrialNoise, from_impact_ms: float | None) -> float:
        """The amplitude of what the MEP window holds above the floor; a gain acts on the tap's response, too."""
        tap = self.subject.tap_response
        if tap is None or from_impact_ms is None:
            return evoked_mv
        tap_mv = tap.sample_mv(self._rng) * float(np.exp(noise.log_gain))
        return amplitude_of_both_mv(evoked_mv, tap, tap_mv, from_impact_ms)

    def respond_instead(self, isi_ms: float, reference: Reference) -> Response:
        """Answer one pair of stimuli that is given because another was lost; see `respond`.

        Its noise is drawn apart, so that what was lost does not move the noise of all later trials. What it does to the
        person, such as drift, goes on.

        Args:
            isi_ms: the commanded ISI on the reference [ms].
            reference: the event that the ISI counts from.
        """
        usual, self._rng = self._rng, np.random.default_rng([self._seed, 1, self._trials])
        try:
            return self.respond(isi_ms, reference)
        finally:
            self._rng = usual

    def _stimulate(self, isi_ms: float, reference: Reference) -> tuple[float, float]:
        """The ISI as reported, and the true one from the impact [ms]."""
        subject, rng = self.subject, self._rng
        late_ms = subject.hit_delay_sd_ms * rng.standard_normal()
        realised_ms = isi_ms + subject.isi_jitter_ms * rng.standard_normal()
        reported_ms = realised_ms if subject.jitter_reported else isi_ms
        from_impact_ms = realised_ms - late_ms
        if reference == "valve":
            return reported_ms, from_impact_ms - subject.hit_delay_ms
        return reported_ms - late_ms, from_impact_ms

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
            log_gain += self._after_effect
        self._trials += 1
        if subject.change is not None:
            log_gain += subject.change.share(self._trials) * subject.change.log_gain
        return TrialNoise(float(self._input_z), float(log_gain))
