"""What is believed about a person before the first trial, and where each belief comes from.

A particle is a vector of standard normal latents and three discrete kinds. This module maps them to the parameters of
`shapes` and `response`, so that the prior is the same simple thing whatever the parameters' ranges are, and moves can
be made between kinds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import torch

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.particles.noise import NoiseKind, Response
from isiw.models.particles.shapes import Shape, ShapeKind
from isiw.models.protocol import Tensor
from isiw.models.shared.start import start_ms

__all__ = ["LATENTS", "Latents", "Person", "Prior"]

LATENTS = (
    *("start", "width", "form"),
    *("log_floor", "floor_log_sd", "drift", "startup"),
    *("log_ratio", "spread", "output", "boost", "rest"),
)
"""Names of the latents, in order: of the profile, of every response, and those whose meaning depends on the noise."""

SHAPE_LATENTS = slice(0, 3)
NOISE_LATENTS = slice(7, 12)

_SCALES = (
    *("width_ms", "floor_mv", "floor_log_sd", "gain_ratio", "cv"),
    *("recruitment_ratio", "input_sd", "output_sd", "boost"),
    *("hand_ratio", "hand_input_sd", "hand_boost"),
)
_RESTS = ("rest", "hand_rest")

HAND = len(NoiseKind)
"""One more kind of noise for particles: that of a recruitment curve, but a hand muscle's."""


Scale: TypeAlias = tuple[float, float, float]
"""Median, SD and cubic tail: a latent z stands for the median plus SD z + tail z³, of the logarithm where it is one.

The SD is that of the people who were measured, the tail reaches those whom nobody measured: they are learnt from their
trials rather than pulled to the usual."""


