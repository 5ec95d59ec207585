"""What an operator may say about a trial."""

from __future__ import annotations

import pytest

from isiw.design import DesignSpace
from isiw.errors import InvalidValueError
from isiw.findings import Kind
from isiw.log.new_verdicts import acceptance, correction, exclusion
from isiw.log.schema import Correction
from isiw.log.verdicts import excluded_by, under_all
from isiw.trials import Status, Trial, TrialTable


def a_mistrial(mep_mv: float, reason: Kind = Kind.IMPLAUSIBLE) -> TrialTable:
    return TrialTable((Trial(0, Status.MISTRIAL, 50.0, reason, isi_ms=50.0, mep_mv=mep_mv),))


@pytest.mark.parametrize(
    ("mep_mv", "reason", "why"),
    [
        (194.0, Kind.IMPLAUSIBLE, r"194 mV is more than any muscle gives.*Is it in µV\?.*remains a mistrial"),
        (194.0, Kind.BACKGROUND_ACTIVITY, "194 mV is more than any muscle gives"),
        (0.0001, Kind.IMPLAUSIBLE, "less than any amplifier's noise"),
        (0.0, Kind.IMPLAUSIBLE, "its EMG does not move in the MEP window"),
    ],
)
def test_an_amplitude_that_no_muscle_gives_is_not_accepted(
    space: DesignSpace, mep_mv: float, reason: Kind, why: str
) -> None:
    with pytest.raises(InvalidValueError, match=f"trial 0 cannot be accepted: .*{why}"):
        acceptance(a_mistrial(mep_mv, reason), 0, space)


@pytest.mark.parametrize("mep_mv", [0.0, 0.02, 19.0])
def test_an_amplitude_that_a_muscle_gives_is_accepted(space: DesignSpace, mep_mv: float) -> None:
    event = acceptance(a_mistrial(mep_mv, Kind.BACKGROUND_ACTIVITY), 0, space)
    assert (event.kind, event.trial) == ("acceptance", 0)


def test_a_correction_gives_a_trial_other_values_and_nothing_else() -> None:
    trials = TrialTable(tuple(Trial(n, Status.ACCEPTED, 40.0 + n, isi_ms=40.0 + n, mep_mv=0.125) for n in range(2)))
    event = correction(trials, 1, "The amplifier's gain was twice that.", Correction(mep_mv=0.25, isi_ms=41.5))
    first, second = under_all(trials, [event])
    assert first == trials[0]
    assert (second.mep_mv, second.isi_ms) == (0.25, 41.5)
    assert excluded_by([exclusion(trials, 1), event]) == [1]
    with pytest.raises(InvalidValueError, match="cannot correct this trial"):
        correction(trials, 2, "", Correction(mep_mv=0.25))
