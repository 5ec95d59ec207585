"""The MATLAB client, run by GNU Octave against a real server."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest

from isiw.log.record import read_session
from server.serving import TOKEN, client_of

CLIENT = Path(__file__).parents[2] / "clients" / "matlab"
OCTAVE = shutil.which("octave-cli") or ""

pytestmark = pytest.mark.skipif(not OCTAVE, reason="needs GNU Octave (octave-cli)")


def octave(client: httpx.Client, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(  # noqa: S603 - our own script
        [OCTAVE, "--quiet", "--path", str(CLIENT), *arguments],
        env=os.environ | {"ISIW_URL": str(client.base_url), "ISIW_TOKEN": TOKEN},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@contextmanager
def answering(answer: Callable[[], dict[str, Any]]) -> Iterator[httpx.Client]:
    """A client of a server that answers every call so."""

    class Answering(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"]))
            body = json.dumps(answer()).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            """Nothing is shown."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Answering)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{server.server_port}") as client:
            yield client
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@pytest.mark.slow
def test_the_example_of_forty_lines_runs_and_its_log_has_what_the_rig_delivered(tmp_path: Path) -> None:
    script = (CLIENT / "example.m").read_text("utf-8")
    assert len([line for line in script.splitlines() if line.strip()]) <= 40
    with client_of(tmp_path) as client:
        ran = octave(client, str(CLIENT / "example.m"))
    assert ran.returncode == 0, ran.stderr
    rows = [line.split() for line in ran.stdout.splitlines() if line[0].isdecimal()]
    delivered = [(int(trial), float(isi_ms), float(mep_mv)) for trial, isi_ms, mep_mv, hit in rows if hit == "1"]
    record = read_session(tmp_path / "P07.mcap")
    assert [(trial.index, trial.isi_ms, trial.mep_mv) for trial in record.table.told] == delivered
    assert record.table[2].reason == "no impact"
    assert record.finished
    notes = [event.text for event in record.events if event.kind == "note"]
    assert notes == ["coil at 5 mm; a = b & c, 12 µV"]


REFUSED = """
lab = isiw(getenv('ISIW_URL'), 'not the token');
try, lab.create('P07'); catch problem, disp(problem.identifier); end
lab = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
try, lab.resume('P07'); catch problem, disp(problem.identifier); end
try, lab.ask(); catch problem, disp(problem.identifier); end
lab.create('P07', struct('limits', struct('min_iti_s', 0), 'strategy', struct('name', 'nr')));
[trial, isi_ms] = lab.ask();
try, lab.ask(); catch problem, disp(problem.identifier); end
try, lab.tell(trial, isi_ms, NaN); catch problem, disp(problem.message); end
lab.tell(trial, isi_ms, 0.1);
lab.tell(trial, isi_ms, 0.1);
lab.tell(lab.trials, [], 0.02);
lab.tap(40, 0.03);
lab.resume('P07');
disp(lab.trials);
"""

GIVEN = """
lab = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
given = PULSES;
lab.create('P07', struct('limits', struct('min_iti_s', 0), 'strategy', struct('name', 'nr'), 'earlier', given));
lab.alone(1.1, 120);
lab.change('coil re-seated');
lab.alone(0.1);
lab.close();
"""


@pytest.mark.parametrize(
    ("pulses", "before"),
    [
        ("'mep_mv', [0.02 0.9 1.4], 'intensity_pct_rmt', [95 115 130]", [(0.02, 95.0), (0.9, 115.0), (1.4, 130.0)]),
        ("'mep_mv', {{0.9}}, 'intensity_pct_rmt', {{115}}", [(0.9, 115.0)]),
    ],
)
def test_pulses_over_the_curve_are_given_before_and_within_a_session(
    tmp_path: Path, pulses: str, before: list[tuple[float, float]]
) -> None:
    (tmp_path / "given.m").write_text(GIVEN.replace("PULSES", f"struct({pulses})"))
    with client_of(tmp_path / "sessions") as client:
        ran = octave(client, str(tmp_path / "given.m"))
    assert ran.returncode == 0, ran.stderr
    record = read_session(tmp_path / "sessions" / "P07.mcap")
    known = [(trial.mep_mv, trial.intensity_pct_rmt) for trial in (*record.header.earlier, *record.table)]
    assert known == [*before, (1.1, 120.0), (0.1, None)]
    assert [(event.trial, event.text) for event in record.events if event.kind == "change"] == [(0, "coil re-seated")]


NO_NUMBER = """
lab = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
lab.create('P07', struct('limits', struct('min_iti_s', 0), 'strategy', struct('name', 'nr')));
[trial, isi_ms] = lab.ask();
try, lab.tell(trial, '50', 0.1); catch problem, disp(problem.identifier); end
try, lab.tell(trial, [5 0], 0.1); catch problem, disp(problem.identifier); end
try, lab.tell(trial, isi_ms, {0.1}); catch problem, disp(problem.identifier); end
lab.tell(trial, isi_ms, single(0.5));
lab.close();
"""


def test_a_text_or_several_numbers_are_never_joined_to_another_number(tmp_path: Path) -> None:
    (tmp_path / "none.m").write_text(NO_NUMBER)
    with client_of(tmp_path / "sessions") as client:
        ran = octave(client, str(tmp_path / "none.m"))
    assert (ran.returncode, ran.stdout.split()) == (0, ["isiw:NoNumber"] * 3), ran.stderr
    assert [trial.mep_mv for trial in read_session(tmp_path / "sessions" / "P07.mcap").table] == [0.5]


