"""The prior over people.

A particle is a vector of latents and the kinds of its profile and noise. The prior of a block of latents is a
mixture of what is usual and of what else may be, so that particles are where unusual people are from the first trial
on, and moves need no Jacobians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Annotated, Final

import numpy as np

from isiw.checks import Checked, Share, choice, number
from isiw.design import DesignSpace
from isiw.models.particles.changes import INTENSITY_PCT, MATTERS, Change, ChangeKind, ChangePrior
from isiw.models.particles.latents import BLOCKS, RECTIFIED, Latents, latents_of
from isiw.models.particles.laws import (
    FOREARM,
    HAND,
    OTHER_MUSCLE,
    Floor,
    Gain,
    Intensity,
    Muscle,
    NoiseShares,
    RectifiedPrior,
    SessionPrior,
    SwitchPrior,
    check_laws,
    with_less_of_others,
)
from isiw.models.particles.mixture import Mixture, log_sum
from isiw.models.particles.noise import PERSISTENCE, NoiseKind, recruits
from isiw.models.particles.profile import ProfilePrior
from isiw.models.shared.scales import Scale
from isiw.types import BoolArray, FloatArray, IntArray, Singles

STATED_SD_PCT_RMT: Final = 0.5
"""How far an intensity that is stated may be off [% RMT]; how far people's curves are is in their laws."""

_WITHOUT_MUSCLE: Final = {
    NoiseKind.CONSTANT_CV: "constant-CV noise",
    NoiseKind.MISSING: "missing responses",
    NoiseKind.ALL_OR_NONE: "all-or-none responses",
    NoiseKind.RECTIFIED: "recruitment curve with a threshold",
}


