"""What is believed about a person before the first trial, and where each belief comes from.

A particle is a vector of standard normal latents and three discrete kinds. This module maps them to the parameters of
`shapes` and `noise`, so that the prior is the same simple thing whatever the parameters' ranges are, and moves can be
made between kinds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Final, NamedTuple

import torch

from isiw.checks import check_numbers, check_probabilities
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.particles.noise import NoiseKind, Response
from isiw.models.particles.shapes import Shape
from isiw.models.protocol import Tensor
from isiw.models.shared.scales import Scale, check_scales
from isiw.models.shared.start import StartPrior

__all__ = [
    "BLOCKS",
    "LATENTS",
    "AllOrNonePrior",
    "FloorPrior",
    "GainPrior",
    "Latents",
    "Muscle",
    "NoiseShares",
    "Person",
    "Prior",
    "ProfilePrior",
    "SessionPrior",
    "ShapeShares",
    "block",
]

BLOCKS: Final = {
    "place": ("start", "width"),
    "form": ("form",),
    "floor": ("log_floor", "floor_log_sd"),
    "session": ("drift", "startup"),
    "noise": ("log_ratio", "spread", "output", "boost", "rest"),
}
"""The latents by what they are about; those of the noise mean what its kind makes of them."""

LATENTS: Final = tuple(name for names in BLOCKS.values() for name in names)
"""Names of the latents, in order."""


def block(*names: str, device: torch.device) -> Tensor:
    """Which latents belong to some of `BLOCKS`, shape (d,).

    Args:
        *names: of the blocks.
        device: torch device.
    """
    chosen = {latent for name in names for latent in BLOCKS[name]}
    return torch.tensor([latent in chosen for latent in LATENTS], device=device)


class Latents(NamedTuple):
    """Particles of b people.

    Args:
        z: standard normal latents in the order of `LATENTS`, shape (b, p, d).
        shape: one of `ShapeKind`, shape (b, p).
        noise: one of `NoiseKind`, shape (b, p).
        present: whether there is any facilitation, shape (b, p).
    """

    z: Tensor
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
        forearm: of the recruitment curve of a forearm's muscle.
        all_or_none: of responses that are all or none: those of a very steep curve.
        hand: of the recruitment curve of a hand's muscle, or of another of which as little is known.

    Raises:
        InvalidValueError: probabilities that do not sum to 1.
    """

    constant_cv: float = 0.37
    missing: float = 0.11
    forearm: float = 0.352
    all_or_none: float = 0.08
    hand: float = 0.088

    def __post_init__(self) -> None:
        _check_shares(self)


@dataclass(frozen=True)
class ProfilePrior:
    """Of the facilitation by ISI.

    Args:
        p_window: probability that there is any facilitation.
        shapes: probabilities of the families.
        start: where windows start.
        width_ms: their width; 60–220 ms, mean 108 measured (dissertation, Table 4.1).

    Raises:
        InvalidValueError: an invalid probability or scale.
    """

    p_window: float = 0.72
    shapes: ShapeShares = field(default_factory=ShapeShares)
    start: StartPrior = field(default_factory=StartPrior)
    width_ms: Scale = Scale(100.0, 0.42, 0.02)

    def __post_init__(self) -> None:
        check_probabilities(self, "p_window")
        check_scales(self, "width_ms")


@dataclass(frozen=True)
class Muscle:
    """Of a recruitment curve; its input is in logits.

    Args:
        ratio: the largest MEP over the floor.
        input_sd: SD of the noise on the input, k sigma_x.
        output_sd: SD of the noise on the output, natural log.
        boost: shift of the input at the best ISI, k times the boost.
        rest: the input without a tap, k (intensity − x50).

    Raises:
        InvalidValueError: an invalid scale.
    """

    ratio: Scale
    input_sd: Scale
    output_sd: Scale
    boost: Scale
    rest: Scale

    def __post_init__(self) -> None:
        check_scales(self, "ratio", "input_sd", "output_sd", "boost")
        check_scales(self, "rest", positive=False)


