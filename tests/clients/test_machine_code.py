"""The Arduino's sketch as the board's own machine code, in simavr, driven by isiw's line device; its pins by cycle."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from benchmarks.arduino import killed_while_delivering, session_with_noise
from benchmarks.simulated_board import HZ, Board, Port, board, compiled, device_of_the_page, lacking, pairs_of, sealed

import isiw
from isiw.errors import DeviceError, NotDelivered
from isiw.sweeps import Measurement
from isiw.testing import check_device
from isiw.trials import Stimulus

pytestmark = pytest.mark.skipif(bool(lacking()), reason=f"needs {lacking()}")

SPACE = isiw.DesignSpace(0, 120, reference="valve")
TICK = 256
TIMEOUT_S = 5.0

Boards = Callable[..., AbstractContextManager[Board]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("board")


@pytest.fixture(scope="module")
def program(folder: Path) -> Path:
    return compiled(folder, SHORTEST_INTERVAL_MS=0)


@pytest.fixture
def running(program: Path, tmp_path: Path) -> Iterator[Board]:
    with board(program, tmp_path) as one:
        yield one


@pytest.fixture
def device(running: Board) -> Iterator[Any]:
    device = device_of_the_page(running.address, 0.0)
    device.stage()
    yield device
    device.unstage()


@pytest.fixture
def port(running: Board) -> Iterator[Port]:
    with Port(running.address) as port:
        yield port


@pytest.mark.parametrize("isi_ms", [pytest.param(0.0, marks=pytest.mark.slow), 47.0])
def test_the_trigger_comes_the_isi_after_the_valve_and_both_are_as_long_as_they_should(
    isi_ms: float, device: Any, running: Board
) -> None:
    answer = device.deliver(Stimulus(0, isi_ms), TIMEOUT_S)
    edges = running.edges
    ((valve, trigger),) = pairs_of(edges)
    ends = {edge.what: edge.cycle for edge in edges if edge.what in {"valve", "trigger"} and not edge.level}
    assert abs(trigger.cycle - valve.cycle - isi_ms * HZ / 1000) <= TICK / 2
    assert (ends["valve"] - valve.cycle, ends["trigger"] - trigger.cycle) == (60 * HZ // 1000, 63 * TICK)
    assert isinstance(answer, Measurement)
    assert answer.isi_ms is not None
    assert abs(answer.isi_ms * HZ / 1000 - (trigger.cycle - valve.cycle)) < TICK / 2


def test_the_heard_isi_is_the_first_edge_whatever_artefact_comes_after_the_trigger(device: Any, running: Board) -> None:
    running.order("n")
    assert device.deliver(Stimulus(0, 20.0), TIMEOUT_S).isi_ms == pytest.approx(20.0, abs=0.016)


@pytest.mark.slow
def test_without_its_wire_the_board_has_heard_no_trigger(device: Any, running: Board) -> None:
    running.order("j")
    with pytest.raises(DeviceError, match="no trigger at pin 8"):
        device.deliver(Stimulus(0, 20.0), TIMEOUT_S)


@pytest.mark.parametrize(
    "said",
    [
        sealed("5 DISARM").replace(b"ARM", b"ARN"),
        *(
            pytest.param(said, marks=pytest.mark.slow)
            for said in (
                b"5 DISARM\n",
                sealed("5 DANCE"),
                sealed("DISARM"),
                b"9" * 200 + b"\n",
                b"\x00\xff{\x1b[\n",
                sealed("5 SET x"),
            )
        ),
    ],
)
def test_whatever_is_not_understood_disarms(said: bytes, port: Port, running: Board) -> None:
    port.ask("2 ARM", "2 ARMED")
    port.write(said)
    port.ask("6 ALONE", "6 ERR not armed")
    assert running.rises("trigger") == []


@pytest.mark.slow
def test_silence_disarms_and_a_sign_of_life_keeps_it_armed(port: Port, running: Board) -> None:
    port.ask("1 ARM", "1 ARMED")
    armed_ms = running.clock_ms
    while running.clock_ms < armed_ms + 700:
        port.say("2 BEAT")
        wait_ms(running, 150)
    port.ask("3 ALONE", "3 FIRED")
    port.ask("4 ARM", "4 ARMED")
    wait_ms(running, 650)
    port.ask("5 ALONE", "5 ERR not armed")


def wait_ms(running: Board, duration_ms: float) -> None:
    end_ms = running.clock_ms + duration_ms
    while running.clock_ms < end_ms:
        pass


def test_a_computer_that_dies_while_a_stimulus_is_under_way_gives_no_trigger(port: Port, running: Board) -> None:
    for command, answer in (("1 SET 1000000", "1 OK"), ("2 ARM", "2 ARMED")):
        port.ask(command, answer)
    port.say("3 FIRE")
    port.hear("3 ERR stopped on the way")
    valve = running.rises("valve")[0]
    end = next(edge for edge in running.edges if edge.what == "valve" and not edge.level)
    assert running.rises("trigger") == []
    assert end.t_ms - valve.t_ms < 61


def test_the_same_number_twice_is_obeyed_once_and_answered_twice(port: Port, running: Board) -> None:
    port.ask("1 ARM", "1 ARMED")
    for _ in range(2):
        port.seen = b""
        port.ask("2 ALONE", "2 FIRED")
    assert len(running.rises("trigger")) == 1


def test_an_interlock_that_opens_ends_a_stimulus_and_stays_open_until_it_is_acknowledged(
    port: Port, running: Board
) -> None:
    port.ask("1 SET 400000", "1 OK")
    port.ask("2 ARM", "2 ARMED")
    port.say("3 FIRE")
    running.until(lambda edges: any(edge.what == "valve" for edge in edges))
    running.order("o")
    port.hear("3 ERR stopped on the way")
    edges = running.edges
    opened = next(edge for edge in edges if edge.what == "interlock" and edge.level)
    closed = next(edge for edge in edges if edge.what == "valve" and not edge.level)
    assert closed.cycle - opened.cycle < HZ / 1000 or closed.t_ms < opened.t_ms
    port.ask("4 ARM", "4 ERR the interlock is open")
    running.order("c")
    port.ask("5 ARM", "5 ERR interlock was open")
    port.ask("6 ACK", "6 CLOSED")
    port.ask("7 ARM", "7 ARMED")
    assert running.rises("trigger") == []


@pytest.mark.slow
def test_an_interlock_that_was_open_is_acknowledged_by_staging_again_alone(device: Any, running: Board) -> None:
    running.order("o")
    wait_ms(running, 5)
    running.order("c")
    with pytest.raises(NotDelivered, match="interlock was open"):
        device.deliver(Stimulus(0, 20.0), TIMEOUT_S)
    device.stage()
    device.deliver(Stimulus(0, 20.0), TIMEOUT_S)


@pytest.mark.slow
def test_a_reset_lets_go_of_both_pins_and_forgets_what_was_armed(port: Port, running: Board) -> None:
    port.ask("1 SET 400000", "1 OK")
    port.ask("2 ARM", "2 ARMED")
    port.say("3 FIRE")
    running.until(lambda edges: any(edge.what == "valve" for edge in edges))
    running.order("r")
    running.until(lambda edges: any(edge.what == "reset" for edge in edges))
    port.ask("4 ALONE", "4 ERR not armed")
    assert running.rises("trigger") == []
    assert len(running.rises("valve")) == 1


@pytest.mark.slow
def test_a_program_that_is_stuck_is_reset_by_the_watchdog_and_gives_nothing_before_somebody_has_seen_it(
    port: Port, running: Board
) -> None:
    port.ask("1 SET 1000000", "1 OK")
    port.ask("2 ARM", "2 ARMED")
    port.say("3 FIRE")
    running.until(lambda edges: any(edge.what == "valve" for edge in edges))
    port.write(b"\x07")
    edges = running.until(lambda edges: any(edge.what == "watchdog" for edge in edges))
    valve = next(edge for edge in edges if edge.what == "valve")
    assert next(edge for edge in edges if edge.what == "watchdog").t_ms - valve.t_ms < 400
    port.ask("4 ARM", "4 ERR interlock was open")
    assert running.rises("trigger") == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("constants", "refusal"),
    [
        ({"SHORTEST_INTERVAL_MS": 300, "MOST_STIMULI": 1000}, "too soon"),
        ({"SHORTEST_INTERVAL_MS": 0, "MOST_STIMULI": 1}, "too many"),
    ],
)
def test_the_board_has_limits_of_its_own(constants: dict[str, int], refusal: str, folder: Path, tmp_path: Path) -> None:
    limited = compiled(folder, refusal.replace(" ", "_"), **constants)
    with board(limited, tmp_path) as running:
        shortest_s, most = constants["SHORTEST_INTERVAL_MS"] / 1e3, constants["MOST_STIMULI"]
        device = device_of_the_page(running.address, shortest_s, most)
        device.stage()
        wait_ms(running, 1.2e3 * shortest_s)
        device.deliver(Stimulus(0, 20.0), TIMEOUT_S)
        with pytest.raises(NotDelivered, match=refusal):
            device.deliver(Stimulus(1, 20.0), TIMEOUT_S)
        device.unstage()
        assert len(running.rises("trigger")) == 1


@pytest.mark.slow
def test_isiw_refuses_a_board_with_other_limits_than_its_configuration_states(running: Board) -> None:
    with pytest.raises(DeviceError, match="another shortest_iti_s"):
        device_of_the_page(running.address, 2.0).stage()
    with pytest.raises(DeviceError, match="another most_pulses"):
        device_of_the_page(running.address, 0.0, 7).stage()


@pytest.mark.slow
def test_the_example_of_the_page_conforms_on_the_machine_code_also_when_isiw_dies(running: Board) -> None:
    said: list[str] = []
    make = partial(device_of_the_page, running.address, 0.0)
    check_device(make, SPACE, timeout_s=TIMEOUT_S, iti_s=0.0, say=said.append)
    assert any("that had armed Arduino timer was killed: disarmed after" in line for line in said)


@pytest.mark.slow
def test_a_killed_isiw_ends_the_stimulus_that_is_under_way(program: Path, tmp_path: Path) -> None:
    with board(program, tmp_path) as running:
        assert killed_while_delivering(running, signal.SIGKILL) < 600


@pytest.mark.slow
def test_a_session_with_noise_resets_and_a_dead_host_loses_no_pair_and_keeps_the_shortest_interval(
    folder: Path, tmp_path: Path
) -> None:
    found = session_with_noise(folder, tmp_path, pairs=16, seed=1)
    assert found.unlogged == 0
    assert found.shortest_ms >= found.least_ms
    assert found.resets == 2