class Latents(NamedTuple):
    """Particles of b people.

    Args:
        z: standard normal latents in the order of `LATENTS`, shape (b, p, d).
        shape: one of `ShapeKind`, shape (b, p).
        noise: one of `NoiseKind`, or `HAND`, shape (b, p).
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


@dataclass(frozen=True)
class Prior:
    """The prior over people.

    Args:
        p_window: probability that there is any facilitation.
        p_shape: probabilities of Gaussian, skewed, flat-topped and two-peaked profiles. Most profiles pass a normality
            test (dissertation, 4.2: 8 of 11), the others are described in its outlook (8.1).
        p_noise: probabilities of constant-CV noise, the same with missing responses, a noisy recruitment curve, and
            responses that are all or none: those of a very steep curve.
        p_hand: probability that a recruitment curve is a hand muscle's, or another's of which as little is known.
        start_ms: where windows start after the impact [ms], uniform between these.
        hit_delay_ms: mean and SD of the hit delay of a person unknown [ms]; 172–188 ms measured (dissertation, 4.2).
        p_anywhere: probability that a window starts anywhere in the range instead, for stimulators unlike that one;
            more in a range that only a part of the usual starts lies in.
        width_ms: logarithmic scale of the width; 60–220 ms, mean 108 measured (dissertation, Table 4.1).
        floor_mv: logarithmic scale of the EMG floor; 6–20 µV measured. The tail reaches a factor of ten at 2.4 SDs, for
            rigs with another gain.
        floor_log_sd: logarithmic scale of the floor's own log SD; 0.12–0.35.
        gain_ratio: logarithmic scale of the best expected MEP over the floor; MEPs peak at 0.03–0.3 mV (ibid., 4.2).
        cv: logarithmic scale of the constant CV.
        max_probability: mean and SD, in logits, of the response probability at the best ISI; often about one half
            (dissertation, Fig. 6.5).
        switch_probability: the same where responses are all or none.
        rest_probability: mean and SD, in logits, of the probability of such a response without a tap; 0.05–0.25 of the
            trials at 90 % RMT are above 50 µV in the hand, next to none in the forearm.
        recruitment_ratio: logarithmic scale of the largest MEP over the floor; 0.1–0.25 mV in forearm muscles.
        input_sd: logarithmic scale of the input noise in logits: k sigma_x, 0.3 × 5–9 % RMT in the forearm.
        output_sd: logarithmic scale of the output noise, natural log; 0.3–0.5.
        boost: logarithmic scale of the boost in logits: k times 5–18 % RMT.
        rest: scale of the drive at rest in logits: k (90 % RMT − x50), −4 to −5 in the forearm.
        hand_ratio: the largest MEP over the floor of a hand muscle; 0.2–3 mV.
        hand_input_sd: its input noise in logits: k sigma_x, 0.23 × 5–9 % RMT.
        hand_boost: its boost in logits: k times 16 % RMT in the middle; nobody has measured it.
        hand_rest: its drive at rest in logits: −6 at 90 % RMT, −4 at 100 %.
        drift_sd: SD of what the log of evoked MEPs drifts by in the long run; about 0.26 over a session measured.
        startup: mean and SD of how strongly the first trials startle, 1 being as much as in blocks of plain TMS.

    Raises:
        InvalidValueError: probabilities that are none or do not sum to one, scales that cannot be.
    """

    p_window: float = 0.72
    p_shape: tuple[float, float, float, float] = (0.68, 0.12, 0.08, 0.12)
    p_noise: tuple[float, float, float, float] = (0.37, 0.11, 0.44, 0.08)
    p_hand: float = 0.2
    start_ms: tuple[float, float] = (0.0, 115.0)
    hit_delay_ms: tuple[float, float] = (180.0, 6.2)
    p_anywhere: float = 0.08
    width_ms: Scale = (100.0, 0.42, 0.02)
    floor_mv: Scale = (0.009, 0.35, 0.12)
    floor_log_sd: Scale = (0.22, 0.38, 0.02)
    gain_ratio: Scale = (7.3, 0.6, 0.04)
    cv: Scale = (0.62, 0.25, 0.02)
    max_probability: tuple[float, float] = (0.2, 0.7)
    switch_probability: tuple[float, float] = (1.2, 0.9)
    rest_probability: tuple[float, float] = (-3.3, 1.0)
    recruitment_ratio: Scale = (16.0, 0.42, 0.04)
    input_sd: Scale = (2.1, 0.18, 0.015)
    output_sd: Scale = (0.39, 0.18, 0.02)
    boost: Scale = (3.4, 0.33, 0.02)
    rest: Scale = (-4.5, 0.38, 0.05)
    hand_ratio: Scale = (90.0, 0.9, 0.0)
    hand_input_sd: Scale = (1.8, 0.3, 0.0)
    hand_boost: Scale = (3.6, 0.5, 0.0)
    hand_rest: Scale = (-4.7, 1.0, 0.0)
    drift_sd: float = 0.3
    startup: tuple[float, float] = (0.5, 0.5)

    def __post_init__(self) -> None:
        for name in ("p_window", "p_hand", "p_anywhere"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise InvalidValueError(f"{name} must be a probability", got=getattr(self, name))
        for name, kinds in (("p_shape", ShapeKind), ("p_noise", NoiseKind)):
            shares = getattr(self, name)
            if len(shares) != len(kinds) or not min(shares) >= 0 or not math.isclose(sum(shares), 1.0, abs_tol=1e-6):
                raise InvalidValueError(
                    f"{name} must hold a probability for each kind", got=shares, expected=f"{len(kinds)} that sum to 1"
                )
        for name in (*_SCALES, *_RESTS):
            scale = getattr(self, name)
            if not _is_scale(scale, of_logarithm=name not in _RESTS):
                raise InvalidValueError(f"{name} is no scale", got=scale, expected="a median, an SD, and a cubic tail")
        if not all(math.isfinite(value) and value > 0 for value in self.hit_delay_ms):
            raise InvalidValueError("hit_delay_ms must be positive", got=self.hit_delay_ms)
        sds = [probability[1] for probability in (self.max_probability, self.switch_probability, self.rest_probability)]
        if not all(math.isfinite(value) and value >= 0 for value in (self.drift_sd, *self.startup, *sds)):
            raise InvalidValueError(
                "drift_sd, startup and the SDs of probabilities must not be negative",
                got=(self.drift_sd, self.startup, *sds),
            )
        if not self.start_ms[0] < self.start_ms[1]:
            raise InvalidValueError("start_ms is empty", got=self.start_ms, expected="earliest < latest")

    @property
    def p_noise_of_particles(self) -> tuple[float, ...]:
        """Probabilities of the kinds of `Latents.noise`: `p_noise`, with `HAND` apart from the other recruitment."""
        shares = [*self.p_noise, self.p_noise[NoiseKind.RECRUITMENT] * self.p_hand]
        shares[NoiseKind.RECRUITMENT] *= 1.0 - self.p_hand
        return tuple(shares)

    def sample_kinds(self, size: tuple[int, ...], generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Shape, noise and presence of new particles, each of `size`."""
        uniform = torch.rand((3, *size), generator=generator, device=generator.device)
        kinds = (
            torch.bucketize(u, torch.tensor(p, device=u.device).cumsum(0)[:-1])
            for u, p in zip(uniform[:2], (self.p_shape, self.p_noise_of_particles), strict=True)
        )
        return next(kinds), next(kinds), uniform[2] < self.p_window

    def sample(self, people: int, particles: int, generator: torch.Generator) -> Latents:
        """Particles of the prior."""
        z = torch.randn((people, particles, len(LATENTS)), generator=generator, device=generator.device)
        return Latents(z, *self.sample_kinds((people, particles), generator))

    def person(self, latents: Latents, space: DesignSpace) -> Person:
        """What particles mean in a design space."""
        z = dict(zip(LATENTS, latents.z.unbind(-1), strict=True))
        shape = Shape(
            latents.shape, self._start(z["start"], space), _log_normal(z["width"], self.width_ms), _even(z["form"])
        )
        return Person(shape, self._response(z, latents.noise), latents.present)

    def _response(self, z: dict[str, Tensor], noise: Tensor) -> Response:
        hand, switches = noise == HAND, noise == NoiseKind.ALL_OR_NONE
        recruits = hand | (noise == NoiseKind.RECRUITMENT)

        def of_muscle(name: str, forearms: Scale, hands: Scale) -> Tensor:
            return torch.where(hand, _log_normal(z[name], hands), _log_normal(z[name], forearms))

        largest = of_muscle("log_ratio", self.recruitment_ratio, self.hand_ratio)
        input_sd = of_muscle("spread", self.input_sd, self.hand_input_sd)
        return Response(
            kind=torch.where(hand, NoiseKind.RECRUITMENT, noise),
            log_floor=_log_normal(z["log_floor"], self.floor_mv).log(),
            floor_log_sd=_log_normal(z["floor_log_sd"], self.floor_log_sd),
            log_ratio=torch.where(recruits, largest, _log_normal(z["log_ratio"], self.gain_ratio)).log(),
            spread=torch.where(recruits, input_sd, _log_normal(z["spread"], self.cv)),
            output_log_sd=_log_normal(z["output"], self.output_sd),
            boost=of_muscle("boost", self.boost, self.hand_boost),
            rest=torch.where(hand, _normal(z["rest"], self.hand_rest), _normal(z["rest"], self.rest)),
            max_probability=torch.where(
                switches,
                _probability(z["output"], self.switch_probability),
                _probability(z["output"], self.max_probability),
            ),
            rest_probability=_probability(z["rest"], self.rest_probability),
            drift=self.drift_sd * z["drift"],
            startup=self.startup[0] + self.startup[1] * z["startup"],
        )

    def _start(self, z: Tensor, space: DesignSpace) -> Tensor:
        return start_ms(z, space, self.start_ms, self.hit_delay_ms, self.p_anywhere)


def _is_scale(scale: Scale, *, of_logarithm: bool) -> bool:
    if len(scale) != 3 or not all(map(math.isfinite, scale)):
        return False
    median, sd, tail = scale
    return sd > 0 and tail >= 0 and (median > 0 or not of_logarithm)


def _normal(z: Tensor, scale: Scale) -> Tensor:
    median, sd, tail = scale
    return median + sd * z + tail * z**3


def _log_normal(z: Tensor, scale: Scale) -> Tensor:
    median, sd, tail = scale
    return torch.exp(_normal(z, (math.log(median), sd, tail)))


def _probability(z: Tensor, logit: tuple[float, float]) -> Tensor:
    return torch.sigmoid(logit[0] + logit[1] * z)


def _even(z: Tensor) -> Tensor:
    """Uniform in -1..1."""
    even: Tensor = 2.0 * torch.special.ndtr(z) - 1.0
    return even
