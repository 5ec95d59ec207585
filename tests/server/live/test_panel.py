"""The live page as a panel in a browser: its states, its places, and what pressing does; skipped without Chromium."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st
from matplotlib.image import imread
from playwright.sync_api import Page

from browsing import IN_CHROMIUM, broken_rules, hard_to_read, screenshots
from isiw.errors import InvalidValueError
from isiw.session.pausing import Presses
from isiw.session.rig import Rig
from isiw.session.state import SENTENCES, State
from server.live.staged import FAULT, REASON, UNPROTECTED, Staged, in_state
from server.live.watched import Watched

pytestmark = [pytest.mark.slow, IN_CHROMIUM]

STATES: Final = [state for state in State if state is not State.NOT_BEGUN]
SIZES: Final = {1280: 900, 400: 850}
SIZES_OF_AXE: Final = 1280
FIXED: Final = (
    "#bar",
    "#pause",
    "#resume",
    "#stop",
    "#last",
    "#strip",
    "#background",
    "#left",
    "#coil",
    "#intensity",
    "#next",
)
SEQUENCES: Final = int(os.environ.get("ISIW_BROWSER_SEQUENCES", "6"))
"""How many sequences of presses are drawn in the browser; three hundred take some minutes."""


@pytest.fixture(scope="module")
def news(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a session sends that runs, after eight trials."""
    with Watched(tmp_path_factory.mktemp("panel") / "s.mcap", trials=20, subject="P07") as watched:
        watched.start(trials=8)
        with watched.viewer() as sent:
            return next(one for one in sent if len(one["drawn"]["trials"]) == 8 and one["drawn"]["beliefs"])


@pytest.fixture
def stage(news: dict[str, Any]) -> Iterator[Staged]:
    with Staged(in_state(news, State.RUNS)) as stage:
        yield stage


def opened(browser: Any, stage: Staged, width: int = 1280, scheme: Any = "light") -> Page:
    page: Page = browser.new_page(viewport={"width": width, "height": SIZES[width]}, color_scheme=scheme)
    page.set_default_timeout(20_000)
    page.goto(stage.url)
    word(page, State(stage.news["state"]))
    return page


def word(page: Page, state: State) -> None:
    """Wait until the bar has a word."""
    page.locator(f"#bar[data-state='{state}'] #state").filter(has_text=state).wait_for()


def turned(page: Page, stage: Staged, state: State, *, stays: bool = False) -> None:
    """Let a page that runs come to a state; after a fault and an end it stays connected, if another one comes."""
    if state is State.NO_CONNECTION:
        stage.die()
    else:
        news = in_state(stage.news, state)
        stage.news = news | {"over": False} if stays else news
    word(page, state)


def boxes(page: Page) -> dict[str, Any]:
    page.evaluate("scrollTo(0, 0)")
    return {name: page.locator(name).bounding_box() for name in FIXED}


@pytest.mark.parametrize(("width", "scheme"), list(itertools.product(SIZES, ("light", "dark"))))
def test_each_state_has_its_word_nothing_moves_and_all_are_told_apart_at_two_hundred_pixels(
    browser: Any, stage: Staged, tmp_path_factory: pytest.TempPathFactory, width: int, scheme: str
) -> None:
    page, places, bars = opened(browser, stage, width, scheme), [], []
    page.locator("#sweep .main-svg").first.wait_for()
    for state in STATES:
        turned(page, stage, state, stays=True)
        places.append({name: (box["x"], box["y"]) for name, box in boxes(page).items()})
        assert hard_to_read(page) == []
        if width == SIZES_OF_AXE:
            assert broken_rules(page) == [], state
        file = screenshots(tmp_path_factory) / f"{state}-{width}-{scheme}.png".replace(" ", "-")
        page.screenshot(path=file)
        bars.append(in_small(imread(file)[..., :3]))
    page.close()
    assert [place for place in places if place != places[0]] == []
    for one, other in itertools.combinations(bars, 2):
        assert np.abs(one - other).max(axis=1).mean() > 0.15


def in_small(picture: Any) -> Any:
    """The upper rows of a picture that is scaled to 200 pixels."""
    step = picture.shape[1] / 200
    rows, columns = (np.arange(int(n / step)) * step for n in picture.shape[:2])
    return picture[rows.astype(int)][:, columns.astype(int)][:24].reshape(-1, 3)


