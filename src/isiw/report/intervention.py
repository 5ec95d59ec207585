"""The report of an intervention: one page with TMS alone before and after, the change, and what was delivered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from isiw import schedule
from isiw.errors import InvalidValueError, IsiwError
from isiw.intervention import Arm, Plan
from isiw.log.record import SessionRecord
from isiw.pairing import words
from isiw.pairing.agenda import Agenda, FollowedPair, course_of
from isiw.pairing.effect import AfterEffect, BlockChange, change_of
from isiw.pairing.pulses import Delivered, TestPulse, pairing_of
from isiw.plots.intervention import change_figure, course_figure, dose_figure
from isiw.plots.style import inline_svg
from isiw.report.html import rendered, write_page
from isiw.report.tables import Fact, first_facts
from isiw.schedule import Part
from isiw.session.replay import strategy_of

_OF_A_SEARCH: Final = frozenset({"strategy"})
"""Facts that mean nothing to an intervention."""

HEADINGS: Final = (
    "block",
    "from the last pair",
    "pulses",
    "change",
    "90 % interval",
    "without a drift",
    "P(more)",
    "mean MEPs",
)
"""The columns of the table."""


@dataclass(frozen=True)
class InterventionContents:
    """What a page about an intervention is made of.

    Args:
        pulses: of TMS alone, in the order of delivery; None while they are to be seen by nobody.
        delivered: the pairs; None while the arm is concealed.
        stimuli: how many stimuli lie between the pulses before and after; None if that is the number of pairs.
        window: at some times [s from the first pair] where the window starts and ends [ms].
        course: what was known of the window at each pair, if it was followed.
        subject: whose it is.
        log: the name of the log.
        states: what a reader must know before trusting the page.
        losses: what is lost of the log.
        facts: names and values of settings.
    """

    pulses: Sequence[TestPulse] | None
    delivered: Sequence[Delivered] | None
    stimuli: int | None = None
    window: Sequence[tuple[float, float, float]] = ()
    course: Sequence[FollowedPair] = ()
    subject: str = "an unnamed subject"
    log: str = ""
    states: Sequence[str] = ()
    losses: Sequence[str] = ()
    facts: Sequence[Fact] = ()

    def change(self) -> AfterEffect:
        """What the pulses say of the change.

        Raises:
            InvalidValueError: too few pulses.
        """
        stimuli = self.stimuli if self.stimuli is not None else len(self.delivered or ())
        return change_of(self.pulses or (), pairs=stimuli)


def contents_of(record: SessionRecord, states: Sequence[str] = ()) -> InterventionContents:
    """What the log of an intervention says; of one whose arm is concealed nothing that would show it."""
    pairing, intervention = pairing_of(record), record.header.intervention
    arm = "concealed" if record.conceals or intervention is None else intervention.arm.words
    plan, unfinished = pairing.plan, record.given < len(schedule.slots(pairing.plan))
    waits = record.conceals and unfinished
    given = [f"{record.given} of {len(schedule.slots(plan))} stimuli of the plan were given."] if unfinished else []
    course, unknown = ((), []) if record.conceals else _course(record)
    facts = [fact for fact in first_facts(record) if fact.name not in _OF_A_SEARCH]
    more = Fact(
        "plan", f"{plan.before} before, {plan.pairs} pairs, {plan.after} in each block after, at each intensity"
    )
    return InterventionContents(
        None if waits else pairing.tests,
        None if record.conceals else pairing.pairs,
        plan.pairs,  # all of them, where there are pulses after them
        () if record.conceals else _window_course(record, plan),
        course,
        record.header.subject or "an unnamed subject",
        record.path.name,
        [*states, *given, *unknown],
        (*record.unread_said, *record.losses),
        [*facts, Fact("arm", arm), Fact("protocol", plan.protocol_code), more],
    )


def _course(record: SessionRecord) -> tuple[tuple[FollowedPair, ...], list[str]]:
    """What was known of the window at each pair, if it was followed, and why that cannot be said."""
    header, intervention = record.header, record.header.intervention
    if intervention is None or intervention.arm is not Arm.WINDOW or not header.strategy.name:
        return (), []
    if not (intervention.plan.probes or intervention.plan.follow_ms):
        return (), []
    try:
        agenda = Agenda(intervention, strategy_of(header), header.seed)
        return course_of(agenda, record.table, header.seed), []
    except IsiwError as error:
        return (), [f"The course of the window cannot be worked out by this version of isiw: {error}"]


def _window_course(record: SessionRecord, plan: Plan) -> list[tuple[float, float, float]]:
    """When the window was known to lie where, while it was used."""
    slots, onsets = schedule.slots(plan), record.onsets
    used = [trial.index for trial in record.table if trial.index in onsets and slots[trial.index].part is Part.PAIRS]
    windows = {estimate.trial: estimate.window for estimate in record.estimates if estimate.window is not None}
    first_s = onsets[used[0]].onset_s if used else 0.0
    return [
        (onsets[number].onset_s - first_s, windows[number].start_ms, windows[number].end_ms)
        for number in used
        if number in windows
    ]


def save_intervention(intervention: InterventionContents, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write the page of an intervention into a file.

    Args:
        intervention: what it is made of.
        path: where to, such as `report.html`.
        overwrite: whether to replace a file that is there; a log never is.

    Raises:
        ConfigError: jinja2 is not installed.
        InvalidValueError: a path that is none of a page, or a file not to be replaced.
    """
    return write_page(path, lambda: intervention_page(intervention), overwrite=overwrite)


def intervention_page(intervention: InterventionContents) -> str:
    """A page of HTML about an intervention; it needs no network and no JavaScript."""
    effect: AfterEffect | None = None
    try:
        effect = intervention.change()
        said = words.statement(effect)
    except InvalidValueError as error:
        few = f"{error.what[:1].upper()}{error.what[1:]}."
        said = [words.NOT_YET if intervention.pulses is None else few]
    delivered = intervention.delivered
    return rendered(
        "intervention.html",
        subject=intervention.subject,
        states=list(intervention.states),
        losses=list(intervention.losses),
        statement=said,
        change="" if effect is None else inline_svg(change_figure(effect, intervention.pulses or ()), "change"),
        headings=HEADINGS,
        rows=[] if effect is None else [_row(change) for change in (*effect.blocks, effect.pooled)],
        dose=words.CONCEALED if delivered is None else words.dose(delivered),
        pairs=inline_svg(dose_figure(delivered, intervention.window), "pairs") if delivered else "",
        course=inline_svg(course_figure(intervention.course), "course") if intervention.course else "",
        facts=list(intervention.facts),
        log=f"Log: {intervention.log}" if intervention.log else "",
    )


def _row(change: BlockChange) -> tuple[str, ...]:
    factor, steady = change.factor, change.steady
    return (
        change.block,
        f"{change.at_min:.0f} min",
        str(change.pulses),
        words.times(factor.median),
        f"{words.times(factor.low)} to {words.times(factor.high)}",
        f"{words.times(steady.low)} to {words.times(steady.high)}",
        f"{change.more:.2f}",
        "–" if change.ratio is None else words.times(change.ratio),
    )