FOREARM: Final = Muscle(
    ratio=Scale(16.0, 0.42, 0.04),  # 0.1–0.25 mV over the floor
    input_sd=Scale(2.1, 0.18, 0.015),  # 0.3 × 5–9 % RMT
    output_sd=Scale(0.39, 0.18, 0.02),
    boost=Scale(3.4, 0.33, 0.02),  # 0.3 × 5–18 % RMT
    rest=Scale(-4.5, 0.38, 0.05),  # −4 to −5 at 90 % RMT
)

HAND: Final = Muscle(
    ratio=Scale(90.0, 0.9),  # 0.2–3 mV over the floor
    input_sd=Scale(1.8, 0.3),  # 0.23 × 5–9 % RMT
    output_sd=Scale(0.39, 0.18, 0.02),
    boost=Scale(3.6, 0.5),  # 0.23 × 16 % RMT in the middle; nobody has measured it
    rest=Scale(-4.7, 1.0),  # −6 at 90 % RMT, −4 at 100 %
)


@dataclass(frozen=True)
class GainPrior:
    """Of responses in proportion to the facilitation, with noise of a constant CV.

    Args:
        ratio: the best expected MEP over the floor; MEPs peak at 0.03–0.3 mV (dissertation, 4.2).
        cv: the CV.
        max_probability: logit of the response probability at the best ISI, where responses may be missing; often about
            one half (dissertation, Fig. 6.5).

    Raises:
        InvalidValueError: an invalid scale.
    """

    ratio: Scale = Scale(7.3, 0.6, 0.04)
    cv: Scale = Scale(0.62, 0.25, 0.02)
    max_probability: Scale = Scale(0.2, 0.7)

    def __post_init__(self) -> None:
        check_scales(self, "ratio", "cv")
        check_scales(self, "max_probability", positive=False)


@dataclass(frozen=True)
class AllOrNonePrior:
    """Of responses that are all or none; their size is that of `GainPrior`.

    Args:
        max_probability: logit of the response probability at the best ISI.
        rest_probability: logit of that without a tap; 0.05–0.25 of the trials at 90 % RMT are above 50 µV in the hand,
            next to none in the forearm.

    Raises:
        InvalidValueError: an invalid scale.
    """

    max_probability: Scale = Scale(1.2, 0.9)
    rest_probability: Scale = Scale(-3.3, 1.0)

    def __post_init__(self) -> None:
        check_scales(self, "max_probability", "rest_probability", positive=False)


@dataclass(frozen=True)
class FloorPrior:
    """Of the EMG floor.

    Args:
        median_mv: its median [mV]; 6–20 µV measured. The tail reaches a factor of ten at 2.4 SDs, for rigs with another
            gain.
        log_sd: its SD from trial to trial, natural log; 0.12–0.35.

    Raises:
        InvalidValueError: an invalid scale.
    """

    median_mv: Scale = Scale(0.009, 0.35, 0.12)
    log_sd: Scale = Scale(0.22, 0.38, 0.02)

    def __post_init__(self) -> None:
        check_scales(self, "median_mv", "log_sd")


@dataclass(frozen=True)
class SessionPrior:
    """Of what changes within a session.

    Args:
        drift_sd: SD of what the log of evoked MEPs drifts by in the long run; about 0.26 over a session measured.
        startup: how strongly the first trials startle, 1 being as much as in blocks of plain TMS; mean and SD.

    Raises:
        InvalidValueError: a negative SD.
    """

    drift_sd: float = 0.3
    startup: tuple[float, float] = (0.5, 0.5)

    def __post_init__(self) -> None:
        check_numbers(self, "drift_sd", least=0)
        if not all(math.isfinite(value) and value >= 0 for value in self.startup):
            raise InvalidValueError("SessionPrior.startup must not be negative", got=self.startup)


