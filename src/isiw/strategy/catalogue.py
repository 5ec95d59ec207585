"""The named strategies: documented, ready, and rebuilt from a log by name, seed and settings."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from isiw.acquisition.registry import ACQUISITIONS, OWN
from isiw.checks import whole
from isiw.design import VALVE_SPACE, DesignSpace, require_space
from isiw.errors import InvalidValueError, StrategyError, did_you_mean
from isiw.findings import require_percent
from isiw.models.particles.profile import ProfilePrior
from isiw.models.protocol import pairs_pct_rmt_of, profile_of
from isiw.strategy.intensities import NONE, Intensities
from isiw.strategy.recipe import Recipe
from isiw.strategy.settings.common import (
    Choosing,
    DescribedSetting,
    Settings,
    described,
    settings_from,
    settings_keys,
    settings_values,
)
from isiw.strategy.strategy import Strategy


@dataclass(frozen=True)
class Measured:
    """How answers came out after 20 and 40 stimuli on simulated people of `recruitment`, by `benchmarks.compare`.

    Args:
        people: on how many people.
        coverage: share of the true edges in the 90 % intervals.
        wrong: share of the answers that expected an F1 of at least .7, and of .35 more than they had.
    """

    people: int
    coverage: tuple[float, float]
    wrong: tuple[float, float]


@dataclass(frozen=True)
class _Entry:
    """A named strategy, and where its usual settings are: they are loaded only when it is made."""

    summary: str
    family: str
    meant: Mapping[str, Any] = field(default_factory=dict)
    measured: Measured | None = None  # of one whose intervals hold less than they claim, or that may be sure and wrong


_CORE: Final = "isiw.strategy.settings.families"
_PARTICLES, _PARAMETRIC, _GP = f"{_CORE}:PARTICLES", f"{_CORE}:PARAMETRIC", f"{_CORE}:GAUSSIAN_PROCESS"

_CATALOGUE: Final[dict[str, _Entry]] = {
    "default": _Entry(
        "Particle posterior; chooses ISIs in turn most informative about the window and about all unknowns.",
        _PARTICLES,
    ),
    "particles-window": _Entry(
        "Particle posterior; chooses the ISI most informative about which ISIs are in the window.",
        _PARTICLES,
        {"acquisition": "window-gain"},
    ),
    "particles-mi": _Entry(
        "Particle posterior; chooses the ISI most informative about all unknowns.",
        _PARTICLES,
        {"acquisition": "mutual-information"},
    ),
    "even": _Entry(
        "Particle posterior; evenly spaced ISIs, whatever the responses.", _PARTICLES, {"acquisition": "even"}
    ),
    "random": _Entry("Particle posterior; random ISIs, whatever the responses.", _PARTICLES, {"acquisition": "random"}),
    "supra-threshold": _Entry(
        "For TMS above the motor threshold: looks for depressed MEPs as well as for enhanced ones.",
        f"{_CORE}:SUPRA",
    ),
    "parametric-mi": _Entry(
        "Gaussian window in Pyro; chooses the ISI most informative about all unknowns.",
        _PARAMETRIC,
        {"acquisition": "mutual-information"},
    ),
    "parametric-window": _Entry(
        "Gaussian window in Pyro; chooses the ISI most informative about which ISIs are in the window.",
        _PARAMETRIC,
        {"acquisition": "window-gain"},
    ),
    "gp-straddle": _Entry(
        "Gaussian process; asks where it is least clear whether an ISI is in the window.",
        _GP,
        measured=Measured(1000, coverage=(0.9, 0.85), wrong=(0.09, 0.08)),
    ),
    "gp-variance": _Entry(
        "Gaussian process; chooses the ISI most informative about the whole profile.",
        _GP,
        {"acquisition": "integrated-variance"},
        Measured(1000, coverage=(0.9, 0.88), wrong=(0.09, 0.09)),
    ),
    "gp-ei": _Entry(
        "Gaussian process; seeks the best ISI only, by expected improvement.",
        _GP,
        {"acquisition": "log-ei"},
        Measured(1000, coverage=(0.92, 0.89), wrong=(0.1, 0.09)),
    ),
    "nr": _Entry("Dissertation: nonlinear regression of one Gaussian.", "isiw.dissertation.strategies:NR"),
    "nr2": _Entry(
        "Dissertation: nonlinear regression of two Gaussians.",
        "isiw.dissertation.strategies:NR",
        {"peaks": 2, "initial": 7, "segments": "all"},
    ),
    "svmr": _Entry("Dissertation: support vector regression.", "isiw.dissertation.strategies:SVMR"),
    "gpr": _Entry("Dissertation: Gaussian process regression of the amplitudes.", "isiw.dissertation.strategies:GPR"),
    "pf": _Entry(
        "Dissertation: bootstrap particle filter over ISIs, a generation of particles at a time.",
        "isiw.dissertation.strategies:PF",
    ),
    "incremental": _Entry(
        "Conventional search: twelve trials every 5 ms, until the window is passed.",
        "isiw.dissertation.strategies:SWEEP",
    ),
}


def list_strategies() -> dict[str, str]:
    """The named strategies and what each does in a sentence."""
    return {name: entry.summary for name, entry in _CATALOGUE.items()}


def measured_of(name: str) -> Measured | None:
    """How a strategy's answers came out, if they claim more than is so; None for the others, and for unknown names.

    Args:
        name: a strategy's name.
    """
    return _CATALOGUE[name].measured if name in _CATALOGUE else None


def list_settings(name: str = "default") -> tuple[DescribedSetting, ...]:
    """The settings of a named strategy: key, value, unit and meaning.

    Args:
        name: one of `list_strategies()`.

    Raises:
        StrategyError: an unknown name.
    """
    return described(settings_for(name))


def _meant(name: object) -> str:
    """The way to name a function of one's own, if that may be meant."""
    module, dot, function = name.rpartition(".") if isinstance(name, str) else ("", "", "")
    return f'A function of your own is named with a colon, in a study: "{module}:{function}".' if dot else ""


