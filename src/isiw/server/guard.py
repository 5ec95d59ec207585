"""The guard: who may connect and ask, from where, how many at a time, and how much and how slowly they may send.

Whoever has not shown the token is a stranger: of too many the oldest is closed, before TLS, and they never count
against those that have. Whoever opens too many with the token is answered so, and still pauses and stops a session.
"""

from __future__ import annotations

import asyncio
import hmac
import ssl
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, Final, cast
from urllib.parse import parse_qs, urlsplit

import h11
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from isiw.checks import Checked, Count, NonNegative, Positive, Text
from isiw.errors import InvalidValueError
from isiw.server.answers import Refusal, answered

LOOPBACK: Final = frozenset({"127.0.0.1", "localhost", "::1"})
"""The names under which a computer reaches itself."""

SHORTEST_TOKEN: Final = 16


@dataclass(frozen=True)
class Rules(Checked):
    """Rules by which requests are let through.

    Args:
        token: what every request must carry.
        hosts: the names under which the server may be asked; a page of another name that a browser shows is refused.
        most_bytes: the longest body [bytes].
        body_s: how long a body may take to arrive [s].
        open_paths: what is answered without the token, as it says nothing of any session.
        stranger_s: how long whoever shows no token waits for each answer [s]; so a foreign page that asks without a
            pause, over the few connections that a browser allows it, takes little of the processor.
        head_s: how long a request's headers may take to arrive, from the connection or its last answer on [s].
        most_strangers: how many connections may be open that have not shown the token.
        most_known: how many may be open that have.
        urgent_paths: what is answered to whoever shows the token, however many connections are open.

    Raises:
        InvalidValueError: a token that is too short, a limit that is not positive, or a negative wait.
    """

    token: Text
    hosts: frozenset[str] = LOOPBACK
    most_bytes: Count = 2**20
    body_s: Positive = 10.0
    open_paths: frozenset[str] = frozenset()
    stranger_s: NonNegative = 0.05
    head_s: Positive = 5.0
    most_strangers: Count = 100
    most_known: Count = 100
    urgent_paths: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.token) < SHORTEST_TOKEN or not self.token.isascii() or not self.token.isprintable():
            raise InvalidValueError(
                "the token cannot be used",
                expected=f"at least {SHORTEST_TOKEN} letters, digits and signs",
                remedy="Leave it out, and the server makes one.",
            )

    def shows_token(self, headers: Headers) -> bool:
        """True if a request carries the token."""
        kind, _, given = headers.get("authorization", "").partition(" ")
        same = hmac.compare_digest(given.strip().encode("latin-1", "replace"), self.token.encode())
        return same and kind.lower() == "bearer"


class Guard:
    """Lets through what the rules allow, with its whole body; everything else is answered here."""

    def __init__(self, app: ASGIApp, rules: Rules) -> None:
        self._app, self._rules = app, rules

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or hand it on with its body."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        as_200 = wants_200(scope["query_string"].decode("latin-1"))
        try:
            self._require_host(headers)
            if scope["path"] in self._rules.open_paths:
                await asyncio.sleep(self._rules.stranger_s)
                await self._app(scope, receive, send)  # which reads no body
                return
            self._require_token(headers)
        except Refusal as refusal:
            await asyncio.sleep(self._rules.stranger_s)
            await answered(refusal, as_200=as_200)(scope, receive, send)
            return
        try:
            body = await self._body(headers, receive)
        except Refusal as refusal:  # the rest of the body is not read
            await answered(refusal, as_200=as_200, headers={"Connection": "close"})(scope, receive, send)
            return
        whole = iter([{"type": "http.request", "body": body, "more_body": False}])

        async def received() -> Message:
            return next(whole, None) or await receive()

        await self._app(scope, received, send)

    def _require_host(self, headers: Headers) -> None:
        host, origin = headers.get("host", ""), headers.get("origin")
        if _hostname(f"//{host}") not in self._rules.hosts:
            raise Refusal(
                403, "ForeignHost", "the server is not known by this name", got=host,
                expected=" or ".join(sorted(self._rules.hosts)),
            )  # fmt: skip
        if origin is not None and origin not in {f"http://{host}", f"https://{host}"}:
            raise Refusal(403, "ForeignOrigin", "pages from elsewhere may not use the server", got=origin)

    def _require_token(self, headers: Headers) -> None:
        if not self._rules.shows_token(headers):
            raise Refusal(
                401, "Unauthorized", "the request has no token, or not the server's",
                expected="the header Authorization: Bearer TOKEN",
                remedy="isiw serve prints its token when it starts, unless --token-file or ISIW_TOKEN gives it.",
            )  # fmt: skip

    async def _body(self, headers: Headers, receive: Receive) -> bytes:
        stated = headers.get("content-length", "0")
        if not stated.isdecimal() or int(stated) > self._rules.most_bytes:
            raise self._too_large()
        body, more = bytearray(), True
        try:
            async with asyncio.timeout(self._rules.body_s):
                while more:
                    message = await receive()
                    if message["type"] != "http.request":
                        raise Refusal(400, "Incomplete", "the connection ended before the body did")
                    body += message.get("body", b"")
                    if len(body) > self._rules.most_bytes:
                        raise self._too_large()
                    more = message.get("more_body", False)
        except TimeoutError as error:
            raise Refusal(
                408, "TooSlow", "the body did not arrive in time", expected=f"at most {self._rules.body_s:g} s"
            ) from error
        return bytes(body)

    def _too_large(self) -> Refusal:
        return Refusal(413, "TooLarge", "the body is too large", expected=f"at most {self._rules.most_bytes} bytes")


