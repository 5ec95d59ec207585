"""What the live page's server answers, and that nobody who looks on can hold a session up."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

import isiw
from isiw.errors import ConfigError
from isiw.log.writer import LogWriter
from isiw.server.live.page import FILES, file_of
from isiw.server.live.view import Shown, View
from isiw.text.sanitize import plain
from server.live.watched import HOSTILE, Watched
from server.serving import NOBODY, done, refused


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[Watched]:
    with Watched(tmp_path / "s.mcap") as watched:
        yield watched


def test_the_pages_files_need_no_token_as_they_say_nothing_of_the_session(watched: Watched) -> None:
    for path in FILES:
        answer = httpx.get(watched.client.base_url.join(path), verify=NOBODY)
        assert answer.status_code == 200
        assert "P07" not in answer.text
        assert "script-src 'self';" in answer.headers["Content-Security-Policy"]


def test_who_shows_no_token_cannot_ask_without_a_pause(watched: Watched) -> None:
    with httpx.Client(base_url=watched.client.base_url, verify=NOBODY) as stranger:
        for path in ("updates", "live.css", "nothing"):
            begun_s = time.monotonic()
            for _ in range(3):
                stranger.get(path)
            assert time.monotonic() - begun_s > 3 * 0.05


@pytest.mark.slow
def test_a_browser_that_has_a_file_is_not_sent_it_again(watched: Watched) -> None:
    for path in FILES:
        url = watched.client.base_url.join(path)
        tag = httpx.get(url, verify=NOBODY).headers["ETag"]
        again = httpx.get(url, headers={"If-None-Match": tag}, verify=NOBODY)
        assert (again.status_code, again.content) == (304, b"")
        assert httpx.get(url, headers={"If-None-Match": '"another"'}, verify=NOBODY).status_code == 200


def test_a_file_is_made_once_however_often_it_is_asked_for(monkeypatch: pytest.MonkeyPatch, watched: Watched) -> None:
    made: list[str] = []

    def text() -> str:
        made.append("made")
        return "body {}"

    monkeypatch.setitem(FILES, "/live.css", ("text/css", text))
    file_of.cache_clear()
    for _ in range(3):
        assert httpx.get(watched.client.base_url.join("/live.css"), verify=NOBODY).text == "body {}"
    file_of.cache_clear()
    assert made == ["made"]


@pytest.mark.slow
def test_what_is_of_the_session_needs_the_token_and_the_pages_own_origin(watched: Watched) -> None:
    for path in ("updates", "pause", "stop", "exclude", "note", "resume", "include"):
        method = "GET" if path == "updates" else "POST"
        url = watched.client.base_url.join(path)
        refused(httpx.request(method, url, verify=NOBODY), 401, "Unauthorized")
        refused(
            httpx.request(method, url, headers={"Authorization": "Bearer not-the-token"}, verify=NOBODY),
            401,
            "Unauthorized",
        )
        refused(watched.client.request(method, path, headers={"Host": "evil.example"}), 403, "ForeignHost")
        refused(watched.client.request(method, path, headers={"Origin": "http://127.0.0.1:1"}), 403, "ForeignOrigin")


def test_the_page_names_no_stimulus_before_the_session_says_which_it_gives(watched: Watched) -> None:
    for path in ("/", "/live.js", "/draw.js"):
        assert "hammer" not in httpx.get(watched.client.base_url.join(path), verify=NOBODY).text
    watched.start()
    with watched.viewer() as news:
        drawn = next(news)["drawn"]
    assert drawn["dotted"] == "Dotted orange lines: valve command and hit of the hammer."
    assert drawn["isiAxis"] == "ISI after the valve command [ms]"


def test_what_is_shown_is_what_the_log_holds(watched: Watched) -> None:
    watched.start(trials=3)
    with watched.viewer() as news:
        shown = next(state for state in news if "2" in state["drawn"]["beliefs"] and state["left"] == 3)
    record = watched.record
    (belief,) = shown["drawn"]["beliefs"].values()
    assert shown["state"] == "RUNS"
    assert shown["subject"] == plain(HOSTILE)
    assert [trial["isiMs"] for trial in shown["drawn"]["trials"]] == [trial.isi_ms for trial in record.table]
    assert belief["nextMs"] == record.estimates[-1].next_isi_ms
    assert (shown["delivered"], shown["left"], shown["leftS"]) == (3, 3, pytest.approx(15.0))
    sweeps = [trial["sweep"] for trial in shown["drawn"]["trials"]]
    assert [len(waves) for waves in sweeps] == [0, 0, 2]
    assert sweeps[2][1]["values"] == pytest.approx(record.waveforms[2, "emg"].values.tolist(), abs=1e-3)


def test_a_reload_and_a_second_viewer_see_the_same(watched: Watched) -> None:
    watched.start(trials=2)
    for _ in range(2):
        with watched.viewer() as one, watched.viewer() as other:
            seen = [next(viewer) | {"waitS": None} for viewer in (one, other)]  # a wait may begin between the two
            assert seen[0] == seen[1]


def test_the_buttons_are_events_in_the_log(watched: Watched) -> None:
    watched.start(trials=2)
    done(watched.press("note", text="coil moved"))
    done(watched.press("exclude", trial=1))
    done(watched.press("include", trial=1))
    done(watched.press("pause"))
    watched.until(lambda: watched.session.paused)
    refused(watched.press("resume", pause=2), 409, "OtherPause")
    done(watched.press("resume", pause=1))
    watched.until(lambda: watched.session.paused is None)
    done(watched.press("exclude", trial=0))
    done(watched.press("stop"))
    watched.finish()
    assert watched.events == [
        ("note", "coil moved"),
        ("exclusion", "Excluded on the live page."),
        ("inclusion", "Included again by the operator."),
        ("pause", "Paused on the live page."),
        ("pause", "The operator continued."),
        ("exclusion", "Excluded on the live page."),
        ("pause", "Ended on the live page."),
    ]
    assert len(watched.record.table) == 2
    assert not watched.record.estimates[-1].stop


def test_a_paused_session_can_be_ended(watched: Watched) -> None:
    watched.start()
    done(watched.press("pause"))
    watched.until(lambda: watched.session.paused)
    done(watched.press("stop"))
    watched.finish()
    assert watched.events[-1] == ("pause", "Ended on the live page.")


def test_a_pause_is_shown_without_what_terminals_obey(watched: Watched) -> None:
    with watched.viewer() as news:
        watched.start()
        watched.session.pause("The device said \x1b[2J.")
        pause = next(state["pause"] for state in news if state["state"] == "PAUSED")
        assert pause == {"number": 1, "reason": "The device said ."}
        done(watched.press("resume", pause=1))
        watched.until(lambda: watched.session.paused is None)


def test_going_on_after_an_earlier_pause_does_not_answer_a_later_one_for_the_same_reason(watched: Watched) -> None:
    with watched.viewer() as news:
        watched.start()
        done(watched.press("pause"))
        first = next(state["pause"] for state in news if state["state"] == "PAUSED")
        done(watched.press("resume", pause=first["number"]))
        watched.until(lambda: watched.session.paused is None)
        done(watched.press("pause"))
        second = next(state["pause"] for state in news if state["pause"] and state["pause"] != first)
        assert second["reason"] == first["reason"]
        refused(watched.press("resume", pause=first["number"]), 409, "OtherPause")
        assert watched.session.paused == second["reason"]
        done(watched.press("resume", pause=second["number"]))
        watched.until(lambda: watched.session.paused is None)


def test_what_cannot_be_done_is_said(watched: Watched) -> None:
    refused(watched.press("pause"), 409, "NotRunning")
    watched.start()
    refused(watched.press("exclude", trial=7), 422, "InvalidValueError")
    refused(watched.press("resume", pause=1), 409, "OtherPause")
    refused(watched.press("note"), 422, "InvalidValueError")
    watched.finish()
    late: dict[str, dict[str, Any]] = {"pause": {}, "stop": {}, "note": {"text": "late"}, "exclude": {"trial": 0}}
    for button, body in late.items():
        refused(watched.press(button, **body), 409, "NotRunning")


def test_the_end_is_shown_and_ends_the_updates(watched: Watched) -> None:
    with watched.viewer() as news:
        assert next(news)["state"] == "NOT BEGUN"
        watched.start()
        watched.finish()
        *_, last = news
    assert (last["state"], last["over"], last["armed"]) == ("ENDED", True, False)
    assert len(last["drawn"]["trials"]) == 6


def test_a_session_that_has_run_is_not_said_to_have_not_begun_while_its_log_is_closed(
    watched: Watched, monkeypatch: pytest.MonkeyPatch
) -> None:
    phases: list[str] = []
    close = LogWriter.close

    def closing(log: LogWriter) -> None:
        with watched.viewer() as news:
            phases.append(next(state["state"] for state in news if state["state"] != "RUNS"))
        close(log)

    monkeypatch.setattr(LogWriter, "close", closing)
    watched.start()
    watched.finish()
    assert phases == ["ENDED"]


def test_where_nobody_looks_on_and_there_is_no_terminal_a_pause_ends_the_session(watched: Watched) -> None:
    watched.start()
    watched.session.pause("A look at the coil.")
    watched.finish()
    assert watched.events == [("pause", "A look at the coil.")]


@pytest.mark.slow
def test_viewers_that_never_read_or_vanish_do_not_hold_a_session_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(View, "shown", _larger_than_any_buffer)
    with Watched(tmp_path / "s.mcap", trials=20) as watched:
        silent, vanishing = _asking(watched.client), _asking(watched.client)
        watched.start(trials=2)
        vanishing.close()
        watched.finish()
        assert watched.events == []
        with watched.viewer() as news:
            assert next(news)["state"] == "ENDED"
        watched.page.close()
        silent.close()
    assert len(watched.record.table) == 20
    assert capfd.readouterr().err == ""


def test_who_vanishes_while_news_is_put_together_is_written_to_no_more(
    watched: Watched, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    viewers = [_asking(watched.client) for _ in range(2)]

    def shown_to_nobody(view: View) -> Shown:
        shown = _larger_than_any_buffer(view)
        while viewers:
            viewer = viewers.pop()
            viewer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # gone at once
            viewer.close()
        return shown

    monkeypatch.setattr(View, "shown", shown_to_nobody)
    watched.start()
    watched.finish()
    watched.page.close()
    assert capfd.readouterr().err == ""


def _larger_than_any_buffer(view: View, shown: Callable[[View], Shown] = View.shown) -> Shown:
    """What is shown, and so many blanks behind it that who does not read stops whoever sends."""
    state, text = shown(view)
    return Shown(state, text + " " * 5_000_000)


def _asking(client: httpx.Client) -> socket.socket:
    """A connection that asks for updates and takes none."""
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
    connection.connect((client.base_url.host, client.base_url.port or 0))
    head: dict[str, Any] = {"Host": client.base_url.netloc.decode(), **client.headers}
    connection.sendall(
        b"GET /updates HTTP/1.1\r\n" + b"".join(f"{k}: {v}\r\n".encode() for k, v in head.items()) + b"\r\n"
    )
    return connection


def test_a_port_that_is_taken_is_refused(watched: Watched) -> None:
    with pytest.raises(ConfigError, match="cannot listen"):
        isiw.watch(watched.session, port=known_port(watched))


def known_port(watched: Watched) -> int:
    assert watched.client.base_url.port is not None
    return watched.client.base_url.port
