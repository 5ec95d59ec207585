"""Who and what the tapping robot taps: the dissertation's subjects, its load cell, and its cushion."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from isiw.checks import choice
from isiw.devices.robot.mechanism import Event, Faults, Geometry


def _geometry(
    descent_ms: tuple[float, float], hit_ms: tuple[float, float], contact_ms: tuple[float, float], **others: Any
) -> Geometry:
    return Geometry(Event(*descent_ms), Event(*hit_ms), Event(*contact_ms), **others)


def _later_person(hit_ms: float) -> Geometry:
    return _geometry((hit_ms - 53, 3), (hit_ms, 1.5), (14, 0.5))


PRESETS: Mapping[str, Geometry] = MappingProxyType(
    {
        # Table 3.2; the load cell is hard, so the contact is short.
        "bench": _geometry((121, 2), (188, 1), (2, 0.2), artefact_mv=0, load_cell=True),
        "subject1": _geometry((131, 5), (183, 4), (15, 1.0), memg=Event(18, 1.0)),
        "subject2": _geometry((126, 4), (172, 2), (9, 0.5), memg=Event(23, 0.5)),
        "subject3": _geometry((115, 2), (176, 1), (17, 0.3), memg=Event(19, 0.3)),
        "subject4": _geometry((129, 2), (182, 1), (15, 0.3), memg=Event(22, 1.5)),
        # Fig. 4.9: mean hits of five later people, each with an SD "below 2 ms"; the rest is that of an average person.
        **{f"subject{number}": _later_person(hit_ms) for number, hit_ms in enumerate((183, 182, 173, 177, 188), 7)},
        # Section 5.3.1: the cushion of the precision study, once as its SD says and once as its mistrials say.
        "cushion": _geometry((125, 3), (180, 1.93), (15, 0.5)),
        "timing-fault": _geometry(
            (125, 3), (180, 1.93), (15, 0.5), faults=Faults(late_probability=0.08, late_ms=(13.0, 22.0))
        ),
    }
)
"""The robot on a load cell, on nine people [Kim2020, Table 3.2, Fig. 4.9], and on the precision study's cushion."""


def preset(name: str) -> Geometry:
    """A geometry by its name."""
    return PRESETS[choice("the preset of the tapping robot", name, PRESETS)]
