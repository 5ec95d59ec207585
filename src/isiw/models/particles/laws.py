"""The prior of a person's responses, and where each law in it comes from.

The first of several laws is what is usual, the others say what else may be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Final, TypeVar

from isiw.checks import Checked, Positive, Share
from isiw.models.shared.scales import AnyLaw, PositiveLaw, Scale, require_sum_of_one

L = TypeVar("L", bound=Any)
"""A law with a share."""


class Shares(Checked):
    """Fields of a dataclass that are probabilities, and sum to 1."""

    def __post_init__(self) -> None:
        super().__post_init__()
        values = [getattr(self, f.name) for f in fields(self)]  # type: ignore[arg-type] # a dataclass
        require_sum_of_one(f"the probabilities of {type(self).__name__}", values)


def check_laws(owner: object, *names: str) -> None:
    """Check fields of a dataclass that are several laws, each with a share."""
    for name in names:
        require_sum_of_one(f"the shares of {type(owner).__name__}.{name}", [law.share for law in getattr(owner, name)])


def with_less_of_others(laws: tuple[L, ...], kept: float) -> tuple[L, ...]:
    """The same laws, of which all but the first keep a part of their probability."""
    first, *others = laws
    less = [replace(law, share=kept * law.share) for law in others]
    return replace(first, share=1.0 - math.fsum(law.share for law in less)), *less


@dataclass(frozen=True)
class NoiseShares(Shares):
    """Probabilities of the kinds of noise, in the order of `NoiseKind`.

    Args:
        constant_cv: probability of noise of a constant CV.
        missing: probability of noise of a constant CV with missing responses.
        recruitment: probability of a recruitment curve with noise on its input.
        all_or_none: probability of responses that are all or none, as those of a very steep curve.
        rectified: probability of a recruitment curve that starts at a threshold.
    """

    constant_cv: Share = 0.36
    missing: Share = 0.11
    recruitment: Share = 0.43
    all_or_none: Share = 0.08
    rectified: Share = 0.02


@dataclass(frozen=True)
class Intensity(Checked):
    """A law of the intensity of the pulse.

    Args:
        share: probability of this law.
        pct_rmt: the intensity [% RMT].
    """

    share: Share
    pct_rmt: AnyLaw


@dataclass(frozen=True)
class Muscle(Checked):
    """A law of recruitment curves: `s = A / (1 + exp(-k (x + sigma_x z1 - x50))) exp(sigma_y z2)` (Goetz et al.).

    Args:
        name: name of the muscle.
        share: probability of this muscle.
        ratio: the largest MEP over the floor, A.
        slope_per_pct: k [1 / % RMT].
        input_sd: SD of the noise on the input, k sigma_x: about the same in steep curves and flat ones.
        sigma_y: SD of the noise on the output, natural log.
        boost_pct: shift of the input at the best ISI [% RMT].
        rest_pct: the input without a tap, intensity − x50 [% RMT].
        at_pct_rmt: the intensity that `rest_pct` is at [% RMT]; None where it is that of the session, whatever it is.
    """

    name: str
    share: Share
    ratio: PositiveLaw
    slope_per_pct: PositiveLaw
    input_sd: PositiveLaw
    sigma_y: PositiveLaw
    boost_pct: PositiveLaw
    rest_pct: AnyLaw
    at_pct_rmt: Positive | None = None


FOREARM: Final = Muscle(
    name="forearm",
    share=0.54,
    ratio=Scale(16.0, 0.45),  # 0.1–0.25 mV over the floor
    slope_per_pct=Scale(0.30, 0.06),
    input_sd=Scale(2.1, 0.20),  # 5–9 % RMT
    sigma_y=Scale(0.39, 0.19),  # 0.3–0.5
    boost_pct=Scale(11.3, 0.36),  # 5–18 % RMT
    rest_pct=Scale(-15.0, 1.5),  # half of the largest MEP at RMT + 4 %
    at_pct_rmt=90.0,
)

HAND: Final = Muscle(
    name="hand",
    share=0.16,
    ratio=Scale(90.0, 0.85),  # 0.2–3 mV over the floor
    slope_per_pct=Scale(0.23, 0.1),
    input_sd=Scale(1.65, 0.25),
    sigma_y=Scale(0.39, 0.19),
    boost_pct=Scale(15.0, 0.5),  # nobody has measured it
    rest_pct=Scale(-27.0, 3.5),  # half of the largest MEP at RMT + 17 %
    at_pct_rmt=90.0,
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
    at_pct_rmt=90.0,
)


@dataclass(frozen=True)
class RectifiedPrior(Checked):
    """Of recruitment curves that start at a threshold [Tyagi2024]: what the logistic curve is above its value there.

    Such a curve is flat at rest, rises within a few % RMT, and then grows in proportion to the input; a logistic curve
    through its middle makes windows too wide. The forearm whose whole curve was recorded is one (decision 19).

    Args:
        ratio: the largest MEP over the floor, A.
        slope_per_pct: k of the logistic curve [1 / % RMT].
        input_sd: SD of the noise on the input, k sigma_x.
        sigma_y: SD of the noise on the output, natural log.
        boost_pct: shift of the input at the best ISI [% RMT].
        rest_pct: the input without a tap, intensity − threshold [% RMT].
        at_pct_rmt: the intensity that `rest_pct` is at [% RMT]; None where it is that of the session, whatever it is.
        onset: the logistic curve at the threshold, as a share of its largest value.
    """

    ratio: PositiveLaw = Scale(200.0, 1.2)
    slope_per_pct: PositiveLaw = Scale(0.10, 0.35)
    input_sd: PositiveLaw = Scale(0.7, 0.4)
    sigma_y: PositiveLaw = Scale(0.2, 0.6)
    boost_pct: PositiveLaw = Scale(18.0, 0.5)
    rest_pct: AnyLaw = Scale(-6.0, 5.0)
    onset: PositiveLaw = Scale(0.1, 0.5)
    at_pct_rmt: Positive | None = 90.0


@dataclass(frozen=True)
class Gain(Checked):
    """A law of responses in proportion to the facilitation, with noise of a constant CV.

    Args:
        share: probability of this law.
        ratio: the best expected MEP over the floor; MEPs peak at 0.03–0.3 mV (dissertation, 4.2).
        cv: CV of the responses.
    """

    share: Share
    ratio: PositiveLaw
    cv: PositiveLaw


@dataclass(frozen=True)
class SwitchPrior(Checked):
    """Of how often responses come that may be missing or are all or none, in logits, and of the size of the latter.

    Args:
        reliability: probability of a response at the best ISI if responses may be missing, in logits; often about one
            half (dissertation, Fig. 6.5).
        switched_on: probability of a response at the best ISI if responses are all or none, in logits.
        switched_off: probability of such a response without a tap, in logits; 0.05–0.25 of the trials at 90 % RMT are
            above 50 µV in the hand, next to none in the forearm.
        sizes: sizes of responses that are all or none, a forearm's or a hand's; their ratio is that of the mean
            response.
    """

    reliability: AnyLaw = Scale(0.2, 0.7)
    switched_on: AnyLaw = Scale(1.2, 0.9)
    switched_off: AnyLaw = Scale(-3.3, 1.0)
    sizes: tuple[Gain, ...] = (
        Gain(0.6, Scale(8.0, 0.8), Scale(0.62, 0.3)),
        Gain(0.4, Scale(60.0, 0.9), Scale(0.62, 0.45)),
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_laws(self, "sizes")


@dataclass(frozen=True)
class Floor(Checked):
    """A law of the EMG floor.

    Args:
        share: probability of this law.
        median_mv: median of the EMG floor [mV]; 6–20 µV measured.
        log_sd: SD of the EMG floor from trial to trial, natural log; 0.12–0.35.
    """

    share: Share
    median_mv: PositiveLaw
    log_sd: PositiveLaw


@dataclass(frozen=True)
class SessionPrior(Checked):
    """Of what changes within a session.

    Args:
        drift_sd: SD of what the log of evoked MEPs drifts by in the long run; about 0.26 over a session measured.
        far_drift_sd: the same SD of those that drift far.
        far_drift_share: probability that evoked MEPs drift far.
        startup: how strongly the first trials startle, 1 being as much as in blocks of plain TMS.
    """

    drift_sd: Positive = 0.3
    far_drift_sd: Positive = 1.2
    far_drift_share: Share = 0.1
    startup: AnyLaw = Scale(0.5, 0.5)
