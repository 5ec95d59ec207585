from __future__ import annotations

import numpy as np
import pytest

from isiw.text.sanitize import shown


class Unprintable:
    def __repr__(self) -> str:
        raise ZeroDivisionError


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "None"),
        (0.12, "0.12 (float)"),
        ("a\x1b[31mb", r"'a\x1b[31mb' (str)"),
        (Unprintable(), "an object of the type Unprintable"),
    ],
)
def test_a_value_is_shown_with_its_type(value: object, words: str) -> None:
    assert shown(value) == words


def test_what_is_long_or_of_several_lines_is_shown_shortly_on_one() -> None:
    assert len(shown(np.arange(6000.0).reshape(2, 3000))) < 100
    assert "\n" not in shown(np.eye(3))
