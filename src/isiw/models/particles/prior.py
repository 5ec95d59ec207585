"""What is believed about a person before the first trial, and where each belief comes from.

A particle is a vector of latents, each of one meaning, and the kinds of its profile and noise. Latents come in blocks;
what is believed of a block is a mixture of what is usual and of what else may be, so that particles are where unusual
people are from the first trial on, and moves need no Jacobians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Final, NamedTuple

import torch

from isiw.checks import check_numbers, check_probabilities, choice
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.particles.mixture import JointMixture, Mixture
from isiw.models.particles.noise import NoiseKind, Response
from isiw.models.particles.places import Place, mixture_of
from isiw.models.particles.shapes import Shape
from isiw.models.protocol import Tensor
from isiw.models.shared.scales import Scale, check_scales
from isiw.models.shared.start import StartPrior

__all__ = [
    "BLOCKS",
    "LATENTS",
    "PROFILE_BLOCKS",
    "RESPONSE_BLOCKS",
    "Floor",
    "Gain",
    "Latents",
    "Muscle",
    "NoiseShares",
    "Person",
    "Prior",
    "ProfilePrior",
    "SessionPrior",
    "ShapeShares",
    "SwitchPrior",
    "Width",
    "latents_of",
    "used_by",
]

BLOCKS: Final = {
    "start": ("start_ms",),
    "width": ("log_width_ms",),
    "form": ("form",),
    "floor": ("log_floor_mv", "log_floor_sd"),
    "session": ("drift", "startup"),
    "gain": ("log_gain", "log_cv"),
    "reliability": ("reliability",),
    "switch": ("switched_on", "switched_off"),
    "recruitment": ("log_ceiling", "log_slope", "log_input_sd", "log_sigma_y", "log_boost", "rest"),
}
"""The latents by what they are about."""

LATENTS: Final = tuple(name for names in BLOCKS.values() for name in names)
"""Names of the latents, in order."""

PROFILE_BLOCKS: Final = ("start", "width", "form")
RESPONSE_BLOCKS: Final = ("gain", "reliability", "switch", "recruitment")

_COMMON: Final = ("floor", "session")
_USED: Final = {
    NoiseKind.CONSTANT_CV: ("gain",),
    NoiseKind.MISSING: ("gain", "reliability"),
    NoiseKind.RECRUITMENT: ("recruitment",),
    NoiseKind.ALL_OR_NONE: ("gain", "switch"),
}


_WITHOUT_CURVE: Final = {
    NoiseKind.CONSTANT_CV: "constant-CV noise",
    NoiseKind.MISSING: "missing responses",
    NoiseKind.ALL_OR_NONE: "all-or-none responses",
}


def latents_of(*blocks: str, device: torch.device) -> Tensor:
    """Which latents belong to some of `BLOCKS`, shape (d,).

    Args:
        *blocks: names of the blocks.
        device: torch device.
    """
    chosen = {latent for block in blocks for latent in BLOCKS[block]}
    return torch.tensor([latent in chosen for latent in LATENTS], device=device)


def used_by(noise: Tensor, present: Tensor) -> Tensor:
    """Which latents mean anything to particles of some kinds; all others are as the prior draws them.

    Args:
        noise: one of `NoiseKind`, shape (b, p).
        present: whether there is any facilitation, shape (b, p).

    Returns:
        Shape (b, p, d).
    """
    device = noise.device
    by_kind = torch.stack([latents_of(*_COMMON, *_USED[kind], device=device) for kind in NoiseKind])
    return by_kind[noise] | (present.unsqueeze(-1) & latents_of(*PROFILE_BLOCKS, device=device))


class Latents(NamedTuple):
    """Particles of b people.

    Args:
        values: of the latents, in the order of `LATENTS`, shape (b, p, d).
        shape: one of `ShapeKind`, shape (b, p).
        noise: one of `NoiseKind`, shape (b, p).
        present: whether there is any facilitation, shape (b, p).
    """

    values: Tensor
    shape: Tensor
    noise: Tensor
    present: Tensor


class Person(NamedTuple):
    """What the latents mean: a profile, a response, and whether there is any facilitation; fields (b, p)."""

    shape: Shape
    response: Response
    present: Tensor


def _check_shares(shares: object) -> None:
    names = [f.name for f in fields(shares)]  # type: ignore[arg-type] # a dataclass
    check_probabilities(shares, *names)
    total = math.fsum(getattr(shares, name) for name in names)
    if not math.isclose(total, 1.0, abs_tol=1e-6):
        raise InvalidValueError(f"the probabilities of {type(shares).__name__} must sum to 1", got=total)


@dataclass(frozen=True)
class ShapeShares:
    """Probabilities of the families of profiles, in the order of `ShapeKind`.

    Most profiles pass a normality test (dissertation, 4.2: 8 of 11), the others are described in its outlook (8.1).

    Args:
        gaussian: of Gaussian profiles.
        skewed: of skewed ones.
        plateau: of flat-topped ones.
        two_peak: of those with two peaks.

    Raises:
        InvalidValueError: probabilities that do not sum to 1.
    """

    gaussian: float = 0.68
    skewed: float = 0.12
    plateau: float = 0.08
    two_peak: float = 0.12

    def __post_init__(self) -> None:
        _check_shares(self)


@dataclass(frozen=True)
class NoiseShares:
    """Probabilities of the kinds of noise, in the order of `NoiseKind`.

    Args:
        constant_cv: of noise of a constant CV.
        missing: of the same with missing responses.
        recruitment: of a recruitment curve with noise on its input.
        all_or_none: of responses that are all or none: those of a very steep curve.

    Raises:
        InvalidValueError: probabilities that do not sum to 1.
    """

    constant_cv: float = 0.37
    missing: float = 0.11
    recruitment: float = 0.44
    all_or_none: float = 0.08

    def __post_init__(self) -> None:
        _check_shares(self)


@dataclass(frozen=True)
class Width:
    """A law of the window's width.

    Args:
        share: its probability.
        width_ms: the width.

    Raises:
        InvalidValueError: an invalid share or scale.
    """

    share: float
    width_ms: Scale

    def __post_init__(self) -> None:
        check_probabilities(self, "share")
        check_scales(self, "width_ms")


@dataclass(frozen=True)
class ProfilePrior:
    """Of the facilitation by ISI.

    Args:
        p_window: probability that there is any facilitation.
        shapes: probabilities of the families.
        start: where windows start.
        widths: how wide they are; 60–220 ms, mean 108 measured (dissertation, Table 4.1).
        places: where and how wide they are as far as earlier sessions say; the rest of the probability is that of
            `start` and `widths`.

    Raises:
        InvalidValueError: an invalid probability, places that leave nothing to the rest, or that count from different
            events.
    """

    p_window: float = 0.72
    shapes: ShapeShares = field(default_factory=ShapeShares)
    start: StartPrior = field(default_factory=StartPrior)
    widths: tuple[Width, ...] = (Width(0.8, Scale(100.0, 0.42)), Width(0.2, Scale(150.0, 0.6)))
    places: tuple[Place, ...] = ()

    def __post_init__(self) -> None:
        check_probabilities(self, "p_window")
        if self.p_place >= 1.0:
            raise InvalidValueError("the shares of ProfilePrior.places must sum to less than 1", got=self.p_place)
        if len(references := {place.reference for place in self.places}) > 1:
            raise InvalidValueError("ProfilePrior.places must count from one event", got=sorted(references))

    @property
    def p_place(self) -> float:
        """Probability that a window is where earlier sessions say."""
        return math.fsum(place.share for place in self.places)

    def require_space(self, space: DesignSpace) -> None:
        """Check that the places mean something in a space.

        Raises:
            InvalidValueError: they count from another event than the space.
        """
        if self.places and self.places[0].reference != space.reference:
            raise InvalidValueError(
                "the prior's places and the design space count ISIs from different events",
                got=f"{space.reference} in the space",
                expected=self.places[0].reference,
                remedy="Use the prior with the kind of space that it was learnt in.",
            )


@dataclass(frozen=True)
class Muscle:
    """A law of recruitment curves: `s = A / (1 + exp(-k (x + sigma_x z1 - x50))) exp(sigma_y z2)` (Goetz et al.).

    Args:
        name: what it is called.
        share: its probability.
        ratio: the largest MEP over the floor, A.
        slope_per_pct: k [1 / % RMT].
        input_sd: SD of the noise on the input, k sigma_x: about the same in steep curves and flat ones.
        sigma_y: SD of the noise on the output, natural log.
        boost_pct: shift of the input at the best ISI [% RMT].
        rest_pct: the input without a tap, intensity − x50 [% RMT].

    Raises:
        InvalidValueError: an invalid share or scale.
    """

    name: str
    share: float
    ratio: Scale
    slope_per_pct: Scale
    input_sd: Scale
    sigma_y: Scale
    boost_pct: Scale
    rest_pct: Scale

    def __post_init__(self) -> None:
        check_probabilities(self, "share")
        check_scales(self, "ratio", "slope_per_pct", "input_sd", "sigma_y", "boost_pct")
        check_scales(self, "rest_pct", positive=False)


FOREARM: Final = Muscle(
    name="forearm",
    share=0.54,
    ratio=Scale(16.0, 0.45),  # 0.1–0.25 mV over the floor
    slope_per_pct=Scale(0.30, 0.06),
    input_sd=Scale(2.1, 0.20),  # 5–9 % RMT
    sigma_y=Scale(0.39, 0.19),  # 0.3–0.5
    boost_pct=Scale(11.3, 0.36),  # 5–18 % RMT
    rest_pct=Scale(-15.0, 1.5),  # 90 % RMT, half of the largest MEP at RMT + 4 %
)

HAND: Final = Muscle(
    name="hand",
    share=0.16,
    ratio=Scale(90.0, 0.85),  # 0.2–3 mV over the floor
    slope_per_pct=Scale(0.23, 0.1),
    input_sd=Scale(1.65, 0.25),
    sigma_y=Scale(0.39, 0.19),
    boost_pct=Scale(15.0, 0.5),  # nobody has measured it
    rest_pct=Scale(-19.0, 6.0),  # 90–110 % RMT, half of the largest MEP at RMT + 17 %
)

OTHER_MUSCLE: Final = Muscle(
    name="other muscle",
    share=0.30,
    ratio=Scale(18.0, 0.7),
    slope_per_pct=Scale(0.36, 0.5),
    input_sd=Scale(2.0, 0.3),
    sigma_y=Scale(0.39, 0.3),
    boost_pct=Scale(10.5, 0.45),
    rest_pct=Scale(-14.5, 5.0),
)


@dataclass(frozen=True)
class Gain:
    """A law of responses in proportion to the facilitation, with noise of a constant CV.

    Args:
        share: its probability.
        ratio: the best expected MEP over the floor; MEPs peak at 0.03–0.3 mV (dissertation, 4.2).
        cv: the CV.

    Raises:
        InvalidValueError: an invalid share or scale.
    """

    share: float
    ratio: Scale
    cv: Scale

    def __post_init__(self) -> None:
        check_probabilities(self, "share")
        check_scales(self, "ratio", "cv")


@dataclass(frozen=True)
class SwitchPrior:
    """Of the probabilities with which responses come, where they may be missing or are all or none; in logits.

    Args:
        reliability: of a response at the best ISI where responses may be missing; often about one half (dissertation,
            Fig. 6.5).
        switched_on: of a response at the best ISI where responses are all or none.
        switched_off: of such a response without a tap; 0.05–0.25 of the trials at 90 % RMT are above 50 µV in the hand,
            next to none in the forearm.

    Raises:
        InvalidValueError: an invalid scale.
    """

    reliability: Scale = Scale(0.2, 0.7)
    switched_on: Scale = Scale(1.2, 0.9)
    switched_off: Scale = Scale(-3.3, 1.0)

    def __post_init__(self) -> None:
        check_scales(self, "reliability", "switched_on", "switched_off", positive=False)


@dataclass(frozen=True)
class Floor:
    """A law of the EMG floor.

    Args:
        share: its probability.
        median_mv: its median [mV]; 6–20 µV measured.
        log_sd: its SD from trial to trial, natural log; 0.12–0.35.

    Raises:
        InvalidValueError: an invalid share or scale.
    """

    share: float
    median_mv: Scale
    log_sd: Scale

    def __post_init__(self) -> None:
        check_probabilities(self, "share")
        check_scales(self, "median_mv", "log_sd")


@dataclass(frozen=True)
class SessionPrior:
    """Of what changes within a session.

    Args:
        drift_sd: SD of what the log of evoked MEPs drifts by in the long run; about 0.26 over a session measured.
        startup: how strongly the first trials startle, 1 being as much as in blocks of plain TMS.

    Raises:
        InvalidValueError: an SD that is not positive, or an invalid scale.
    """

    drift_sd: float = 0.3
    startup: Scale = Scale(0.5, 0.5)

    def __post_init__(self) -> None:
        check_numbers(self, "drift_sd", above=0)
        check_scales(self, "startup", positive=False)


@dataclass(frozen=True)
class Prior:
    """The prior over people.

    Args:
        profile: of the facilitation by ISI.
        noise: probabilities of the kinds of noise.
        gains: of responses with noise of a constant CV.
        switch: of how often responses come.
        muscles: of recruitment curves.
        floors: of the EMG floor.
        session: of what changes within a session.
        muscle: the name of the muscle, where it is known: the others that have a name are left out then.

    Raises:
        InvalidValueError: a muscle that is none of the muscles.
    """

    profile: ProfilePrior = field(default_factory=ProfilePrior)
    noise: NoiseShares = field(default_factory=NoiseShares)
    gains: tuple[Gain, ...] = (
        Gain(0.85, Scale(7.3, 0.62), Scale(0.62, 0.26)),
        Gain(0.15, Scale(9.0, 1.2), Scale(0.62, 0.45)),
    )
    switch: SwitchPrior = field(default_factory=SwitchPrior)
    muscles: tuple[Muscle, ...] = (FOREARM, HAND, OTHER_MUSCLE)
    floors: tuple[Floor, ...] = (
        Floor(0.85, Scale(0.009, 0.38), Scale(0.22, 0.4)),
        Floor(0.15, Scale(0.009, 1.2), Scale(0.22, 0.5)),
    )
    session: SessionPrior = field(default_factory=SessionPrior)
    muscle: str | None = None

    def __post_init__(self) -> None:
        if self.muscle is not None:
            choice("Prior.muscle", self.muscle, [muscle.name for muscle in self.muscles])

    @cached_property
    def mixtures(self) -> dict[str, Mixture]:
        """What is believed of each block but the start, places aside."""
        switch, session = self.switch, self.session
        return {
            "width": _mixture([(w.share, [_log(w.width_ms)]) for w in self.profile.widths]),
            "form": _mixture([(1.0, [(0.0, 1.0)])]),
            "floor": _mixture([(f.share, [_log(f.median_mv), _log(f.log_sd)]) for f in self.floors]),
            "session": _mixture([(1.0, [(0.0, session.drift_sd), _plain(session.startup)])]),
            "gain": _mixture([(g.share, [_log(g.ratio), _log(g.cv)]) for g in self.gains]),
            "reliability": _mixture([(1.0, [_plain(switch.reliability)])]),
            "switch": _mixture([(1.0, [_plain(switch.switched_on), _plain(switch.switched_off)])]),
            "recruitment": _mixture([(m.share, _of_muscle(m)) for m in self.possible_muscles]),
        }

    @cached_property
    def _joint(self) -> JointMixture:
        return JointMixture(list(self.mixtures.values()))

    @cached_property
    def spreads(self) -> Tensor:
        """Usual SD of each latent, shape (d,)."""
        first = self.profile.start.spans[0]
        parts = [torch.tensor([first.high_ms - first.low_ms]) / math.sqrt(12.0)]
        return torch.cat(parts + [self.mixtures[name].sds[0] for name in BLOCKS if name != "start"])

    def sample(self, people: int, particles: int, generator: torch.Generator, space: DesignSpace) -> Latents:
        """Particles of the prior.

        Args:
            people: how many people.
            particles: how many particles of each.
            generator: source of randomness.
            space: the design space that the window is in.
        """
        size = (people, particles)
        uniform = torch.rand((4, *size), generator=generator, device=generator.device)
        start_ms = self.profile.start.start_ms(uniform[3], space).unsqueeze(-1)
        values = torch.cat([start_ms, self._joint.sample(size, generator)], dim=-1)
        if self.profile.p_place:
            known = torch.rand((*size, 1), generator=generator, device=generator.device) < self.profile.p_place
            place = JointMixture([self._places]).sample(size, generator)
            values = torch.cat([torch.where(known, place, values[..., :2]), values[..., 2:]], dim=-1)
        shape, noise = _kinds(self.profile.shapes, uniform[0]), _kinds(self.noise, uniform[1])
        return Latents(values, shape, noise, uniform[2] < self.profile.p_window)

    def log_density(self, values: Tensor, space: DesignSpace) -> Tensor:
        """Log density of latents but for a constant, shape (b, p).

        Args:
            values: latents, shape (b, p, d).
            space: the design space that the window is in.
        """
        if not self.profile.p_place:
            return self.profile.start.log_density(values[..., 0], space) + self._joint.log_density(values[..., 1:])
        return torch.logsumexp(self.log_places(values, space), dim=-1) + self._beside_place.log_density(values[..., 2:])

    def log_densities(self, values: Tensor, space: DesignSpace) -> dict[str, Tensor]:
        """Log density of the latents of each block, shape (b, p); start and width are one: `"place"`.

        Args:
            values: latents, shape (b, p, d).
            space: the design space that the window is in.
        """
        sizes = [len(names) for names in BLOCKS.values()]
        parts = dict(zip(BLOCKS, torch.split(values, sizes, dim=-1), strict=True))
        others = {name: mixture for name, mixture in self.mixtures.items() if name != "width"}
        place = {"place": torch.logsumexp(self.log_places(values, space), dim=-1)}
        return place | {name: mixture.log_density(parts[name]) for name, mixture in others.items()}

    def log_places(self, values: Tensor, space: DesignSpace) -> Tensor:
        """Log density of start and width, times its probability: anywhere, and in each place, shape (b, p, 1 + k).

        Args:
            values: latents, shape (b, p, d).
            space: the design space that the window is in.
        """
        start, width = self.profile.start.log_density(values[..., 0], space), self.mixtures["width"]
        anywhere = (start + width.log_density(values[..., 1:2])).unsqueeze(-1)
        share = self.profile.p_place
        if not share:
            return anywhere
        places = math.log(share) + self._places.log_parts(values[..., :2])
        return torch.cat([math.log1p(-share) + anywhere, places], dim=-1)

    @cached_property
    def _places(self) -> Mixture:
        return mixture_of(self.profile.places)

    @cached_property
    def _beside_place(self) -> JointMixture:
        return JointMixture([mixture for name, mixture in self.mixtures.items() if name != "width"])

    @property
    def possible_muscles(self) -> tuple[Muscle, ...]:
        """All muscles but, where one is known, the others that have a name of their own."""
        others = set() if self.muscle is None else {FOREARM.name, HAND.name} - {self.muscle}
        return tuple(m for m in self.muscles if m.name not in others)

    @property
    def hypotheses(self) -> tuple[str, ...]:
        """What the kinds of responses are called: kinds of noise, and muscles."""
        names = dict.fromkeys(f"recruitment curve, {muscle.name}" for muscle in self.possible_muscles)
        return (*_WITHOUT_CURVE.values(), *names)

    def hypothesis(self, latents: Latents) -> Tensor:
        """Which of `hypotheses` each particle belongs to, shape (b, p)."""
        recruitment = latents.values[..., latents_of("recruitment", device=latents.values.device)]
        names = [muscle.name for muscle in self.possible_muscles]
        numbers = torch.tensor([list(dict.fromkeys(names)).index(name) for name in names], device=recruitment.device)
        kind = len(_WITHOUT_CURVE) + numbers[self.mixtures["recruitment"].component(recruitment)]
        for number, noise in enumerate(_WITHOUT_CURVE):
            kind = torch.where(latents.noise == noise, number, kind)
        return kind

    def shift_pct_rmt(self, latents: Latents) -> Tensor:
        """Shift of the recruitment curve's input at the best ISI [% RMT], 0 without facilitation, shape (b, p)."""
        return torch.where(latents.present, latents.values[..., LATENTS.index("log_boost")].exp(), 0.0)

    def person(self, latents: Latents) -> Person:
        """What particles mean."""
        z = dict(zip(LATENTS, latents.values.unbind(-1), strict=True))
        shape = Shape(latents.shape, z["start_ms"], z["log_width_ms"].exp(), _even(z["form"]))
        return Person(shape, self._response(z, latents.noise), latents.present)

    def _response(self, z: dict[str, Tensor], noise: Tensor) -> Response:
        recruits, switches = noise == NoiseKind.RECRUITMENT, noise == NoiseKind.ALL_OR_NONE
        slope = z["log_slope"].exp()
        return Response(
            kind=noise,
            log_floor=z["log_floor_mv"],
            floor_log_sd=z["log_floor_sd"].exp(),
            log_ratio=torch.where(recruits, z["log_ceiling"], z["log_gain"]),
            spread=torch.where(recruits, z["log_input_sd"], z["log_cv"]).exp(),
            output_log_sd=z["log_sigma_y"].exp(),
            boost=slope * z["log_boost"].exp(),
            rest=slope * z["rest"],
            max_probability=torch.sigmoid(torch.where(switches, z["switched_on"], z["reliability"])),
            rest_probability=torch.sigmoid(z["switched_off"]),
            drift=z["drift"],
            startup=z["startup"],
        )


def _plain(scale: Scale) -> tuple[float, float]:
    return scale.median, scale.sd


def _log(scale: Scale) -> tuple[float, float]:
    return math.log(scale.median), scale.sd


def _of_muscle(muscle: Muscle) -> list[tuple[float, float]]:
    scales = (muscle.ratio, muscle.slope_per_pct, muscle.input_sd, muscle.sigma_y, muscle.boost_pct)
    return [*map(_log, scales), _plain(muscle.rest_pct)]


def _mixture(components: list[tuple[float, list[tuple[float, float]]]]) -> Mixture:
    return Mixture.of(components, "cpu")


def _kinds(shares: ShapeShares | NoiseShares, uniform: Tensor) -> Tensor:
    """The kind at each quantile, same shape."""
    values = torch.tensor([getattr(shares, f.name) for f in fields(shares)], device=uniform.device)
    return torch.bucketize(uniform, values.cumsum(0)[:-1])


def _even(z: Tensor) -> Tensor:
    """Uniform in -1..1."""
    even: Tensor = 2.0 * torch.special.ndtr(z) - 1.0
    return even
