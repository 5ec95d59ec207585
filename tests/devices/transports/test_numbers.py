"""All transports read numbers in one way; names of channels are texts."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from isiw.devices.info import DeviceInfo
from isiw.devices.transports.exchange import Reply
from isiw.devices.transports.line_table import number_of
from isiw.errors import DeviceError, InvalidValueError
from isiw.sweeps import Channel, Sweep


@pytest.mark.parametrize("written", ["1_0_0", "١٢", "nan", "0x1"])
def test_what_only_python_takes_for_a_number_is_none_in_any_transport(written: str) -> None:
    with pytest.raises(InvalidValueError, match="no finite number"):
        number_of({"isi_us": written}, "isi_us")
    with pytest.raises(DeviceError, match="not a number"):
        Reply({"isi_ms": written}, "an answer").number("isi_ms")


@pytest.mark.parametrize("name", [7, None, b"emg"])
def test_a_channel_whose_name_is_no_text_is_refused(name: object) -> None:
    with pytest.raises(InvalidValueError, match="must be a text"):
        DeviceInfo("rig", "impact", channels={cast("Any", name): "mV"})
    with pytest.raises(InvalidValueError, match="must be a text"):
        Sweep({cast("Any", name): Channel(np.zeros(3), 1000.0, "mV")}, t_tms_ms=0.0)