@dataclass(frozen=True)
class Prior:
    """The prior over people.

    Args:
        profile: of the facilitation by ISI.
        noise: probabilities of the kinds of noise.
        gain: of responses with noise of a constant CV.
        all_or_none: of responses that are all or none.
        forearm: of the recruitment curve of a forearm's muscle.
        hand: of that of a hand's muscle.
        floor: of the EMG floor.
        session: of what changes within a session.
    """

    profile: ProfilePrior = field(default_factory=ProfilePrior)
    noise: NoiseShares = field(default_factory=NoiseShares)
    gain: GainPrior = field(default_factory=GainPrior)
    all_or_none: AllOrNonePrior = field(default_factory=AllOrNonePrior)
    forearm: Muscle = FOREARM
    hand: Muscle = HAND
    floor: FloorPrior = field(default_factory=FloorPrior)
    session: SessionPrior = field(default_factory=SessionPrior)

    def sample_kinds(self, size: tuple[int, ...], generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Shape, noise and presence of new particles, each of `size`.

        Args:
            size: of each.
            generator: what they are drawn from.
        """
        uniform = torch.rand((3, *size), generator=generator, device=generator.device)
        shape, noise = _kinds(self.profile.shapes, uniform[0]), _kinds(self.noise, uniform[1])
        return shape, noise, uniform[2] < self.profile.p_window

    def sample(self, people: int, particles: int, generator: torch.Generator) -> Latents:
        """Particles of the prior.

        Args:
            people: how many people.
            particles: how many particles of each.
            generator: source of randomness.
        """
        z = torch.randn((people, particles, len(LATENTS)), generator=generator, device=generator.device)
        return Latents(z, *self.sample_kinds((people, particles), generator))

    def person(self, latents: Latents, space: DesignSpace) -> Person:
        """What particles mean in a design space.

        Args:
            latents: of the particles.
            space: the ISIs that may be asked.
        """
        z = dict(zip(LATENTS, latents.z.unbind(-1), strict=True))
        start_ms = self.profile.start.start_ms(z["start"], space)
        shape = Shape(latents.shape, start_ms, self.profile.width_ms.log_normal(z["width"]), _even(z["form"]))
        return Person(shape, self._response(z, latents.noise), latents.present)

    def _response(self, z: dict[str, Tensor], noise: Tensor) -> Response:
        hand, switches = noise == NoiseKind.HAND, noise == NoiseKind.ALL_OR_NONE
        recruits = hand | (noise == NoiseKind.FOREARM)

        def of_muscle(latent: str, name: str) -> Tensor:
            forearms, hands = getattr(self.forearm, name), getattr(self.hand, name)
            return torch.where(hand, hands.log_normal(z[latent]), forearms.log_normal(z[latent]))

        largest, input_sd = of_muscle("log_ratio", "ratio"), of_muscle("spread", "input_sd")
        return Response(
            kind=noise,
            log_floor=self.floor.median_mv.log_normal(z["log_floor"]).log(),
            floor_log_sd=self.floor.log_sd.log_normal(z["floor_log_sd"]),
            log_ratio=torch.where(recruits, largest, self.gain.ratio.log_normal(z["log_ratio"])).log(),
            spread=torch.where(recruits, input_sd, self.gain.cv.log_normal(z["spread"])),
            output_log_sd=of_muscle("output", "output_sd"),
            boost=of_muscle("boost", "boost"),
            rest=torch.where(hand, self.hand.rest.normal(z["rest"]), self.forearm.rest.normal(z["rest"])),
            max_probability=torch.where(
                switches,
                self.all_or_none.max_probability.probability(z["output"]),
                self.gain.max_probability.probability(z["output"]),
            ),
            rest_probability=self.all_or_none.rest_probability.probability(z["rest"]),
            drift=self.session.drift_sd * z["drift"],
            startup=self.session.startup[0] + self.session.startup[1] * z["startup"],
        )


def _kinds(shares: ShapeShares | NoiseShares, uniform: Tensor) -> Tensor:
    """The kind at each quantile, same shape."""
    values = torch.tensor([getattr(shares, f.name) for f in fields(shares)], device=uniform.device)
    return torch.bucketize(uniform, values.cumsum(0)[:-1])


def _even(z: Tensor) -> Tensor:
    """Uniform in -1..1."""
    even: Tensor = 2.0 * torch.special.ndtr(z) - 1.0
    return even
