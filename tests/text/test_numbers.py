"""Numbers as other software writes them are read in one way."""

from __future__ import annotations

import pytest

from isiw.devices.transports.exchange import read_number
from isiw.text.sanitize import read_whole


@pytest.mark.parametrize(
    ("text", "value"), [("0.25", 0.25), ("-3", -3), ("+1.", 1), (".5", 0.5), ("1e3", 1000), ("1E-3", 0.001)]
)
def test_a_number_with_a_decimal_point_is_read(text: str, value: float) -> None:
    assert read_number(text) == value


@pytest.mark.parametrize(
    "text", ["1_0_0", "١٢", "１２", "0,5", "nan", "inf", "0x10", " 1", "1 ", "", "1 mV", "--1", "1e", "."]
)
def test_anything_else_is_no_number(text: str) -> None:
    with pytest.raises(ValueError, match="no number"):
        read_number(text)


def test_a_whole_number_has_ascii_digits_only() -> None:
    assert read_whole("0012") == 12
    assert [read_whole(text) for text in ("١٢", "1_0", "-1", "+1", "1.0", "", "9" * 5000)] == [None] * 7
