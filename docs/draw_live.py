"""Draws the picture of the live page, with the Chromium that is installed.

    python docs/draw_live.py

writes `docs/images/live.png` and its dark twin `live-dark.png`, of a session at the simulated tapping
robot that is paused after 24 pairs of stimuli.
"""

from __future__ import annotations

import shutil
import tempfile
import threading
from pathlib import Path

from playwright.sync_api import sync_playwright

import isiw

IMAGES = Path(__file__).parent / "images"
SEED = 1
PAUSE_AFTER = 23


def session_of(folder: Path) -> isiw.Session:
    """A session that pauses by itself."""
    space = isiw.DesignSpace(0, 320, reference="impact")
    person = isiw.subjects.cohort("recruitment", 1, seed=2)[0].begin(seed=0)
    device = isiw.SimulatedDevice(isiw.Tapper(lambda isi_ms: person.respond(isi_ms, "impact"), seed=SEED))
    strategy = isiw.make_strategy(
        space=space, seed=SEED, max_trials=40, particles=200, stop_width_ms=0.01, stop_expected_f1=1.0
    )

    def on_trial(update: isiw.session.SessionUpdate) -> None:
        if update.trial.index == PAUSE_AFTER:
            session.pause("Time to look at the coil.")

    session = isiw.Session(device, strategy, log=folder / "P07.mcap", subject="P07", on_trial=on_trial)
    return session


def main() -> None:
    """Run the session and take the picture."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        session = session_of(Path(folder))
        with isiw.watch(session) as page:
            shown = browser.new_page(viewport={"width": 1280, "height": 900})
            shown.goto(page.url)
            shown.get_by_text("NOT BEGUN", exact=True).wait_for()
            runs = threading.Thread(target=session.run)
            runs.start()
            shown.get_by_text("Time to look at the coil.", exact=True).first.wait_for(timeout=120_000)
            shown.get_by_text(f"Sweep of trial {PAUSE_AFTER}").wait_for()
            for scheme, name in (("light", "live.png"), ("dark", "live-dark.png")):
                shown.emulate_media(color_scheme=scheme)
                shown.wait_for_timeout(500)  # plotly redraws
                shown.screenshot(path=IMAGES / name)
            session.end("The picture is taken.")
            runs.join()
        browser.close()


if __name__ == "__main__":
    main()
