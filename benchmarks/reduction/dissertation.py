"""The dissertation's own numbers, by figure and table, to be held beside ours.

Which method a bar of Fig. 4.24 and 4.25 belongs to was inferred from a copy in which the figures' text is out of order:
likely, not certain. Correlations are confirmed by the text.
"""

from __future__ import annotations

from typing import Final

METHODS: Final = ("nr", "svmr", "gpr", "pf")
"""The dissertation's methods, beside its conventional sweep."""

TRIALS: Final = {
    "without": {"nr": 16, "svmr": 33, "gpr": 18, "pf": 199, "incremental": 272},
    "with": {"nr": 15, "svmr": 18, "gpr": 15, "pf": 190},
}
"""Fig. 4.24, without and with accelerometer."""

TRIALS_SEVEN: Final = {"nr": (13, 5), "svmr": (30, 10), "gpr": (21, 5), "pf": (199, 79), "incremental": (271, 108)}
"""Fig. 4.14–4.18, seven initial observations: mean and SD."""

PEOPLE: Final = {"without": 11, "with": 5}
"""How many people the text has (4.2)."""

RUNS: Final = {"without": 300, "with": 150}
"""Of how many runs a share converged: without accelerometer the printed shares are thirds of 300 runs; with it they are
whole numbers of about 150 runs at least, which is taken for their number."""

F1: Final = {
    "without": {"nr": 0.65, "svmr": 0.69, "gpr": 0.81, "pf": 0.54, "incremental": 1.0},
    "with": {"nr": 0.66, "svmr": 0.77, "gpr": 0.81, "pf": 0.64},
}
"""Fig. 4.25."""

CORRELATION: Final = {"nr": 0.60, "svmr": 0.70, "gpr": 0.79, "pf": 0.70}
"""Fig. 4.23, with the measured profile, without accelerometer."""

CONVERGED: Final = {
    "without": {"nr": 0.9933, "svmr": 0.8233, "gpr": 0.9133, "pf": 1.0},
    "with": {"nr": 0.9615, "svmr": 0.9409, "gpr": 0.9484, "pf": 1.0},
}
"""Fig. 4.26."""

SIGNIFICANT_CORRELATIONS: Final = (("gpr", "nr"), ("gpr", "pf"), ("svmr", "nr"))
"""4.4.2: the first correlates better than the second, at .05."""

WIDTHS_MS: Final = (75, 65, 80, 70, 110, 120, 220, 145, 135, 110, 60)
"""Table 4.1."""

NORMAL_OF_ELEVEN: Final = 8
"""Table 4.1: profiles whose normality a Shapiro–Wilk test does not reject."""

TWO_GAUSSIANS: Final = (0.57, 0.09, 0.70)
"""Fig. 4.34 and 4.4.8: normalised amplitudes, and how often the smaller converged to zero."""

ONLINE: Final = {"correlation": (0.83, 0.85), "stimuli": (23, 15), "conventional": (264, 408)}
"""Table 5.3, two subjects."""