SEVERAL = """
lab = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
settings = struct('intensities_pct_rmt', [90 110], 'particles', 10);
lab.create('P07', struct('visit', struct('intensity_pct_rmt', 90), 'strategy', struct('name', 'even', 'settings', ...
  settings), 'limits', struct('min_iti_s', 0, 'max_intensity_pct_rmt', 110)));
while lab.trials < 3
  [trial, isi_ms, intensity_pct_rmt] = lab.ask();
  try
    lab.tell(trial, isi_ms, 0.1);
  catch problem
    disp(problem.identifier);
  end
  lab.tell(trial, isi_ms, 0.1, false, intensity_pct_rmt);
end
lab.close();
"""


def test_pairs_of_several_intensities_are_told_with_what_was_set(tmp_path: Path) -> None:
    (tmp_path / "several.m").write_text(SEVERAL)
    with client_of(tmp_path / "sessions") as client:
        ran = octave(client, str(tmp_path / "several.m"))
    assert (ran.returncode, ran.stdout.split()) == (0, ["isiw:InvalidValueError"] * 3), ran.stderr
    table = read_session(tmp_path / "sessions" / "P07.mcap").table
    assert [trial.intensity_pct_rmt for trial in table] == [None, 110.0, None]


DOUBTED = """
warning('off', 'isiw:Doubt');
lab = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
lab.create('P07', struct('limits', struct('min_iti_s', 0), 'strategy', struct('name', 'nr')));
while lab.trials < 8
  [trial, isi_ms] = lab.ask();
  try
    lab.tell(trial, 250, 0.1);
  catch problem
    disp(problem.identifier);
    lab.tell(trial, 250, 0.1, true);
  end
end
"""


def test_realised_isis_in_doubt_are_an_error_until_they_are_confirmed(tmp_path: Path) -> None:
    (tmp_path / "doubted.m").write_text(DOUBTED)
    with client_of(tmp_path / "sessions") as client:
        ran = octave(client, str(tmp_path / "doubted.m"))
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.split() == ["isiw:InDoubt"]
    assert len(read_session(tmp_path / "sessions" / "P07.mcap").table.told) == 8


OTHER = """
first = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
second = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
first.create('P07', struct('limits', struct('min_iti_s', 0), 'strategy', struct('name', 'nr')));
[trial, isi_ms] = first.ask();
try, second.resume('P07'); catch problem, disp(problem.identifier); end
second.resume('P07', [], true);
disp(second.trials);
try, first.mistrial(1, 'no impact'); catch problem, disp(problem.identifier); end
try, first.tell(trial, isi_ms, 0.1); catch problem, disp(problem.identifier); end
[trial, isi_ms] = second.ask();
second.tell(trial, isi_ms, 0.1);
try, first.tell(trial, isi_ms, 0.2); catch problem, disp(problem.identifier); end
first = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
try, first.resume('P07'); catch problem, disp(problem.identifier); end
try, second.create('..'); catch, end  % it keeps the session that it has
second.close();
first.resume('P07');
disp(first.trials);
"""


def test_two_objects_are_two_clients_and_one_takes_a_session_over_only_where_it_says_so(tmp_path: Path) -> None:
    (tmp_path / "other.m").write_text(OTHER)
    with client_of(tmp_path / "sessions") as client:
        ran = octave(client, str(tmp_path / "other.m"))
    assert ran.returncode == 0, ran.stderr
    lines = [line.strip() for line in ran.stdout.splitlines()]
    assert lines == [
        "isiw:OtherClient", "1", "isiw:NotAsked", "isiw:Late", "isiw:OtherOutcome", "isiw:OtherClient", "2",
    ]  # fmt: skip
    clients = [event.client for event in read_session(tmp_path / "sessions" / "P07.mcap").events if event.client]
    assert len(set(clients)) == len(clients) == 3


def test_what_is_refused_is_an_error_in_words_and_can_be_put_right(tmp_path: Path) -> None:
    (tmp_path / "refused.m").write_text(REFUSED)
    with client_of(tmp_path / "sessions") as client:
        ran = octave(client, str(tmp_path / "refused.m"))
    assert ran.returncode == 0, ran.stderr
    *kinds, words, trials = ran.stdout.splitlines()
    assert kinds == ["isiw:Unauthorized", "isiw:NoSuchSession", "isiw:NoSession", "isiw:TrialOpen"]
    assert trials.strip() == "3"
    assert "mep_mv" in words


BUSY = """
lab = isiw(getenv('ISIW_URL'), getenv('ISIW_TOKEN'));
try, lab.create('P07'); catch problem, disp(problem.identifier); end
"""


@pytest.mark.parametrize(("kind", "calls"), [("Busy", 10), ("Overloaded", 10), ("TooEarly", 30)])
def test_only_for_a_rest_is_waited_longer_than_ten_answers(tmp_path: Path, kind: str, calls: int) -> None:
    (tmp_path / "busy.m").write_text(BUSY)
    answered = []

    def busy() -> dict[str, Any]:
        answered.append(kind)
        retry_s = 0.01 if len(answered) < 30 else None
        return {"ok": False, "error": {"type": kind, "message": "not now", "retry_s": retry_s}}

    with answering(busy) as client:
        ran = octave(client, str(tmp_path / "busy.m"))
    assert ran.stdout.split() == [f"isiw:{kind}"], ran.stderr
    assert len(answered) == calls
