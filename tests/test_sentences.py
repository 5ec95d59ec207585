"""The words of every sentence about a result; tests elsewhere go by kinds, fields and figures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from isiw import sentences, summary
from isiw.design import DesignSpace
from isiw.figures import Edge, Estimate
from isiw.findings import Kind
from isiw.report.words import counts
from isiw.summary import NO_MEP
from isiw.text.stimuli import STIMULI, TAP
from isiw.trials import Status, Stimulus, Trial
from isiw.window import Window

SPACE = DesignSpace(10, 320, reference="impact")
PAIR, TMS = Trial(1, Status.ACCEPTED, 90.0, mep_mv=0.1), Trial(2, Status.ACCEPTED, None, mep_mv=0.1)
ALONE, LOST = Trial(3, Status.ACCEPTED, None, tap_alone=True), Trial(4, Status.MISTRIAL, 90.0, Kind.NO_IMPACT)
UNKNOWN = Trial.unknown(Stimulus(5, None))
FOUND: dict[str, Any] = {
    "probability": 0.98,
    "segments_ms": (30.0, 160.0),
    "start_ms": 30.0,
    "start_low_ms": -math.inf,
    "start_high_ms": 34.0,
    "start_beyond": 0.1,
    "end_ms": 160.0,
    "end_low_ms": 150.0,
    "end_high_ms": 171.0,
    "best_isi_ms": (90.0, 80.0, 101.0),
}
SURE, PROBABLE = Estimate(**FOUND), Estimate(**FOUND | {"probability": 0.8, "expected_f1": 0.4, "split": 0.25})
NONE = Estimate(probability=0.02, excluded_mv=0.0123, excluded_pct_rmt=3.4)
SWEPT = Estimate(probability=None, grid_ms=(10.0, 20.0), profile_mv=(0.05, 0.05))

_LOOK = "Did the stimulator fire? Was the EMG recorded? Was the intensity high enough?"


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (
            sentences.finding(SURE, TAP, SPACE),
            "The tap enhances the MEP at ISIs of 30–160 ms after the impact (probability 0.98).",
        ),
        (
            sentences.finding(PROBABLE, STIMULI["electrical"], SPACE),
            (
                "The electrical pulse probably enhances the MEP, but at which ISIs is not known "
                "well; the best guess is "
                "30–160 ms after the electrical pulse (probability 0.80)."
            ),
        ),
        (sentences.finding(NONE, TAP, SPACE), "No window was found (probability of a window: 0.02)."),
        (
            sentences.finding(Estimate(probability=0.3), TAP, SPACE),
            "It is undecided whether there is a window (probability of a window: 0.30).",
        ),
        (
            sentences.finding(Estimate(probability=None, segments_ms=(10.0, 40.0)), TAP, SPACE),
            (
                "By this method, which gives no probability, the tap enhances the MEP at ISIs of 10–40 "
                "ms after the impact."
            ),
        ),
        (
            sentences.finding(Estimate(probability=None), TAP, SPACE),
            "The method has no answer yet: it has not measured enough for one.",
        ),
        (
            sentences.finding(SWEPT, TAP, SPACE),
            "The scan of ISIs is not finished: of 10–320 ms it has measured 10–20 ms, where the MEP is not enhanced.",
        ),
        (sentences.finding(SWEPT, TAP, DesignSpace(10, 20, reference="impact")), "No window was found."),
        (
            sentences.edges(SURE, SPACE),
            ("Start before 34 ms, end 150–171 ms (90 % each). It starts before the range with probability 0.10."),
        ),
        (
            sentences.edges(PROBABLE, SPACE),
            (
                "If there is a window, start before 34 ms, end 150–171 ms (90 % each). "
                "Given a window, it starts before the range with probability 0.10 and has more than one segment with "
                "probability 0.25."
            ),
        ),
        (sentences.edges(NONE, SPACE), ""),
        (summary.tap_likely(SURE, TAP), ""),
        (summary.tap_unmeasured(SURE, TAP), ""),
        (
            summary.tap_unmeasured(Estimate(**FOUND, tap_may_explain=True), TAP),
            (
                "Deliver the tap alone at these ISIs too ([protocol] tap_alone, or tell(…, pulse=False)); the muscle "
                "may answer it."
            ),
        ),
        (summary.tap_unmeasured(Estimate(**FOUND, tap_may_explain=True, tap_is_likely=True), TAP), ""),
        (
            summary.tap_likely(Estimate(**FOUND, tap_may_explain=True, tap_is_likely=True), TAP),
            (
                "The tap alone evokes as much at these ISIs: the window is probably the muscle's response to the tap "
                "itself, and not the MEP."
            ),
        ),
        (sentences.best_isi(SURE), "Largest MEP at 90 ms (90 %: 80–101 ms)."),
        (sentences.best_isi(NONE), ""),
        (
            sentences.excluded(NONE),
            "An enhancement of more than 12 µV (3.4 % of RMT) is excluded with 90 % probability.",
        ),
        (
            sentences.excluded(Estimate(probability=0.02, excluded_mv=0.001, excluded_pct_rmt=9.0)),
            "An enhancement of more than 2 µV is excluded with 90 % probability.",
        ),
        (sentences.expected_f1(PROBABLE), "Expected F1: 0.40 (1: exact)."),
        (
            sentences.unusual(Estimate(probability=0.5, unusual={"noise": 0.95, "drift": 0.1})),
            "This person is unlike most in noise (probability 0.95).",
        ),
        (
            sentences.depression(Estimate(probability=0.5, depressed_probability=0.5), "tap", 120.0),
            (
                "It is undecided whether the tap depresses the MEP at any ISI (probability that it does "
                "so anywhere: 0.50)."
            ),
        ),
        (
            sentences.depression(NONE, "tap", 120.0),
            (
                "This strategy looks for enhancement alone. At 120 % of RMT the tap may depress the "
                "MEP too: the strategy "
                "supra-threshold looks for both."
            ),
        ),
        (sentences.depression(NONE, "tap", 100.0), ""),
        (
            sentences.nothing_estimated(2, 3, damaged=True),
            (
                "No estimate can be read, and the log is damaged: 3 pulses were given, or may have been, "
                "2 have an outcome."
            ),
        ),
        (
            sentences.nothing_estimated(0, 1, damaged=False),
            "No outcome can be read: 1 pulse was given, or may have been, none has an outcome.",
        ),
        (sentences.nothing_estimated(0, 0, damaged=True), "No trial can be read, and the log is damaged."),
        (sentences.nothing_estimated(0, 0, damaged=False), "No trial has been completed."),
        (
            sentences.all_silent(9, NO_MEP.text),
            (
                "No MEP was seen in any trial that counts, so nothing is known about a window. The "
                "amplitudes of all 9 trials "
                f"that count are 0. {_LOOK}"
            ),
        ),
        (
            sentences.few_pairs(1, 4),
            "Too little was measured to speak of a window: 1 pair of stimuli counts, of 4 trials.",
        ),
        (sentences.all_lost({}, 4, None), "Nothing was measured: none of 4 trials counts."),
        (
            sentences.all_lost({"no impact": 3}, 4, 2500.0),
            "Nothing was measured: 3 of 4 trials were rejected (3 no impact; background EMG 2.5 mV RMS).",
        ),
        (
            sentences.not_larger((20.0, 21.0)),
            "The data do not bear this out: the MEPs inside are no larger than those outside (medians 20 and 21 µV).",
        ),
        (
            sentences.not_larger((21.0, 20.0), 0.2),
            (
                "The data support this only weakly: the MEPs inside are not clearly larger than those "
                "outside (medians 21 and 20 "
                "µV, p = 0.20)."
            ),
        ),
        (
            sentences.changed("grew", 1e-5),
            (
                "The amplitudes grew during the session by more than the ISIs explain (Kendall's test among near "
                "ISIs, p = 1e-05), and a window may be due to that. Was the intensity changed, did the coil move, or "
                "did the person tire?"
            ),
        ),
        (sentences.at_rest(None, None), f"In no trial was the EMG after the pulse larger than at rest. {_LOOK}"),
        (
            sentences.at_rest((15.0, 35.0), 12),
            (
                "From trial 12 on, the EMG in the MEP window, 15–35 ms after the pulse, was never larger than at rest. "
                f"{_LOOK} Is the time of the pulse right? Does the MEP window fit the muscle? Do the clocks of the EMG "
                "and of the events drift apart, as those of two computers do?"
            ),
        ),
        (
            sentences.few_outside(1, 9, 0),
            (
                "The baseline is poorly measured (1 of 9 pairs outside the window, 0 pulses of TMS alone): add TMS "
                "alone next time ([protocol] tms_alone), or widen the range of ISIs."
            ),
        ),
        (
            counts([PAIR, PAIR, TMS, replace(PAIR, excluded=True), LOST]),
            "5 stimuli were delivered: 4 pairs and 1 pulse of TMS alone; 3 count; mistrials: 1 no impact; 1 excluded.",
        ),
        (counts([PAIR]), "1 pair was delivered; 1 counts."),
        (counts([]), "0 pairs were delivered; 0 count."),
        (counts([TMS]), "1 stimulus was delivered: 1 pulse of TMS alone; 1 counts."),
        (
            counts([*[PAIR] * 20, *[ALONE] * 2, *[TMS] * 2]),
            (
                "24 stimuli were delivered: 20 pairs, 2 taps alone and 2 pulses of TMS alone; "
                "22 count (the taps alone do not)."
            ),
        ),
        (
            counts([PAIR, ALONE, UNKNOWN], STIMULI["electrical"]),
            (
                "3 stimuli were delivered: 1 pair, 1 electrical pulse alone and 1 of unknown kind; "
                "1 counts (the electrical pulse alone does not); mistrials: 1 outcome unknown."
            ),
        ),
        (sentences.truth(None, None, None), "This simulated person in fact has no window."),
        (
            sentences.truth(Window(10, 40), None, 0.0),
            "This simulated person in fact has the window 10–40 ms; none was reported (F1 0.00).",
        ),
        (
            sentences.truth(Window(10, 40), Window(10, 50), 0.9),
            "This simulated person in fact has the window 10–40 ms; the F1 of the reported one is 0.90.",
        ),
        (
            sentences.moved(0.3, 0.1),
            (
                "the probability that the window moved by more than the usual shift from day to day is 30 % "
                "(10 % without data);"
            ),
        ),
        (
            sentences.later(0.4, 0.6),
            "the window probably starts earlier (60 %) and ends later (60 %); 50 % means unknown.",
        ),
        (sentences.later(None, 0.6), ""),
    ],
)
def test_a_sentence_about_a_result_reads(said: str, words: str) -> None:
    assert said == words


def test_an_edge_is_said_in_a_cell_with_signs_for_what_lies_beyond_the_range() -> None:
    edges = [Edge(), Edge(12, 10.4, 14), Edge(12, -math.inf, 14), Edge(12, 10, math.inf), Edge(None, *[-math.inf] * 2)]
    assert [sentences.interval_cell(edge) for edge in edges] == ["", "10–14", "<–14", "10–>", "<"]
    assert [summary.edge_text(edge_ms) for edge_ms in (-math.inf, 12.4, math.inf)] == [
        "before the range",
        "12 ms",
        "beyond the range",
    ]


def test_a_window_is_named_in_short_also_if_there_is_none() -> None:
    not_reported = Estimate(probability=0.9)
    found = [SURE, NONE, Estimate(probability=0.3), not_reported, Estimate(probability=None), SWEPT]
    short = ["30–160 ms", "no window", "undecided", "window not reported", "no answer yet", "no window"]
    assert [summary.in_short(estimate) for estimate in found] == short


def test_a_trial_is_named_by_what_was_asked_and_what_came_of_it() -> None:
    trials = [
        Trial(0, Status.ACCEPTED, 50.0, isi_ms=50.0, mep_mv=0.1),
        Trial(1, Status.ACCEPTED, None, mep_mv=0.05, excluded=True),
        Trial(2, Status.MISTRIAL, 60.0, reason=Kind.NO_IMPACT),
    ]
    assert [sentences.asked(trial) for trial in trials] == ["50 ms", "TMS alone", "60 ms"]
    assert [sentences.outcome(trial) for trial in trials] == ["100 µV", "50 µV (excluded)", "mistrial: no impact"]
