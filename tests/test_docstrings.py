"""Every public name says what it is, and what its arguments are."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import docstring_parser

import isiw


def modules(*, rooms: bool) -> Iterator[ModuleType]:
    """The packages, whose exports are the public face, or all the other modules."""
    yield isiw
    for found in pkgutil.walk_packages(isiw.__path__, "isiw."):
        if found.ispkg == rooms:
            yield importlib.import_module(found.name)


def public() -> dict[str, Any]:
    """Public classes and functions by their full names, and the public methods of those classes."""
    named: dict[str, Any] = {}
    for room in modules(rooms=True):
        for name in getattr(room, "__all__", ()):
            thing = getattr(room, name)
            if (inspect.isclass(thing) or inspect.isfunction(thing)) and thing.__module__.startswith("isiw"):
                named[f"{room.__name__}.{name}"] = thing
                named |= {f"{room.__name__}.{name}.{key}": method for key, method in methods(thing)}
    return named


def methods(owner: Any) -> Iterator[tuple[str, Any]]:
    if not inspect.isclass(owner):
        return
    for name, member in vars(owner).items():
        if not name.startswith("_") and (inspect.isfunction(member) or isinstance(member, classmethod | staticmethod)):
            yield name, member.__func__ if isinstance(member, classmethod | staticmethod) else member


def arguments(function: Callable[..., object]) -> list[str]:
    return [name for name in inspect.signature(function).parameters if name not in {"self", "cls"}]


def explained(function: Callable[..., object]) -> list[str]:
    return [param.arg_name.lstrip("*") for param in docstring_parser.parse(function.__doc__ or "").params]


PUBLIC = public()
FUNCTIONS = {name: thing for name, thing in PUBLIC.items() if inspect.isfunction(thing)}
PROMISED = {  # what a protocol explains is explained for all that keep it
    (key, *explained(method))
    for module in modules(rooms=False)
    for thing in vars(module).values()
    if getattr(thing, "_is_protocol", False)
    for key, method in methods(thing)
}


def test_every_public_class_function_and_method_has_a_docstring() -> None:
    assert [name for name, thing in PUBLIC.items() if not (thing.__doc__ or "").strip()] == []


def test_every_public_function_with_two_arguments_or_more_says_what_each_is() -> None:
    several = {name: arguments(function) for name, function in FUNCTIONS.items() if len(arguments(function)) > 1}
    assert [
        name
        for name, taken in several.items()
        if explained(FUNCTIONS[name]) != taken and (name.rpartition(".")[2], *taken) not in PROMISED
    ] == []
