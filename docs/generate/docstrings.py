"""Docstrings and signatures as Sphinx reads them.

What is indented below a paragraph is shown as it stands, and a field's type without the check that it declares.
"""

from __future__ import annotations

from typing import Any

ANNOTATED = "typing.Annotated["


def connect(app: Any) -> None:
    """Connect it."""
    app.connect("autodoc-process-docstring", _process, priority=400)  # before napoleon
    app.connect("autodoc-process-signature", _process_signature)


def _process(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:  # noqa: ARG001
    if what in {"attribute", "data", "property"}:
        lines[:0] = ["..", ""]  # an empty comment, else napoleon takes what is before a first colon for a type
    for index in range(len(lines) - 1, 1, -1):
        before = lines[index - 2]
        if lines[index].startswith("    ") and not lines[index - 1].strip() and before.strip() and before[0] != " ":
            lines[index:index] = ["::", ""]


def _process_signature(
    app: Any,  # noqa: ARG001
    what: str,  # noqa: ARG001
    name: str,  # noqa: ARG001
    thing: Any,  # noqa: ARG001
    options: Any,  # noqa: ARG001
    signature: str | None,
    returned: str | None,
) -> tuple[str | None, str | None]:
    return signature and without_checks(signature), returned and without_checks(returned)


def without_checks(signature: str) -> str:
    """A signature in which `Annotated[float, check]` is `float`: a check would show the address of a function."""
    while (begin := signature.find(ANNOTATED)) >= 0:
        first = begin + len(ANNOTATED)
        commas, end = [], first
        depth = 1
        while depth:
            letter = signature[end]
            depth += (letter in "[(") - (letter in "])")
            commas += [end] if letter == "," and depth == 1 else []
            end += 1
        signature = signature[:begin].removesuffix("~") + signature[first : commas[0]] + signature[end:]
    return signature
