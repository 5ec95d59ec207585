"""JSON with a key twice is refused."""

from __future__ import annotations

import pytest

from isiw.text.parsing import read_json, refuse_doubled


@pytest.mark.parametrize("text", ['{"a": 1, "a": 1}', '[{"x": {"b": [1, 2], "b": [1]}}]', '{"a\\u0062": 1, "ab": 2}'])
def test_a_key_that_is_there_twice_is_refused_wherever_it_is(text: str) -> None:
    for read in (read_json, lambda given: refuse_doubled(given.encode())):
        with pytest.raises(ValueError, match="is there twice"):
            read(text)


@pytest.mark.parametrize(
    "text", ['{"a": {"b": 1}, "b": [1, 2, 3]}', '{"x:[1]": 1, "x:[2]": 2}', '{"a": ["b", "b"]}', "[]"]
)
def test_any_other_is_read(text: str) -> None:
    refuse_doubled(text.encode())
    assert read_json(text) is not None


def test_what_is_nested_without_end_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="nested"):
        read_json("[" * 100_000)
