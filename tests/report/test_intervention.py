from __future__ import annotations

import pytest

from isiw.pairing import Delivered
from isiw.report.intervention import InterventionContents, intervention_page
from pairing.tested import visit
from report.sessions import HOSTILE, Page

DELIVERED = tuple(Delivered(88.0 + place % 3, 10.0 * place, 0.1, probe=place % 10 == 0) for place in range(50))
PULSES = visit(0, 2.0).pulses


@pytest.mark.needs_pictures
def test_a_page_shows_the_change_each_block_the_dose_and_the_window() -> None:
    window = [(0.0, 60.0, 120.0), (400.0, 70.0, 130.0)]
    page = Page(intervention_page(InterventionContents(PULSES, DELIVERED, window=window, subject=HOSTILE)))
    assert "TMS alone evokes more than before" in page.words
    for said in (
        "after 0 min",
        "after 60 min",
        "all blocks",
        "45 pairs at 88–90 ms and 5 probes",
        "window as known then",
    ):
        assert said in page.words
    assert "taken" in page.words  # the subject's code is text


def test_a_concealed_arm_is_not_shown_though_the_change_is() -> None:
    page = Page(intervention_page(InterventionContents(PULSES, None, stimuli=50)))
    assert "The arm is concealed" in page.words
    assert "after 15 min" in page.words
    assert "probe" not in page.words


def test_too_few_pulses_are_said_and_no_change_is_drawn() -> None:
    page = Page(intervention_page(InterventionContents(PULSES[:30], DELIVERED)))
    assert "Too few pulses of TMS alone" in page.words
    assert "all blocks" not in page.words


@pytest.mark.needs_pictures
def test_pulses_of_several_intensities_are_told_apart() -> None:
    pulses = [
        type(pulse)(pulse.mep_mv, 110.0 + 10 * (place % 2), pulse.after_last_pair_s, pulse.block)
        for place, pulse in enumerate(PULSES)
    ]
    words = Page(intervention_page(InterventionContents(pulses, ()))).words
    assert "mean of a block at 110 % RMT" in words
    assert "No pair of stimuli was delivered." in words