def wants_200(query: str) -> bool:
    """True if a client can read the words of an answer with status 200 only, as its query says."""
    return parse_qs(query).get("errors") == ["200"]


def _hostname(url: str) -> str | None:
    try:
        return urlsplit(url).hostname
    except ValueError:
        return None


TAKING_S: Final = 30.0
"""The longest time in which a client takes nothing of what it is sent [s]."""

PIECE: Final = 2**16
"""The size of a piece that is sent at a time [bytes]: a client that reads nothing holds little memory."""


class Connections:
    """The open connections of a server; called by uvicorn, it makes the protocol of a new one."""

    def __init__(self, rules: Rules, tls: ssl.SSLContext | None = None) -> None:
        self.rules, self.tls = rules, tls
        self.strangers: dict[Connection, None] = {}  # the oldest first
        self.known: set[Connection] = set()

    def __call__(self, *args: Any, **kwargs: Any) -> Connection:
        """The protocol of a connection."""
        return Connection(self, *args, **kwargs)

    def enter(self, connection: Connection) -> None:
        """Take a new connection in, at the cost of the oldest stranger where there are too many."""
        if len(self.strangers) >= self.rules.most_strangers:
            next(iter(self.strangers)).hang_up()
        self.strangers[connection] = None

    def leave(self, connection: Connection) -> None:
        """Forget a connection."""
        self.strangers.pop(connection, None)
        self.known.discard(connection)

    def lets_in(self, connection: Connection, path: str) -> bool:
        """Let a connection in that has shown the token if there is room, or its request is urgent."""
        room = len(self.known) < self.rules.most_known
        if room or path in self.rules.urgent_paths:
            self.leave(connection)
            self.known.add(connection)
            connection.cycle.keep_alive &= room
        return connection in self.known