def test_buttons_are_large_and_have_places_of_their_own(browser: Any, stage: Staged) -> None:
    page = opened(browser, stage, 400)
    found: list[Any] = [page.locator(f"#{name}").bounding_box() or {} for name in ("pause", "resume", "stop")]
    assert min(min(box["height"], box["width"]) for box in found) >= 44
    assert all(one["x"] + one["width"] <= other["x"] for one, other in itertools.pairwise(found))
    red, green, blue = page.evaluate(
        "getComputedStyle(document.getElementById('stop')).backgroundColor.match(/\\d+/g).map(Number)"
    )
    assert red > 150
    assert max(green, blue) < 60
    page.close()


def test_where_isiw_was_killed_or_is_silent_the_page_says_so_and_its_buttons_are_off(
    browser: Any, news: dict[str, Any]
) -> None:
    for falls_silent in (False, True):
        with Staged(in_state(news, State.RUNS)) as stage:
            page = opened(browser, stage)
            stage.silent = falls_silent
            if not falls_silent:
                stage.die()
            word(page, State.NO_CONNECTION)
            assert page.inner_text("#line") == "Use the stimulator's own switch."
            letters = page.evaluate("parseFloat(getComputedStyle(document.getElementById('line')).fontSize)")
            assert letters >= 28
            assert page.inner_text("#lamp") == "armed: not known"
            for name in ("pause", "resume", "stop"):
                assert page.get_attribute(f"#{name}", "aria-disabled") == "true"
            page.click("#stop", force=True)
            assert stage.pressed == []
            stage.silent = False
            if falls_silent:
                word(page, State.RUNS)
            page.close()


def test_a_fault_is_said_once_its_instruction_first(browser: Any, stage: Staged) -> None:
    page = opened(browser, stage)
    turned(page, stage, State.FAULT)
    said = page.inner_text("#said")
    assert said.index(FAULT["do"]) < said.index(FAULT["what"])
    assert page.inner_text("body").count(FAULT["what"]) == 1
    page.close()


def test_a_pause_says_why_and_rests_and_pulses_are_counted_down(browser: Any, stage: Staged) -> None:
    page = opened(browser, stage)
    assert page.inner_text("#more").startswith("Next pulse in 0:0")
    assert page.inner_text("#lamp") == "ARMED"
    turned(page, stage, State.REST)
    page.locator("#count").filter(has_text="1:11").wait_for()
    page.locator("#count").filter(has_text="1:10").wait_for()
    turned(page, stage, State.PAUSED)
    assert page.inner_text("#line") == REASON
    assert page.inner_text("#lamp") == "not armed"
    page.close()


def test_the_figures_that_an_operator_needs_are_there_or_said_to_be_lacking(
    browser: Any, stage: Staged, news: dict[str, Any]
) -> None:
    page = opened(browser, stage)
    assert page.inner_text("#background") == "3.1 µV"
    assert page.inner_text("#background-more") == "limit 20 µV"
    assert (page.inner_text("#coil"), page.inner_text("#intensity")) == ("31.5 °C", "not reported")
    assert page.inner_text("#left") == str(news["left"])
    assert page.locator("#strip span").count() == 8
    assert page.inner_text("#last") == news["drawn"]["trials"][-1]["outcome"]
    page.locator("#sweep .main-svg").first.wait_for()
    zero = "() => document.getElementById('sweep').layout.shapes.filter(s => s.line.dash === 'solid').map(s => s.x0)"
    assert set(page.evaluate(zero)) == {0}
    against = next(iter(news["drawn"]["beliefs"].values()))["against"]
    assert against
    assert page.locator("#against p").all_inner_texts() == against
    page.close()


@pytest.mark.parametrize("key", ["Enter", "Space"])
def test_a_held_key_on_pause_presses_it_once_and_focus_stays(browser: Any, stage: Staged, key: str) -> None:
    page = opened(browser, stage)
    page.focus("#pause")
    for _ in range(8):
        page.keyboard.down(key)  # the second and all later ones are repeats
    turned(page, stage, State.PAUSED)
    for _ in range(8):
        page.keyboard.down(key)
    page.keyboard.up(key)
    page.wait_for_timeout(200)
    assert stage.pressed in (["pause"], [])  # by Space it would be pressed on letting go, when it is off
    assert page.evaluate("document.activeElement.id") == "pause"
    page.close()


