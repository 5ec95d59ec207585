"""The prior of the facilitation by ISI, and where each law in it comes from.

The first of several laws is what is usual, the others say what else may be.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Final, NamedTuple

from isiw.checks import Checked, Share
from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.models.particles.laws import Shares, check_laws, with_less_of_others
from isiw.models.particles.mixture import Mixture
from isiw.models.particles.places import Place
from isiw.models.shared.scales import AnyLaw, PositiveLaw, Scale
from isiw.models.shared.start import TAP_SPANS, Span, StartPrior
from isiw.text.stimuli import STIMULI
from isiw.types import Conditioning


@dataclass(frozen=True)
class ShapeShares(Shares):
    """Probabilities of the families of profiles, in the order of their kinds in the engine.

    Most profiles pass a normality test (dissertation, 4.2: 8 of 11), the others are described in its outlook (8.1).

    Args:
        gaussian: probability of a Gaussian profile.
        skewed: probability of a skewed profile.
        plateau: probability of a flat-topped profile.
        two_peak: probability of a profile with two peaks.
    """

    gaussian: Share = 0.68
    skewed: Share = 0.12
    plateau: Share = 0.08
    two_peak: Share = 0.12


@dataclass(frozen=True)
class Width(Checked):
    """A law of the window's width.

    Args:
        share: probability of this law.
        width_ms: the width.
    """

    share: Share
    width_ms: PositiveLaw


@dataclass(frozen=True)
class Early(Checked):
    """A law of wide windows that start before the hit: of start and width together.

    Args:
        share: probability of this law.
        start_ms: the start from the impact [ms].
        width_ms: the width.
    """

    share: Share
    start_ms: AnyLaw
    width_ms: PositiveLaw


class _Windows(NamedTuple):
    """Where windows start, and how wide they are."""

    spans: tuple[Span, ...]
    widths: tuple[Width, ...]
    early: tuple[Early, ...]


_AFTER: Final[Mapping[Conditioning | None, _Windows]] = MappingProxyType(
    {
        # A tap most probably; but windows of 15–40 ms, as after an electrical pulse, too.
        None: _Windows(
            TAP_SPANS,
            (Width(0.655, Scale(100.0, 0.42)), Width(0.23, Scale(190.0, 0.45)), Width(0.115, Scale(28.0, 0.35))),
            (Early(0.13, Scale(-20.0, 12.0), Scale(190.0, 0.45)),),
        ),
        # 60–220 ms, mean 108 measured (dissertation, Table 4.1).
        "tap": _Windows(
            TAP_SPANS,
            (Width(0.8, Scale(100.0, 0.42)), Width(0.2, Scale(170.0, 0.5))),
            (Early(0.12, Scale(-20.0, 12.0), Scale(170.0, 0.5)),),
        ),
        # 15–20 ms measured, with TMS below the threshold (dissertation, 3.3.4); most studies use an ISI of 25 ms.
        "electrical": _Windows(
            (Span(0.7, 0.0, 60.0, 3.0), Span(0.3, -30.0, 260.0, 20.0)),
            (Width(0.75, Scale(20.0, 0.4)), Width(0.25, Scale(60.0, 0.7))),
            (Early(0.01, Scale(-15.0, 10.0), Scale(60.0, 0.7)),),
        ),
    }
)
"""The law of windows after each kind of conditioning stimulus, and if it is not stated."""


LEAST_KEPT: Final = 1e-6
"""A law whose probability were 0 would be none."""


class JointPlaces(NamedTuple):
    """Windows whose start and width depend on each other."""

    share: float  # their probability
    mixture: Mixture  # of start and log width


@dataclass(frozen=True)
class ProfilePrior(Checked):
    """Of the facilitation by ISI.

    Where `start`, `widths` and `early` are not a user's own, they are those of the conditioning stimulus.

    Args:
        p_window: probability that there is any facilitation.
        shapes: probabilities of the families of profiles.
        start: where windows start.
        widths: how wide windows are.
        early: windows that start before the hit, which are wide; the rest of the probability is that of `start` and
            `widths`, which do not depend on each other.
        places: where windows are, and how wide, as far as earlier sessions say; the rest of the probability is that
            of all other windows.
        conditioning: what the first stimulus of a pair is: a tap on the tendon, or an electrical pulse to the nerve;
            None where it is not stated, and a tap is most probable.
    """

    p_window: Share = 0.72
    shapes: ShapeShares = field(default_factory=ShapeShares, metadata={"shares": True})
    start: StartPrior = field(default_factory=StartPrior)
    widths: tuple[Width, ...] = _AFTER[None].widths
    early: tuple[Early, ...] = _AFTER[None].early
    places: tuple[Place, ...] = ()
    conditioning: Conditioning | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        own = _AFTER[self.conditioning]
        if self.start.spans in [each.spans for each in _AFTER.values()]:
            object.__setattr__(self, "start", replace(self.start, spans=own.spans))
        for name in ("widths", "early"):
            if getattr(self, name) in [getattr(each, name) for each in _AFTER.values()]:
                object.__setattr__(self, name, getattr(own, name))
        check_laws(self, "widths")
        if math.fsum(law.share for law in self.early) >= 1.0:
            raise InvalidValueError("the shares of ProfilePrior.early must sum to less than 1", got=self.early)
        if self.p_place >= 1.0:
            raise InvalidValueError("the shares of ProfilePrior.places must sum to less than 1", got=self.p_place)
        if len(references := {place.reference for place in self.places}) > 1:
            raise InvalidValueError("ProfilePrior.places must count from one event", got=sorted(references))

    @property
    def stimulus(self) -> Conditioning:
        """The conditioning stimulus, as it is stated, or a tap."""
        return self.conditioning or "tap"

    def after(self, stimulus: Conditioning) -> ProfilePrior:
        """The same of a conditioning stimulus; unchanged where that is what is most probable already."""
        return self if stimulus == self.stimulus else replace(self, conditioning=stimulus)

    @property
    def p_place(self) -> float:
        """Probability that a window is where earlier sessions say."""
        return math.fsum(place.share for place in self.places)

    def as_usual(self, kept: float) -> ProfilePrior:
        """The same with less probability of unusual starts and widths."""
        early = tuple(replace(law, share=max(kept, LEAST_KEPT) * law.share) for law in self.early)
        start, widths = self.start.as_usual(kept), with_less_of_others(self.widths, kept)
        return replace(self, start=start, widths=widths, early=early)

    def joint(self, space: DesignSpace) -> JointPlaces | None:
        """The windows whose start and width depend on each other: `early`, then `places`; None where there are none."""
        return _joint(self, space)

    def require_rig(self, space: DesignSpace) -> None:
        """Check that the rig of a new session fits its space; what an earlier log says goes on as it was."""
        if self.conditioning == "electrical" and space.reference == "valve":
            raise InvalidValueError(
                "ISIs after an electrical pulse count from the pulse, and there is no valve command",
                got=f'reference "{space.reference}"',
                expected='reference "impact", which is the pulse here',
                remedy='Set reference="impact" in isiw.DesignSpace, or reference = "impact" under [space].',
            )
        delay_ms = self.start.hit_delay_ms
        if delay_ms is not None and space.reference == "valve" and delay_ms[0] > space.high_ms:
            raise InvalidValueError(
                "the tap would hit after the last ISI, so no window could be found",
                got=f"a hit delay of {delay_ms[0]:g} ms",
                expected=f"less than {space.high_ms:g} ms, which is the largest ISI after the valve command",
                remedy="Is it in ms? isiw timing LOG measures it. If it is right, make the space longer.",
            )

    def require_space(self, space: DesignSpace) -> None:
        """Check that the places mean something in a space."""
        if any(place.conditioning != self.stimulus for place in self.places):
            raise InvalidValueError(
                "the prior was learnt with another conditioning stimulus, so its windows say nothing here",
                got=self.stimulus,
                expected=self.places[0].conditioning,
                remedy="Learn a prior from sessions with this stimulus.",
            )
        if self.places and (learnt := self.places[0].reference) != space.reference:
            origin = STIMULI[self.stimulus].origin
            raise InvalidValueError(
                "the earlier sessions of the prior and the design space count ISIs from different events",
                got=f"{space.reference} in the space",
                expected=f"{learnt}, as in those sessions",
                remedy=f'If the rig counts from the {origin(learnt)}, set reference = "{learnt}" in the space. If '
                f"not, learn from sessions that count from the {origin(space.reference)}, or leave the prior out.",
            )
        delay_ms = self.start.hit_delay_ms
        if others := [place.hit_delay_ms for place in self.places if not place.is_of_rig(delay_ms)]:
            raise InvalidValueError(
                "the prior was learnt on a rig with another hit delay, so its windows would be in the wrong place",
                got=f"a hit delay of {delay_ms} ms",
                expected=f"about {others[0]} ms",
                remedy="Learn a prior from sessions with this rig; or correct hit_delay_ms, if it is not this rig's.",
            )


@lru_cache(maxsize=64)
def _joint(profile: ProfilePrior, space: DesignSpace) -> JointPlaces | None:
    delays, left = profile.start.hit_delays(space), 1.0 - profile.p_place
    laws = [
        (
            left * share * law.share,
            [(law.start_ms.median + mean_ms, math.hypot(law.start_ms.sd, sd_ms)), law.width_ms.log_law],
        )
        for law in profile.early
        for share, mean_ms, sd_ms in delays
    ]
    laws += [(place.share, [place.start_ms.law, place.width_ms.log_law]) for place in profile.places]
    if not laws:
        return None
    return JointPlaces(math.fsum(share for share, _ in laws), Mixture.of(laws))
