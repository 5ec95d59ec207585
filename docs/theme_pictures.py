"""Gives the SVG pictures of the README a dark scheme, which a browser chooses by itself.

    python docs/theme_pictures.py

Run it after a picture was drawn again; one that has its scheme is left as it is.
"""

from __future__ import annotations

from pathlib import Path

IMAGES = Path(__file__).parent / "images"
PICTURES = ("session.svg", "results.svg")
DARK = {"#ffffff": "#15181b", "#222222": "#e6e8ea", "#000000": "#e6e8ea", "#8a8a8a": "#9ba3aa", "#0072b2": "#2a8ad4"}
"""What a colour of a picture is on a dark ground: paper, ink, faint ink and blue; the others stay."""

RULES = " ".join(
    f'[style*="{part}: {light}"] {{ {part}: {dark} !important }}'
    for light, dark in DARK.items()
    for part in ("fill", "stroke")
)
STYLE = f"<style>@media (prefers-color-scheme: dark) {{ svg {{ fill: {DARK['#000000']} }} {RULES} }}</style>\n"


def main() -> None:
    """Write the scheme behind the opening tag of each picture."""
    for path in (IMAGES / name for name in PICTURES):
        text = path.read_text(encoding="utf-8")
        if STYLE not in text:
            behind = text.index(">", text.index("<svg")) + 1
            path.write_text(f"{text[:behind]}\n{STYLE}{text[behind:].lstrip()}", encoding="utf-8")


if __name__ == "__main__":
    main()
