"""Connections: how many there may be, and how long each may take.

Whoever has not shown the token is a stranger: of too many the oldest is closed, before TLS, and they never count
against those that have. Whoever opens too many with the token is answered so, and still pauses and stops a session.
"""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Callable
from http import HTTPStatus
from typing import Any, Final, cast

import h11
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from isiw.server.answers import Refusal, answered
from isiw.server.guard import Rules, wants_200

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
            app = _too_many(others.rules.most_known, as_200=wants_200(scope["query_string"].decode("latin-1")))
        await app(scope, receive, _in_pieces(send if self.cycle.keep_alive else _closing(send)))


def _too_many(most: int, *, as_200: bool) -> ASGIApp:
    refusal = Refusal(
        503, "Overloaded", "too many connections with the token are open", expected=f"at most {most}", retry_s=1.0,
        remedy="Close those that are not needed, or send all requests over one. Nothing was done.",
    )  # fmt: skip
    return answered(refusal, as_200=as_200, headers={"Connection": "close"})


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
        await send(message if last == 0 else {**message, "body": body[last:]})

    return sent
