"""Connections that never ask anything, ask slowly, or are too many: whoever has the token is answered all the same."""

from __future__ import annotations

import http.client
import json
import socket
import ssl
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import httpx
import pytest

from isiw.server.guard import Connection
from isiw.server.live.page import file_of
from server.live.watched import Watched
from server.serving import BEARER, NOBODY, WITH_OPENSSL, certified, client_of, done, refused, server
from waiting import until

HALF = b"GET /sessions HTTP/1.1\r\nX: "
IN_TIME_S = 1.0


@contextmanager
def held(port: int, number: int, sent: bytes = b"") -> Iterator[list[socket.socket]]:
    """So many connections that have sent no whole request, and stay."""
    with ExitStack() as stack:
        made = []
        for _ in range(number):
            made.append(stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=5)))
            made[-1].sendall(sent)
        yield made


def is_open(connection: socket.socket) -> bool:
    connection.setblocking(False)
    try:
        return connection.recv(10_000) != b""
    except BlockingIOError:
        return True
    except ConnectionError:
        return False


def answer_on(connection: socket.socket) -> tuple[int, dict[str, dict[str, str]]]:
    """The status and the JSON of what is answered before the server hangs up."""
    response = http.client.HTTPResponse(connection)
    response.begin()
    content: dict[str, dict[str, str]] = json.loads(response.read())
    assert connection.recv(1) == b""
    return response.status, content


def port_of(client: httpx.Client) -> int:
    return client.base_url.port or 0


@pytest.mark.parametrize("sent", [b"", HALF], ids=["idle", "half"])
def test_connections_without_the_token_keep_nobody_out_who_has_it(tmp_path: Path, sent: bytes) -> None:
    with client_of(tmp_path, head_s=60.0) as client, held(port_of(client), 205, sent):  # the client waits 30 s
        done(client.get("/sessions"))


