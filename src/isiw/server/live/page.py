"""Serving the live page of one session to this computer, in a thread beside the session's loop."""

from __future__ import annotations

import asyncio
import ipaddress
import threading
from typing import Final, Self

from fastapi import FastAPI

import isiw
from isiw.checks import whole
from isiw.server.app import Server, guarded, listening, new_token, settings_of
from isiw.server.guard import Rules
from isiw.server.live.routes import FILES, URGENT, router
from isiw.server.live.view import View
from isiw.session.loop import Session

_ADDRESS: Final = ipaddress.IPv4Address("127.0.0.1")
_LEAVING_S: Final = 5.0


class LivePage:
    """The live page of a session, served until it is closed; a context manager.

    Args:
        session: the session.
        port: the port; 0 for any that is free.
    """

    def __init__(self, session: Session, port: int) -> None:
        self._view, token = View(session), new_token()
        rules = Rules(token, open_paths=frozenset(FILES), urgent_paths=URGENT)
        app = FastAPI(title="isiw", version=isiw.__version__, docs_url=None, redoc_url=None, openapi_url=None)
        app.state.session, app.state.view = session, self._view
        app.include_router(router)
        guarded(app, rules)
        config = settings_of(app, rules, log_level="critical")  # the screen is the operator's
        self._listener = listening(_ADDRESS, port)
        self.url = f"http://{_ADDRESS}:{self._listener.getsockname()[1]}/#{token}"
        self._server = Server(config)
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


def watch(session: Session, *, port: int = 0) -> LivePage:
    """Show a session in the browser while it runs: `with isiw.watch(session) as page: print(page.url); session.run()`.

    The page is served to this computer alone, from now until it is closed. Its address holds a token that is good for
    as long. Where the session has no terminal, a pause is decided on the page.

    Args:
        session: a session that does not run yet.
        port: the port; 0 for any that is free.

    Raises:
        ConfigError: the libraries of `isiw[serve]` are not installed, or the port is taken.
        InvalidValueError: no port.
    """
    return LivePage(session, whole("port", port, least=0, most=65535))