@dataclass(frozen=True)
class Prior(Checked):
    """The prior over people.

    Args:
        profile: prior of the facilitation by ISI.
        noise: probabilities of the kinds of noise.
        gains: laws of responses with noise of a constant CV.
        switch: prior of how often responses come if they may be missing or are all or none.
        muscles: laws of recruitment curves.
        rectified: law of recruitment curves that start at a threshold.
        intensities: laws of the intensity of the pulse if it is not stated.
        floors: laws of the EMG floor.
        session: prior of the drift of amplitudes within a session.
        changes: prior of what else changes within a session.
        other_curve: probability that pulses given alone at other intensities are of another curve than the pairs.
        muscle: the name of the muscle, if it is known; the others that have a name are then left out.
        intensity_pct_rmt: intensity of the pulse if it is stated [% RMT].
    """

    profile: ProfilePrior = field(default_factory=ProfilePrior)
    noise: NoiseShares = field(default_factory=NoiseShares, metadata={"shares": True})
    gains: tuple[Gain, ...] = (
        Gain(0.85, Scale(7.3, 0.62), Scale(0.62, 0.26)),
        Gain(0.15, Scale(9.0, 1.2), Scale(0.62, 0.45)),
    )
    switch: SwitchPrior = field(default_factory=SwitchPrior)
    muscles: tuple[Muscle, ...] = (FOREARM, HAND, OTHER_MUSCLE)
    rectified: RectifiedPrior = field(default_factory=RectifiedPrior)
    intensities: tuple[Intensity, ...] = (
        Intensity(0.75, Scale(90.0, STATED_SD_PCT_RMT)),
        Intensity(0.25, Scale(106.0, 12.0)),  # 80–130 % RMT
    )
    floors: tuple[Floor, ...] = (
        Floor(0.85, Scale(0.009, 0.38), Scale(0.22, 0.4)),
        Floor(0.15, Scale(0.009, 1.2), Scale(0.22, 0.5)),
    )
    session: SessionPrior = field(default_factory=SessionPrior)
    changes: ChangePrior = field(default_factory=ChangePrior)
    other_curve: Share = 0.25
    muscle: str | None = None
    intensity_pct_rmt: Annotated[float, partial(number, above=0, most=1e4)] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_laws(self, "gains", "muscles", "intensities", "floors")
        if self.muscle is not None:
            choice("Prior.muscle", self.muscle, [muscle.name for muscle in self.muscles])

    @cached_property
    def mixtures(self) -> dict[str, Mixture]:
        """The prior of each block but the start, places aside."""
        switch, session = self.switch, self.session
        often = [switch.switched_on.law, switch.switched_off.law]
        return {
            "width": Mixture.of([(w.share, [w.width_ms.log_law]) for w in self.profile.widths]),
            "form": Mixture.of([(1.0, [(0.0, 1.0)])]),
            "floor": Mixture.of([(f.share, [f.median_mv.log_law, f.log_sd.log_law]) for f in self.floors]),
            "session": Mixture.of(
                [
                    (1.0 - session.far_drift_share, [(0.0, session.drift_sd), session.startup.law]),
                    (session.far_drift_share, [(0.0, session.far_drift_sd), session.startup.law]),
                ]
            ),
            "gain": Mixture.of([(g.share, _of_gain(g)) for g in self.gains]),
            "reliability": Mixture.of([(1.0, [switch.reliability.law])]),
            "switch": Mixture.of([(size.share, [*often, *_of_gain(size)]) for size in switch.sizes]),
            "recruitment": Mixture.of([(share, _of_curve(m, rest)) for m, share, rest in self._possible_curves]),
            "rectified": Mixture.of(
                [
                    (share, [*_of_curve(self.rectified, rest), self.rectified.onset.log_law])
                    for share, rest in self._rests(self.rectified)
                ]
            ),
            **self.changes.mixtures,
        }

    @cached_property
    def spreads(self) -> FloatArray:
        """Usual SD of each latent, shape (d,)."""
        first = self.profile.start.spans[0]
        start = [(first.high_ms - first.low_ms) / math.sqrt(12.0)]
        return np.concatenate([start] + [self.mixtures[name].sds[0] for name in BLOCKS if name != "start"])

    def log_densities(self, values: Singles, space: DesignSpace) -> dict[str, FloatArray]:
        """Log density of the latents of each block, shape (b, p); start and width are one: `"place"`."""
        behind = np.cumsum([len(names) for names in BLOCKS.values()])[:-1]
        parts = dict(zip(BLOCKS, np.split(values, behind, axis=-1), strict=True))
        others = {name: mixture for name, mixture in self.mixtures.items() if name != "width"}
        place = {"place": self.log_place(values, space)}
        return place | {name: mixture.log_density(parts[name]) for name, mixture in others.items()}

    def log_places(self, values: Singles, space: DesignSpace) -> FloatArray:
        """Log density of start and width, times its probability: anywhere, and in each place, shape (b, p, 1 + k)."""
        start, width = self.profile.start.log_density(values[..., 0], space), self.mixtures["width"]
        anywhere = (start + width.log_density(values[..., 1:2]))[..., np.newaxis]
        joint = self.profile.joint(space)
        if joint is None:
            return anywhere
        parts = math.log(joint.share) + joint.mixture.log_parts(values[..., :2])
        early = parts.shape[-1] - len(self.profile.places)
        anywhere = np.concatenate([math.log1p(-joint.share) + anywhere, parts[..., :early]], axis=-1)
        return np.concatenate([log_sum(anywhere)[..., np.newaxis], parts[..., early:]], axis=-1)

    def log_place(self, values: Singles, space: DesignSpace) -> FloatArray:
        """Log density of start and width, shape (b, p)."""
        return log_sum(self.log_places(values, space))

    def as_usual(self, kept: float) -> Prior:
        """The same with a part of the probability of unusual starts, widths and intensities, far drifts and changes."""
        far = kept * self.session.far_drift_share
        return replace(
            self,
            profile=self.profile.as_usual(kept),
            intensities=with_less_of_others(self.intensities, kept),
            session=replace(self.session, far_drift_share=far),
            changes=self.changes.as_usual(kept),
        )

    @property
    def possible_muscles(self) -> tuple[Muscle, ...]:
        """All muscles but, where one is known, the others that have a name of their own."""
        others = set() if self.muscle is None else {FOREARM.name, HAND.name} - {self.muscle}
        return tuple(m for m in self.muscles if m.name not in others)

    @cached_property
    def _possible_curves(self) -> list[tuple[Muscle, float, Scale]]:
        """Each muscle at each intensity, the probability of both, and the input without a tap [% RMT]."""
        return [(m, m.share * share, rest) for m in self.possible_muscles for share, rest in self._rests(m)]

    def _rests(self, law: Muscle | RectifiedPrior) -> list[tuple[float, Scale]]:
        """The input without a tap at each intensity [% RMT], and the probability of the intensity."""
        if law.at_pct_rmt is None:
            return [(1.0, law.rest_pct)]
        stated = self.intensity_pct_rmt
        known = self.intensities if stated is None else (Intensity(1.0, Scale(stated, STATED_SD_PCT_RMT)),)
        median, sd = law.rest_pct.law
        return [
            (each.share, Scale(median + each.pct_rmt.median - law.at_pct_rmt, math.hypot(sd, each.pct_rmt.sd)))
            for each in known
        ]

    @cached_property
    def hypotheses(self) -> tuple[str, ...]:
        """What the kinds of responses are called: kinds of noise, and muscles."""
        names = dict.fromkeys(f"recruitment curve, {muscle.name}" for muscle in self.possible_muscles)
        return (*_WITHOUT_MUSCLE.values(), *names)

    @cached_property
    def _hypothesis_numbers(self) -> IntArray:
        """Which of `hypotheses` a particle is of by its kind of noise and its possible curve, shape (kinds, k)."""
        names = [muscle.name for muscle, *_ in self._possible_curves]
        curves = [len(_WITHOUT_MUSCLE) + list(dict.fromkeys(names)).index(name) for name in names]
        others = {noise: [number] * len(curves) for number, noise in enumerate(_WITHOUT_MUSCLE)}
        return np.array([others.get(noise, curves) for noise in NoiseKind])

    def hypothesis(self, latents: Latents) -> IntArray:
        """Which of `hypotheses` each particle belongs to, shape (b, p)."""
        # A law by levels was made of a curve that the same pulses taught, and is of its muscle.
        curved = (latents.noise == NoiseKind.RECRUITMENT) | (latents.noise == NoiseKind.BY_LEVELS)
        found: IntArray = self._hypothesis_numbers[latents.noise, 0]
        values = latents.values.reshape(-1, latents.values.shape[-1])
        curve = self.mixtures["recruitment"].component(values.take(np.flatnonzero(curved), axis=0)[:, _OF_CURVE])
        found[curved] = self._hypothesis_numbers[NoiseKind.RECRUITMENT, curve]
        return found

    def unusual(self, latents: Latents, space: DesignSpace) -> dict[str, float]:
        """How probable it is that parts of a person are of another law than the usual one, by what they are called."""
        values = latents.values
        places, width = self.log_places(values, space), values[..., latents_of("width")]
        anywhere = np.exp(places[..., 0] - log_sum(places))
        unusual = {
            "the start of the window": anywhere * (1.0 - self.profile.start.usual(values[..., 0], space)),
            "the width of the window": anywhere * (1.0 - self.mixtures["width"].usual(width)),
        }
        given = {name: share[latents.present] for name, share in unusual.items()}
        given["the EMG floor"] = 1.0 - self.mixtures["floor"].usual(values[..., latents_of("floor")])
        return {name: float(share.mean()) for name, share in given.items() if share.size}

    def of_time(self, latents: Latents, trials: int) -> BoolArray:
        """In which particles amplitudes change within so many trials at any ISI, as far as it matters, shape (b, p)."""
        gain, shift_pct = self.change(latents).steps(trials)
        drifted = latents.of("drift") * (1.0 - PERSISTENCE ** max(0, trials - 1))
        matters: BoolArray = np.maximum(np.abs(gain), np.abs(drifted)) > MATTERS
        return matters | (np.abs(shift_pct) > MATTERS * INTENSITY_PCT)

    def untouched(self, latents: Latents, trials: int) -> BoolArray:
        """In which particles nothing has changed any of so many trials, shape (b, p)."""
        change = self.change(latents)
        untouched: BoolArray = (change.fading == 0) & (change.after > trials - 1) | (latents.change == ChangeKind.NONE)
        return untouched

    def change(self, latents: Latents) -> Change:
        """What changes in a session of each particle, fields (b, p)."""
        when, size = latents.of("log_changed_after"), latents.of("change_size")
        return Change.of(latents.change, when, size, recruits(latents.noise))

    def shift_pct_rmt(self, latents: Latents) -> Singles:
        """Shift of the recruitment curve's input at the best ISI [% RMT], 0 without facilitation, shape (b, p)."""
        own, rectified = latents.of("log_boost"), latents.of(RECTIFIED["log_boost"])
        boost = np.exp(np.where(latents.noise == NoiseKind.RECTIFIED, rectified, own))
        return np.where(latents.present, boost, np.float32(0.0))


_OF_CURVE: Final = latents_of("recruitment")


def _of_gain(law: Gain) -> list[tuple[float, float]]:
    return [law.ratio.log_law, law.cv.log_law]


def _of_curve(law: Muscle | RectifiedPrior, rest_pct: Scale) -> list[tuple[float, float]]:
    scales = (law.ratio, law.slope_per_pct, law.input_sd, law.sigma_y, law.boost_pct)
    return [*(scale.log_law for scale in scales), rest_pct.law]
