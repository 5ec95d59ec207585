"""Draws the picture of the prior for the page of the model.

    python docs/draw_prior.py

writes `docs/images/prior.png`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import isiw
from isiw.design import VALVE_SPACE
from isiw.models.particles import ParticleModel

PEOPLE = 200
SEED = 1


def draw_people(model: ParticleModel, windows: Axes, meps: Axes) -> None:
    """Windows of people of the prior by start, and one MEP of each at every tenth ISI."""
    isis_ms = np.arange(0.0, 501.0, 10.0)
    drawn = [model.simulate(VALVE_SPACE, SEED + person, isis_ms) for person in range(PEOPLE)]
    found = sorted((person.window for person in drawn if person.window is not None), key=lambda window: window.start_ms)
    windows.hlines(range(len(found)), [w.start_ms for w in found], [w.end_ms for w in found], color="#0072B2", lw=1)
    for person in drawn:
        meps.semilogy(isis_ms, 1e3 * person.mep_mv, ".", color="black", ms=1, alpha=0.3)
    windows.set(xlim=(0, 500), ylabel=f"people with a window ({len(found)} of {PEOPLE})")
    meps.set(xlim=(0, 500), ylim=(1, 3e4), ylabel="MEP [µV]")


def picture() -> Figure:
    """The prior with the hit delay stated, and with nothing stated."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    rows = figure.subplots(2, 2, sharex=True)
    told = {"hit delay stated: 180 ± 6 ms": {"hit_delay_ms": (180.0, 6.0)}, "nothing stated": {}}
    for (title, settings), (windows, meps) in zip(told.items(), rows, strict=True):
        model = isiw.make_strategy(**settings).model
        if isinstance(model, ParticleModel):
            draw_people(model, windows, meps)
        windows.set_title(title, loc="left")
    for axes in rows[1]:
        axes.set_xlabel("ISI from the valve command [ms]")
    return figure


if __name__ == "__main__":
    picture().savefig(Path(__file__).parent / "images" / "prior.png", dpi=110)
