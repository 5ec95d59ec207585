"""Who is let in: every way in that was tried, and is refused."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import httpx
import pytest

from isiw.errors import InvalidValueError
from isiw.server import Rules
from server.serving import BEARER, PLAN, TOKEN, client_of, created, done, refused


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("guarded") / "sessions"


@pytest.fixture(scope="module")
def client(folder: Path) -> Iterator[httpx.Client]:
    with client_of(folder, most_bytes=2000, body_s=0.3) as client:
        yield client


@pytest.mark.parametrize("given", ["", "Bearer", f"Bearer {TOKEN}x", f"Basic {TOKEN}", "Bearer \u00fc" * 9])
@pytest.mark.parametrize("path", ["/sessions", "/openapi.json", "/nowhere"])
def test_nothing_is_answered_without_the_token(client: httpx.Client, given: str, path: str) -> None:
    headers = {"Authorization": given.encode("latin-1")}
    refused(client.get(path, headers=headers), 401, "Unauthorized")  # type: ignore[arg-type] # bytes are sent as they are


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "127.0.0.1@evil.example", "", "[", "0"])
def test_a_foreign_name_of_the_server_is_refused(client: httpx.Client, host: str) -> None:
    refused(client.get("/sessions", headers={"Host": host}), 403, "ForeignHost")


@pytest.mark.parametrize(
    "origin", ["https://evil.example", "null", "http://127.0.0.1:1", "http://localhost", "file://"]
)
def test_a_page_from_elsewhere_is_refused_and_no_browser_is_told_otherwise(client: httpx.Client, origin: str) -> None:
    response = client.get("/sessions", headers={"Origin": origin})
    refused(response, 403, "ForeignOrigin")
    assert not any(name.startswith("access-control") for name in response.headers)
    refused(client.options("/sessions", headers={"Origin": origin}), 403, "ForeignOrigin")


def test_the_servers_own_page_and_other_names_of_this_computer_are_let_in(client: httpx.Client) -> None:
    port = client.base_url.port
    for name in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]"):
        done(client.get("/sessions", headers={"Host": f"{name}:{port}", "Origin": f"http://{name}:{port}"}))


@pytest.mark.parametrize(
    "name",
    ["../secret", "..", ".", "/etc/passwd", "a/b", "a\\b", "P07.mcap", "P 07", "-P07", "P07\n", "P\x00", "ü", "a" * 65],
)
def test_no_name_of_a_session_leaves_the_folder(client: httpx.Client, folder: Path, name: str) -> None:
    (folder.parent / "secret.mcap").touch()
    refused(client.post("/sessions", json={**PLAN, "id": name}), 422, "InvalidValueError")
    for path in (name, quote(name, safe="")):
        if path.isascii() and path.isprintable() and " " not in path:  # what a client can send
            request = client.build_request("GET", "/")
            request.url = request.url.copy_with(raw_path=f"/sessions/{path}/trials".encode())
            assert client.send(request).status_code in {404, 422}
    assert [path.name for path in folder.parent.iterdir() if path != folder] == ["secret.mcap"]


def test_a_symbolic_link_out_of_the_folder_is_not_followed(client: httpx.Client, folder: Path, tmp_path: Path) -> None:
    created(client, "real")
    done(client.post("/sessions/real/close"))
    target = tmp_path / "target.mcap"
    target.write_bytes((folder / "real.mcap").read_bytes())
    before = target.read_bytes()
    (folder / "link.mcap").symlink_to(target)
    (folder / "dangling.mcap.part").symlink_to(tmp_path / "new.mcap")
    for name in ("link", "dangling"):
        refused(client.get(f"/sessions/{name}/trials"), 403, "SymbolicLink")
        refused(client.post(f"/sessions/{name}/resume"), 403, "SymbolicLink")
        refused(client.post("/sessions", json={**PLAN, "id": name}), 403, "SymbolicLink")
    assert target.read_bytes() == before
    assert not (tmp_path / "new.mcap").exists()


def test_an_oversized_body_is_refused_whether_it_says_so_or_not(client: httpx.Client) -> None:
    refused(client.post("/sessions/x/note", content=b"x" * 2001), 413, "TooLarge")
    pieces = (b"x" * 500 for _ in range(100))
    refused(client.post("/sessions/x/note", content=pieces), 413, "TooLarge")


def test_a_slow_body_is_refused_in_time(client: httpx.Client) -> None:
    with socket.create_connection(("127.0.0.1", client.base_url.port or 0), timeout=5) as connection:
        head = f"POST /sessions HTTP/1.1\r\nHost: localhost\r\nAuthorization: {BEARER['Authorization']}\r\n"
        connection.sendall(f"{head}Content-Length: 100\r\n\r\n{{".encode())
        begun_s = time.monotonic()
        answer = connection.recv(10_000)
        assert answer.startswith(b"HTTP/1.1 408")
        assert time.monotonic() - begun_s < 3
        while connection.recv(10_000):  # until the server hangs up
            pass


def test_a_body_that_is_cut_off_is_not_taken_for_a_whole_one(client: httpx.Client) -> None:
    session = created(client, "cut")
    done(client.post(f"{session}/ask"))
    with socket.create_connection(("127.0.0.1", client.base_url.port or 0), timeout=5) as connection:
        head = f"POST {session}/tell HTTP/1.1\r\nHost: localhost\r\nAuthorization: {BEARER['Authorization']}\r\n"
        form = (
            "Content-Type: application/x-www-form-urlencoded\r\nContent-Length: 29\r\n\r\ntrial=0&isi_ms=60&mep_mv=0.1"
        )
        connection.sendall(f"{head}{form}".encode())  # of 0.12
        connection.shutdown(socket.SHUT_WR)
        while connection.recv(10_000):  # until the server has done with it
            pass
    assert done(client.get(session))["trials"] == 0


def test_a_request_that_is_no_http_is_refused(client: httpx.Client) -> None:
    with socket.create_connection(("127.0.0.1", client.base_url.port or 0), timeout=5) as connection:
        connection.sendall(b"\x00\xff nonsense\r\n\r\n")
        assert connection.recv(1000).startswith(b"HTTP/1.1 400")
    done(client.get("/sessions"))


def test_an_error_comes_with_status_200_where_asked_for(client: httpx.Client) -> None:
    for response in (
        client.get("/sessions/none?errors=200"),
        client.get("/nowhere?errors=200"),
        client.get("/sessions?errors=200", headers={"Authorization": ""}),
        client.post("/sessions?errors=200", json={}),
    ):
        assert (response.status_code, response.json()["ok"]) == (200, False)
        assert response.json()["error"]["status"] in {401, 404, 422}


@pytest.mark.parametrize("token", ["", "short", "ü" * 20, "a" * 20 + "\n"])
def test_a_token_that_could_be_guessed_or_not_be_sent_is_refused(token: str) -> None:
    with pytest.raises(InvalidValueError, match="token"):
        Rules(token)
