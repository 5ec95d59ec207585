"""What is wrong with a TOML file is told by file, key and value."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from isiw.errors import ConfigError
from isiw.text.toml_files import checked, read_toml


@dataclass(frozen=True)
class Part:
    name: str


class Law(NamedTuple):
    median: float = 1.0
    sd: float = 1.0


@dataclass(frozen=True)
class Whole:
    parts: tuple[Part, ...]
    people: int = 3
    extra: Part | None = None
    law: Law | None = None


def test_values_become_the_dataclass() -> None:
    assert checked(Whole, {"parts": [{"name": "a"}], "people": 4}, "f.toml") == Whole((Part("a"),), 4)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"parts": [], "peple": 3}, r"f.toml: the key peple is unknown; got 3; .*Did you mean people"),
        ({"parts": [{"nam": "a"}]}, r"the key parts.0.nam is unknown.*Did you mean name"),
        ({"parts": [], "extra": {"nam": "a"}}, r"the key extra.nam is unknown.*Did you mean name"),
        ({"parts": [], "law": {"medan": 2.0}}, r"the key law.medan is unknown.*one of median, sd.*Did you mean median"),
        ({"parts": [], "people": "many"}, r"the value of people cannot be used; got 'many'; expected a whole number"),
        ({"parts": "ab"}, r"the value of parts cannot be used; got 'ab'; expected a list"),
        ({"parts": [7]}, r"the value of parts.0 cannot be used; got 7; expected a table of keys and values"),
        ({"parts": [{"name": 7}]}, r"the value of parts.0.name cannot be used; got 7; expected text"),
        ({"people": 3}, r"the key parts is missing"),
    ],
)
def test_what_is_wrong_is_named(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        checked(Whole, values, "f.toml")


def test_the_mark_that_windows_puts_before_a_text_is_no_error(tmp_path: Path) -> None:
    file = tmp_path / "f.toml"
    file.write_text("people = 4\n", encoding="utf-8-sig")
    assert read_toml(file) == {"people": 4}


def test_a_file_that_is_not_toml_or_not_there_is_named(tmp_path: Path) -> None:
    (tmp_path / "broken.toml").write_text("people = = 3")
    with pytest.raises(ConfigError, match=r"broken\.toml"):
        read_toml(tmp_path / "broken.toml")
    with pytest.raises(ConfigError, match=r"^the TOML file cannot be read: .*Check the path\.$"):
        read_toml(tmp_path / "nowhere.toml")


PARTS = ".".join(f"k{part}" for part in range(97))


@pytest.mark.parametrize(
    "text",
    [
        "x = 0x" + "f" * 5000,
        "x = " + "9" * 5000,
        "[a]\ny = [1, 0b1" + "0" * 300 + "]",
        "".join(f"[a{n}.{PARTS}]\n" for n in range(20_000)),
        ".".join(f'"k {part}"' for part in range(20_000)) + " = 1",
        ".".join("k" * 50 for _ in range(200)) + " = 1",
        "x = " + "[" * 5000,
    ],
    ids=["hexadecimal", "decimal", "binary", "tables", "quoted keys", "keys", "brackets"],
)
def test_what_is_too_large_to_read_is_refused_in_words_at_once(tmp_path: Path, text: str) -> None:
    file = tmp_path / "large.toml"
    file.write_text(text, encoding="utf-8")
    begin_s = time.process_time()
    with pytest.raises(ConfigError, match="is not valid TOML") as refused:
        read_toml(file)
    assert time.process_time() - begin_s < 2
    assert len(str(refused.value)) < 1000


def test_a_value_of_a_megabyte_is_not_repeated_whole(tmp_path: Path) -> None:
    file = tmp_path / "large.toml"
    for text in (f'people = "{"x" * 900_000}"', f"{'x' * 900_000} = 1"):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(ConfigError) as refused:
            checked(Whole, read_toml(file), str(file))
        assert len(str(refused.value)) < 4000
