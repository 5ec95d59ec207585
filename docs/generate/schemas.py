"""Tables of the fields that a JSON schema describes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from docs.generate.tables import arguments, cell, code, table


def fields(
    schema: dict[str, Any],
    kind: Any = None,
    definitions: dict[str, Any] | None = None,
    known: Mapping[str, str] | None = None,
) -> str:
    """The fields of one record: name, type, and meaning, as the docstring, the schema or `known` has it."""
    definitions = definitions or schema.get("$defs", {})
    options = [_resolved(one, definitions) for one in schema.get("oneOf", [])] or [_resolved(schema, definitions)]
    meanings = {**arguments(kind), **(known or {})}
    properties = {name: one for option in options for name, one in option.get("properties", {}).items()}
    rows = [
        [code(name), cell(type_of(one)), cell(one.get("description") or meanings.get(name, ""))]
        for name, one in properties.items()
    ]
    if not any(row[2] for row in rows):
        return table(["field", "type"], [row[:2] for row in rows])
    return table(["field", "type", "meaning"], rows)


def type_of(one: dict[str, Any]) -> str:
    """The type of a field in words."""
    if "$ref" in one:
        return str(one["$ref"]).rpartition("/")[2].strip("_")
    if "const" in one:
        return repr(one["const"])
    if "enum" in one:
        return ", ".join(map(repr, one["enum"])) if len(one["enum"]) < 8 else "one of the names"
    if parts := one.get("anyOf") or one.get("oneOf"):
        return " or ".join(dict.fromkeys(type_of(part) for part in parts))
    kind = one.get("type", "anything")
    if kind == "array":
        return f"list of {type_of(one['items'])}" if isinstance(one.get("items"), dict) else "list"
    return " or ".join(kind) if isinstance(kind, list) else str(kind)


def _resolved(schema: dict[str, Any], definitions: dict[str, Any]) -> dict[str, Any]:
    name = str(schema.get("$ref", "")).rpartition("/")[2]
    return dict(definitions[name]) if name else schema
