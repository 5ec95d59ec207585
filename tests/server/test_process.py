"""A server in a process of its own: the command, progress as it happens, and what a kill leaves."""

from __future__ import annotations

import json
import signal
import ssl
import subprocess
import sys
import threading
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

from isiw.cli import app
from isiw.errors import ConfigError, InvalidValueError
from isiw.log.record import read_session
from isiw.server import ServerSettings
from server.serving import (
    BEARER,
    NOBODY,
    SEVERAL,
    WITH_OPENSSL,
    certified,
    client_of,
    created,
    done,
    refused,
    server,
    told,
)


def client_at(url: str) -> httpx.Client:
    return httpx.Client(base_url=url, headers=BEARER, verify=NOBODY, timeout=120.0)


@pytest.mark.slow
def test_a_killed_server_loses_nothing_and_a_new_one_resumes_by_the_id(tmp_path: Path) -> None:
    with server(tmp_path) as (process, url), client_at(url) as client:
        session = created(client)
        asked = told(client, session, 3)
        open_trial = done(client.post(f"{session}/ask"))
        process.kill()
        process.wait()
        with pytest.raises(httpx.TransportError):
            client.get(session)
    with client_of(tmp_path) as client:
        assert done(client.get(session))["open_trial"] == 3
        assert done(client.post(f"{session}/resume"))["trials"] == 4
        repeated = {"trial": 0, "isi_ms": asked[0], "mep_mv": 0.01 + asked[0] / 1e4}
        assert done(client.post(f"{session}/tell", json=repeated))["status"] == "accepted"
        late = {"trial": 3, "isi_ms": open_trial["isi_ms"], "mep_mv": 0.1}
        refused(client.post(f"{session}/tell", json=late), 409, "Late")
        told(client, session, 1)
    record = read_session(tmp_path / "P07.mcap")
    assert [trial.reason for trial in record.table] == [None, None, None, "outcome unknown", None]
    assert "came too late" in record.events[-1].text


@pytest.mark.slow
def test_a_session_of_several_intensities_goes_on_after_a_kill_with_the_one_whose_turn_it_is(tmp_path: Path) -> None:
    def tell_one() -> float:
        asked = done(client.post(f"{session}/ask"))
        outcome = {name: asked[name] for name in ("trial", "isi_ms", "intensity_pct_rmt")} | {"mep_mv": 0.1}
        done(client.post(f"{session}/tell", json=outcome))
        set_pct_rmt: float = asked["intensity_pct_rmt"]
        return set_pct_rmt

    with server(tmp_path) as (process, url), client_at(url) as client:
        session = created(client, **SEVERAL)
        before = [tell_one() for _ in range(3)]
        open_trial = done(client.post(f"{session}/ask"))
        process.kill()
        process.wait()
    with client_of(tmp_path) as client:
        stands = done(client.get(session))
        assert (stands["open_trial"], stands["open_intensity_pct_rmt"]) == (3, open_trial["intensity_pct_rmt"])
        done(client.post(f"{session}/resume"))
        after = [tell_one() for _ in range(2)]
    assert [*before, open_trial["intensity_pct_rmt"], *after] == [90.0, 110.0, 90.0, 110.0, 110.0, 90.0]
    record = read_session(tmp_path / "P07.mcap")
    assert [trial.intensity_pct_rmt for trial in record.table] == [None, 110.0, None, 110.0, 110.0, None]


@pytest.mark.slow
def test_a_session_whose_server_was_killed_can_be_closed_at_once_and_its_log_is_finished(tmp_path: Path) -> None:
    with server(tmp_path) as (process, url), client_at(url) as client:
        session = created(client)
        told(client, session, 2)
        done(client.post(f"{session}/ask"))
        process.kill()
        process.wait()
    with client_of(tmp_path) as client:
        for _ in range(2):
            closed = done(client.post(f"{session}/close"))
            assert (closed["open"], closed["trials"], closed["open_trial"]) == (False, 3, None)
    record = read_session(tmp_path / "P07.mcap")
    assert record.finished
    assert [trial.reason for trial in record.table] == [None, None, "outcome unknown"]
    assert not (tmp_path / "P07.mcap.part").exists()


@pytest.mark.slow
def test_a_server_that_is_told_to_end_closes_its_logs(tmp_path: Path) -> None:
    with server(tmp_path) as (process, url), client_at(url) as client:
        told(client, created(client), 2)
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=20)
    assert read_session(tmp_path / "P07.mcap").finished


