"""The prior over people under TMS above the motor threshold.

Both segments shift the input of one recruitment curve: the enhanced one up, the depressed one down. A tap can be seen
to depress an MEP only where that is well above the EMG floor without a tap, so that all noise is that of the curve.
One segment ends before the other starts, also where only one is there or none, so that each is as probable as stated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from isiw.checks import Checked, Share
from isiw.models.particles.laws import Floor, SessionPrior, check_laws
from isiw.models.particles.mixture import Mixture
from isiw.models.particles.profile import Width
from isiw.models.shared.scales import AnyLaw, PositiveLaw, Scale
from isiw.models.shared.start import Span, StartPrior
from isiw.types import FloatArray

LATENTS: Final = (
    "start_ms",
    "depressed_start_ms",
    "log_width_ms",
    "log_shift",
    "depressed_log_width_ms",
    "depressed_log_shift",
    "log_floor_mv",
    "log_floor_sd",
    "drift",
    "startup",
    "log_ceiling",
    "log_slope",
    "log_input_sd",
    "log_sigma_y",
    "rest",
)
"""Names of the latents, in order."""

BLOCKS: Final = {
    "enhanced": ("start_ms", "log_width_ms", "log_shift"),
    "depressed": ("depressed_start_ms", "depressed_log_width_ms", "depressed_log_shift"),
    "session": ("log_floor_mv", "log_floor_sd", "drift", "startup"),
    "curve": ("log_ceiling", "log_slope", "log_input_sd", "log_sigma_y", "rest"),
}
"""The latents by what they are about."""


@dataclass(frozen=True)
class Segment(Checked):
    """Of the ISIs at which the tap enhances, or depresses, the MEP.

    Args:
        probability: probability that there are such ISIs.
        widths: how wide their segment is.
        shift_pct: by how much the input of the recruitment curve is shifted in its middle [% RMT].
    """

    probability: Share
    widths: tuple[Width, ...]
    shift_pct: PositiveLaw

    def __post_init__(self) -> None:
        super().__post_init__()
        check_laws(self, "widths")


@dataclass(frozen=True)
class Curve(Checked):
    """A law of recruitment curves above the motor threshold.

    Args:
        share: probability of this curve.
        ratio: the largest MEP over the floor.
        slope_per_pct: slope [1 / % RMT].
        input_sd: SD of the noise on the input, in logits.
        sigma_y: SD of the noise on the output, natural log.
        rest_pct: the input without a tap, intensity − intensity of the half-maximal MEP [% RMT].
    """

    share: Share
    ratio: PositiveLaw
    slope_per_pct: PositiveLaw
    input_sd: PositiveLaw
    sigma_y: PositiveLaw
    rest_pct: AnyLaw


_START: Final = StartPrior(spans=(Span(0.85, 0.0, 95.0, 5.0), Span(0.15, -30.0, 260.0, 20.0)), p_anywhere=0.02)
_WIDTHS: Final = (Width(0.85, Scale(30.0, 0.35)), Width(0.15, Scale(80.0, 0.5)))


@dataclass(frozen=True)
class SupraPrior:
    """The prior over people under TMS above the motor threshold.

    Args:
        start: where either segment starts.
        enhanced: prior of the ISIs at which the tap enhances the MEP.
        depressed: prior of the ISIs at which the tap depresses the MEP.
        curves: laws of recruitment curves, the usual one first.
        floors: laws of the EMG floor.
        session: prior of what changes within a session.
    """

    start: StartPrior = _START
    enhanced: Segment = field(default_factory=lambda: Segment(0.9, _WIDTHS, Scale(11.3, 0.36)))
    depressed: Segment = field(default_factory=lambda: Segment(0.9, _WIDTHS, Scale(8.3, 0.35)))
    curves: tuple[Curve, ...] = (
        Curve(0.85, Scale(100.0, 0.5), Scale(0.23, 0.1), Scale(1.6, 0.2), Scale(0.39, 0.19), Scale(3.0, 3.5)),
        Curve(0.15, Scale(30.0, 1.2), Scale(0.27, 0.3), Scale(1.9, 0.35), Scale(0.39, 0.3), Scale(-8.0, 10.0)),
    )
    floors: tuple[Floor, ...] = (
        Floor(0.85, Scale(0.009, 0.38), Scale(0.22, 0.4)),
        Floor(0.15, Scale(0.009, 1.2), Scale(0.22, 0.5)),
    )
    session: SessionPrior = field(default_factory=SessionPrior)

    def __post_init__(self) -> None:
        check_laws(self, "curves", "floors")

    @cached_property
    def mixtures(self) -> tuple[Mixture, ...]:
        """The prior of each latent but the starts, in the order of `LATENTS`."""
        startup = self.session.startup
        session = [(0.0, self.session.drift_sd), (startup.median, startup.sd)]
        return (
            *(mixture for segment in (self.enhanced, self.depressed) for mixture in _of_segment(segment)),
            Mixture.of([(f.share, [f.median_mv.log_law, f.log_sd.log_law]) for f in self.floors]),
            Mixture.of([(1.0, session)]),
            Mixture.of([(c.share, _of_curve(c)) for c in self.curves]),
        )

    @cached_property
    def spreads(self) -> FloatArray:
        """Usual SD of each latent, shape (d,)."""
        first = self.start.spans[0]
        starts = np.full(2, (first.high_ms - first.low_ms) / math.sqrt(12.0))
        return np.concatenate([starts, *(mixture.sds[0] for mixture in self.mixtures)])


def _of_segment(segment: Segment) -> tuple[Mixture, Mixture]:
    widths = Mixture.of([(width.share, [width.width_ms.log_law]) for width in segment.widths])
    return widths, Mixture.of([(1.0, [segment.shift_pct.log_law])])


def _of_curve(curve: Curve) -> list[tuple[float, float]]:
    scales = (curve.ratio, curve.slope_per_pct, curve.input_sd, curve.sigma_y)
    return [*(scale.log_law for scale in scales), curve.rest_pct.law]
