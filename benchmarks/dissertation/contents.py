"""Every table and figure of chapters 3 to 8 and of appendix B, in order of appearance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["CHAPTERS", "Chapter", "Item"]

PHOTOGRAPH, DRAWING, MODEL = "a photograph", "a drawing", "a drawing of the hardware"
DESCRIBED: Final = "a description, which is what the library does"


@dataclass(frozen=True)
class Item:
    """A table or figure.

    Args:
        place: such as "Table 3.2".
        title: what it shows.
        without: why it has no counterpart, such as "a photograph"; None where it has one.
    """

    place: str
    title: str
    without: str | None = None


@dataclass(frozen=True)
class Chapter:
    """A chapter, with its tables and figures.

    Args:
        number: its number; a claim on a section of it begins with this.
        title: its title in our words.
        items: its tables and figures.
    """

    number: str
    title: str
    items: tuple[Item, ...]


CHAPTERS: Final = (
    Chapter(
        "3",
        "Timing of the tapping robot",
        (
            Item("Fig. 3.1", "The robot", PHOTOGRAPH),
            Item("Fig. 3.2", "The tapping motion", DRAWING),
            Item("Fig. 3.3", "Where the delay comes from", DRAWING),
            Item("Fig. 3.4", "The robot over the load cell", PHOTOGRAPH),
            Item("Fig. 3.5", "The robot over a wrist", PHOTOGRAPH),
            Item("Fig. 3.6", "One tap on the load cell"),
            Item("Fig. 3.7", "One tap on a wrist, with TMS"),
            Item("Table 3.1", "Definitions of the events", f"{DESCRIBED} (docs/timing.md)"),
            Item("Table 3.2", "When the events come"),
            Item("Fig. 3.8", "Delays of all events"),
            Item("Fig. 3.9", "From the hit to the tap in the EMG"),
            Item("Fig. 3.10", "How long the hammer presses"),
            Item("Fig. 3.11", "EMG with a long-latency response"),
            Item("Fig. 3.12", "Responses by ISI, electrical and mechanical"),
        ),
    ),
    Chapter(
        "4",
        "Estimating the window",
        (
            Item("Fig. 4.1", "The experiment", DRAWING),
            Item("Fig. 4.2", "Responses by ISI of eleven people"),
            Item("Fig. 4.3", "Where the coil lies", PHOTOGRAPH),
            Item("Fig. 4.4", "The system", DRAWING),
            Item("Fig. 4.5", "How tap and pulse meet", DRAWING),
            Item("Fig. 4.6", "Acceleration and EMG of a trial", "a drawing; Fig. 5.2 has the signals"),
            Item("Fig. 4.7", "How each method samples", DRAWING),
            Item("Fig. 4.8", "Names of the times", DESCRIBED),
            Item("Fig. 4.9", "The hit of five later people"),
            Item("Fig. 4.10", "Iterations of NR"),
            Item("Fig. 4.11", "Iterations of SVMR"),
            Item("Fig. 4.12", "Iterations of GPR"),
            Item("Fig. 4.13", "The window of a Gaussian", f"{DESCRIBED} (docs/definitions.md)"),
            Item("Fig. 4.14", "PF: estimated profiles and trials"),
            Item("Fig. 4.15", "NR: estimated profiles and trials"),
            Item("Fig. 4.16", "SVMR: estimated profiles and trials"),
            Item("Fig. 4.17", "GPR: estimated profiles and trials"),
            Item("Fig. 4.18", "The conventional sweep: profiles and trials"),
            Item("Fig. 4.19", "GPR's window at each iteration"),
            Item("Fig. 4.20", "Steps of the particle filter", DRAWING),
            Item("Fig. 4.21", "EMG at each ISI"),
            Item("Fig. 4.22", "MEP by ISI of subject 4"),
            Item("Table 4.1", "Widths of the windows, and normality"),
            Item("Fig. 4.23", "Correlation with the measured profile"),
            Item("Fig. 4.24", "Trials"),
            Item("Fig. 4.25", "F1"),
            Item("Fig. 4.26", "Convergence"),
            Item("Fig. 4.27", "The particle filter's progress"),
            Item("Fig. 4.28", "Number of particles"),
            Item("Fig. 4.29", "Final particles of subject 3"),
            Item("Fig. 4.30", "Variance of the particles"),
            Item("Fig. 4.31", "NR: number of initial ISIs"),
            Item("Fig. 4.32", "SVMR: number of initial ISIs"),
            Item("Fig. 4.33", "GPR: number of initial ISIs"),
            Item("Fig. 4.34", "Two Gaussians"),
            Item("Fig. 4.35", "Two Gaussians of comparable amplitude"),
        ),
    ),
    Chapter(
        "5",
        "The automated experiment",
        (
            Item("Fig. 5.1", "The cushion", PHOTOGRAPH),
            Item("Fig. 5.2", "Signals of one trial"),
            Item("Fig. 5.3", "The system", DRAWING),
            Item("Fig. 5.4", "How the impact is detected"),
            Item("Fig. 5.5", "Where the MEP is sought", DESCRIBED),
            Item("Fig. 5.6", "How the MEP is measured", DESCRIBED),
            Item("Fig. 5.7", "The online loop", DRAWING),
            Item("Fig. 5.8", "Mean ISI error"),
            Item("Table 5.1", "Probability of an ISI error"),
            Item("Fig. 5.9", "The pulse against the valve"),
            Item("Table 5.2", "MEPs by program and by hand"),
            Item("Table 5.3", "Two people online"),
            Item("Fig. 5.10", "Subject 1 online: iterations"),
            Item("Fig. 5.11", "Subject 2 online: iterations"),
            Item("Fig. 5.12", "Subject 1 online: profile"),
            Item("Fig. 5.13", "Subject 2 online: profile"),
        ),
    ),
    Chapter(
        "6",
        "Interval production by hand",
        (
            Item("Fig. 6.1", "What the person sees", "a picture of the screen"),
            Item("Fig. 6.2", "The set-up", PHOTOGRAPH),
            Item("Fig. 6.3", "The task", DRAWING),
            Item("Fig. 6.4", "Two kinds of feedback", DRAWING),
            Item("Table 6.1", "The modes", "a description"),
            Item("Fig. 6.5", "Response frequencies of two people"),
            Item("Table 6.2", "Produced intervals by mode"),
            Item("Fig. 6.6", "Error and SD by mode"),
            Item("Fig. 6.7", "Mean and SD by scaling factor"),
            Item("Fig. 6.8", "Distributions by scaling factor"),
            Item("Fig. 6.9", "Person and BO at 100 %"),
            Item("Fig. 6.10", "Person and BO at 50 %"),
            Item("Table 6.3", "Person and BO at 100 %"),
            Item("Table 6.4", "Person and BO at 50 %"),
        ),
    ),
    Chapter(
        "7",
        "The rotational vane actuator",
        (
            Item("Fig. 7.1", "The actuator", MODEL),
            Item("Fig. 7.2", "The printed actuator", PHOTOGRAPH),
            Item("Fig. 7.3", "First version", MODEL),
            Item("Fig. 7.4", "First version from the side", MODEL),
            Item("Fig. 7.5", "First version", PHOTOGRAPH),
            Item("Fig. 7.6", "How it works", DRAWING),
            Item("Fig. 7.7", "The pneumatic model", DRAWING),
            Item("Fig. 7.8", "Parameters of the shaft", DRAWING),
            Item("Table 7.1", "Parameters"),
            Item("Fig. 7.9", "Range and delay by depth and height"),
            Item("Fig. 7.10", "Response by height"),
            Item("Fig. 7.11", "Two depths compared"),
        ),
    ),
    Chapter(
        "8",
        "Outlook",
        (
            Item("Table 8.1", "Normality with stronger TMS"),
            Item("Fig. 8.1", "MEPs with stronger TMS"),
            Item("Fig. 8.2", "Fits of one to five Gaussians"),
        ),
    ),
    Chapter("B", "The same person another day", (Item("Fig. B.1", "The window sixteen days apart"),)),
)
"""The dissertation's own titles are longer; these say what is to be seen."""
