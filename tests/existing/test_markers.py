"""Events and channels that say more than when stimuli came: kinds of taps, remarks, units, where recording began."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from existing.writers import KNOWN, NAMES, RATE_HZ
from isiw.errors import IsiwError
from isiw.existing.delivered import Delivered
from isiw.existing.formats.contents import Contents, Stretch, Track, events_of
from isiw.existing.layout import Layout
from isiw.existing.reading import people_of_contents

ISIS_MS = np.where(
    np.arange(20) % 5 == 4, np.nan, np.random.default_rng(3).permutation(np.linspace(20, 172, 20)).round()
)
TAPS_S = 1.0 + 2.0 * np.arange(20)
PULSES_S = TAPS_S + np.nan_to_num(ISIS_MS) / 1e3
PAIRS = np.flatnonzero(~np.isnan(ISIS_MS))
TIMES_S = np.arange(round(42 * RATE_HZ)) / RATE_HZ


def emg_mv() -> np.ndarray:
    """EMG with an MEP of 1 mV after each pulse."""
    values = 1e-3 * np.random.default_rng(1).standard_normal(len(TIMES_S))
    for at_s in PULSES_S:
        first = round((at_s + 0.018) * RATE_HZ)
        values[first : first + 48] += 0.5 * np.sin(np.linspace(0, 2 * np.pi, 48))
    return values


EVENTS = sorted([*((at, NAMES["tap"]) for at in TAPS_S[PAIRS]), *((at, NAMES["pulse"]) for at in PULSES_S)])


def read(events: Any = EVENTS, *, begin_s: float = 0.0, end_s: float = 42.0, **said: Any) -> Delivered:
    values = emg_mv()[round(begin_s * RATE_HZ) : round(end_s * RATE_HZ)]
    emg = Track.of_values("FCR", RATE_HZ, [Stretch(0, len(values), begin_s)], values, "mV", "emg")
    rows = [(name, float(at), 0.0) for at, name in sorted(events)]
    layout = KNOWN.saying(**{"unmarked": "alone", **said})
    return people_of_contents(Contents("P01.xdf", (emg,), events_of(rows)), None, layout, "P01")[0]


def isis_of(person: Delivered) -> list[float]:
    return [round(trial.isi_ms) for trial in person.trials if trial.told and trial.isi_ms is not None]


def test_taps_of_another_code_are_asked_about_and_chosen() -> None:
    two = [(at, "S  3" if name == NAMES["tap"] and n % 2 else name) for n, (at, name) in enumerate(EVENTS)]
    with pytest.raises(IsiwError, match=r"without a marked tap come after an event 'S  3'.*--marker \"tap=S  3\""):
        read(two)
    first, second = (isis_of(read(two, unmarked="lost", markers={"tap": tap})) for tap in ("S  1", "S  3"))
    assert sorted([*first, *second]) == sorted(ISIS_MS[PAIRS])
    assert len(read(two, where={"event": "*"}).trials) == 20


def test_codes_that_tell_pairs_apart_are_asked_about_and_chosen() -> None:
    sites = [(TAPS_S[n] + 0.0005, f"S 1{k % 2}") for k, n in enumerate(PAIRS[np.argsort(ISIS_MS[PAIRS])])]
    with pytest.raises(IsiwError, match=r"events of several names; got 'S 10, S 11'.*--where \"event=S 10\""):
        read([*EVENTS, *sites])
    person = read([*EVENTS, *sites], where={"event": "S 10"})
    assert (len(isis_of(person)), sum(trial.is_control for trial in person.trials)) == (8, 4)
    assert len(isis_of(read([*EVENTS, *sites], where={"event": "*"}))) == 16
    with pytest.raises(IsiwError, match=r"no such event; got 'S 12'"):
        read([*EVENTS, *sites], where={"event": "S 12"})
    with pytest.raises(IsiwError, match=r"got 'no event, S 10'|got 'S 10, no event'"):
        read([*EVENTS, *sites[::2]])


def test_codes_of_all_pairs_and_what_comes_by_itself_are_named_and_no_more() -> None:
    begins = [(at - 0.7, "S 99") for at in PULSES_S]
    kinds = [(at - 0.4, "S 90" if np.isnan(isi) else "S 91") for at, isi in zip(PULSES_S, ISIS_MS, strict=True)]
    blinks = [(at, "blink") for at in np.random.default_rng(5).uniform(0, 40, 60)]
    for more in (begins, kinds, blinks):
        assert isis_of(read([*EVENTS, *more])) == ISIS_MS[PAIRS].tolist()


def test_a_trial_that_recording_cuts_off_is_lost_and_never_tms_alone() -> None:
    cut = read(EVENTS[1:], begin_s=float(TAPS_S[0]) + 0.001)  # just after the first tap
    assert (str(cut.trials[0].reason), len(isis_of(cut))) == ("no impact", 15)
    for begin_s, end_s in ((float(PULSES_S[0]) + 0.02, 42.0), (0.0, float(PULSES_S[-1]) + 0.03)):
        person = read(begin_s=begin_s, end_s=end_s)
        assert "1 pulse of 20 came where no EMG was recorded up to the end of the MEP." in person.notes
        assert sum(trial.told for trial in person.trials) == 19


def test_the_name_of_a_marker_that_says_another_event_is_asked_about() -> None:
    valves = [(at, "Valve" if name == NAMES["tap"] else name) for at, name in EVENTS]
    with pytest.raises(IsiwError, match=r"the marker 'Valve' of P01\.xdf counts from another event.*--marker tap=NAME"):
        read(valves, markers={"tap": "Valve"})


def test_a_trigger_that_bounces_or_has_few_samples_a_second_is_read_and_said() -> None:
    def trigger(rate_hz: float, at_s: np.ndarray, *later_s: float) -> Track:
        values = np.zeros(round(42 * rate_hz))
        for at in (one + later for one in at_s for later in (0.0, *later_s)):
            values[round(at * rate_hz) : round(at * rate_hz) + 2] = 5.0
        return Track.of_values("tap" if later_s or rate_hz < RATE_HZ else "TMS", rate_hz,
                               [Stretch(0, len(values), 0.0)], values, "V")  # fmt: skip

    emg = Track.of_values("FCR", RATE_HZ, [Stretch(0, len(TIMES_S), 0.0)], emg_mv(), "mV", "emg")
    layout = Layout("impact", channels={"emg": "FCR", "tap": "tap", "pulse": "TMS"}, unmarked="alone")
    for tap, within_ms in ((trigger(RATE_HZ, TAPS_S[PAIRS], 0.001), 0.3), (trigger(200.0, TAPS_S[PAIRS]), 5.0)):
        contents = Contents("P01.acq", (emg, tap, trigger(RATE_HZ, PULSES_S)))
        (person,) = people_of_contents(contents, None, layout, "P01")
        assert isis_of(person) == pytest.approx(ISIS_MS[PAIRS], abs=within_ms)
    assert person.notes == ("'tap' has a sample each 5 ms: ISIs are not known better.",)
