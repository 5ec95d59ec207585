"""The public names, a page a package: what is exported by a package's `__init__`, or listed in its `.pyi`."""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from itertools import pairwise
from types import ModuleType
from typing import Any

from docs.generate.places import DOCS, MADE, ROOT

import isiw

_HIDDEN = {"isiw.cli", "isiw.text"}
"""Rooms whose exports are for isiw itself; the command line has its own page."""

_PYTHON = re.compile(r"^```(?:python|\{code-cell\}[^\n]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def pages() -> Iterator[tuple[str, str]]:
    """A page a package, and the list of them."""
    rooms = list(packages())
    for room in rooms:
        yield f"api/{room.__name__}.rst", _page(room)
    listed = "\n".join(f"   {room.__name__}" for room in rooms)
    yield "api/index.rst", f"{_title('Python API')}{_INDEX}\n.. toctree::\n   :maxdepth: 1\n\n{listed}\n"


_INDEX = """
What may be imported, by package. ``import isiw`` loads a part when it is first used. Units are in names
(``isi_ms``, ``mep_mv``), and shapes use one alphabet: *n* trials, *t* candidate ISIs, *s* posterior samples,
*p* particles, *b* people side by side, *w* samples of a waveform. Errors are :doc:`values of one tree <isiw.errors>`.

"""


@cache
def packages() -> tuple[ModuleType, ...]:
    """The packages that export names, `isiw` first, and the plain modules that it exports."""
    found = [
        isiw,
        *(importlib.import_module(room.name) for room in pkgutil.walk_packages(isiw.__path__, "isiw.") if room.ispkg),
    ]
    modules = [thing for name in dir(isiw) if inspect.ismodule(thing := getattr(isiw, name))]
    plain = [module for module in modules if not hasattr(module, "__path__")]
    return (*(room for room in found if exported(room) and room.__name__ not in _HIDDEN), *plain)


def exported(room: ModuleType) -> list[str]:
    """The names that a package exports, without modules; the public classes and functions of a plain module."""
    if hasattr(room, "__path__"):
        return [name for name in getattr(room, "__all__", ()) if not inspect.ismodule(getattr(room, name))]
    return [
        name
        for name, thing in vars(room).items()
        if name[0] != "_" and getattr(thing, "__module__", "") == room.__name__
    ]


@cache
def homes() -> dict[int, str]:
    """Under which name each thing is described: the shortest of its public ones."""
    names = [f"{room.__name__}.{name}" for room in packages() for name in exported(room)]
    by_thing: dict[int, str] = {}
    for name in sorted(names, key=lambda name: name.count(".")):
        by_thing.setdefault(id(_thing(name)), name)
    return by_thing


def _thing(name: str) -> Any:
    room, _, last = name.rpartition(".")
    return getattr(importlib.import_module(room), last)


def _page(room: ModuleType) -> str:
    parts = [_title(f"``{room.__name__}``"), f".. automodule:: {room.__name__}\n\n"]
    for name in sorted(exported(room), key=str.lower):
        full = f"{room.__name__}.{name}"
        home = homes()[id(_thing(full))]
        parts.append(_entry(full) if home == full else f"``{full}``\n   The same as :py:obj:`{home}`.\n\n")
    return "".join(parts)


def _entry(full: str) -> str:
    thing = _thing(full)
    if inspect.isclass(thing):
        kind, options = "class", "   :members:\n"
        if thing.__bases__ != (object,):
            options += "   :show-inheritance:\n"
        if getattr(thing, "_is_protocol", False) and "__call__" in vars(thing):
            options += "   :special-members: __call__\n"
    elif inspect.isroutine(thing):
        kind, options = "function", ""
    else:
        return f".. py:data:: {full}\n\n   {_said_of(full, thing)}\n\n   {example_of(full)}\n\n"
    return f".. auto{kind}:: {full}\n{options}\n   {example_of(full)}\n\n"


def _said_of(full: str, thing: Any) -> str:
    """What the docstring below a constant says, wherever it is defined."""
    name = full.rpartition(".")[2]
    for module in [one for key, one in sys.modules.items() if key.startswith("isiw.") and vars(one).get(name) is thing]:
        body = ast.parse(inspect.getsource(module)).body
        for line, after in pairwise(body):
            target = getattr(line, "target", None) or next(iter(getattr(line, "targets", [])), None)
            if (
                getattr(target, "id", None) == name
                and isinstance(after, ast.Expr)
                and isinstance(after.value, ast.Constant)
            ):
                return " ".join(str(after.value.value).split())
    return f"``{thing!r}``" if isinstance(thing, str | tuple) else ""


def example_of(full: str) -> str:
    """Where the name is used, as a link: on a page whose code runs, or in a test."""
    room, _, name = full.rpartition(".")
    if found := [page for page, words in _words_of(_code_of_pages).items() if words[name]]:
        return "Used in " + ", ".join(f":doc:`/{page}`" for page in found[:3]) + "."
    near = f"tests/{'/'.join(room.split('.')[1:])}"
    words = _words_of(_code)
    files = [path for path, text in _code().items() if words[path][name] and words[path][name] > _defines(text, name)]
    if not files:
        return ""
    path = min(files, key=lambda path: (not path.startswith(near), not path.startswith("tests"), path))
    return f"Example: :download:`{path} </../{path}>`."


def _defines(text: str, name: str) -> bool:
    return bool(re.search(rf"^(?:class|def) {name}\b|^{name}\b.*=", text, re.MULTILINE))


@cache
def _words_of(texts: Callable[[], dict[str, str]]) -> dict[str, Counter[str]]:
    """How often each word is in each text."""
    return {path: Counter(re.findall(r"\w+", text)) for path, text in texts().items()}


@cache
def _code_of_pages() -> dict[str, str]:
    """The Python code of each page, tutorials first."""
    paths = sorted(DOCS.rglob("*.md"), key=lambda path: ("tutorials" not in path.parts, path))
    own = [path for path in paths if path.relative_to(DOCS).parts[0] not in MADE and path.name != "README.md"]
    codes = {
        str(path.relative_to(DOCS).with_suffix("")): "\n".join(_PYTHON.findall(path.read_text("utf-8"))) for path in own
    }
    return {page: code for page, code in codes.items() if code}


@cache
def _code() -> dict[str, str]:
    """Code that uses the names: tests, benchmarks, and isiw itself."""
    paths = [*(ROOT / "tests").rglob("test_*.py"), *(ROOT / "benchmarks").rglob("*.py"), *(ROOT / "src").rglob("*.py")]
    return {
        str(path.relative_to(ROOT)): path.read_text("utf-8") for path in sorted(paths) if path.name != "__init__.py"
    }


def _title(words: str) -> str:
    return f"{words}\n{'=' * len(words)}\n\n"
