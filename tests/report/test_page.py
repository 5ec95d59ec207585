from __future__ import annotations

import json
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from isiw.errors import ConfigError, InvalidValueError
from isiw.log.record import SessionRecord, read_session
from isiw.report.page import report_page, save_report
from isiw.report.words import findings
from isiw.session.afterwards import exclude
from isiw.summary import JUDGED_SINCE
from isiw.trials import Trial
from isiw.window import Window
from logs import cut_after, damage
from report.sessions import HOSTILE, Page, pulsed, tapped

LOGS = Path(__file__).parents[1] / "data" / "logs"
OLD_LOGS = [
    "06ce820-default.mcap", "e31d040-killed.mcap.part", "e31d040-nr.mcap", "e31d040-pf.mcap", "e31d040-resumed.mcap",
    "e31d040-waveforms.mcap", "adc1fc6-visit.mcap",
]  # fmt: skip
"""One of each kind: of the first schema, killed, without a posterior, resumed, with waveforms, of the newest schema."""


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> SessionRecord:
    return tapped(tmp_path_factory.mktemp("page") / "s.mcap")


@pytest.fixture(scope="module")
def page(record: SessionRecord) -> Page:
    return Page(report_page(record, truth=Window(30, 90)))


def data_of(page: Page) -> Any:
    return next(json.loads(text) for text in page.of("script") if text.startswith('{"'))


def test_the_page_begins_with_what_was_found_and_answers_the_first_questions(page: Page, record: SessionRecord) -> None:
    assert page.of("h1") == [f"Session of {HOSTILE}"]
    for found in findings(record):
        assert found.text in page.words
    assert page.of("dt") == [
        "Which trials were lost, and why?", "Was the timing right?", "Was the muscle at rest?", "Why did it stop?",
    ]  # fmt: skip
    assert "The budget of 6 stimuli is used up." in page.words


def test_who_when_with_what_and_within_which_limits_stands_on_it(page: Page, record: SessionRecord) -> None:
    for said in ("day 2, operator MK", "simulated tapping robot", "at least 5 s apart", record.header.created[:10]):
        assert said in page.words


def test_a_session_is_compared_with_other_methods_once_enough_was_measured(page: Page, record: SessionRecord) -> None:
    assert "Response counts [Kim2020, 3.3.4]" in page.words
    assert "Threshold of a response" in page.words
    nothing = replace(record, history=tuple(e for e in record.history if not isinstance(e, Trial)))
    assert "Response counts" not in report_page(nothing)


def test_every_trial_has_a_row_and_a_button(page: Page, record: SessionRecord) -> None:
    shown = [value for tag, name, value in page.attributes if (tag, name) == ("button", "data-trial")]
    assert shown == [str(trial.index) for trial in record.table]
    assert all(f"{trial.isi_ms:.1f} ms" in page.of("td") for trial in record.table if trial.isi_ms is not None)


def test_events_and_lost_trials_are_listed_with_their_texts(page: Page) -> None:
    cells = page.of("td")
    assert "The arm was moved. </script><img src='https://elsewhere.example/x.png'>" in cells
    assert "excluded by the operator: cough" in cells


def test_what_a_log_says_is_text_and_nothing_is_fetched(page: Page) -> None:
    assert [value for tag, name, value in page.attributes if name in {"src", "href"} and value[:1] != "#"
            and tag not in {"use", "image"}] == []  # fmt: skip
    assert [tag for tag, *_ in page.attributes if tag in {"img", "iframe", "link", "object"}] == []
    (policy,) = [value for tag, name, value in page.attributes if name == "content" and "default-src" in value]
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe-eval" not in policy


def test_the_numbers_that_are_drawn_are_those_of_the_log(page: Page, record: SessionRecord) -> None:
    shown = data_of(page)
    for trial, of_log in zip(shown["trials"], record.table, strict=True):
        assert (trial["number"], trial["isiMs"], trial["tmsMs"]) == (of_log.index, of_log.isi_ms, of_log.t_tms_ms)
        assert trial["mepUv"] is None or trial["mepUv"] == pytest.approx(1e3 * (of_log.mep_mv or 0), abs=0.01)
    last = record.estimates[-1]
    assert shown["beliefs"][str(last.trial)]["reason"] == last.reason
    assert shown["beliefs"][str(last.trial)]["profile"] == pytest.approx([1e3 * mv for mv in last.profile_mv], abs=0.01)


@pytest.mark.slow
@pytest.mark.needs_pictures
def test_all_pictures_are_there_and_readable_without_javascript(page: Page, record: SessionRecord) -> None:
    whole = report_page(record)
    assert whole.count("<svg xmlns:xlink") == 4
    for words in ("MEP window", "background EMG", "valve command", "P(window)"):
        assert words in whole
    assert "var(--ink)" in whole
    assert ("section", "hidden", "") in page.attributes


