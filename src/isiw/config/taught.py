"""What earlier sessions teach a session that a configuration describes: the strategy's prior."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from isiw.config.run import RunConfig
from isiw.devices.protocol import DeviceInfo
from isiw.errors import ConfigError, StrategyError
from isiw.log.reader import SessionRecord, read_session
from isiw.models.particles.prior import Prior
from isiw.priors import after, read_lab_prior
from isiw.strategy.catalogue import settings_for
from isiw.visit import Visit


def settings_with_taught(config: RunConfig, device: DeviceInfo) -> dict[str, Any]:
    """The strategy's settings, with what earlier sessions taught as its prior."""
    settings = dict(config.strategy.settings)
    if config.prior is None and not config.after:
        return settings
    if "prior" in settings:
        raise ConfigError(
            "strategy.settings.prior and a prior from earlier sessions exclude each other",
            remedy="Give only one of them.",
        )
    if not learns_from_earlier(config.strategy.name):
        raise StrategyError(
            f"the strategy {config.strategy.name} learns nothing from earlier sessions",
            remedy="Leave out the prior and the earlier sessions, or choose another strategy, such as default.",
        )
    return settings | {"prior": _taught(config, device)}


def learns_from_earlier(name: str) -> bool:
    """Whether a strategy has a prior for what earlier sessions teach."""
    try:
        settings_for(name, prior=Prior())
    except StrategyError:  # no prior, or that of another model
        return False
    return True


def _taught(config: RunConfig, device: DeviceInfo) -> Prior:
    """What the lab's people and the person's earlier sessions taught."""
    lab = None if config.prior is None else read_lab_prior(config.prior)
    earlier = [read_session(path) for path in config.after]
    nobodys = [str(record.path) for record in earlier if record.header.device.simulated]
    if lab is not None and lab.simulated:
        nobodys.append(str(config.prior))
    if nobodys and not device.simulated:
        raise ConfigError(
            "what simulated sessions taught says nothing about the person who will be stimulated",
            got=nobodys,
            remedy="Leave it out, or learn from sessions with people.",
        )
    require_same_person(config, earlier)
    for record in earlier:
        _require_like(config, record.header.visit, record.path)
    if lab is not None:
        _require_like(config, Visit(muscle=lab.noted_muscle), config.prior)
    return after(*earlier, prior=None if lab is None else lab.joined())


def require_same_person(config: RunConfig, records: Sequence[SessionRecord]) -> None:
    """Check that sessions are of the person whom a configuration names, where both say whom they are of.

    Args:
        config: the configuration.
        records: the sessions.

    Raises:
        ConfigError: a session of another subject than `visit.subject`.
    """
    subject = config.visit.subject
    others = [record for record in records if record.header.subject not in {"", subject}]
    if subject and others:
        raise ConfigError(
            "the log is another person's",
            got=f"{others[0].header.subject} in {others[0].path}",
            expected=f"{subject}, as visit.subject says",
            remedy="Give this person's own log, or correct visit.subject.",
        )


def _require_like(config: RunConfig, visit: Visit, path: Path | None) -> None:
    """Raise where what taught something is of another muscle, or another intensity, than the configuration says."""
    if unlike := config.visit.noted().unlike(visit):
        raise ConfigError(
            f"[visit] and the sessions that were learnt from are of {unlike}",
            got=str(path),
            remedy="What one taught says little about the other. Leave this file out, or correct [visit].",
        )