def settings_for(name: str, **settings: Any) -> Settings:
    """Settings of a named strategy, checked."""
    if not isinstance(name, str) or name not in _CATALOGUE:
        raise StrategyError(
            "unknown strategy",
            got=name,
            expected=", ".join(_CATALOGUE),
            remedy=_meant(name) or did_you_mean(name, _CATALOGUE) or "isiw strategies says what each of them does.",
        )
    entry = _CATALOGUE[name]
    usual: Settings = pkgutil.resolve_name(entry.family)
    if isinstance(plan := settings.get("acquisition"), str) and plan == OWN:  # an array is equal to nothing
        _require_own_plan(usual, name)
        settings = {key: value for key, value in settings.items() if key != "acquisition"}
    return settings_from(usual, {**entry.meant, **settings}, name)


def _require_own_plan(usual: Settings, name: str) -> None:
    """Raise if a method has no plan of its own, which "own" asks for; those that have one follow nothing else."""
    if "acquisition" in settings_keys(usual):
        raise StrategyError(
            f"the method of {name!r} has no plan of its own that its ISIs could follow",
            got=f'acquisition="{OWN}"',
            expected=", ".join(sorted(ACQUISITIONS.keys() - {OWN})),
            remedy="An acquisition function of your own is an object: with "
            f'usual = isiw.make_strategy("{name}", space), give it to '
            "isiw.Strategy(space, usual.model, YOURS, usual.stopping, initial_ms=usual.initial_ms).",
        )


def known_settings(name: str, known: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of a strategy that are known of a rig or a person: those that it has."""
    keys = settings_keys(settings_for(name))
    return {key: value for key, value in known.items() if value is not None and key in keys}


def make_strategy(name: str = "default", space: DesignSpace = VALVE_SPACE, seed: int = 0, **settings: Any) -> Strategy:
    """Make a named strategy.

    Args:
        name: one of `list_strategies()`.
        space: the ISIs that may be asked; by default what can be searched without an accelerometer, 0 to 500 ms *after
            the valve command*, as the strategy says when it is printed. Give `IMPACT_SPACE` if you count from the
            impact.
        seed: seed of all randomness, not negative.
        **settings: what differs from what the name stands for, by key; `isiw strategies NAME` lists the keys.

    Raises:
        StrategyError: an unknown name or setting, or an acquisition function that cannot work with the model.
        ConfigError: a nested key or value that cannot be used.
        InvalidValueError: an invalid seed or setting, or no design space.
    """
    strategy = remade_strategy(name, space, seed, **settings)
    if isinstance(profile := profile_of(strategy.model), ProfilePrior):
        profile.require_rig(space)
    require_percent("the strategy's intensity_pct_rmt", strategy.recipe.settings.get("intensity_pct_rmt"))
    if (several := strategy.intensities) and several.usual_pct_rmt not in several.named_pct_rmt:
        raise InvalidValueError(
            "no pair would have the usual intensity, at which the window is",
            got=f"intensities_pct_rmt {', '.join(f'{pct_rmt:g}' for pct_rmt in several.named_pct_rmt)}",
            expected=f"{several.usual_pct_rmt:g} among them",
            remedy="Name it, too, or state another usual one, intensity_pct_rmt.",
        )
    return strategy


def remade_strategy(name: str, space: DesignSpace, seed: int, **settings: Any) -> Strategy:
    """As `make_strategy`, for a log: also with what a new session does not accept any more."""
    seed = whole("the seed", seed, least=0)
    chosen = settings_for(name, **settings)
    require_space(space)
    initial_ms = chosen.asking.initial_ms(space)
    return Strategy(
        space,
        chosen.model,
        chosen.asking.function(seed),
        chosen.stopping.rule(len(initial_ms)),
        initial_ms=initial_ms,
        seed=seed,
        recipe=Recipe(name=name, seed=seed, settings=settings_values(chosen)),
        intensities=intensities_of(chosen),
    )


def intensities_of(settings: Settings) -> Intensities:
    """The intensities of a strategy's pairs; none where all have the usual one."""
    asking = settings.asking
    if not isinstance(asking, Choosing):
        return NONE
    return intensities_for(settings.model, asking.intensities_pct_rmt, chosen=asking.chooses_intensity)


def intensities_for(model: object, named_pct_rmt: Sequence[float], *, chosen: bool) -> Intensities:
    """The named intensities, for a model that has a law of them.

    Raises:
        InvalidValueError: an intensity in another unit, or one that is named twice.
        StrategyError: a model without a law of intensities.
    """
    if not named_pct_rmt:
        return NONE
    for pct_rmt in named_pct_rmt:
        require_percent("intensities_pct_rmt", pct_rmt)
    if len(set(named_pct_rmt)) < len(named_pct_rmt):
        raise InvalidValueError("an intensity of the pairs is named twice", got=tuple(named_pct_rmt))
    usual_pct_rmt = pairs_pct_rmt_of(model)
    if usual_pct_rmt is None:
        raise StrategyError(
            "the strategy cannot learn from pairs of several intensities",
            got=f"{type(model).__name__}, which has no law of other intensities",
            remedy="Leave out intensities_pct_rmt, or choose the default.",
        )
    return Intensities(tuple(map(float, named_pct_rmt)), chosen, usual_pct_rmt)
