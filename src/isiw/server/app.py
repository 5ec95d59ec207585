"""The server as an ASGI application: its routes behind the guard, every error as words, and all calls described."""

from __future__ import annotations

import gc
import ipaddress
import secrets
import socket
import ssl
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import uvicorn
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute
from pydantic.json_schema import models_json_schema
from pydantic_core import ErrorDetails
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException

import isiw
from isiw.checks import Checked, Text, whole
from isiw.errors import ConfigError, IsiwError, os_errors
from isiw.server.answers import Refusal, answered, as_refusal
from isiw.server.guard import LOOPBACK, Connections, Guard, Rules, wants_200
from isiw.server.requests import FORM, JSON, BodyOf
from isiw.server.routes import router
from isiw.server.sessions import Sessions
from isiw.text.toml_files import expected_instead

_ABOUT: Final = (
    "Sessions of isiw for a lab's own software. Bodies are JSON, or forms whose fields have the same names: texts as "
    "they are, all others as JSON has them. Answers are JSON objects with `ok`. With errors=200 in the query an error "
    "is answered with status 200, and its own status is in the body."
)


def described(app: FastAPI) -> dict[str, Any]:
    """The description of an application's routes."""
    if app.openapi_schema is None:
        document = get_openapi(title=app.title, version=app.version, description=_ABOUT, routes=app.routes)
        dependencies = [(r, d.call) for r in router.routes if isinstance(r, APIRoute) for d in r.dependant.dependencies]
        bodies = {route.path: body.kind for route, body in dependencies if isinstance(body, BodyOf)}
        _, definitions = models_json_schema(
            [(kind, "validation") for kind in bodies.values()], ref_template="#/components/schemas/{model}"
        )
        document["components"]["schemas"] |= definitions["$defs"]
        error = {"$ref": "#/components/schemas/ErrorAnswer"}
        document["components"]["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
        document["security"] = [{"token": []}]
        for path, kind in bodies.items():
            schema = {"schema": {"$ref": f"#/components/schemas/{kind.__name__}"}}
            required = any(field.is_required() for field in kind.model_fields.values())
            body = {"required": required, "content": {JSON: schema, FORM: schema}}
            document["paths"][path]["post"]["requestBody"] = body
        for operations in document["paths"].values():
            for operation in operations.values():  # an answer with status 200 may be an error
                content = operation["responses"]["200"]["content"]
                usual = content.get(JSON, {}).get("schema")
                content[JSON] = {"schema": {"anyOf": [usual, error]} if usual else error}
        app.openapi_schema = document
    return app.openapi_schema


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
        title="isiw",
        version=isiw.__version__,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        routes=router.routes,  # as they are: FastAPI would make each of a router's routes again for its first request
    )
    app.state.sessions = sessions
    guarded(app, rules)
    app.openapi = lambda: described(app)  # type: ignore[method-assign] # as FastAPI's documentation extends it
    return app


def guarded(app: FastAPI, rules: Rules) -> None:
    """Put an application behind the guard, and answer every error in words."""
    app.add_middleware(Guard, rules=rules)
    for kind in (RequestValidationError, HTTPException, IsiwError, Exception):
        app.add_exception_handler(kind, _refused)


async def _refused(request: Request, error: Exception) -> Response:
    """The answer to a request that failed: also by a route that there is not, or a value in its path or query."""
    headers, refusal = None, as_refusal(error)
    if isinstance(error, HTTPException):
        words, headers = error.detail, error.headers
        refusal = Refusal(
            error.status_code, words.replace(" ", ""), words.lower(), got=f"{request.method} {request.url.path}",
            remedy="GET /openapi.json lists all calls.",
        )  # fmt: skip
    elif isinstance(error, RequestValidationError):
        found: ErrorDetails = error.errors()[0]
        *_, field = found["loc"]
        what, expected = f"{field} cannot be used", expected_instead(found)
        refusal = Refusal(422, "InvalidValueError", what, got=found["input"], expected=expected, field=str(field))
    return answered(refusal, as_200=wants_200(request.url.query), headers=headers)


PORT: Final = 8473

_LEAVING_S: Final = 2

_AT_ONCE: Final = 10
"""Connections that are accepted before those there are heard: fewer than would push each other out."""

_SILENT_S: Final = 5
"""The longest wait outside of a connection that has sent nothing yet [s]."""

_WAITING: Final = 2000
"""Connections that wait for this."""


def new_token() -> str:
    """A random token."""
    return secrets.token_urlsafe(32)


