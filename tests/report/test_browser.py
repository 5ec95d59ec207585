"""The pages as a browser shows them; skipped where there is no Chromium.

Pictures of them are kept in the folder that the environment variable ISIW_SCREENSHOTS names; by default it is one of
pytest's.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, ViewportSize

from browsing import IN_CHROMIUM, broken_rules, hard_to_read, screenshots
from isiw.log.record import SessionRecord, read_session
from isiw.priors import Difference
from isiw.report.comparison import save_comparison
from isiw.report.page import save_report
from isiw.session.resuming import open_session
from isiw.sweeps import Channel
from known import known
from report.sessions import HOSTILE, tapped
from scripted import scripted_strategy

SIZE: ViewportSize = {"width": 1000, "height": 900}
pytestmark = [pytest.mark.slow, IN_CHROMIUM, pytest.mark.needs_pictures]


@dataclass
class Opened:
    """A page in a browser, what its console said, and what it asked the network for."""

    page: Page
    said: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def text(self, selector: str) -> str:
        return self.page.locator(selector).inner_text()

    def drawn(self, script: str) -> Any:
        return self.page.evaluate(f"() => {script}")


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> SessionRecord:
    return tapped(tmp_path_factory.mktemp("browser") / "s.mcap")


@pytest.fixture(scope="module")
def path(record: SessionRecord) -> Path:
    return save_report(record, record.path.with_suffix(".html"))


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return screenshots(tmp_path_factory)


@pytest.fixture(scope="module")
def opened(browser: Any, path: Path) -> Iterator[Opened]:
    page = browser.new_page(viewport=SIZE)
    page.set_default_timeout(20_000)
    opened = Opened(page)
    page.on("console", lambda message: opened.said.append(message.text))
    page.on("pageerror", lambda error: opened.said.append(str(error)))
    page.on("request", lambda request: opened.asked.append(request.url))
    page.goto(path.as_uri())
    page.locator("#belief .main-svg").first.wait_for()
    yield opened
    page.close()


@pytest.fixture(autouse=True)
def quiet(opened: Opened) -> Iterator[None]:
    """No test leaves an error in the console or asks the network for anything."""
    yield
    assert opened.said == []
    assert [url for url in opened.asked if not url.startswith(("file:", "data:", "blob:"))] == []


def test_hostile_names_are_text(opened: Opened) -> None:
    assert opened.text("h1") == f"Session of {HOSTILE}"
    assert opened.page.title() == f"Session of {HOSTILE}"
    assert opened.page.locator("main b, main img").count() == 0


def test_no_button_sends_what_is_drawn_to_anybody(opened: Opened) -> None:
    opened.page.locator("#belief").hover()
    assert opened.page.locator(".modebar-btn").count() == 0


def test_the_last_trial_is_shown_first_with_the_logs_numbers(opened: Opened, record: SessionRecord) -> None:
    last, estimate = record.table[-1], record.estimates[-1]
    assert opened.text("#told-trial").startswith(f"Trial {last.index} ({len(record.table)} of {len(record.table)})")
    assert estimate.reason in opened.text("#told-belief")
    shown = opened.drawn("document.getElementById('belief').data.find(trace => trace.name === 'trial')")
    told = {trial.index: trial for trial in record.table.told}
    places = dict(zip(shown["customdata"], shown["x"], strict=True))
    assert {n: places[n] for n, t in told.items() if t.isi_ms is not None} == {
        n: t.isi_ms for n, t in told.items() if t.isi_ms is not None
    }
    beside = [places[n] for n, t in told.items() if t.isi_ms is None]
    assert beside
    assert max(beside) < record.header.space.low_ms
    assert shown["y"] == pytest.approx([1e3 * (trial.mep_mv or 0) for trial in told.values()], abs=0.01)


def test_the_slider_moves_belief_words_and_sweep_by_keyboard(opened: Opened, record: SessionRecord) -> None:
    before = opened.drawn("document.getElementById('belief').data.find(trace => trace.name === 'expected MEP').y")
    opened.page.locator("#trial").focus()
    opened.page.keyboard.press("Home")
    first, estimate = record.table[0], record.estimates[0]
    assert opened.text("#told-trial").startswith(f"Trial {first.index} (1 of {len(record.table)})")
    assert estimate.reason in opened.text("#told-belief")
    after = opened.drawn("document.getElementById('belief').data.find(trace => trace.name === 'expected MEP').y")
    assert after == pytest.approx([1e3 * mv for mv in estimate.profile_mv], abs=0.01)
    assert after != before
    opened.page.keyboard.press("ArrowRight")
    assert opened.text("#sweep-title") == f"The sweep of trial {record.table[1].index}"


def test_what_is_asked_next_is_said_and_marked(opened: Opened, record: SessionRecord) -> None:
    estimate = next(e for e in record.estimates if e.next_isi_ms is not None)
    opened.page.locator(f".choose[data-trial='{estimate.trial}']").click()
    assert opened.text("#told-next") == f"Next ISI: {estimate.next_isi_ms:g} ms, where the score is highest."
    marks = opened.drawn("document.getElementById('belief').layout.shapes.filter(s => s.line.dash === 'dash')")
    assert [shape["x0"] for shape in marks] == [estimate.next_isi_ms]


def test_the_scores_of_the_acquisition_function_are_drawn_with_what_they_chose(
    opened: Opened, record: SessionRecord
) -> None:
    estimate = next(e for e in record.estimates if e.chosen_by == "acquisition")
    opened.page.locator(f".choose[data-trial='{estimate.trial}']").click()
    drawn = "document.getElementById('belief').data.find(trace => trace.name.startsWith('score'))"
    curve = opened.drawn(drawn)
    assert curve["x"] == list(estimate.scored_ms)
    assert curve["y"] == pytest.approx(estimate.scores, abs=0.05)
    assert curve["x"][curve["y"].index(max(curve["y"]))] == pytest.approx(estimate.next_isi_ms, abs=1)
    opened.page.locator(f".choose[data-trial='{record.estimates[-1].trial}']").click()
    assert opened.drawn(f"{drawn} === undefined")


def test_a_click_on_a_trial_shows_its_sweep(opened: Opened, record: SessionRecord) -> None:
    wanted = [trial for trial in record.table.told if trial.isi_ms is not None][1]
    points = "document.getElementById('belief').data.find(trace => trace.name === 'trial').customdata"
    number = opened.drawn(f"{points}.indexOf({wanted.index})")
    trace = opened.drawn("document.getElementById('belief').data.findIndex(trace => trace.name === 'trial')")
    markers = opened.page.locator("#belief .scatterlayer .trace").nth(trace).locator(".point").nth(number)
    markers.scroll_into_view_if_needed()
    box = markers.bounding_box()
    assert box is not None
    opened.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    opened.page.locator("#belief .hovertext").filter(has_text=f"trial {wanted.index}").wait_for()
    opened.page.mouse.down()
    opened.page.mouse.up()
    opened.page.get_by_text(f"The sweep of trial {wanted.index}", exact=True).wait_for()
    emg = opened.drawn("document.getElementById('sweep').data[0]")
    channel = record.waveforms[wanted.index, "emg"]
    first = round((emg["x"][0] + known(wanted.t_tms_ms) - channel.t0_ms) * channel.rate_hz / 1e3)
    assert emg["y"] == pytest.approx(channel.values[first : first + len(emg["y"])].tolist(), abs=1e-3)
    pulses = opened.drawn("document.getElementById('sweep').layout.shapes.filter(s => s.line.dash === 'solid')")
    assert {shape["x0"] for shape in pulses} == {0.0}


def test_a_trial_of_the_table_is_chosen_by_keyboard(opened: Opened, record: SessionRecord) -> None:
    number = record.table[2].index
    opened.page.locator(f".choose[data-trial='{number}']").focus()
    opened.page.keyboard.press("Enter")
    assert opened.text("#sweep-title") == f"The sweep of trial {number}"
    assert opened.page.locator(".choose[aria-pressed='true']").inner_text() == str(number)


def test_everything_that_can_be_used_is_reached_by_tab_and_has_a_name(opened: Opened) -> None:
    named = "a, button, input, summary, [tabindex='0']"
    nameless = opened.drawn(
        f"[...document.querySelectorAll({named!r})].filter(e => !e.closest('.modebar') && !(e.innerText.trim() || "
        "e.getAttribute('aria-label') || (e.labels && e.labels.length))).length"
    )
    assert nameless == 0
    opened.page.locator("nav a").first.focus()
    reached = set()
    for _ in range(40):
        opened.page.keyboard.press("Tab")
        reached.add(opened.drawn("document.activeElement.id || document.activeElement.className"))
    assert {"trial", "before", "after", "choose"} <= reached


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_stand_out_from_the_paper_in_light_and_dark(opened: Opened, scheme: Any) -> None:
    opened.page.emulate_media(media="screen", color_scheme=scheme)
    colours = {
        name: opened.drawn(f"getComputedStyle(document.documentElement).getPropertyValue('--{name}').trim()")
        for name in ("ink", "faint", "blue", "paper", "panel", "warn")
    }
    for words in ("ink", "faint"):
        for ground in ("paper", "panel", "warn"):
            assert contrast(colours[words], colours[ground]) >= 4.5
    assert contrast(colours["blue"], colours["paper"]) >= 4.5


def test_paper_has_the_pictures_and_the_tables_but_nothing_to_move(opened: Opened) -> None:
    opened.page.emulate_media(media="print", color_scheme="dark")
    assert not opened.page.locator("#explore").is_visible()
    assert opened.page.locator("#window svg").first.is_visible()
    assert opened.drawn("document.querySelector('#trials .scroll').scrollHeight") == opened.drawn(
        "document.querySelector('#trials .scroll').clientHeight"
    )
    assert opened.drawn("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    sheets = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", opened.page.pdf(prefer_css_page_size=True))
    assert {(round(float(width)), round(float(height))) for width, height in sheets} == {(595, 842)}
    opened.page.emulate_media(media="screen")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_passes_axe_and_its_picture_is_kept(opened: Opened, scheme: Any, pictures: Path) -> None:
    opened.page.emulate_media(media="screen", color_scheme=scheme)
    opened.page.wait_for_timeout(200)  # plotly redraws when the scheme changes
    assert broken_rules(opened.page) == []
    opened.page.screenshot(path=pictures / f"report-{scheme}.png", full_page=True)
    opened.page.emulate_media(media="screen", color_scheme="light")
    assert (pictures / f"report-{scheme}.png").stat().st_size > 50_000


def test_an_mep_of_50_uv_beside_an_artefact_of_5_mv_has_a_fifth_of_the_axis(
    browser: Any, record: SessionRecord, tmp_path: Path
) -> None:
    last, rate_hz = record.table[-1], 2000.0
    since_ms = np.arange(3000) * 1e3 / rate_hz - known(last.t_tms_ms)
    mep_mv = 0.025 * np.sin((since_ms - 20) * np.pi / 5) * ((since_ms > 20) & (since_ms < 30))
    emg = Channel(mep_mv + 5.0 * ((since_ms > 0) & (since_ms < 1)), rate_hz, "mV")
    shown = replace(record, waveforms={**record.waveforms, (last.index, "emg"): emg})
    page = browser.new_page(viewport=SIZE)
    page.goto(save_report(shown, tmp_path / "s.html").as_uri())
    page.locator("#sweep .main-svg").first.wait_for()
    traces, axis_mv = page.evaluate(
        "() => { const { data, layout } = document.getElementById('sweep'); return [data, layout.yaxis.range]; }"
    )
    assert max(traces[0]["y"]) == pytest.approx(5.0)
    in_window = [y for x, y in zip(traces[0]["x"], traces[0]["y"], strict=True) if 15 < x < 35]
    assert np.ptp(in_window) == pytest.approx(0.05, rel=0.02)
    assert np.ptp(in_window) >= 0.2 * (axis_mv[1] - axis_mv[0])
    assert axis_mv[0] < min(in_window)
    assert max(in_window) < axis_mv[1]
    page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_on_a_narrow_screen_nothing_overflows_and_all_is_legible(
    browser: Any, record: SessionRecord, path: Path, pictures: Path, scheme: Any
) -> None:
    difference = Difference(record, record, same_person=True, starts_later=0.97, ends_later=0.6, moved=0.91)
    compared = save_comparison([record, record], [difference], pictures / "narrow.html", overwrite=True)
    page = browser.new_page(viewport={"width": 400, "height": 900}, color_scheme=scheme)
    for name, shown in (("report", path), ("compared", compared)):
        page.goto(shown.as_uri())
        page.wait_for_timeout(300)  # plotly draws
        assert hard_to_read(page) == []
        assert page.locator(".picture").first.evaluate("it => it.scrollWidth > it.clientWidth")
        assert broken_rules(page) == []
        page.screenshot(path=pictures / f"{name}-narrow-{scheme}.png", full_page=True)
    page.close()


def test_small_letters_and_what_is_too_wide_would_be_found(browser: Any) -> None:
    page = browser.new_page(viewport={"width": 400, "height": 900})
    page.set_content(
        "<main><p style='font-size:10px'>small</p><div style='width:500px'>wide</div>"
        "<p style='width:2em;word-break:break-all'>interval</p></main>"
    )
    assert hard_to_read(page) == ["the page is 508 px wide", "10.0 px: small", "broken: interval"]
    page.close()


def test_the_comparison_names_people_in_its_picture(browser: Any, record: SessionRecord, pictures: Path) -> None:
    named = replace(record, header=record.header.model_copy(update={"subject": "P11"}))
    page = browser.new_page(viewport=SIZE)
    page.goto(save_comparison([named, named], [], pictures / "named.html", overwrite=True).as_uri())
    drawn = page.locator("#windows svg").text_content()
    assert [f"{number}: P11, {record.header.created[:10]}" in drawn for number in (1, 2)] == [True, True]
    page.close()


def test_a_nameless_button_and_faint_words_would_be_found(browser: Any) -> None:
    page = browser.new_page()
    page.set_content("<html lang=en><title>x</title><main><h1>x</h1><button></button><p style='color:#ddd'>faint</p>")
    assert {rule.split(":")[0] for rule in broken_rules(page)} == {"button-name", "color-contrast"}
    page.close()


def test_sessions_beside_each_other_are_a_page_for_everybody(
    browser: Any, record: SessionRecord, pictures: Path
) -> None:
    difference = Difference(record, record, same_person=True, starts_later=0.97, ends_later=0.6, moved=0.91)
    page = browser.new_page(viewport=SIZE)
    opened = Opened(page)
    page.on("console", lambda message: opened.said.append(message.text))
    page.on("request", lambda request: opened.asked.append(request.url))
    page.goto(save_comparison([record, record], [difference], pictures / "compared.html", overwrite=True).as_uri())
    assert HOSTILE in opened.text("h3 >> nth=0")
    assert page.locator("main b, main img, script").count() == 0
    assert page.locator("#windows svg").is_visible()
    moved = "the window moved by more than the usual shift from day to day is 91 % (30 % without data)"
    assert moved in opened.text(".finding >> nth=0")
    assert broken_rules(page) == []
    page.screenshot(path=pictures / "compared.png", full_page=True)
    assert (opened.said, len(opened.asked)) == ([], 1)
    page.close()


def test_after_a_trial_that_others_followed_nothing_is_said_to_have_stopped(browser: Any, tmp_path: Path) -> None:
    with open_session(scripted_strategy(2), tmp_path / "s.mcap") as session:
        for _ in range(2):
            session.tell(session.ask(), 0.05)
        session.tell(None, 0.01)
        session.tell(None, 0.02)
    page = browser.new_page()
    page.goto(save_report(read_session(tmp_path / "s.mcap"), tmp_path / "s.html").as_uri())
    page.locator("#belief .main-svg").first.wait_for()
    next_said = page.locator("#told-next")
    assert next_said.inner_text() == "No ISI came next: the session stopped."
    page.locator("input[type=range]").first.press("ArrowLeft")
    assert next_said.inner_text() == "Next came trial 3: TMS alone."
    page.close()


def test_without_javascript_everything_but_the_moving_part_is_read(browser: Any, path: Path) -> None:
    page = browser.new_context(java_script_enabled=False, viewport=SIZE).new_page()
    page.goto(path.as_uri())
    assert page.locator("#sweeps svg").is_visible()
    assert not page.locator("#explore").is_visible()
    assert "With JavaScript this page also shows" in page.locator("body").inner_text()
    page.context.close()


def contrast(one: str, other: str) -> float:
    """As WCAG defines it."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def luminance(colour: str) -> float:
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), linear, strict=True))
