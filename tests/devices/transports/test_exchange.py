"""Requests and answers, with a carrier that does in between what another thread might do."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from isiw.devices.transports.exchange import Exchange, Reply, Request, Verb, described
from isiw.errors import DeviceError, DeviceTimeoutError, InvalidValueError, NotDelivered
from isiw.trials import Stimulus

SAID = {Verb.ARM: "armed", Verb.DELIVER: "delivered", Verb.DISARM: "disarmed"}


class Honest:
    """Answers at once, as it should; something may happen before an answer."""

    def __init__(self) -> None:
        self.sent: list[str] = []
        self.before: dict[int, Callable[[], object]] = {}
        self.deaf_to: set[Verb] = set()

    def send(self, request: Request) -> None:
        self.sent.append(request.verb.value)

    def reply(self, request: Request, wait_s: float) -> Reply | None:
        del wait_s
        self.before.pop(request.number, lambda: None)()
        if request.verb in self.deaf_to:
            return None
        stimulus = request.stimulus
        about = {} if stimulus is None else {"trial": stimulus.trial, "set_isi_ms": stimulus.isi_ms}
        return Reply({"token": request.token, "number": request.number, "said": SAID[request.verb]} | about, "test")

    def silence(self, request: Request) -> DeviceError:
        return DeviceTimeoutError(f"no answer to {request.verb}")


def exchange() -> tuple[Exchange, Honest]:
    carrier = Honest()
    return Exchange("rig", carrier, (), stop_timeout_s=0.01), carrier


@pytest.mark.parametrize("during", [1, 2])
def test_what_is_stopped_while_it_is_being_armed_does_not_arm(during: int) -> None:
    made, carrier = exchange()
    carrier.before[during] = made.disarm
    with pytest.raises(DeviceError, match="while it was being armed"):
        made.arm(1.0)
    assert carrier.sent[-1] == "disarm"
    assert carrier.sent.count("arm") == during - 1
    assert not made.may_be_armed
    with pytest.raises(NotDelivered, match="not staged"):
        made.deliver(Stimulus(0, 50.0), 1.0, bool)


def test_whatever_fails_after_firing_has_it_disarmed() -> None:
    made, carrier = exchange()
    made.arm(1.0)

    def broken(reply: Reply) -> None:
        raise KeyError(reply.source)

    with pytest.raises(KeyError):
        made.deliver(Stimulus(0, 50.0), 1.0, broken)
    assert carrier.sent == ["disarm", "arm", "deliver", "disarm"]
    with pytest.raises(NotDelivered, match="not staged"):
        made.deliver(Stimulus(1, 50.0), 1.0, bool)


def test_it_may_be_armed_until_somebody_says_otherwise() -> None:
    made, carrier = exchange()
    carrier.deaf_to = {Verb.ARM, Verb.DISARM}
    made.disarm()
    carrier.deaf_to = {Verb.ARM}
    with pytest.raises(DeviceTimeoutError, match="no answer to arm"):
        made.arm(0.01)
    assert made.may_be_armed
    carrier.deaf_to = {Verb.DISARM}
    with pytest.raises(DeviceTimeoutError, match="no answer to disarm"):
        made.disarm()
    carrier.deaf_to = set()
    made.disarm()
    assert not made.may_be_armed


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "trial is missing"),
        ({"trial": 2.5}, "trial is not a whole number"),
        ({"trial": True}, "trial must be"),
        ({"trial": float("nan")}, "trial must be"),
        ({"trial": "1e400"}, "trial must be"),
        ({"trial": -1}, "trial must be"),
        ({"trial": [1]}, "trial must be"),
    ],
)
def test_a_value_that_is_no_number_is_told_with_its_source(values: dict[str, object], words: str) -> None:
    with pytest.raises(DeviceError, match=f"^answer.txt: {words}"):
        Reply(values, "answer.txt").whole("trial")


def test_a_device_that_is_told_no_intensity_does_not_claim_to_set_one() -> None:
    assert "intensity" not in str(
        Request("t", 1, Verb.DELIVER, 1.0, Stimulus(0, 50.0, intensity_pct_rmt=110.0)).values()
    )
    with pytest.raises(InvalidValueError, match="no intensity can be sent"):
        described({"name": "rig", "reference": "impact", "sets_intensity": True})
