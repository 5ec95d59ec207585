"""A session's trials and the log that they are in: what is added to the one is added to the other."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from isiw import checks
from isiw.devices.protocol import Answer
from isiw.errors import InvalidValueError, LimitExceededError, told
from isiw.findings import Kind
from isiw.log.schema import Event, EventKind, Intent, Waveform
from isiw.log.verdicts import excluded_by, under_all
from isiw.log.writer import LogWriter
from isiw.strategy.strategy import Strategy
from isiw.trials import Stimulus, Sweep, Trial, TrialTable

__all__ = ["Journal", "learn", "relearned"]


def learn(strategy: Strategy, trial: Trial) -> None:
    """Tell a strategy one trial, or count it where there is nothing to tell.

    Args:
        strategy: the strategy.
        trial: the trial.
    """
    if trial.told:
        strategy.learn(trial.isi_ms, trial.mep_mv, isi_sd_ms=trial.isi_sd_ms)
    elif trial.is_control:
        strategy.count_control()
    elif trial.excluded and trial.reason is None:
        strategy.count_excluded()
    else:
        strategy.count_mistrial()


def relearned(strategy: Strategy, trials: Iterable[Trial]) -> Strategy:
    """The same strategy, told all trials anew.

    Args:
        strategy: the strategy.
        trials: what it learns.
    """
    anew = strategy.restarted()
    for trial in trials:
        learn(anew, trial)
    return anew


class Journal:
    """The trials so far, and the log that they are written to while it is open. Safe to use from several threads.

    Args:
        trials: what was delivered before.
        events: what happened meanwhile.
    """

    def __init__(self, trials: TrialTable | None = None, events: Iterable[Event] = ()) -> None:
        self.begin_after(trials or TrialTable(), events)
        self.unconcluded: Trial | None = None
        self.overruled = False
        self._refusal: Exception | None = None
        self._log: LogWriter | None = None
        self._lock = threading.RLock()

    def begin_after(self, trials: TrialTable, events: Iterable[Event]) -> None:
        """Begin where another run ended.

        Args:
            trials: what was delivered before.
            events: what happened meanwhile.
        """
        self.trials, self._events = trials, list(events)
        self._keys = {event.key for event in self._events}

    @property
    def last_excluded(self) -> int | None:
        """The trial that was excluded last, of those that are; None where none is."""
        excluded = excluded_by(self._events)
        return excluded[-1] if excluded else None

    @property
    def log(self) -> LogWriter:
        """The open log.

        Raises:
            InvalidValueError: there is none.
        """
        if self._log is None:
            raise InvalidValueError(
                "the session is not running, so nothing can be added to its log",
                remedy="Do it while run() is busy, from on_trial or another thread. When no session is writing the "
                "log, use isiw.exclude and isiw.include.",
            )
        return self._log

    @contextmanager
    def writing(self, log: LogWriter) -> Iterator[None]:
        """Within, the log is open."""
        self._log = log
        try:
            yield
        finally:
            self._log = None

    @property
    def is_open(self) -> bool:
        """Whether the log is open."""
        return self._log is not None

    @property
    def last(self) -> int | None:
        """The number of the last trial; None before the first."""
        return len(self.trials) - 1 if self.trials else None

    def event(self, kind: EventKind, text: str, trial: int | None = None, finding: Kind | None = None) -> None:
        """Write that something happened, behind the last trial.

        Args:
            kind: what kind of thing.
            text: what, in words.
            trial: which one it is about; None for the last one.
            finding: what was found, of a doubt or a pause.
        """
        self.log.append(Event(kind=kind, trial=self.last if trial is None else trial, text=text, finding=finding))

    def note(self, text: str, trial: int | None = None, key: str | None = None) -> None:
        """Put a remark on disk; with a key that a note has already, nothing.

        Args:
            text: anything.
            trial: which one it is about; None for the last one.
            key: by which a note that is sent again is known.

        Raises:
            InvalidValueError: it is no text, or the key is none.
        """
        checks.text("a note", text)
        checks.text("the key of a note", key or "")
        with self._lock:
            if key is None or key not in self._keys:
                self.log.append(Event(kind="note", trial=self.last if trial is None else trial, text=text, key=key))
                self._keys.add(key)
        self.log.sync()

    def judge(self, verdict: Callable[[TrialTable], Event]) -> None:
        """Put on disk what an operator says about a trial; from then on the strategy has to learn anew.

        Args:
            verdict: says it, of all trials so far.
        """
        with self._lock:
            event = verdict(self.trials)
            self.log.append(event)
            self.trials = under_all(self.trials, [event])
            self._events.append(event)
            self.overruled = True
        self.log.sync()

    def faults(self, faults: deque[str]) -> None:
        """Write what went wrong and was overcome, in whichever thread."""
        while faults:
            self.event("fault", faults.popleft())

    def refusal(self, kind: EventKind, error: Exception, trial: int | None = None) -> None:
        """Write that a stimulus was refused; where that ends the session, it is not written again.

        Args:
            kind: of event.
            error: why it was refused.
            trial: which one; None for the last one.
        """
        self.event(kind, told(error), trial)
        self._refusal = error

    def failure(self, error: BaseException) -> None:
        """Write what ends a session before its time."""
        if error is self._refusal:
            return
        kind: EventKind = "limit" if isinstance(error, LimitExceededError) else "fault"
        self.event(kind, "Interrupted by the operator." if isinstance(error, KeyboardInterrupt) else told(error))

    def intent(self, stimulus: Stimulus, t_s: float, fallback: str | None = None) -> bool:
        """Put on disk what is about to be delivered; not where a trial was judged anew since it was asked for.

        Args:
            stimulus: what is to be delivered.
            t_s: the time [s].
            fallback: why its ISI is not the acquisition function's choice; None where it is.

        Returns:
            Whether it may be delivered.
        """
        with self._lock:
            if self.overruled:
                return False
            if fallback is not None:
                self.log.append(Event(kind="fallback", trial=stimulus.trial, text=fallback))
            self.log.append(Intent(trial=stimulus.trial, isi_ms=stimulus.isi_ms, t_s=t_s, tap_alone=stimulus.tap_alone))
        self.log.sync()
        return True

    def waveforms(self, stimulus: Stimulus, answer: Answer) -> None:
        """Write what was recorded, where waveforms were.

        Args:
            stimulus: what was delivered.
            answer: what came of it.
        """
        if isinstance(answer, Sweep):
            for name, channel in answer.channels.items():
                self.log.append(Waveform.of(stimulus.trial, channel), name)

    def trial(self, trial: Trial) -> None:
        """Write a trial; it is unconcluded until it is learnt and an estimate is written."""
        with self._lock:
            self.log.append(trial)
            self.trials = self.trials.appended(trial)
            self.unconcluded = trial