def test_keys_are_those_of_the_terminal(browser: Any, stage: Staged) -> None:
    page = opened(browser, stage)
    for key in ("r", "q", "p", "x"):  # neither r nor q does anything while it runs
        page.keyboard.press(key)
    turned(page, stage, State.PAUSED)
    page.keyboard.press("p")
    page.keyboard.press("r")
    page.fill("#note", "")
    page.locator("#note").press_sequentially("pq", delay=5)
    page.locator("#note").blur()
    page.keyboard.press("q")
    page.wait_for_timeout(200)
    assert stage.pressed == ["pause", "exclude", "resume", "stop"]
    page.close()


def test_the_words_of_the_page_are_those_of_the_table(browser: Any, stage: Staged) -> None:
    page = opened(browser, stage)
    for state in (State.RUNS, State.REST, State.ENDED):
        turned(page, stage, state)
        warned = f" {UNPROTECTED}" if stage.news["armed"] else ""
        assert page.inner_text("#line") == SENTENCES[state] + warned
    page.close()


PRESSES: Final = st.lists(
    st.one_of(
        st.tuples(st.just("hold"), st.sampled_from(("p", "r", "Enter", "Space")), st.integers(2, 6)),
        st.tuples(st.just("click"), st.sampled_from(("#pause", "#resume")), st.integers(1, 2)),
        st.tuples(st.just("reload"), st.just(""), st.just(1)),
    ),
    min_size=1,
    max_size=6,
)


@pytest.mark.needs_a_second
def test_no_sequence_of_presses_in_two_windows_arms_after_pause_without_one_of_its_own(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stagings: list[bool] = []
    stage = Rig.stage

    def noted(rig: Rig) -> None:
        """Whether the last that counted was a press of Continue of its own; the session's begin counts as one."""
        stagings.append(heard[-1] == "a press of its own")
        stage(rig)

    heard, pressed_s = ["a press of its own"], [0.0]
    for name in ("wait", "pause", "go_on"):
        monkeypatch.setattr(Presses, name, _noting(heard, pressed_s, getattr(Presses, name)))
    monkeypatch.setattr(Rig, "stage", noted)
    with Watched(tmp_path / "s.mcap", trials=30, subject="P07") as watched:
        pages = [browser.new_page() for _ in range(2)]
        watched.start(trials=1)
        for page in pages:
            page.set_default_timeout(20_000)
            page.goto(watched.page.url)
            word(page, State.RUNS)

        def continued() -> bool:
            """Continue after a second without a press, of which one may still be on its way, or have continued it."""
            time.sleep(1.05)
            with suppress(InvalidValueError):
                watched.session.go_on()
                return True
            return watched.session.paused is None

        @hypothesis.seed(71)
        @hypothesis.settings(max_examples=SEQUENCES, deadline=None, database=None, phases=[hypothesis.Phase.generate])
        @hypothesis.given(st.lists(st.tuples(st.integers(0, 1), PRESSES), min_size=1, max_size=2))
        def goes(parts: list[tuple[int, list[tuple[str, str, int]]]]) -> None:
            """Pause, press whatever keys, and then continue as it should be."""
            watched.session.pause("A look.")
            watched.until(lambda: watched.session.paused)
            for which, presses in parts:
                for press in presses:
                    _do(pages[which], *press)
            watched.until(continued)
            watched.until(lambda: watched.session.paused is None)

        goes()
        for page in pages:
            page.close()
        assert stagings
        assert [own for own in stagings if not own] == []


def _noting(heard: list[str], pressed_s: list[float], press: Callable[..., Any]) -> Callable[..., Any]:
    """A press that is noted: of Continue only one that counts, and whether it was a second after any other."""

    def noted(presses: Presses, now_s: float, *number: Any) -> Any:
        result = press(presses, now_s, *number)
        if not isinstance(result, tuple):
            heard.append("Pause")
        elif result[1] is None:
            heard.append("a press of its own" if now_s - pressed_s[-1] >= 1.0 else "a repeated one")
        pressed_s.append(now_s)
        return result

    return noted


def _do(page: Page, what: str, where: str, times: int) -> None:
    if what == "reload":
        page.reload()
        return
    for _ in range(times):
        if what == "click":
            page.click(where, force=True)
        else:
            page.keyboard.down(where)
    if what == "hold":
        page.keyboard.up(where)
