"""The calls of the server, from its description."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from docs.generate.schemas import fields
from docs.generate.tables import cell
from docs.write_openapi import description


def pages() -> Iterator[tuple[str, str]]:
    """One page."""
    described = json.loads(description())
    definitions = described["components"]["schemas"]
    parts = [
        """# HTTP calls

The calls of `isiw serve`. [From your own software](../lab/server.md) shows their use, and which errors there are;
{download}`openapi.json </lab/openapi.json>` is the same for tools.
"""
    ]
    for path, methods in described["paths"].items():
        parts += [_call(method, path, call, definitions) for method, call in methods.items()]
    yield "http.md", "".join(parts)


def _call(method: str, path: str, call: dict[str, Any], definitions: dict[str, Any]) -> str:
    text = f"\n## `{method.upper()} {path}`\n\n{cell(call.get('description', ''))}\n"
    body = call.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema")
    if body:
        text += f"\nSend:\n\n{fields(body, definitions=definitions)}"
    answer = call["responses"]["200"].get("content", {}).get("application/json", {}).get("schema", {})
    kinds = [one for one in answer.get("anyOf", [answer]) if not str(one.get("$ref", "")).endswith("/ErrorAnswer")]
    for one in kinds:
        if one:
            text += f"\nAnswer:\n\n{fields(one, definitions=definitions)}"
    return text
