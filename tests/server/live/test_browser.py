"""The live page as a browser shows it; skipped where there is no Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page

from browsing import IN_CHROMIUM, broken_rules, hard_to_read, screenshots
from isiw.text.sanitize import plain
from server.live.watched import HOSTILE, Watched

pytestmark = [pytest.mark.slow, IN_CHROMIUM]
TRIALS = 8


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    with Watched(tmp_path_factory.mktemp("live") / "s.mcap", trials=TRIALS) as watched:
        yield watched


@pytest.fixture(scope="module")
def page(browser: Any, watched: Watched) -> Iterator[Page]:
    page = browser.new_page(viewport={"width": 1000, "height": 900})
    page.set_default_timeout(20_000)
    said: list[str] = []
    asked: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(watched.page.url)
    shows(page, "#state", "NOT BEGUN")
    watched.start(trials=3)
    shows(page, "#last-more", "trial 2,")
    yield page
    page.close()
    assert said == []
    own = str(watched.client.base_url)
    assert [url for url in asked if not url.startswith((own, "data:", "blob:"))] == []


def shows(page: Page, selector: str, text: str) -> None:
    """Wait until an element shows a text."""
    page.locator(selector).filter(has_text=text).wait_for()


def begin_trial_3(page: Page, watched: Watched) -> None:
    """Let trial 3 be given where no test before has: workers of pytest share the tests of this module between them."""
    watched.clock.let = 4
    shows(page, "#last-more", "trial 3,")


def drawn(page: Page, script: str) -> Any:
    return page.evaluate(f"() => document.getElementById('belief').{script}")


def test_what_is_drawn_are_the_logs_numbers(page: Page, watched: Watched) -> None:
    page.wait_for_function(
        "() => document.getElementById('belief').data?.find(trace => trace.name === 'trial')?.x.length === 3"
    )
    shows(page, "#next", " ms")
    record = watched.record
    shown = drawn(page, "data.find(trace => trace.name === 'trial')")
    assert dict(zip(shown["customdata"], shown["x"], strict=True)) == {t.index: t.isi_ms for t in record.table}
    assert shown["y"] == pytest.approx([1e3 * (t.mep_mv or 0.0) for t in record.table], abs=0.01)
    estimate = record.estimates[-1]
    marks = drawn(page, "layout.shapes.filter(shape => shape.line.dash === 'dash')")
    assert [mark["x0"] for mark in marks] == [estimate.next_isi_ms]
    assert page.inner_text("#left") == f"{TRIALS - 3}"
    assert estimate.reason in page.inner_text("#reason")
    pulses = page.evaluate(
        "() => document.getElementById('sweep').layout.shapes.filter(s => s.line.dash === 'solid').map(s => s.x0)"
    )
    assert set(pulses) == {0}


def test_hostile_names_and_notes_are_text(page: Page, watched: Watched) -> None:
    assert page.inner_text("#title") == f"Session of {plain(HOSTILE)}"
    page.fill("#note", "<img src=x onerror=alert(1)>")
    page.get_by_label("Note").press("Enter")
    shows(page, "#done", "The note is in the log.")
    shows(page, "#events", "<img src=x onerror=alert(1)>")
    assert page.locator("main b, main img").count() == 0
    assert page.title() == f"RUNS: session of {plain(HOSTILE)}"
    assert watched.events[-1] == ("note", "<img src=x onerror=alert(1)>")


def test_a_new_trial_appears_by_itself(page: Page, watched: Watched) -> None:
    begin_trial_3(page, watched)
    assert page.inner_text("#sweep-title") == "Sweep of trial 3"


def tabbed(page: Page, name: str) -> None:
    """Press Tab until an element has the focus."""
    for _ in range(40):
        if page.evaluate("document.activeElement.id") == name:
            return
        page.keyboard.press("Tab")
    pytest.fail(f"Tab does not come to {name}")


def test_the_session_is_operated_by_keyboard_alone(page: Page, watched: Watched) -> None:
    begin_trial_3(page, watched)
    tabbed(page, "pause")
    page.keyboard.press("Enter")
    shows(page, "#state", "PAUSED")
    assert page.inner_text("#line") == "Paused on the live page."
    assert page.evaluate("document.activeElement.id") == "pause"
    tabbed(page, "exclude")
    page.keyboard.press("Enter")
    shows(page, "#exclude", "Count it again")
    page.keyboard.press("Enter")
    shows(page, "#exclude", "Exclude the last")
    page.locator("#resume").press("Enter")
    shows(page, "#state", "RUNS")
    assert [kind for kind, _ in watched.events[-4:]] == ["pause", "exclusion", "inclusion", "pause"]


def test_the_page_loaded_again_and_a_second_one_show_the_same(page: Page, watched: Watched, browser: Any) -> None:
    begin_trial_3(page, watched)
    page.reload()
    shows(page, "#last-more", "trial 3,")
    second = browser.new_page()
    second.goto(watched.page.url)
    shows(second, "#last-more", "trial 3,")
    assert second.inner_text("#found") == page.inner_text("#found")
    second.close()


def test_without_the_token_nothing_is_shown(watched: Watched, browser: Any) -> None:
    stranger = browser.new_page()
    stranger.goto(str(watched.client.base_url))
    shows(stranger, "#line", "Open that one.")
    assert "P07" not in stranger.inner_text("body")
    assert stranger.get_attribute("#stop", "aria-disabled") == "true"
    stranger.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_passes_axe_and_its_picture_is_kept(
    page: Page, scheme: Any, tmp_path_factory: pytest.TempPathFactory
) -> None:
    page.emulate_media(color_scheme=scheme)
    page.wait_for_timeout(200)  # plotly redraws when the scheme changes
    assert broken_rules(page) == []
    picture = screenshots(tmp_path_factory) / f"live-{scheme}.png"
    page.screenshot(path=picture, full_page=True)
    page.emulate_media(color_scheme="light")
    assert picture.stat().st_size > 50_000


def test_an_operator_has_all_that_matters_on_one_screen(page: Page, tmp_path_factory: pytest.TempPathFactory) -> None:
    page.set_viewport_size({"width": 1280, "height": 900})
    page.locator("#sweep .main-svg").first.wait_for()
    page.evaluate("scrollTo(0, 0)")  # a test before this one on the same worker may have scrolled down
    boxes: dict[str, Any] = {
        name: page.locator(name).bounding_box() or {} for name in ("#bar", "#operate", "#values", "#belief")
    }
    assert {name: box for name, box in boxes.items() if box["y"] < 0 or box["y"] + box["height"] > 900} == {}
    window: Any = boxes["#belief"]
    swept: Any = page.locator("#sweep").bounding_box()
    assert window["y"] == swept["y"]
    assert window["x"] + window["width"] <= swept["x"]
    assert min(window["height"], swept["height"]) > 240
    page.screenshot(path=screenshots(tmp_path_factory) / "live-1280.png")
    page.set_viewport_size({"width": 1000, "height": 900})


def test_on_a_narrow_screen_nothing_overflows_and_all_is_legible(
    page: Page, tmp_path_factory: pytest.TempPathFactory
) -> None:
    page.set_viewport_size({"width": 400, "height": 900})
    page.wait_for_timeout(300)  # plotly redraws
    assert hard_to_read(page) == []
    assert broken_rules(page) == []
    page.screenshot(path=screenshots(tmp_path_factory) / "live-narrow.png", full_page=True)
    page.set_viewport_size({"width": 1000, "height": 900})


def test_stop_ends_the_session_at_once_and_the_end_is_told(page: Page, watched: Watched) -> None:
    page.click("#stop")
    shows(page, "#state", "ENDED")
    assert page.get_attribute("#stop", "aria-disabled") == "true"
    watched.finish()
    assert watched.events[-1] == ("pause", "Ended on the live page.")
