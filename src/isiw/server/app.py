"""The server as an ASGI application: its routes behind the guard, and every error as words."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic_core import ErrorDetails
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException

import isiw
from isiw.errors import IsiwError
from isiw.server.description import described
from isiw.server.guard import Guard, Rules, wants_200
from isiw.server.refusals import Refusal, answered, as_refusal
from isiw.server.routes import router
from isiw.server.sessions import Sessions
from isiw.text.expected import expected_instead


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
