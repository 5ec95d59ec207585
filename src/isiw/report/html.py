"""Pages of HTML from the templates in `assets`: what comes from a log is text in them, whatever it holds."""

from __future__ import annotations

import base64
import hashlib
import importlib
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, Final

from isiw.errors import ConfigError, InvalidValueError
from isiw.log.outputs import check_output, write_output
from isiw.text import plain

_ASSETS: Final = resources.files("isiw.report") / "assets"
_SUFFIXES: Final = {".html", ".htm"}


def write_page(path: str | Path, page: Callable[[], str], *, overwrite: bool = False) -> Path:
    """Write a page into a file, which is checked before the page is made."""
    if Path(path).suffix.lower() not in _SUFFIXES:
        raise InvalidValueError("a page is for a browser", got=str(path), expected="a path that ends in .html")
    check_output(path, overwrite=overwrite)
    return write_output(path, page().encode(), overwrite=overwrite)


def rendered(template: str, scripts: Sequence[str] = (), **contents: Any) -> str:
    """A page; its policy lets no script run but these, and nothing be fetched."""
    jinja2 = library("jinja2")
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(asset),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=lambda value: plain(value) if type(value) is str else value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page: str = environment.get_template(template).render(
        contents,
        style=asset("page.css"),
        scripts=scripts,
        hashes=" ".join(map(_hash, scripts)) or "'none'",
    )
    return page


def asset(name: str) -> str:
    """A file of `assets`."""
    return (_ASSETS / name).read_text(encoding="utf-8")


def library(name: str) -> Any:
    """A library of the extra `report`."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        missing = name.partition(".")[0]
        raise ConfigError(
            f"{missing} is not installed", remedy='Install it with: pip install "isiw[report]"'
        ) from error


def _hash(script: str) -> str:
    """What the page's policy knows a script by, so that no other is run."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
