from pathlib import Path

import pytest

import isiw
from isiw import summary
from isiw.change import Change
from isiw.findings import Kind
from isiw.session.afterwards import estimate_again
from isiw.session.examination import change_found
from isiw.trials import Status, Trial

TOLD = [Trial(number, Status.ACCEPTED, 100.0, isi_ms=100.0, mep_mv=0.1) for number in (0, 2, 3, 5)]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            Change("amplitudes", 0.97, 4.6, 3.1, 6.7, 2),
            "Amplitudes rose ×4.6 (90 % interval ×3.1 to ×6.7) at trial 3, at all ISIs",
        ),
        (Change("amplitudes", 0.97, 0.2, 0.1, 0.3, 2), "Amplitudes fell ×0.2"),
        (Change("intensity", 0.97, -9.0, -14.0, -5.0, 2), "MEPs are as if the intensity were 9 % RMT lower"),
        (Change("enhancement", 0.97, 0.4, 0.2, 0.6), "The enhancement has faded during the session, ×0.4"),
    ],
)
def test_a_change_is_found_with_its_trial_in_the_log_and_its_size(change: Change, said: str) -> None:
    found = change_found(change, TOLD)
    assert found is not None
    assert found.kind is Kind.CHANGED
    assert said in found.text


def test_a_change_before_the_first_trial_is_between_what_was_given_before_and_the_session() -> None:
    change = Change("amplitudes", 0.97, 2.9, 2.0, 4.1, 31)
    assert change.counted_from(0) == change
    assert change.counted_from(20) == Change("amplitudes", 0.97, 2.9, 2.0, 4.1, 11)
    assert change.counted_from(33) == Change("amplitudes", 0.97, 2.9, 2.0, 4.1, 0)
    assert change.counted_from(34) is None
    found = change_found(change.counted_from(32), TOLD)
    assert found is not None
    assert "do not fit each other: amplitudes are ×2.9 now (90 % interval ×2 to ×4.1)" in found.text
    assert "muscle, coil, gain" in (found.remedy or "")
    shifted = change_found(Change("intensity", 0.97, -9.0, -14.0, -5.0, 0), TOLD)
    assert shifted is not None
    assert "do not fit each other: MEPs are as if the intensity were 9 % RMT lower" in shifted.text


def test_a_change_that_is_not_sure_is_not_said() -> None:
    assert change_found(Change("amplitudes", 0.85, 4.6, 3.1, 6.7, 2), TOLD) is None
    assert change_found(None, TOLD) is None


def test_an_estimate_says_what_changed() -> None:
    change = Change("enhancement", 0.95, 2.1, 1.6, 3.0)
    assert summary.at_a_trial(change, None).startswith("The enhancement has grown")


def test_an_estimate_made_again_knows_the_change_that_was_noted(tmp_path: Path) -> None:
    log = tmp_path / "changed.mcap"
    strategy = isiw.make_strategy("default", isiw.DesignSpace(0, 300, 5, reference="impact"), seed=1, particles=100)
    person = isiw.subjects.cohort("recruitment", 1, seed=3)[0].begin(1)
    with isiw.open_session(strategy, log, on_doubt=lambda _: None) as own:
        for number in range(12):
            isi_ms = own.ask()
            own.tell(isi_ms, person.respond(isi_ms, "impact").mep_mv * (4.0 if number > 5 else 1.0))
            if number == 5:
                own.note_change("another electrode")
        known = own.estimate()
    estimate_again(log)
    again = isiw.read_session(log).estimates[-1]
    assert (again.probability, again.start_ms, again.end_ms) == (known.probability, known.start_ms, known.end_ms)
