"""The live page's own files before a server that sends whatever state a test wants to look at."""

from __future__ import annotations

import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self

from isiw.server.live.page import FILES, file_of
from isiw.session.state import SENTENCES, State

FAULT = {
    "do": "See that the stimulator is disarmed. Then resume with: isiw resume isiw-sessions/P07.mcap session.toml",
    "what": "the device does not answer: USB device vanished. The pulse of trial 7 may have been given, and counts.",
}
UNPROTECTED = "My rig is not protected if isiw dies: what is armed then stays armed. Keep the switch at hand."
REASON = "3 mistrials in a row: no impact. Is the hammer free, and the accelerometer plugged in?"


def in_state(news: dict[str, Any], state: State) -> dict[str, Any]:
    """The news of a session as they are in a state."""
    return news | {
        "state": state,
        "sentence": SENTENCES[state],
        "over": state in {State.FAULT, State.ENDED},
        "armed": state in {State.RUNS, State.REST},
        "pause": {"number": 1, "reason": REASON} if state is State.PAUSED else None,
        "fault": FAULT if state is State.FAULT else None,
        "waitS": {State.RUNS: 4.0, State.REST: 72.0}.get(state),
        "unprotected": UNPROTECTED,
        "backgroundUv": 3.1,
        "limitUv": 20.0,
        "coilC": 31.5,
    }


class Staged:
    """A server that sends some news, is there, and falls silent when it is told to."""

    def __init__(self, news: dict[str, Any]) -> None:
        self.news, self.silent, self.over = news, False, threading.Event()
        self.pressed: list[str] = []
        stage = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.0"

            def do_GET(self) -> None:
                if self.path in FILES:
                    content, kind, headers = file_of(self.path)
                    self._answer(content, kind, headers)
                    return
                self.send_response(200)
                self.send_header("Content-Type", "text/event-stream")
                self.end_headers()
                sent: object = None
                while not stage.over.is_set():
                    if not stage.silent:
                        text = f"data: {json.dumps(stage.news)}" if stage.news is not sent else ": still here"
                        sent = stage.news
                        self.wfile.write(f"{text}\n\n".encode())
                        self.wfile.flush()
                    stage.over.wait(0.1)

            def do_POST(self) -> None:
                stage.pressed.append(self.path.strip("/"))
                self._answer(b'{"ok": true}', "application/json", {})

            def _answer(self, content: bytes, kind: str, headers: dict[str, str]) -> None:
                self.send_response(200)
                for name, value in ({"Content-Type": kind} | headers).items():
                    self.send_header(name, value)
                self.end_headers()
                self.wfile.write(content)

            def log_message(self, *_: object) -> None:
                """Say nothing."""

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self._server.block_on_close = False
        self._server.handle_error = lambda *_: None  # type: ignore[method-assign]  # of a page that was closed
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}/#token"

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.die()

    def die(self) -> None:
        """End at once, as a process that is killed."""
        if not self.over.is_set():
            self.over.set()
            self._server.shutdown()
            self._server.server_close()
