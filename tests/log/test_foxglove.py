"""The layout for Foxglove names topics and fields that a log has."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from isiw.log.schema import CHANNEL_IDS
from isiw.log.writer import json_schema

LAYOUT: dict[str, Any] = json.loads(
    (Path(__file__).parents[2] / "clients" / "foxglove" / "isiw.json").read_text(encoding="utf-8")
)


def paths(value: Any) -> Iterator[str]:
    """All message paths in a part of the layout."""
    if isinstance(value, dict):
        yield from (path for key, inner in value.items() for path in ([inner] if key == "topicPath" else paths(inner)))
    elif isinstance(value, list):
        yield from (path for inner in value for path in paths(inner))
    elif isinstance(value, str) and value.startswith("/"):
        yield value


def panels(tree: Any) -> list[str]:
    return [tree] if isinstance(tree, str) else [*panels(tree["first"]), *panels(tree["second"])]


@pytest.mark.parametrize("path", sorted(set(paths(LAYOUT["configById"]))))
def test_every_path_is_a_field_of_a_topic_with_its_kind(path: str) -> None:
    matched = re.fullmatch(r"(/\w+)(?:\.(\w+)(\[:\])?)?", path)
    assert matched is not None
    topic, field, every = matched.groups()
    assert topic in CHANNEL_IDS
    if field is not None:
        kind = json.loads(json_schema(topic)[1])["properties"][field]
        assert (kind.get("type") == "array") is bool(every)


def test_panels_that_are_laid_out_are_those_that_are_configured() -> None:
    assert sorted(panels(LAYOUT["layout"])) == sorted(LAYOUT["configById"])


def test_what_is_drawn_over_isis_has_as_many_isis() -> None:
    axes = {
        name: config["xAxisPath"]["value"] for name, config in LAYOUT["configById"].items() if "xAxisPath" in config
    }
    assert axes == {
        "Plot!profile": "/estimate.grid_ms[:]", "Plot!scores": "/estimate.scored_ms[:]", "Plot!trials": "/trial.isi_ms",
    }  # fmt: skip
