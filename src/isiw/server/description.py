"""The description of all calls (OpenAPI), with both forms of their bodies and errors that come with status 200."""

from __future__ import annotations

from typing import Any, Final

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from isiw.server.requests import (
    FORM,
    JSON,
    AskRequest,
    CreateRequest,
    ExcludeRequest,
    IncludeRequest,
    MistrialRequest,
    NoteRequest,
    ResumeRequest,
    TellRequest,
)

_BODIES: Final[dict[str, type[BaseModel]]] = {
    "/sessions": CreateRequest,
    "/sessions/{id}/resume": ResumeRequest,
    "/sessions/{id}/ask": AskRequest,
    "/sessions/{id}/tell": TellRequest,
    "/sessions/{id}/mistrial": MistrialRequest,
    "/sessions/{id}/note": NoteRequest,
    "/sessions/{id}/exclude": ExcludeRequest,
    "/sessions/{id}/include": IncludeRequest,
}

_ABOUT: Final = (
    "Sessions of isiw for a lab's own software. Bodies are JSON, or forms whose fields have the same names: texts as "
    "they are, all others as JSON has them. Answers are JSON objects with `ok`. With errors=200 in the query an error "
    "is answered with status 200, and its own status is in the body."
)


def described(app: FastAPI) -> dict[str, Any]:
    """The description of an application's routes."""
    if app.openapi_schema is None:
        document = get_openapi(title=app.title, version=app.version, description=_ABOUT, routes=app.routes)
        _, definitions = models_json_schema(
            [(kind, "validation") for kind in _BODIES.values()], ref_template="#/components/schemas/{model}"
        )
        document["components"]["schemas"] |= definitions["$defs"]
        document["components"]["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
        document["security"] = [{"token": []}]
        for path, kind in _BODIES.items():
            document["paths"][path]["post"]["requestBody"] = _body(kind)
        for operations in document["paths"].values():
            for operation in operations.values():
                _allow_errors(operation["responses"]["200"]["content"])
        app.openapi_schema = document
    return app.openapi_schema


def _body(kind: type[BaseModel]) -> dict[str, Any]:
    required = any(field.is_required() for field in kind.model_fields.values())
    schema = {"$ref": f"#/components/schemas/{kind.__name__}"}
    return {"required": required, "content": {JSON: {"schema": schema}, FORM: {"schema": schema}}}


def _allow_errors(content: dict[str, Any]) -> None:
    """Say that an answer with status 200 may be an error."""
    error = {"$ref": "#/components/schemas/ErrorAnswer"}
    usual = content.get(JSON, {}).get("schema")
    content[JSON] = {"schema": {"anyOf": [usual, error]} if usual else error}
