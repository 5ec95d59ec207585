"""All checks for findings, each with what it needs: to look for something more, write a function and list it here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from isiw.findings import Finding
from isiw.signals import amplitudes, places, rig
from isiw.signals.evidence import Check, Evidence, of_sweep, of_told, of_trial

CHECKS: Final[tuple[Check, ...]] = (
    of_sweep(rig.unusable_emg),
    of_sweep(rig.wrong_acceleration),
    of_sweep(rig.no_origin),
    of_sweep(rig.stray_edge),
    of_trial(rig.wrong_level),
    of_trial(rig.lost_trial),
    of_told(places.repeated),
    of_told(amplitudes.equal),
    of_told(amplitudes.silent),
    of_told(amplitudes.stopped),
    of_told(amplitudes.small),
    of_told(amplitudes.large),
    of_told(places.hum),
    of_told(places.misplaced),
    of_told(places.cut_off),
    of_told(places.artefact),
    of_told(places.decay),
)
"""The surest first: of one trial, the first finding explains the others."""


def findings(evidence: Evidence) -> Iterator[Finding]:
    """What is found in some evidence, in the order of the list."""
    found = (check(evidence) for check in CHECKS)
    return (finding for finding in found if finding is not None)