@dataclass(frozen=True)
class ServerSettings(Checked):
    """Where and how a folder of sessions is served.

    Args:
        folder: where the logs are.
        host: the address to listen at, or localhost.
        port: the port; 0 for any that is free.
        token: what every request must carry; by default a random one.
        certificate: the file of a TLS certificate, needed for any other address than this computer's own.
        key: the file of its key.

    Raises:
        ConfigError: another address without certificate and key, one of these that is not there, or a host that is no
            address.
        InvalidValueError: no port, or a token that cannot be used.
    """

    folder: Path
    host: Text = "127.0.0.1"
    port: Annotated[int, partial(whole, least=0, most=65535)] = PORT
    token: str = field(default_factory=new_token, repr=False)
    certificate: Path | None = None
    key: Path | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.certificate is None) != (self.key is None):
            raise ConfigError("a certificate and its key belong together", remedy="Give both files, or neither.")
        for path in filter(None, (self.certificate, self.key)):
            if not path.is_file():
                raise ConfigError("the file of a certificate, or of its key, is not there", got=str(path))
        if not self.address.is_loopback and self.certificate is None:
            raise ConfigError(
                "other computers may reach the server only with TLS",
                got=self.host,
                remedy="Give a certificate and its key, or leave the host out: 127.0.0.1.",
            )
        self.rules()

    @property
    def address(self) -> ipaddress.IPv4Address | ipaddress.IPv6Address:
        """The address to listen at."""
        try:
            return ipaddress.ip_address("127.0.0.1" if self.host == "localhost" else self.host)
        except ValueError as error:
            raise ConfigError(
                "the host is not an IP address", got=self.host, expected="an IP address of this computer, or localhost"
            ) from error

    def tls(self) -> ssl.SSLContext | None:
        """The context by which connections are encrypted; None without a certificate. Raise if it cannot be used."""
        if self.certificate is None:
            return None
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        try:
            context.load_cert_chain(self.certificate, self.key)
        except ssl.SSLError as error:
            raise ConfigError(
                "the certificate and its key cannot be used",
                got=f"{self.certificate} and {self.key} ({error.reason})",
                expected="a certificate (PEM), and the key that belongs to it (PEM)",
            ) from error
        return context

    def rules(self) -> Rules:
        """The rules of requests: this computer's own names, and the address and names that others use."""
        others = {self.host, socket.gethostname().lower(), socket.getfqdn().lower()}
        return Rules(self.token, hosts=LOOPBACK if self.address.is_loopback else LOOPBACK | others)


def serve(settings: ServerSettings, ready: Callable[[str], None]) -> None:
    """Serve until Ctrl-C or TERM; then every open log is closed.

    Args:
        settings: where and how.
        ready: called with the server's address (URL) once it can be reached.

    Raises:
        ConfigError: the port is taken, or the address is not this computer's.
        InvalidValueError: the folder cannot be made.
    """
    rules = settings.rules()
    app = make_app(settings.folder, rules)
    with listening(settings.address, settings.port) as listener:
        host, port, *_ = listener.getsockname()
        name = f"[{host}]" if settings.address.version == 6 else host
        server = Server(settings_of(app, rules, settings.tls()))
        ready(f"{'https' if settings.certificate else 'http'}://{name}:{port}")
        gc.freeze()  # to look for garbage in all that the libraries have loaded holds up every answer for 0.3 s
        try:
            server.run(sockets=[listener])
        finally:
            gc.unfreeze()


class Server(uvicorn.Server):
    """uvicorn's server, which accepts a few connections at a time while many wait."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to serve; uvicorn lets as many wait as it accepts at a time."""
        await super().startup(sockets)
        for listener in sockets or ():
            listener.listen(_WAITING)


def settings_of(
    app: FastAPI, rules: Rules, tls: ssl.SSLContext | None = None, *, log_level: str = "error"
) -> uvicorn.Config:
    """The settings by which uvicorn serves an application of isiw."""
    return uvicorn.Config(
        app,
        http=Connections(rules, tls),  # type: ignore[arg-type] # as much a maker of protocols as their class is
        loop="asyncio",
        ws="none",
        log_level=log_level,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        backlog=_AT_ONCE,
        timeout_graceful_shutdown=_LEAVING_S,
    )


def listening(address: ipaddress.IPv4Address | ipaddress.IPv6Address, port: int) -> socket.socket:
    """A socket that listens."""
    family = socket.AF_INET6 if address.version == 6 else socket.AF_INET
    taken = "Choose another port; 0 takes any that is free."
    with os_errors(ConfigError, "the server cannot listen", f"{address}, port {port}", taken):
        listener = socket.create_server((str(address), port), family=family, backlog=_WAITING)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # or each answer waits 40 ms for the one before
    if hasattr(socket, "TCP_DEFER_ACCEPT"):  # Linux: who says nothing waits outside for a while
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_DEFER_ACCEPT, _SILENT_S)
    return listener
