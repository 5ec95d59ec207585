"""The file of a lab's prior: TOML with numbers and names, of which nothing is ever executed."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import tomli_w

from isiw.errors import ConfigError, InvalidValueError
from isiw.files import check_output, write_output
from isiw.models.particles.laws import NoiseShares
from isiw.models.particles.prior import Prior
from isiw.priors.lab import SCHEMA_VERSION, LabPrior
from isiw.strategy.settings.common import as_toml
from isiw.text.toml_files import checked, read_toml
from isiw.visit import Visit


def write_lab_prior(lab: LabPrior, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a lab's prior as TOML, into a folder that is made if it is missing.

    Args:
        lab: the lab's prior.
        path: where to.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        InvalidValueError: there is a file that is not to be replaced, or is something else than a lab's prior.
    """
    check_lab_output(path, overwrite=overwrite)
    return write_output(path, tomli_w.dumps(as_toml(lab)).encode(), overwrite=overwrite)


def check_lab_output(path: str | Path, *, overwrite: bool = False) -> None:
    """Check that `write_lab_prior` may write a file; for whoever has long work to do before."""
    check_output(path, overwrite=overwrite)
    kept: dict[str, Any] = {}
    with suppress(ConfigError):
        kept = read_toml(path)
    if Path(path).exists() and "schema_version" not in kept:
        raise InvalidValueError(
            "the file that is there is not a lab's prior, so it is not replaced",
            got=str(path),
            remedy="Choose another path.",
        )


def read_lab_prior(path: str | Path) -> LabPrior:
    """Read a lab's prior.

    Args:
        path: the file.

    Raises:
        ConfigError: it cannot be read, is not such a file, or was written by a newer version.
    """
    values = read_toml(path)
    version = values.get("schema_version")
    if isinstance(version, int) and version > SCHEMA_VERSION:
        raise ConfigError(
            "the prior was learnt with a newer isiw",
            got=f"schema version {version} in {path}",
            expected=f"{SCHEMA_VERSION} or older",
            remedy="Upgrade isiw, or learn it again from the logs.",
        )
    return checked(LabPrior, _upgraded(values), str(path))


def load(path: str | Path, visit: Visit | None = None) -> Prior:
    """A prior with a lab's laws in it, for `isiw.make_strategy(prior=...)`.

    Args:
        path: the file.
        visit: as for `LabPrior.joined`.

    Raises:
        ConfigError: as from `read_lab_prior`.
    """
    return read_lab_prior(path).joined(visit=visit)


def _upgraded(values: dict[str, Any]) -> dict[str, Any]:
    """A file of schema version 1, which knew no curves that start at a threshold: they get their usual share."""
    noise = values.get("noise")
    if values.get("schema_version") != 1 or not isinstance(noise, dict):
        return values
    share = NoiseShares().rectified
    learnt = {name: (1.0 - share) * value for name, value in noise.items() if isinstance(value, int | float)}
    return values | {"schema_version": SCHEMA_VERSION, "noise": noise | learnt | {"rectified": share}}
