"""All checks for findings, each with what it needs: to look for something more, write a function and list it here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from isiw.findings import Finding
from isiw.signals import amplitudes, places, rig
from isiw.signals.evidence import Check, Evidence, OfSweep, OfTold, OfTrial

__all__ = ["CHECKS", "findings"]

CHECKS: Final[tuple[Check, ...]] = (
    OfSweep(rig.unusable_emg),
    OfSweep(rig.wrong_acceleration),
    OfSweep(rig.no_origin),
    OfSweep(rig.stray_edge),
    OfTrial(rig.wrong_level),
    OfTrial(rig.lost_amplitude),
    OfTrial(rig.lost_trial),
    OfTold(places.repeated),
    OfTold(amplitudes.equal),
    OfTold(amplitudes.silent),
    OfTold(amplitudes.stopped),
    OfTold(amplitudes.small),
    OfTold(amplitudes.large),
    OfTold(places.misplaced),
    OfTold(places.artefact),
)
"""The surest first: of one trial, the first finding explains the others."""


def findings(evidence: Evidence) -> Iterator[Finding]:
    """What is found in some evidence, in the order of the list; what a check needs and has not got, it passes over.

    Args:
        evidence: what is known.
    """
    found = (check(evidence) for check in CHECKS)
    return (finding for finding in found if finding is not None)
