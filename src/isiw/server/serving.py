"""Serving a folder of sessions: to this computer alone, unless a certificate makes it safe for others to ask."""

from __future__ import annotations

import gc
import ipaddress
import secrets
import socket
import ssl
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Final

import uvicorn
from fastapi import FastAPI

from isiw.checks import Checked, Text, whole
from isiw.errors import ConfigError
from isiw.server.app import make_app
from isiw.server.connections import Connections
from isiw.server.guard import LOOPBACK, Rules

PORT: Final = 8473

_LEAVING_S: Final = 2

_AT_ONCE: Final = 10
"""Connections that are accepted before those there are heard: fewer than would push each other out."""

_SILENT_S: Final = 5
"""How long a connection may wait outside that has sent nothing yet [s]."""

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
        """What connections are encrypted by; None without a certificate."""
        if self.certificate is None:
            return None
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        context.load_cert_chain(self.certificate, self.key)
        return context

    def rules(self) -> Rules:
        """What is let through: under this computer's own names, and the address and names by which others ask."""
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
    """How uvicorn serves an application of isiw."""
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
    try:
        listener = socket.create_server((str(address), port), family=family, backlog=_WAITING)
    except OSError as error:
        raise ConfigError(
            f"the server cannot listen: {error.strerror}",
            got=f"{address}, port {port}",
            remedy="Choose another port; 0 takes any that is free.",
        ) from error
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # or each answer waits 40 ms for the one before
    if hasattr(socket, "TCP_DEFER_ACCEPT"):  # Linux: who says nothing waits outside for a while
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_DEFER_ACCEPT, _SILENT_S)
    return listener
