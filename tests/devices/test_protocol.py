from __future__ import annotations

from typing import Any

import pytest

from isiw.devices.info import DeviceInfo
from isiw.errors import InvalidValueError


@pytest.mark.parametrize(
    ("said", "error"),
    [
        ({"name": None}, "DeviceInfo.name must be a text$"),
        ({"version": 2.1}, r'DeviceInfo.version must be a text; got 2.1. Write it in quotes: "2.1"'),
        ({"address": 3}, "DeviceInfo.address must be a text"),
        ({"channels": ["emg"]}, "DeviceInfo.channels must be a table of units"),
        ({"channels": {"emg": None}}, "the unit of 'emg' in DeviceInfo.channels must be a text"),
    ],
)
def test_what_a_device_says_in_words_is_a_text_or_its_log_could_not_be_read(said: dict[str, Any], error: str) -> None:
    with pytest.raises(InvalidValueError, match=error):
        DeviceInfo(**{"name": "bench", "reference": "impact"} | said)
