"""The server as an ASGI application: its routes behind the guard, every error as words, and all calls described."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema
from pydantic_core import ErrorDetails
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException

import isiw
from isiw.errors import IsiwError
from isiw.server.answers import Refusal, answered, as_refusal
from isiw.server.guard import Guard, Rules, wants_200
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
from isiw.server.routes import router
from isiw.server.sessions import Sessions
from isiw.text.toml_files import expected_instead

_BODIES: Final[dict[str, type[BaseModel]]] = {
    "/sessions": CreateRequest,
    "/sessions/{id}/resume": ResumeRequest,
    "/sessions/{id}/ask": AskRequest,
    "/sessions/{id}/tell": TellRequest,
    "/sessions/{id}/mistrial": MistrialRequest,
    "/sessions/{id}/note": NoteRequest,
    "/sessions/{id}/change": NoteRequest,
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


def make_app(folder: str | Path, rules: Rules) -> FastAPI:
    """The application that serves the sessions of a folder.

    Args:
        folder: where the logs are.
        rules: who may ask, and how much they may send.
    """
    sessions = Sessions(Path(folder))

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        await run_in_threadpool(sessions.close_all)

    app = FastAPI(
        title="isiw", version=isiw.__version__, lifespan=lifespan, docs_url=None, redoc_url=None, redirect_slashes=False
    )
    app.state.sessions = sessions
    app.include_router(router)
    guarded(app, rules)
    app.openapi = lambda: described(app)  # type: ignore[method-assign] # as FastAPI's documentation extends it
    return app


def guarded(app: FastAPI, rules: Rules) -> None:
    """Put an application behind the guard, and answer every error in words."""
    app.add_middleware(Guard, rules=rules)
    for kind, handler in _HANDLERS.items():
        app.add_exception_handler(kind, handler)


async def _refused(request: Request, error: Exception) -> Response:
    return answered(as_refusal(error), as_200=wants_200(request.url.query))


async def _invalid(request: Request, error: Exception) -> Response:
    """A path, query or header that cannot be used."""
    found: ErrorDetails = error.errors()[0]  # type: ignore[attr-defined] # it is the RequestValidationError
    *_, field = found["loc"]
    what, expected = f"{field} cannot be used", expected_instead(found)
    refusal = Refusal(422, "InvalidValueError", what, got=found["input"], expected=expected, field=str(field))
    return answered(refusal, as_200=wants_200(request.url.query))


async def _unknown(request: Request, error: Exception) -> Response:
    """No such route, or not by this method."""
    status, words = error.status_code, error.detail  # type: ignore[attr-defined] # it is the HTTPException
    refusal = Refusal(
        status, words.replace(" ", ""), words.lower(), got=f"{request.method} {request.url.path}",
        remedy="GET /openapi.json lists all calls.",
    )  # fmt: skip
    return answered(refusal, as_200=wants_200(request.url.query), headers=error.headers)  # type: ignore[attr-defined]


_HANDLERS = {
    RequestValidationError: _invalid,
    HTTPException: _unknown,
    IsiwError: _refused,
    Exception: _refused,
}
