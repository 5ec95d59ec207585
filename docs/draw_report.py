"""Draws the pictures of a report for its page, with the Chromium that is installed.

    python docs/draw_report.py

writes `docs/images/report.png`, its dark twin `report-dark.png`, and `docs/images/report-trial.png`, of a
session at the simulated tapping robot.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

import isiw

IMAGES = Path(__file__).parent / "images"
SEED = 1
SHOWN = "10"


def report(folder: Path) -> Path:
    """The page of a session of 40 pairs of stimuli with raw sweeps."""
    space = isiw.DesignSpace(0, 320, reference="impact")
    person = isiw.subjects.cohort("recruitment", 1, seed=2)[0].begin(seed=0)
    device = isiw.SimulatedDevice(isiw.Tapper(lambda isi_ms: person.respond(isi_ms, "impact"), seed=SEED))
    strategy = isiw.make_strategy(
        space=space, seed=SEED, max_trials=40, particles=200, stop_width_ms=0.01, stop_expected_f1=1.0
    )
    visit, protocol = isiw.Visit(day=2, operator="MK", muscle="FCR"), isiw.VisitProtocol(iti_s=(5, 8), tms_alone=0.1)
    session = isiw.Session(
        device, strategy, log=folder / "P07.mcap", subject="P07", visit=visit, protocol=protocol,
        on_trial=lambda update: session.exclude(8, "cough") if update.trial.index == 9 else None,
    )  # fmt: skip
    return isiw.report.save_report(isiw.read_session(session.run().log), folder / "P07.html")


def main() -> None:
    """Run the session and take the pictures."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = report(Path(folder))
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1000, "height": 1100})
        page.goto(path.as_uri())
        for scheme, name in (("dark", "report-dark.png"), ("light", "report.png")):
            page.emulate_media(color_scheme=scheme)
            page.screenshot(path=IMAGES / name)
        page.locator(f".choose[data-trial='{SHOWN}']").click()
        page.wait_for_timeout(500)
        page.locator("#explore").screenshot(path=IMAGES / "report-trial.png")
        browser.close()


if __name__ == "__main__":
    main()