class Connection(H11Protocol):
    """One connection: uvicorn's protocol for HTTP/1.1, with deadlines, and words where it has none."""

    def __init__(self, others: Connections, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._others, self._routes, self.app = others, cast("ASGIApp", self.app), cast("Any", self._answer)
        self._line: asyncio.Transport | None = None
        self._early = b""  # what comes with the end of a handshake, before the connection is made
        self._securing: asyncio.Task[None] | None = None
        self._deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override] # as uvicorn has it
        """Begin, with the TLS handshake where there is one."""
        self._line = transport
        self._others.enter(self)
        self._within(self._others.rules.head_s, self._late)
        if self._others.tls is None:
            super().connection_made(transport)
        else:
            transport.pause_reading()
            self._securing = self.loop.create_task(self._secure(transport, self._others.tls))

    async def _secure(self, line: asyncio.Transport, tls: ssl.SSLContext) -> None:
        shutdown_s = self._others.rules.head_s
        try:
            secured = await self.loop.start_tls(line, self, tls, server_side=True, ssl_shutdown_timeout=shutdown_s)
        except OSError:  # no TLS, or the client has gone
            secured = None
        if secured is None:
            self._end()
        else:
            super().connection_made(secured)
            if self._early:
                self.data_received(self._early)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._end()
        if self._securing is not None:
            self._securing.cancel()
        if self.transport is not None:
            super().connection_lost(exc)

    def hang_up(self) -> None:
        """Close it at once, whatever was not sent yet."""
        self._end()
        if self._line is not None:
            self._line.abort()

    def _end(self) -> None:
        self._others.leave(self)
        self._at_leisure()

    def data_received(self, data: bytes) -> None:
        """Take what came; from the first byte of a head on, or of a body that nobody waits for, time runs."""
        if self.transport is None:
            self._early += data
            return
        super().data_received(data)
        if self.cycle is not None and not self.cycle.response_complete:
            if not self.flow.write_paused:
                self._at_leisure()
        elif self._deadline is None:
            self._within(self._others.rules.head_s, self._late)

    def on_response_complete(self) -> None:
        """See to it that an answer after which the connection is closed is taken."""
        super().on_response_complete()
        if self.transport.is_closing():
            self._within(TAKING_S, self.hang_up)

    def pause_writing(self) -> None:
        """Wait a while for a client that does not take what it is sent."""
        super().pause_writing()
        self._within(TAKING_S, self.hang_up)

    def resume_writing(self) -> None:
        """Go on."""
        super().resume_writing()
        self._at_leisure()

    def timeout_keep_alive_handler(self) -> None:
        """Close a connection on which nothing is asked any more."""
        super().timeout_keep_alive_handler()
        self._within(TAKING_S, self.hang_up)

    def send_400_response(self, msg: str) -> None:
        """Say in JSON, too, that a request is none."""
        del msg
        self._refuse(Refusal(400, "MalformedRequest", "the request is no HTTP", expected="HTTP/1.1"))

    def _late(self) -> None:
        """The head of a request has not come in time, or the rest of a body that is not wanted."""
        if self.transport is None or not self.conn.trailing_data[0]:
            self.hang_up()
        else:
            in_time = f"at most {self._others.rules.head_s:g} s"
            self._refuse(Refusal(408, "TooSlow", "the request's headers did not arrive in time", expected=in_time))

    def _refuse(self, refusal: Refusal) -> None:
        """Answer a request that never reached the routes, and close."""
        if self.conn.our_state in {h11.IDLE, h11.SEND_RESPONSE}:
            answer = answered(refusal, headers={"Connection": "close"})
            reason = HTTPStatus(answer.status_code).phrase.encode()
            head = h11.Response(status_code=answer.status_code, headers=answer.raw_headers, reason=reason)
            for event in (head, h11.Data(data=bytes(answer.body)), h11.EndOfMessage()):
                self.transport.write(self.conn.send(event) or b"")
        self.transport.close()
        self._within(TAKING_S, self.hang_up)

    def _within(self, limit_s: float, otherwise: Callable[[], None]) -> None:
        """Set the deadline."""
        self._at_leisure()
        self._deadline = self.loop.call_later(limit_s, otherwise)

    def _at_leisure(self) -> None:
        """Lift the deadline."""
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request by the routes, if there is room for whoever shows the token."""
        app, others = self._routes, self._others
        is_new = self not in others.known and others.rules.shows_token(Headers(scope=scope))
        if is_new and not others.lets_in(self, scope["path"]):
            refusal = Refusal(
                503, "Overloaded", "too many connections with the token are open", retry_s=1.0,
                expected=f"at most {others.rules.most_known}",
                remedy="Close those that are not needed, or send all requests over one. Nothing was done.",
            )  # fmt: skip
            as_200 = wants_200(scope["query_string"].decode("latin-1"))
            app = answered(refusal, as_200=as_200, headers={"Connection": "close"})
        await app(scope, receive, _in_pieces(send if self.cycle.keep_alive else _closing(send)))


def _closing(send: Send) -> Send:
    """A sender of an answer that says that the connection ends with it, so that nobody asks again on it."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), (b"connection", b"close")]}
        await send(message)

    return sent


def _in_pieces(send: Send) -> Send:
    """A sender of an answer that holds no more of it than a client takes."""

    async def sent(message: Message) -> None:
        body = message.get("body", b"")
        last = max(0, len(body) - 1) // PIECE * PIECE
        for begin in range(0, last, PIECE):
            await send({**message, "body": body[begin : begin + PIECE], "more_body": True})
            await asyncio.sleep(0)  # the loss of the connection is heard of here, before more is written to it
        await send(message if last == 0 else {**message, "body": body[last:]})

    return sent