@pytest.mark.slow
@pytest.mark.needs_pictures
def test_a_page_about_electrical_pulses_speaks_of_no_tap(page: Page, record: SessionRecord) -> None:
    of_a_tap = re.compile(r"\b(taps?|tapped|hammer|hit|impact|valve)\b")
    assert {"hammer", "valve", "impact"} <= set(of_a_tap.findall(page.words))
    words = Page(report_page(pulsed(record))).words
    assert of_a_tap.findall(words) == []
    for said in (
        "time after the electrical pulse [ms]", "ISI after the electrical pulse [ms]", "electrical pulse alone",
        "Dotted orange line: electrical pulse.", "shows the electrical pulse's own response",
        "0–200 ms after the electrical pulse, every 1 ms",
    ):  # fmt: skip
        assert said in words


def test_lines_in_a_sweep_are_those_of_valve_and_hammer_after_a_tap(page: Page) -> None:
    assert "Dotted orange lines: valve command and hit of the hammer. Green: MEP window" in page.words


def test_a_log_that_is_whole_and_closed_is_shown_without_a_warning(page: Page) -> None:
    assert not [value for _, name, value in page.attributes if name == "class" and value == "warning"]


@pytest.mark.slow
def test_a_damaged_log_says_at_the_top_what_is_lost(tmp_path: Path) -> None:
    tapped(tmp_path / "s.mcap", subject="P07")
    damage(tmp_path / "s.mcap", 4)
    said = Page(report_page(read_session(tmp_path / "s.mcap"))).words
    assert said.index("The log is damaged.") < said.index("Which trials were lost")
    assert "fails its checksum and is lost" in said


def test_a_log_that_was_cut_off_says_that_more_may_have_been_delivered(tmp_path: Path) -> None:
    tapped(tmp_path / "s.mcap", subject="P07")
    cut_after(tmp_path / "s.mcap", 3)
    assert "The log's end is missing: more stimuli may have been delivered" in Page(
        report_page(read_session(tmp_path / "s.mcap"))
    ).words  # fmt: skip


def test_a_log_that_is_not_closed_says_up_to_which_trial_it_is_shown(record: SessionRecord) -> None:
    said = Page(report_page(replace(record, finished=False))).words
    assert f"is running, or was interrupted. It is shown up to trial {record.table[-1].index}." in said


def test_a_verdict_after_the_last_estimate_is_said(tmp_path: Path) -> None:
    tapped(tmp_path / "s.mcap", subject="P07")
    exclude(tmp_path / "s.mcap", 4, "sneezed")
    assert JUDGED_SINCE in Page(report_page(read_session(tmp_path / "s.mcap"))).words


@pytest.mark.slow
@pytest.mark.parametrize("name", OLD_LOGS)
@pytest.mark.needs_pictures
def test_logs_of_every_kind_have_a_page(name: str) -> None:
    record = read_session(LOGS / name)
    page = Page(report_page(record))
    assert findings(record)[0].text in page.words
    assert len(data_of(page)["trials"]) == len(record.table)


def test_a_session_without_a_trial_has_a_page(record: SessionRecord) -> None:
    empty = replace(record, history=(), waveforms={}, finished=False, delivered=0)
    assert "No trial has been completed." in Page(report_page(empty)).words


def test_a_page_replaces_nothing_unasked(record: SessionRecord, tmp_path: Path) -> None:
    (tmp_path / "r.html").write_text("precious")
    with pytest.raises(InvalidValueError, match="not overwritten unasked"):
        save_report(record, tmp_path / "r.html")
    assert (tmp_path / "r.html").read_text() == "precious"
    save_report(record, tmp_path / "r.html", overwrite=True)
    assert (tmp_path / "r.html").stat().st_size > 1_000_000


def test_a_page_is_not_written_into_what_is_no_page(record: SessionRecord, tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match=r"r\.pdf.*in \.html"):
        save_report(record, tmp_path / "r.pdf")
    assert not (tmp_path / "r.pdf").exists()


@pytest.mark.parametrize("library", ["plotly.offline", "jinja2"])
def test_without_its_libraries_the_extra_is_named(
    record: SessionRecord, library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, library, None)
    with pytest.raises(ConfigError, match=r"isiw\[report\]"):
        report_page(record)


@pytest.mark.slow
@pytest.mark.needs_pictures
def test_three_hundred_trials_with_raw_sweeps_take_less_than_15_mb_and_10_s(record: SessionRecord) -> None:
    begin = time.process_time()
    page = report_page(many(record, 300))
    assert time.process_time() - begin < 10
    assert len(page.encode()) < 15e6


def many(record: SessionRecord, trials: int) -> SessionRecord:
    """The same session with its trials again and again, at 5 kHz where it had 2 kHz."""
    told = [trial for trial in record.table if record.sweep(trial.index)]
    history: list[Any] = []
    waveforms = {}
    for number in range(trials):
        source = told[number % len(told)]
        history += [replace(source, index=number), record.estimates[-1].model_copy(update={"trial": number})]
        for name, channel in record.sweep(source.index).items():
            samples = np.tile(channel.values, 3)[: 5 * len(channel.values) // 2]
            waveforms[number, name] = replace(channel, values=samples, rate_hz=5000.0)
    return replace(record, history=tuple(history), waveforms=waveforms)
