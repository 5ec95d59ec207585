"""The live page of one session, served to this computer in a thread beside the session's loop, and its calls."""

from __future__ import annotations

import asyncio
import hashlib
import ipaddress
import threading
from collections.abc import AsyncIterator
from functools import cache
from pathlib import Path
from typing import Annotated, Final, Self

from fastapi import APIRouter, Depends, FastAPI, Request, Response
from fastapi.responses import StreamingResponse
from plotly.offline import get_plotlyjs

import isiw
from isiw.checks import whole
from isiw.errors import InvalidValueError
from isiw.report.html import asset
from isiw.server.answers import OkAnswer, Refusal
from isiw.server.app import Server, guarded, listening, new_token, settings_of
from isiw.server.guard import Rules
from isiw.server.live.view import View
from isiw.server.requests import BodyOf, ExcludeRequest, GoOnRequest, IncludeRequest, NoteRequest
from isiw.session.loop import Session

GLANCE_S, MOST_S = 0.05, 0.5
"""The time between two looks for news, and the longest if none is put together for a while [s]."""

QUIET_S: Final = 1.0
"""After so long without news, the page hears that the session is still there [s]."""

BY_PAGE: Final = "on the live page"

FILES: Final = {
    "/": ("text/html", lambda: asset("live.html", "isiw.server")),
    "/page.css": ("text/css", lambda: asset("page.css")),
    "/live.css": ("text/css", lambda: asset("live.css", "isiw.server")),
    "/panel.js": ("text/javascript", lambda: asset("panel.js", "isiw.server")),
    "/draw.js": ("text/javascript", lambda: asset("draw.js")),
    "/live.js": ("text/javascript", lambda: asset("live.js", "isiw.server")),
    "/plotly.js": ("text/javascript", get_plotlyjs),
}
"""Files that say nothing of the session: those of the page, by path, with their type."""

URGENT: Final = frozenset({"/pause", "/stop"})
"""Paths that are answered however much there is to do."""

_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; "
    "img-src data: blob:; form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)
