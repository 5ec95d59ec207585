"""Pages in headless Chromium, for tests of what they look like and do."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, sync_playwright

__all__ = ["IN_CHROMIUM", "broken_rules", "chromium", "hard_to_read", "screenshots"]

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

IN_CHROMIUM = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium to open the page in")
"""Of a module of such tests, which are slow ones."""


@contextmanager
def chromium() -> Iterator[Any]:
    """The browser."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"], timeout=60_000)
        yield browser
        browser.close()


def screenshots(paths: pytest.TempPathFactory) -> Path:
    """Where pictures of pages are kept: `$ISIW_SCREENSHOTS`, or a folder of the test run."""
    folder = Path(os.environ.get("ISIW_SCREENSHOTS") or paths.mktemp("screenshots"))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def broken_rules(page: Page) -> list[str]:
    """The rules of axe-core that a page breaks, and where."""
    found = Axe().run(page).response["violations"]
    return [f"{rule['id']}: {[node['target'] for node in rule['nodes']][:3]}" for rule in found]


def hard_to_read(page: Page) -> list[str]:
    """What is wider than the page, written in letters of less than 11 px, or broken within a word."""
    found: list[str] = page.evaluate("""() => {
      const faults = [];
      const { scrollWidth, clientWidth } = document.documentElement;
      if (scrollWidth > clientWidth) faults.push(`the page is ${scrollWidth} px wide`);
      const texts = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT);
      for (let text = texts.nextNode(); text; text = texts.nextNode()) {
        const around = text.parentElement;
        if (!text.data.trim() || around.closest("script, .unseen") || !around.checkVisibility()) continue;
        const drawn = around.getScreenCTM?.();
        const letters = parseFloat(getComputedStyle(around).fontSize) * (drawn ? Math.hypot(drawn.a, drawn.b) : 1);
        if (letters < 11) faults.push(`${letters.toFixed(1)} px: ${text.data.trim()}`);
        for (const { 0: word, index } of drawn ? [] : text.data.matchAll(/(?<!\\S)[a-z]+(?![^\\s.,:;])/gi)) {
          const range = document.createRange();
          range.setStart(text, index);
          range.setEnd(text, index + word.length);
          if (new Set([...range.getClientRects()].map((line) => line.top)).size > 1) faults.push(`broken: ${word}`);
        }
      }
      return faults;
    }""")
    return found
