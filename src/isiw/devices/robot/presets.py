"""Who and what the tapping robot taps: the dissertation's subjects, its load cell, and its cushion."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from isiw.devices.robot.mechanism import Geometry
from isiw.errors import InvalidValueError

__all__ = ["PRESETS", "preset"]

PRESETS: Mapping[str, Geometry] = MappingProxyType(
    {
        # Table 3.2; the load cell is hard, so the contact is short.
        "bench": Geometry(121, 2, 188, 1, 2, 0.2, artefact_mv=0, load_cell=True),
        "subject1": Geometry(131, 5, 183, 4, 15, 1.0, memg_ms=18, memg_sd_ms=1.0),
        "subject2": Geometry(126, 4, 172, 2, 9, 0.5, memg_ms=23, memg_sd_ms=0.5),
        "subject3": Geometry(115, 2, 176, 1, 17, 0.3, memg_ms=19, memg_sd_ms=0.3),
        "subject4": Geometry(129, 2, 182, 1, 15, 0.3, memg_ms=22, memg_sd_ms=1.5),
        # Section 5.3.1: the cushion of the precision study, once as its SD says and once as its mistrials say.
        "cushion": Geometry(125, 3, 180, 1.93, 15, 0.5),
        "timing-fault": Geometry(125, 3, 180, 1.93, 15, 0.5, late_probability=0.08, late_ms=(13.0, 22.0)),
    }
)
"""The robot on a load cell, on four people (dissertation, Table 3.2), and on the cushion of the precision study."""


def preset(name: str) -> Geometry:
    """A geometry by its name.

    Raises:
        InvalidValueError: an unknown name.
    """
    if name not in PRESETS:
        raise InvalidValueError("no preset of the tapping robot has this name", got=name, expected=", ".join(PRESETS))
    return PRESETS[name]