_HEADERS: Final = {
    "Content-Security-Policy": _POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
_UPDATES_HEADERS: Final = {**_HEADERS, "Cache-Control": "no-store"}

router = APIRouter()


@cache
def file_of(path: str) -> tuple[bytes, str, dict[str, str]]:
    """A file of the page, its type and headers; to make the largest takes as long as a good many updates."""
    kind, text = FILES[path]
    content = text().encode()
    tag = f'"{hashlib.sha256(content).hexdigest()}"'
    return content, kind, {**_HEADERS, "Cache-Control": "no-cache", "ETag": tag}


async def _file(request: Request) -> Response:
    content, kind, headers = file_of(request.url.path)
    if request.headers.get("if-none-match") == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return Response(content, media_type=kind, headers=headers)


for _path in FILES:
    router.get(_path)(_file)


async def _view(request: Request) -> View:
    view: View = request.app.state.view
    return view


async def _session(request: Request, view: Annotated[View, Depends(_view)]) -> Session:
    """The session, while it runs."""
    session: Session = request.app.state.session
    view.seen()
    if not session.running:
        raise Refusal(409, "NotRunning", "the session is not running", remedy="Nothing was done.")
    return session


Running = Annotated[Session, Depends(_session)]


@router.get("/updates")
async def updates(view: Annotated[View, Depends(_view)]) -> StreamingResponse:
    """The contents of the page, whenever they change, as Server-Sent Events; until the session has ended."""
    return StreamingResponse(_followed(view), media_type="text/event-stream", headers=_UPDATES_HEADERS)


async def _followed(view: View) -> AsyncIterator[str]:
    """Each viewer gets the latest when it has taken what came before; what it missed it need not know."""
    seen: object = None
    quiet_s = 0.0
    with view.attended():
        while True:
            over, shown = view.over, view.shown()
            if shown.state != seen:
                seen, quiet_s = shown.state, 0.0
                yield f"data: {shown.json}\n\n"
            elif quiet_s >= QUIET_S:
                quiet_s = 0.0
                yield ": still here\n\n"
            if over:
                return
            glance_s = max(GLANCE_S, min(view.wait_s, MOST_S))
            await asyncio.sleep(glance_s)
            quiet_s += glance_s


@router.post("/pause")
async def pause(session: Running) -> OkAnswer:
    """Disarm now, and pause."""
    await asyncio.to_thread(session.pause, f"Paused {BY_PAGE}.")  # threads that other calls cannot all be holding
    return OkAnswer()


@router.post("/resume")
def resume(session: Running, body: Annotated[GoOnRequest, Depends(BodyOf(GoOnRequest))]) -> OkAnswer:
    """Let the paused session go on, if it still waits in the pause that was shown."""
    try:
        session.go_on(body.pause)
    except InvalidValueError as error:
        raise Refusal.of(error, 409, "OtherPause", field="pause") from error
    return OkAnswer()


@router.post("/stop")
async def stop(session: Running) -> OkAnswer:
    """Disarm now, and end the session, which can be resumed later."""
    await asyncio.to_thread(session.end, f"Ended {BY_PAGE}.")
    return OkAnswer()


@router.post("/exclude")
def exclude(session: Running, body: Annotated[ExcludeRequest, Depends(BodyOf(ExcludeRequest))]) -> OkAnswer:
    """Let a trial not count."""
    session.exclude(body.trial, body.reason or f"Excluded {BY_PAGE}.")
    return OkAnswer()


@router.post("/include")
def include(session: Running, body: Annotated[IncludeRequest, Depends(BodyOf(IncludeRequest))]) -> OkAnswer:
    """Let a trial count again that was excluded."""
    session.include(body.trial)
    return OkAnswer()


@router.post("/note")
def note(session: Running, body: Annotated[NoteRequest, Depends(BodyOf(NoteRequest))]) -> OkAnswer:
    """Log a remark."""
    session.note(body.text, key=body.key)
    return OkAnswer()


@router.post("/change")
def change(session: Running, body: Annotated[NoteRequest, Depends(BodyOf(NoteRequest))]) -> OkAnswer:
    """Log that something changed that may bear on all later MEPs."""
    session.note_change(body.text, key=body.key)
    return OkAnswer()


_ADDRESS: Final = ipaddress.IPv4Address("127.0.0.1")
_LEAVING_S: Final = 5.0


class LivePage:
    """The live page of a session, served until it is closed; a context manager.

    Args:
        session: the session.
        port: the port; 0 for any that is free.
        config: the configuration that it runs with, for the command that resumes it.
    """

    def __init__(self, session: Session, port: int, config: Path | None = None) -> None:
        self._view, token = View(session, config), new_token()
        rules = Rules(token, open_paths=frozenset(FILES), urgent_paths=URGENT)
        app = FastAPI(title="isiw", version=isiw.__version__, openapi_url=None, routes=router.routes)
        app.state.session, app.state.view = session, self._view
        guarded(app, rules)
        settings = settings_of(app, rules, log_level="critical")  # the screen is the operator's
        self._listener = listening(_ADDRESS, port)
        self.url = f"http://{_ADDRESS}:{self._listener.getsockname()[1]}/#{token}"
        self._server = Server(settings)
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="isiw live page", daemon=True)
        session.follow(self._view)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    async def _serve(self) -> None:
        await self._server.serve([self._listener])
        for connection in tuple(self._server.server_state.connections):  # of viewers that take nothing
            connection.transport.abort()
        await asyncio.sleep(0)

    def close(self) -> None:
        """Show the end to those who still look, and serve no longer."""
        self._view.ended()
        self._server.should_exit = True
        self._thread.join(_LEAVING_S)
        self._listener.close()


def watch(session: Session, *, port: int = 0, config: str | Path | None = None) -> LivePage:
    """Show a session in the browser while it runs: `with isiw.watch(session) as page: print(page.url); session.run()`.

    The page is served to this computer alone, from now until it is closed. Its address holds a token that is good for
    as long. Where the session has no terminal, a pause is decided on the page.

    Args:
        session: a session that does not run yet.
        port: the port; 0 for any that is free.
        config: the configuration that it runs with, for the command that resumes it.

    Raises:
        ConfigError: the libraries of `isiw[serve]` are not installed, or the port is taken.
        InvalidValueError: no port.
    """
    return LivePage(session, whole("port", port, least=0, most=65535), None if config is None else Path(config))