@pytest.mark.parametrize("sent", [b"", HALF], ids=["idle", "half"])
def test_of_too_many_strangers_the_oldest_is_closed_for_a_new_one(
    tmp_path: Path, sent: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(socket, "TCP_DEFER_ACCEPT", raising=False)  # the idle ones, too, are let in at once
    with client_of(tmp_path, most_strangers=3) as client, held(port_of(client), 5, sent) as strangers:
        until(lambda: not is_open(strangers[1]))
        assert [is_open(one) for one in strangers] == [False, False, True, True, True]


def test_headers_that_do_not_arrive_in_time_are_answered_so_and_the_connection_is_closed(tmp_path: Path) -> None:
    with client_of(tmp_path, head_s=0.3) as client, held(port_of(client), 1, HALF) as (slow,):
        for letter in b"slow":
            time.sleep(0.05)
            slow.sendall(bytes([letter]))
        status, content = answer_on(slow)
        assert (status, content["error"]["type"]) == (408, "TooSlow")


def test_the_second_request_of_a_connection_has_as_long_for_its_headers(tmp_path: Path) -> None:
    with client_of(tmp_path, head_s=0.3) as client, held(port_of(client), 1) as (slow,):
        head = f"GET /sessions HTTP/1.1\r\nHost: localhost\r\nAuthorization: {BEARER['Authorization']}\r\n\r\n"
        slow.sendall(head.encode())
        answer = b""
        while not answer.endswith(b"}"):
            answer += slow.recv(10_000)
        slow.sendall(HALF)
        assert answer_on(slow)[0] == 408


def test_a_body_that_is_not_wanted_does_not_hold_a_connection(tmp_path: Path) -> None:
    with client_of(tmp_path, head_s=0.3) as client, held(port_of(client), 1) as (slow,):
        slow.sendall(b"POST /sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\n{")
        assert slow.recv(10_000).startswith(b"HTTP/1.1 401"), "the token is asked for before the body is read"
        begun_s = time.monotonic()
        with suppress(ConnectionError):  # once the server hangs up
            while time.monotonic() - begun_s < 5:
                slow.sendall(b" ")
                time.sleep(0.05)
        assert time.monotonic() - begun_s < 2


def test_too_many_connections_with_the_token_are_told_so_in_json(tmp_path: Path) -> None:
    with client_of(tmp_path, most_known=2) as client:
        others = [
            httpx.Client(base_url=client.base_url, headers=BEARER, verify=NOBODY, timeout=120.0) for _ in range(3)
        ]
        with ExitStack() as stack:
            for other in others:
                stack.enter_context(other)
            for other in others[:2]:
                done(other.get("/sessions"))
            error = refused(others[2].get("/sessions"), 503, "Overloaded")
            assert error["retry_s"] == 1.0
            answer = others[2].get("/sessions?errors=200")
            assert (answer.status_code, answer.json()["error"]["status"]) == (200, 503)
            done(others[0].get("/sessions"))
            others[1].close()
            time.sleep(0.1)
            done(others[2].get("/sessions"))


def test_half_open_connections_do_not_keep_the_stop_button_from_stopping(tmp_path: Path) -> None:
    with Watched(tmp_path / "s.mcap") as watched, held(port_of(watched.client), 210, HALF):
        watched.start()
        begun_s = time.monotonic()
        for button in ("pause", "stop"):
            done(watched.press(button))
        assert time.monotonic() - begun_s < IN_TIME_S
        watched.until(lambda: not watched.session.running)


def test_a_page_with_too_many_viewers_still_pauses_and_stops(tmp_path: Path) -> None:
    with Watched(tmp_path / "s.mcap") as watched, ExitStack() as stack:
        token, port = watched.client.headers["Authorization"], port_of(watched.client)
        look = f"GET /updates HTTP/1.1\r\nHost: localhost\r\nAuthorization: {token}\r\n\r\n".encode()
        viewers = stack.enter_context(held(port, 95, look)) + stack.enter_context(held(port, 15, look))
        watched.start()
        refusals = [viewer for viewer in viewers if viewer.recv(30).startswith(b"HTTP/1.1 503")]
        assert len(refusals) == 10
        refused(watched.client.post("/note", json={"text": "too many"}), 503, "Overloaded")
        for button in ("pause", "stop"):
            answer = watched.press(button)
            done(answer)
            assert answer.headers["Connection"] == "close"  # so that the next button opens one of its own
        watched.until(lambda: not watched.session.running)


@pytest.mark.slow
def test_calls_that_wait_keep_neither_pause_nor_stop_waiting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written = threading.Event()
    with Watched(tmp_path / "s.mcap") as watched, ExitStack() as stack:
        stack.callback(written.set)
        watched.start()
        monkeypatch.setattr(watched.session, "note", lambda *_, **__: written.wait(20))
        for _ in range(50):  # more than there are threads for such calls
            thread = threading.Thread(target=watched.press, args=("note",), kwargs={"text": "slow"})
            thread.start()
            stack.callback(thread.join)
        time.sleep(0.5)
        begun_s = time.monotonic()
        for button in ("pause", "stop"):
            token = {"Authorization": watched.client.headers["Authorization"]}
            done(httpx.post(watched.client.base_url.join(f"/{button}"), headers=token, verify=NOBODY))
        assert time.monotonic() - begun_s < IN_TIME_S
        written.set()


def test_who_reads_nothing_is_not_sent_a_whole_file_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(file_of("/plotly.js")[0]) > 2**21
    connections, pause_writing = list[Connection](), Connection.pause_writing

    def noted(connection: Connection) -> None:
        connections.append(connection)
        pause_writing(connection)

    monkeypatch.setattr(Connection, "pause_writing", noted)
    with Watched(tmp_path / "s.mcap") as watched, held(port_of(watched.client), 1) as (idle,):
        idle.sendall(b"GET /plotly.js HTTP/1.1\r\nHost: localhost\r\n\r\n")
        until(lambda: bool(connections))
        assert connections[0].transport.get_write_buffer_size() <= 2**17


@pytest.mark.slow
@WITH_OPENSSL
def test_handshakes_that_are_never_finished_keep_nobody_out(tmp_path: Path) -> None:
    certificate, key = certified(tmp_path)
    options = ("--certificate", str(certificate), "--key", str(key))
    with server(tmp_path / "logs", *options) as (_, url), ExitStack() as stack:
        port = httpx.URL(url).port or 0
        hello = b"\x16\x03\x01\x02\x00\x01\x00"  # of 512 bytes that never come
        strangers = stack.enter_context(held(port, 205, hello))
        context = ssl.create_default_context(cafile=str(certificate))
        with httpx.Client(base_url=url, headers=BEARER, verify=context, timeout=120.0) as client:
            begun_s = time.monotonic()
            done(client.get("/sessions"))
            assert time.monotonic() - begun_s < IN_TIME_S
        assert sum(is_open(one) for one in strangers) <= 100
        time.sleep(6)
        assert sum(is_open(one) for one in strangers) == 0
