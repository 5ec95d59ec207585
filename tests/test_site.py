"""The reference has every public name, command and configuration key; the pages have the parts that the site needs."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from functools import cache
from typing import Any

import pytest
from docs.generate import api, commands, configuration, docstrings, pages, topics
from docs.generate.meanings import MEANINGS
from docs.generate.places import DOCS
from pydantic import BaseModel
from typer.main import get_command

import isiw
from isiw.cli import app
from isiw.config.run import RunConfig

OWN = {"isiw.cli", "isiw.text"}
"""Packages whose exports are for isiw itself."""


def public() -> set[str]:
    """Full names of what packages export, and of what the plain modules that `isiw` exports define."""
    rooms = [isiw, *(importlib.import_module(room.name) for room in pkgutil.walk_packages(isiw.__path__, "isiw."))]
    modules = [thing for name in dir(isiw) if inspect.ismodule(thing := getattr(isiw, name))]
    plain = [module for module in modules if not hasattr(module, "__path__")]
    return {f"{module.__name__}.{name}" for module in plain for name in api.exported(module)} | {
        f"{room.__name__}.{name}"
        for room in rooms
        if hasattr(room, "__path__") and room.__name__ not in OWN
        for name in getattr(room, "__all__", ())
        if not inspect.ismodule(getattr(room, name))
    }


def command_names(group: Any, before: str = "isiw") -> set[str]:
    parts = getattr(group, "commands", None)
    if parts is None:
        return {before}
    return set().union(*(command_names(inner, f"{before} {name}") for name, inner in parts.items()))


@cache
def reference() -> dict[str, str]:
    return dict(api.pages())


@pytest.mark.slow
def test_every_public_name_is_in_the_reference() -> None:
    described = set(re.findall(r"^(?:\.\. [\w:]+:: |``)(isiw[\w.]+)", "\n".join(reference().values()), re.MULTILINE))
    assert public() - described == set()


def test_every_public_name_has_an_example_or_a_link_to_one() -> None:
    assert [name for name in sorted(public()) if not api.example_of(name)] == []


def test_every_command_and_its_options_are_in_the_reference() -> None:
    ((_, page),) = commands.pages()
    root = get_command(app)
    names = command_names(root)
    assert {"isiw run", "isiw new rig"} <= names
    assert [name for name in sorted(names) if f"\n## `{name}`\n" not in page] == []
    options = {option for _, command in commands.every(root) for one in command.params for option in one.opts}
    assert [option for option in options if option.startswith("-") and f"`{option}`" not in page] == []


@pytest.mark.slow
def test_every_configuration_key_is_in_the_reference_with_its_meaning() -> None:
    page = dict(configuration.pages())["configuration.md"]
    for name, field in RunConfig.model_fields.items():
        section = next(
            (one for one in (field.annotation, *getattr(field.annotation, "__args__", ())) if is_section(one)), None
        )
        if section is None:
            assert re.search(rf"^\| `{name}` \| [^|]+ \| [^|\s][^|]+ \|$", page, re.MULTILINE)
            continue
        part = page.partition(f"\n## `[{name}]`\n")[2].partition("\n## ")[0]
        keys = getattr(section, "model_fields", None) or inspect.signature(section).parameters
        assert [key for key in keys if not re.search(rf"^\| `{key}` \| [^|]+ \| [^|]+ \|$", part, re.MULTILINE)] == []


def is_section(kind: Any) -> bool:
    return isinstance(kind, type) and (issubclass(kind, BaseModel) or hasattr(kind, "__dataclass_fields__"))


def test_tutorials_are_read_far_from_each_other() -> None:
    names = [*(f"a{number:02}" for number in range(20)), "tutorials/one", "tutorials/three", "tutorials/two", "words"]
    before = sorted(names)
    pages.spread(names)
    assert sorted(names) == before
    assert [number for number, name in enumerate(names) if name.startswith("tutorials/")] == [0, 8, 16]


@pytest.mark.parametrize("topic", ["/header", "/intent", "/trial", "/estimate", "/event", "/threshold/pulse"])
def test_every_topic_of_a_log_is_in_the_reference(topic: str) -> None:
    ((_, page),) = topics.pages()
    assert f"\n## `{topic}`\n" in page


def test_a_signature_shows_types_without_the_checks_that_they_declare() -> None:
    number, choice = "<function number at 0x7f1c>", "functools.partial(<function choice at 0x7f1d>, known=(1, 2))"
    whole = f"(low_ms: ~typing.Annotated[float, {number}], mode: typing.Annotated[int, {choice}] | None = None) -> None"
    assert docstrings.without_checks(whole) == "(low_ms: float, mode: int | None = None) -> None"


def test_every_field_of_a_log_has_a_meaning() -> None:
    ((_, page),) = topics.pages()
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", page, re.MULTILINE)
    assert len(rows) > 90
    assert [name for name, row in rows if not re.search(r" \| \S", row)] == []
    titles = {title.replace("`", "") for title in topics.kinds()}
    assert MEANINGS.keys() <= titles
    fields = {name for name, _ in rows}
    assert {name for meanings in MEANINGS.values() for name in meanings} <= fields


def test_a_protocol_that_is_called_shows_how() -> None:
    entry = reference()["api/isiw.acquisition.rst"].partition("isiw.acquisition.AcquisitionFunction\n")[2]
    assert "   :special-members: __call__" in entry.partition("\n\n")[0].splitlines()


def test_every_tutorial_can_be_downloaded_as_a_notebook() -> None:
    pages = [page for page in (DOCS / "tutorials").glob("*.md") if page.stem != "index"]
    assert pages
    for page in pages:
        assert re.search(rf"\{{nb-download\}}`[^`]+ <{page.stem}\.ipynb>`", page.read_text("utf-8")), page


def test_each_key_of_a_configuration_has_a_default_or_is_required_and_a_meaning() -> None:
    keys = configuration.keys()
    assert keys["intervention"]["protocol_code"][0] == "required"
    assert [
        f"{section}.{key}" for section, known in keys.items() for key, (_, meaning) in known.items() if not meaning
    ] == []
