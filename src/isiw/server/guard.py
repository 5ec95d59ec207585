"""The guard before all routes: who may ask, from where, and how much and how slowly they may send."""

from __future__ import annotations

import asyncio
import hmac
import itertools
from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

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
        first: Message = {"type": "http.request", "body": body, "more_body": False}
        await self._app(scope, _beginning_with(first, receive), send)

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
        try:
            async with asyncio.timeout(self._rules.body_s):
                return await self._received(receive)
        except TimeoutError as error:
            raise Refusal(
                408, "TooSlow", "the body did not arrive in time", expected=f"at most {self._rules.body_s:g} s"
            ) from error

    async def _received(self, receive: Receive) -> bytes:
        body = bytearray()
        while True:
            message = await receive()
            if message["type"] != "http.request":
                raise Refusal(400, "Incomplete", "the connection ended before the body did")
            body += message.get("body", b"")
            if len(body) > self._rules.most_bytes:
                raise self._too_large()
            if not message.get("more_body", False):
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


def _beginning_with(first: Message, receive: Receive) -> Receive:
    """A receiver with one message before all others."""
    messages = itertools.chain([first], itertools.repeat(None))

    async def received() -> Message:
        return next(messages) or await receive()

    return received
