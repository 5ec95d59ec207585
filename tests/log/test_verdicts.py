"""What an operator may say about a trial."""

from __future__ import annotations

import pytest

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.log.verdicts import acceptance
from isiw.trials import MistrialReason, Status, Trial, TrialTable


def a_mistrial(mep_mv: float, reason: MistrialReason = MistrialReason.IMPLAUSIBLE) -> TrialTable:
    return TrialTable((Trial(0, Status.MISTRIAL, 50.0, reason, isi_ms=50.0, mep_mv=mep_mv),))


@pytest.mark.parametrize(
    ("mep_mv", "reason", "why"),
    [
        (194.0, MistrialReason.IMPLAUSIBLE, r"194 mV is more than any muscle gives.*Is it in µV\?.*remains a mistrial"),
        (194.0, MistrialReason.BACKGROUND_ACTIVITY, "194 mV is more than any muscle gives"),
        (0.0001, MistrialReason.IMPLAUSIBLE, "less than any amplifier's noise"),
        (0.0, MistrialReason.IMPLAUSIBLE, "its EMG does not move in the MEP window"),
    ],
)
def test_an_amplitude_that_no_muscle_gives_is_not_accepted(
    space: DesignSpace, mep_mv: float, reason: MistrialReason, why: str
) -> None:
    with pytest.raises(InvalidValueError, match=f"trial 0 cannot be accepted: .*{why}"):
        acceptance(a_mistrial(mep_mv, reason), 0, space)


@pytest.mark.parametrize("mep_mv", [0.0, 0.02, 19.0])
def test_an_amplitude_that_a_muscle_gives_is_accepted(space: DesignSpace, mep_mv: float) -> None:
    event = acceptance(a_mistrial(mep_mv, MistrialReason.BACKGROUND_ACTIVITY), 0, space)
    assert (event.kind, event.trial) == ("acceptance", 0)
