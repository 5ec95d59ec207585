"""A page of HTML: made of a template, with a policy that lets it fetch nothing, and written into a file."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, Final

from isiw.errors import InvalidValueError
from isiw.files import check_output, write_output
from isiw.text.named_code import library
from isiw.text.sanitize import plain

_SUFFIXES: Final = {".html", ".htm"}


def write_page(path: str | Path, page: Callable[[], str], *, overwrite: bool = False) -> Path:
    """Write a page into a file, which is checked before the page is made."""
    if Path(path).suffix.lower() not in _SUFFIXES:
        raise InvalidValueError("a page is for a browser", got=str(path), expected="a path that ends in .html")
    check_output(path, overwrite=overwrite)
    return write_output(path, page().encode(), overwrite=overwrite)


def rendered(template: str, scripts: Sequence[str] = (), **contents: Any) -> str:
    """A page; its policy lets no script run but these, and nothing be fetched."""
    jinja2 = library("jinja2", "report")
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(asset),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=lambda value: plain(value) if type(value) is str else value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    digests = (base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts)
    hashes = [f"'sha256-{digest}'" for digest in digests]  # what the page's policy knows a script by
    page: str = environment.get_template(template).render(
        contents, style=asset("page.css"), scripts=scripts, hashes=" ".join(hashes) or "'none'"
    )
    return page


def asset(name: str, room: str = "isiw.report") -> str:
    """A file of a room's `assets`."""
    return (resources.files(room) / "assets" / name).read_text(encoding="utf-8")
