from __future__ import annotations

from isiw.devices.info import DeviceInfo
from isiw.devices.simulated import SimulatedDevice, SimulatedPerson
from isiw.errors import DeviceError
from isiw.subjects.subject import Response
from isiw.sweeps import Measurement
from isiw.trials import Stimulus
from known import instance, known


def test_it_reports_what_the_person_answers_at_the_realised_isi() -> None:
    device = SimulatedDevice(SimulatedPerson(lambda isi_ms: Response(known(isi_ms) + 1.5, 0.07, 2.0), "impact"))
    device.stage()
    measured = instance(Measurement, device.deliver(Stimulus(0, 40.0), 1.0))
    assert (measured.isi_ms, measured.mep_mv, measured.isi_sd_ms) == (41.5, 0.07, 2.0)


def test_it_says_that_it_is_simulated() -> None:
    info = SimulatedDevice(SimulatedPerson(lambda isi_ms: Response(isi_ms, 0.0), "impact")).describe()
    assert info.simulated
    assert info.reference == "impact"


def test_resuming_answers_only_what_was_not_answered_before() -> None:
    asked: list[float | None] = []

    def respond(isi_ms: float | None) -> Response:
        asked.append(isi_ms)
        return Response(isi_ms, 0.01)

    device = SimulatedDevice(SimulatedPerson(respond, "valve"))
    device.stage()
    device.deliver(Stimulus(0, 10.0), 1.0)
    device.resume_after([Stimulus(0, 10.0), Stimulus(1, 20.0), Stimulus(2, None)])
    assert asked == [10.0, 20.0, None]


def test_what_was_refused_before_is_refused_again_and_counts_as_asked() -> None:
    class Choosy:
        info = DeviceInfo("choosy", "impact", simulated=True)

        def __init__(self) -> None:
            self.answered: list[int] = []

        def answer(self, stimulus: Stimulus) -> Measurement:
            if known(stimulus.isi_ms) < 10:
                raise DeviceError("too short")
            self.answered.append(stimulus.trial)
            return Measurement(0.1, stimulus.isi_ms)

    stimuli = [Stimulus(0, 20.0), Stimulus(1, 5.0), Stimulus(2, 30.0)]
    choosy = Choosy()
    device = SimulatedDevice(choosy)
    device.resume_after(stimuli)
    device.resume_after([*stimuli, Stimulus(3, 40.0)])
    assert choosy.answered == [0, 2, 3]
