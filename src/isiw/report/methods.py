"""Three methods' answers from the same trials: the estimate, the dissertation's rule on mean MEPs, response counts."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from isiw.dissertation.profiles import best_fit, normality, profile_fits
from isiw.dissertation.regression import curve_masks
from isiw.dissertation.response_counts import TrialsByIsi, by_isi, count_trials
from isiw.errors import InvalidValueError
from isiw.log.reader import SessionRecord
from isiw.report.words import finding_sentences
from isiw.text.sanitize import counted
from isiw.types import FloatArray
from isiw.window import Window

USUAL_TRIALS: Final = 10
"""Trials at each ISI that the dissertation takes means of [Kim2020, 4.2.1]."""


class MethodAnswer(NamedTuple):
    """A method's answer about a window, what it needs for that, and what it cannot say."""

    method: str
    answer: str
    needs: str
    cannot: str


def method_answers(record: SessionRecord) -> list[MethodAnswer]:
    """The estimate of isiw, the dissertation's rule on mean MEPs, response counts, and the form of the profile."""
    trials = by_isi(record.table)
    belief = MethodAnswer(
        "isiw's estimate",
        " ".join(finding_sentences(record)[:2]),
        "Single trials at any ISIs, in their order; TMS alone helps, and is not needed.",
        "Anything reliable about people and noise that its prior does not allow for (docs/model.md).",
    )
    if not len(trials.isi_ms):
        return [belief]
    return [belief, _by_means(trials), _by_counts(trials), _by_form(trials)]


def _means(trials: TrialsByIsi) -> tuple[FloatArray, FloatArray, int]:
    """The ISIs [ms], the mean MEP at each [mV], and the fewest trials at one."""
    at_ms, which, counts = np.unique(trials.isi_ms, return_inverse=True, return_counts=True)
    return at_ms, np.bincount(which, trials.mep_mv) / counts, int(counts.min())


def _by_means(trials: TrialsByIsi) -> MethodAnswer:
    """ISIs about the largest mean whose mean has .135 of its excess over TMS alone."""
    at_ms, mean_mv, fewest = _means(trials)
    known = len(trials.alone_mv) > 0
    baseline_mv = float(trials.alone_mv.mean() if known else np.median(mean_mv))
    inside = curve_masks((mean_mv - baseline_mv)[None], baseline_mv)[0]
    window = Window.from_mask(at_ms, inside)
    of = f"of {counted(len(trials.alone_mv), 'trial')} with TMS alone" if known else "guessed: the median of all means"
    said = f"Baseline {1e3 * baseline_mv:.3g} µV ({of}); means of {counted(fewest, 'trial')} at least."
    return MethodAnswer(
        "Mean MEPs [Kim2020, 4.3; baseline as in 4.2]",
        f"{_told(window)} {said}",
        f"Some {USUAL_TRIALS} trials at every ISI, and TMS alone for the baseline.",
        "How sure it is, and whether there is a window at all: the largest of some means is above any baseline. Few "
        "trials make windows too narrow or torn.",
    )


def _by_counts(trials: TrialsByIsi) -> MethodAnswer:
    """ISIs at which more than 40 % of the trials respond."""
    known = len(trials.alone_mv) > 0
    of = "95 % of the trials with TMS alone are not larger" if known else "a usual value: there is no TMS alone"
    try:
        study = count_trials(trials)
    except InvalidValueError as error:
        answer = f"No answer: {error.what}."
    else:
        answer = f"{_told(study.window)} Threshold of a response {1e3 * study.threshold_mv:.3g} µV ({of})."
    return MethodAnswer(
        "Response counts [Kim2020, 3.3.4]",
        answer,
        "A threshold of the person's own, and some ten trials at every ISI.",
        "How large the enhancement is, and how sure it is; the window depends on the threshold.",
    )


def _by_form(trials: TrialsByIsi) -> MethodAnswer:
    """The form of the mean MEPs by ISI: the number of Gaussians, and a test of normality."""
    at_ms, mean_mv, _ = _means(trials)
    said = []
    try:
        normal = normality(mean_mv)
        said.append(f"The means {'pass' if normal.normal else 'fail'} a test of normality (p = {normal.p_value:.2g}).")
        fits = profile_fits(trials.isi_ms, trials.mep_mv)
        said.append(f"Of up to five Gaussians and a spline, AICc prefers: {best_fit(fits).name}.")
    except InvalidValueError as error:
        said.append(f"No more can be said: {error.what}.")
    return MethodAnswer(
        "Form of the profile [Kim2020, Tables 4.1 and 8.1, Fig. 8.2]",
        " ".join(said),
        "Means at five ISIs and more; a few hundred trials to distinguish two Gaussians from one.",
        f"Where the window is. {counted(len(at_ms), 'ISI')} were used.",
    )


def _told(window: Window | None) -> str:
    return "No window." if window is None else f"Window {window}."
