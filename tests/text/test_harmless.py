from __future__ import annotations

import unicodedata
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from isiw.text.sanitize import one_line, plain


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[31mred\x1b[0m", "red"),
        ("\x1b]8;;https://elsewhere.example\x1b\\the log\x1b]8;;\x1b\\", "the log"),
        ("\x1b]0;another title\x07P01", "P01"),
        ("\x9b2Jgone", "gone"),
        ("\x1bPq#0;2;0;0;0\x1b\\picture", "picture"),
        ("over\rwritten\x08\x7f", "overwritten"),
        ("P\u202e10\u2066\u200b\ufeff", "P10"),
        ("half \ud800 a sign", "half  a sign"),
        ("line\u2028line", "line\nline"),
        ("\tµV ± 3 – ±∞ Zoë 山\n", "\tµV ± 3 – ±∞ Zoë 山\n"),
        ("an unfinished \x1b]8;;link", "an unfinished "),
        ("\x1b", ""),
    ],
)
def test_what_a_terminal_would_obey_is_taken_out_and_the_rest_stays(text: str, shown: Any) -> None:
    assert plain(text) == shown


@pytest.mark.slow
@given(st.text())
def test_what_is_left_can_be_printed(text: str) -> None:
    assert not any(unicodedata.category(character) in ("Cf", "Cs") for character in plain(text))
    assert "\x1b" not in plain(text)
    assert plain(plain(text)) == plain(text)
    plain(text).encode()


def test_a_text_on_one_line_has_single_spaces() -> None:
    assert one_line(" a\n\tb\x1b[2J  c ") == "a b c"
