"""Draw the rooms of isiw, floor by floor, with the imports between them, as they are in the code.

    python docs/draw_rooms.py

writes `docs/images/rooms.svg`. Needs the test extra. An import that others imply is left out: where `session` imports
`log` and `log` imports `strategy`, an arrow from `session` to `strategy` would say nothing new.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import grimp
from matplotlib import rc_context
from matplotlib.figure import Figure

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "images" / "rooms.svg"


def floors() -> list[list[str]]:
    """The rooms of each floor, from the top, as `lint-imports` checks them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["type"] == "layers")
    return [[room.strip() for room in layer.split("|")] for layer in layers]


def imports(rooms: list[str]) -> dict[str, set[str]]:
    """Which rooms each room imports from."""
    graph = grimp.build_graph("isiw", exclude_type_checking_imports=True)
    found: dict[str, set[str]] = {room: set() for room in rooms}
    for module in graph.modules - {"isiw", "isiw.__main__"}:
        room = module.split(".")[1]
        for imported in graph.find_modules_directly_imported_by(module) - {"isiw"}:
            found[room].add(imported.split(".")[1])
    return {room: others - {room} for room, others in found.items()}


def reach(arrows: dict[str, set[str]], room: str) -> set[str]:
    """All rooms that a room needs, directly or not."""
    direct = arrows[room]
    return direct.union(*(reach(arrows, other) for other in direct))


def essential(arrows: dict[str, set[str]]) -> dict[str, set[str]]:
    """The arrows that no others imply."""
    return {
        room: {end for end in ends if not any(end in reach(arrows, other) for other in ends - {end})}
        for room, ends in arrows.items()
    }


def draw() -> Figure:
    """The picture."""
    rows = floors()
    places = {
        room: ((column + 1) / (len(row) + 1) * 10, (len(rows) - level) * 1.0)
        for level, row in enumerate(rows)
        for column, room in enumerate(row)
    }
    figure = Figure(figsize=(9, 8.5), layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(0, 10), ylim=(0.5, len(rows) + 0.5))
    axes.axis("off")
    for level in range(0, len(rows), 2):
        axes.axhspan(len(rows) - level - 0.5, len(rows) - level + 0.5, color="0.96")
    for room, ends in essential(imports(list(places))).items():
        for end in sorted(ends):
            arrow = {"arrowstyle": "->", "color": "0.55", "shrinkA": 11, "shrinkB": 11}
            axes.annotate("", places[end], places[room], arrowprops=arrow)
    box = {"boxstyle": "round,pad=0.4", "facecolor": "white", "edgecolor": "#0072B2"}
    for room, (x, y) in places.items():
        axes.text(x, y, room, ha="center", va="center", fontsize=10, family="monospace", bbox=box)
    return figure


if __name__ == "__main__":
    with rc_context({"svg.hashsalt": "isiw"}):
        draw().savefig(PICTURE, metadata={"Date": None})