def test_progress_is_told_as_it_happens_and_goes_on_from_where_a_client_left(tmp_path: Path) -> None:
    with client_of(tmp_path) as client:
        session = created(client)
        seen: list[str] = []
        follows = threading.Event()

        def follow() -> None:
            with client_at(str(client.base_url)) as follower, follower.stream("GET", f"{session}/progress") as stream:
                follows.set()
                seen.extend(line for line in stream.iter_lines() if line)

        thread = threading.Thread(target=follow)
        thread.start()
        assert follows.wait(timeout=10)
        asked = told(client, session, 2)
        done(client.post(f"{session}/exclude", json={"trial": 0}))
        done(client.post(f"{session}/close"))
        thread.join(timeout=10)
        assert not thread.is_alive()
        data = [json.loads(line.removeprefix("data: ")) for line in seen if line.startswith("data: ")]
        assert [trial["isi_ms"] for trial in data[:-1]] == asked
        assert "event: closed" in seen
        refused(client.get(f"{session}/progress"), 409, "NotOpen")
        done(client.post(f"{session}/resume"))
        with client.stream("GET", f"{session}/progress", headers={"Last-Event-ID": "0"}) as stream:
            assert next(line for line in stream.iter_lines() if line.startswith("id:")) == "id: 1"


def test_sessions_are_driven_side_by_side(tmp_path: Path) -> None:
    with client_of(tmp_path) as client:
        names = [created(client, name) for name in ("A", "B", "C")]
        threads = [threading.Thread(target=told, args=(client, name, 4)) for name in names]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    tables = [read_session(tmp_path / f"{name}.mcap").table for name in "ABC"]
    assert [[trial.isi_ms for trial in table] for table in tables] == [[trial.isi_ms for trial in tables[0]]] * 3
    assert len(tables[0]) == 4


def test_two_servers_never_write_to_one_log(tmp_path: Path) -> None:
    with client_of(tmp_path) as first, client_of(tmp_path) as second:
        session = created(first)
        told(first, session, 1)
        refused(second.post(f"{session}/resume"), 409, "LogError")
        told(first, session, 1)


def test_others_may_ask_only_with_tls(tmp_path: Path) -> None:
    for host in ("0.0.0.0", "::", "192.0.2.1"):  # noqa: S104 - that it is refused
        with pytest.raises(ConfigError, match="only with TLS"):
            ServerSettings(tmp_path, host)
    with pytest.raises(ConfigError, match="belong together"):
        ServerSettings(tmp_path, certificate=tmp_path / "c.pem")
    with pytest.raises(ConfigError, match="not an IP address"):
        ServerSettings(tmp_path, "lab.example")
    with pytest.raises(InvalidValueError, match="port"):
        ServerSettings(tmp_path, port=70_000)
    assert len({ServerSettings(tmp_path).token for _ in range(3)}) == 3


@WITH_OPENSSL
@pytest.mark.parametrize("wrong", ["certificate", "key", "another's key"])
def test_a_certificate_or_key_that_is_none_is_refused_in_words(tmp_path: Path, wrong: str) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "text.pem").write_text("no certificate")
    certificate, key = certified(tmp_path)
    if wrong == "certificate":
        certificate = tmp_path / "text.pem"
    else:
        key = tmp_path / "text.pem" if wrong == "key" else certified(tmp_path / "other")[1]
    with pytest.raises(ConfigError, match="the certificate and its key cannot be used"):
        ServerSettings(tmp_path, certificate=certificate, key=key).tls()


@pytest.mark.slow
@WITH_OPENSSL
def test_with_a_certificate_it_is_served_by_tls_alone(tmp_path: Path) -> None:
    certificate, key = certified(tmp_path)
    with server(tmp_path / "logs", "--certificate", str(certificate), "--key", str(key)) as (_, url):
        assert url.startswith("https://")
        context = ssl.create_default_context(cafile=str(certificate))
        with httpx.Client(base_url=url, headers=BEARER, verify=context, timeout=120.0) as client:
            told(client, created(client), 1)
        with pytest.raises(httpx.TransportError):
            httpx.get(url.replace("https", "http"))


def test_the_command_says_what_is_wrong(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ISIW_TOKEN", "short")
    result = CliRunner().invoke(app, ["serve", str(tmp_path)])
    assert (result.exit_code, "the token cannot be used" in result.output) == (1, True)
    result = CliRunner().invoke(app, ["serve", str(tmp_path), "--host", "0.0.0.0", "--token-file", __file__])  # noqa: S104
    assert (result.exit_code, "only with TLS" in result.output) == (1, True)


def test_the_command_says_that_it_starts_and_when_it_is_ready(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("isiw.server.serve", lambda _, ready: ready("http://127.0.0.1:8473"))
    result = CliRunner().invoke(app, ["serve", str(tmp_path)])
    assert result.stderr == "isiw serve starts …\n"
    assert result.stdout.startswith("Ready: isiw serves the sessions of")


def test_without_its_libraries_the_server_says_which_extra_to_install() -> None:
    script = (
        "import importlib.util as u; find = u.find_spec\n"
        "u.find_spec = lambda name, *more: None if name == 'fastapi' else find(name, *more)\n"
        "import isiw\n"
        "try: isiw.server\n"
        "except isiw.errors.ConfigError as error: print(error)"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)  # noqa: S603
    assert 'pip install "isiw[serve]"' in ran.stdout
