"""Draw how isiw, a lab's software and its hardware are connected, one picture a way.

    python docs/draw_wiring.py

writes `docs/images/wiring_*.svg`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

IMAGES = Path(__file__).parent / "images"

MESSAGE, ELECTRICAL = "#0072B2", "#D55E00"

PLACES = {
    "isiw": (1.0, 2.0),
    "software": (4.4, 2.0),
    "timer": (7.8, 2.0),
    "tap": (11.0, 2.7),
    "stimulator": (11.0, 1.3),
    "amplifier": (7.8, 0.3),
    "interlock": (11.0, 0.3),
}

HARDWARE = {
    "tap": "valve, tap",
    "stimulator": "stimulator",
    "amplifier": "amplifier: EMG, trigger",
    "interlock": "interlock",
}

WIRES = (("timer", "tap"), ("timer", "stimulator"), ("stimulator", "amplifier"), ("interlock", "stimulator"))

SHIFT = 0.12


@dataclass(frozen=True)
class Wiring:
    """What differs from one way to another.

    Args:
        software: what stands between isiw and the timer; empty where nothing does.
        asked: what isiw sends.
        answered: what comes back.
        timer: what times the ISI.
        recorded: where the amplifier's samples go, "software" or "isiw".
    """

    software: str
    asked: str
    answered: str
    timer: str
    recorded: str


PICTURES: Mapping[str, Wiring] = {
    "callback": Wiring("your functions\n(same Python)", "fire(stimulus)", "Sweep", "DAQ counters", "software"),
    "line": Wiring("", "set ISI, fire", "read back", "pulse generator or\nmicrocontroller", "isiw"),
    "lsl": Wiring("software at\nthe stimulator", "marker", "echo", "stimulator delay\nor DAQ counters", "isiw"),
    "folder": Wiring("Signal, LabVIEW,\nMATLAB …", "request.txt", "answer file", "sequencer", "software"),
    "server": Wiring("your loop: MATLAB,\nLabVIEW, C# …", "ISI", "ask, tell (HTTP)", "your timer", "software"),
}


class Drawing:
    """Parts in their places, with messages and wires between them."""

    def __init__(self) -> None:
        self.figure = Figure(figsize=(9, 2.9), layout="constrained")
        self.axes = self.figure.subplots()
        self.axes.set(xlim=(0, 12.2), ylim=(-0.2, 3.2))
        self.axes.axis("off")
        self.boxes: dict[str, FancyBboxPatch] = {}

    def box(self, place: str, text: str, colour: str) -> None:
        """A part."""
        style = {"boxstyle": "round,pad=0.6", "facecolor": "white", "edgecolor": colour}
        drawn = self.axes.text(*PLACES[place], text, ha="center", va="center", fontsize=9, bbox=style)
        self.figure.draw_without_rendering()  # so that arrows know where it ends
        self.boxes[place] = cast("FancyBboxPatch", drawn.get_bbox_patch())

    def arrow(self, start: str, end: str, colour: str, label: str = "", shift: float = 0.0) -> None:
        """A message or a wire; moved up or down so that two can be side by side."""
        (x0, y0), (x1, y1) = PLACES[start], PLACES[end]
        style = {"arrowstyle": "->", "color": colour, "linestyle": "--" if colour == MESSAGE else "-"}
        ends = {"patchA": self.boxes[start], "patchB": self.boxes[end], "shrinkA": 2, "shrinkB": 2}
        self.axes.annotate("", (x1, y1 + shift), (x0, y0 + shift), arrowprops=style | ends)
        above = shift >= 0
        place = (x0 + x1) / 2, (y0 + y1) / 2 + shift + (0.05 if above else -0.05)
        self.axes.text(*place, label, ha="center", va="bottom" if above else "top", fontsize=8)


def draw(wiring: Wiring) -> Figure:
    """The picture of one way."""
    drawing, near = Drawing(), "software" if wiring.software else "timer"
    drawing.box("isiw", "isiw\n(Python)", MESSAGE)
    if wiring.software:
        drawing.box("software", wiring.software, MESSAGE)
    drawing.box("timer", f"{wiring.timer}\n(times the ISI)", ELECTRICAL)
    for place, text in HARDWARE.items():
        drawing.box(place, text, ELECTRICAL)
    drawing.arrow("isiw", near, MESSAGE, wiring.asked, SHIFT)
    drawing.arrow(near, "isiw", MESSAGE, wiring.answered, -SHIFT)
    if wiring.software:
        drawing.arrow("software", "timer", MESSAGE, "ISI, armed", SHIFT)
        drawing.arrow("timer", "software", MESSAGE, "read back", -SHIFT)
    for start, end in WIRES:
        drawing.arrow(start, end, ELECTRICAL)
    drawing.arrow("amplifier", wiring.recorded, MESSAGE)
    return drawing.figure


if __name__ == "__main__":
    with rc_context({"svg.hashsalt": "isiw"}):
        for name, wiring in PICTURES.items():
            draw(wiring).savefig(IMAGES / f"wiring_{name}.svg", metadata={"Date": None})
