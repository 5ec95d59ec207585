"""The named strategies: documented, ready, and rebuilt from a log by name, seed and settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Final

from isiw.acquisition.information import Alternating, MutualInformation, WindowGain
from isiw.acquisition.protocol import AcquisitionFunction
from isiw.acquisition.sweeps import EvenSpacing, RandomIsi
from isiw.asktell import Recipe, Strategy
from isiw.design import VALVE_SPACE, DesignSpace
from isiw.errors import InvalidValueError, StrategyError
from isiw.models.particles import ParticleModel
from isiw.models.prior import Prior
from isiw.stopping import AnyOf, Budget, CredibleWidth, NoWindow, StoppingRule

__all__ = ["StrategySettings", "list_strategies", "make_strategy"]


@dataclass(frozen=True)
class StrategySettings:
    """What can be set about a strategy of the catalogue.

    Args:
        max_trials: stop after this many stimuli; mistrials count.
        stop_width_ms: stop when the 90 % credible intervals of both edges are at most this wide [ms].
        stop_no_window: stop when "there is no window" is at least this probable.
        particles: how many particles the posterior has.
        prior: settings of `isiw.models.prior.Prior` that differ from its defaults.
        detection_limit_mv: what a told amplitude of 0 is known to be below [mV].
        response_threshold_mv: what a told response is known to be above [mV].

    Raises:
        InvalidValueError: a number that cannot be, or a setting that the prior does not have.
    """

    max_trials: int = 80
    stop_width_ms: float = 30.0
    stop_no_window: float = 0.9
    particles: int = 1000
    prior: Mapping[str, Any] = field(default_factory=dict)
    detection_limit_mv: float = 0.005
    response_threshold_mv: float = 0.02

    def __post_init__(self) -> None:
        self.model()
        self.stopping()

    def stopping(self) -> StoppingRule:
        """Known well enough, no window, or the budget used up."""
        return AnyOf((CredibleWidth(self.stop_width_ms), NoWindow(self.stop_no_window), Budget(self.max_trials)))

    def model(self) -> ParticleModel:
        """The particle model."""
        return ParticleModel(
            beliefs=Prior.from_settings(self.prior),
            particles=self.particles,
            detection_limit_mv=self.detection_limit_mv,
            response_threshold_mv=self.response_threshold_mv,
        )


@dataclass(frozen=True)
class _Entry:
    summary: str
    acquisition: Callable[[int], AcquisitionFunction]


_CATALOGUE: Final[dict[str, _Entry]] = {
    "default": _Entry(
        "Particle posterior with input-side noise; asks for the window and for everything in turn.",
        lambda _seed: Alternating(),
    ),
    "particles-window": _Entry(
        "Particle posterior; asks where the window's membership will be learnt best.", lambda _seed: WindowGain()
    ),
    "particles-mi": _Entry(
        "Particle posterior; asks for the largest mutual information with all unknowns.",
        lambda _seed: MutualInformation(),
    ),
    "even": _Entry("Particle posterior; evenly spaced ISIs, whatever the responses.", lambda _seed: EvenSpacing()),
    "random": _Entry("Particle posterior; random ISIs, whatever the responses.", RandomIsi),
}


def list_strategies() -> dict[str, str]:
    """The named strategies and what each does in a sentence."""
    return {name: entry.summary for name, entry in _CATALOGUE.items()}


def make_strategy(name: str = "default", space: DesignSpace = VALVE_SPACE, seed: int = 0, **settings: Any) -> Strategy:
    """Make a named strategy.

    Args:
        name: one of `list_strategies()`.
        space: the ISIs that may be asked; by default what can be searched without an accelerometer.
        seed: seed of all randomness, not negative.
        **settings: fields of `StrategySettings`.

    Raises:
        StrategyError: an unknown name or setting.
        InvalidValueError: a seed or a setting that cannot be.
    """
    if name not in _CATALOGUE:
        raise StrategyError("unknown strategy", got=name, expected=", ".join(_CATALOGUE))
    if seed < 0:
        raise InvalidValueError("a seed must not be negative", got=seed)
    known = [f.name for f in fields(StrategySettings)]
    unknown = sorted(set(settings) - set(known))
    if unknown:
        raise StrategyError(f"the strategy {name!r} has no such setting", got=unknown, expected=", ".join(known))
    chosen = StrategySettings(**settings)
    return Strategy(
        space,
        chosen.model(),
        _CATALOGUE[name].acquisition(seed),
        chosen.stopping(),
        seed=seed,
        recipe=Recipe(name=name, seed=seed, settings=asdict(chosen)),
    )
