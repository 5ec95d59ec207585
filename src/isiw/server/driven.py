"""One open session as clients drive it: a call at a time, and what is told again is not a second trial."""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from isiw.decision import StopDecision, StopKind
from isiw.errors import InvalidValueError, LimitExceededError, LogError
from isiw.figures import Estimate
from isiw.findings import Kind
from isiw.log.new_verdicts import KeyTakenError
from isiw.log.record import SessionRecord
from isiw.log.schema import Event
from isiw.server.answers import AskAnswer, EstimateAnswer, Refusal, SessionAnswer, TrialAnswer, failed
from isiw.server.clients import driven_from_here, given_once, logged_client, require_own
from isiw.server.requests import AskRequest, ExcludeRequest, IncludeRequest, MistrialRequest, NoteRequest, TellRequest
from isiw.session.recorder import Recorder
from isiw.session.state import State, state_of
from isiw.trials import Status, Trial

BUSY_S: Final = 5.0
"""The longest wait of a call for the one before it."""

_HARMLESS: Final = (Refusal, InvalidValueError, LimitExceededError)
"""Errors that change nothing, unless a trial was logged and not concluded."""


class DrivenSession:
    """An open session; every call is made within `alone`."""

    def __init__(
        self, name: str, subject: str, recorder: Recorder, doubts: list[str], record: SessionRecord | None = None
    ) -> None:
        self.name, self.subject, self.recorder = name, subject, recorder
        self.client = None if record is None else logged_client(record)
        self.closed = False
        self._doubts, self._lock = doubts, threading.Lock()
        self._outcomes = {} if record is None else _outcomes(record)
        self._outcomes |= {  # those that became mistrials on resuming
            trial.index: TrialAnswer.of(trial, recorder.decision(), [])
            for trial in recorder.trials
            if trial.index not in self._outcomes
        }

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Within, no other call drives the session. What fails otherwise than by a wrong value or a limit closes it."""
        if not self._lock.acquire(timeout=BUSY_S):
            raise Refusal(409, "Busy", "the session is busy with another call", got=self.name, retry_s=1.0)
        try:
            self._require_open()
            yield
        except BaseException as error:
            concluded = len(self.recorder.trials) == len(self._outcomes)
            if concluded and isinstance(error, _HARMLESS):
                raise
            self.closed = True
            self.recorder.fail(error)
            if not concluded and not isinstance(error, Refusal | LogError):  # not for anything that the client sent
                raise failed(error) from error
            raise
        finally:
            self._lock.release()

    def _require_open(self) -> None:
        if self.closed:
            raise not_open(self.name)

    def close(self) -> SessionAnswer:
        """Close its log, an open trial as a mistrial; how it stands then."""
        self.give_up()
        stands = self.stands()
        self.closed = True
        self.recorder.close()
        return stands.model_copy(update={"open": False, "state": State.ENDED, "wait_s": 0.0})

    def outcomes_after(self, trial: int) -> list[TrialAnswer]:
        """The outcomes of the trials after one, in order."""
        return [self._outcomes[number] for number in sorted(self._outcomes.copy()) if number > trial]

    def stands(self) -> SessionAnswer:
        """The state of the session."""
        decision = self.recorder.decision()
        return SessionAnswer.of(
            self.recorder.trials,
            self.recorder.asked,
            id=self.name,
            open=True,
            state=state_of(begun=True, running=True, paused=False, rests=self.recorder.rests, fault=False),
            subject=self.subject,
            wait_s=self.recorder.wait_s(),
            stop=decision.stop,
            reason=decision.reason,
        )

    def estimate(self) -> EstimateAnswer:
        """The estimate of the window now."""
        estimate = self.recorder.estimate()
        return EstimateAnswer.about(estimate.in_figures(Estimate), estimate.too_little)

    def require_no_wait(self, most_s: float) -> None:
        """Raise if the next stimulus is not allowed soon."""
        wait_s = self.recorder.wait_s()
        if wait_s > most_s:
            raise Refusal(
                429,
                "TooEarly",
                f"the next stimulus is allowed in {wait_s:.1f} s",
                remedy="Wait that long and send the request again. No trial began.",
                retry_s=wait_s,
            )

    def give_to(self, client: str | None) -> None:
        """Let a client drive the session from here on; another's key is refused then."""
        if client != self.client:
            self.recorder.remark(driven_from_here(client))
            self.client = client

    def ask(self, request: AskRequest) -> AskAnswer:
        """The next ISI; that of an open trial only to the client that it was given to, and that names the trial."""
        asked, comes_next = self.recorder.asked, len(self.recorder.trials)
        require_own(self.client, request.client, None if asked is None else asked.trial)
        if asked is not None and asked.isi_ms is None:
            raise Refusal(
                409,
                "TrialOpen",
                f"trial {asked.trial} is {'a tap' if asked.tap_alone else 'TMS'} alone, and its outcome was refused",
                remedy="Tell a valid outcome, or make it a mistrial.",
            )
        if asked is not None and request.trial is None and self.client is not None:
            raise Refusal(
                409,
                "TrialOpen",
                f"trial {asked.trial} was requested and has no outcome; it may have been delivered",
                got=asked.isi_ms,
                remedy="Tell its outcome, or make it a mistrial. Only where the answer of ask was lost, ask again with "
                f"trial={asked.trial}.",
            )
        if request.trial not in {None, comes_next}:
            raise Refusal(
                409, "WrongTrial", "another trial comes next", got=request.trial, expected=f"trial {comes_next}"
            )
        if asked is not None and self.client is None:
            raise given_once(asked.trial, asked.isi_ms)
        self.require_no_wait(request.wait_s)  # another client may have been faster
        isi_ms = self.recorder.ask(request.deadline_s)
        set_pct_rmt = self.recorder.intensity_pct_rmt
        return AskAnswer(trial=comes_next, isi_ms=isi_ms, intensity_pct_rmt=set_pct_rmt, again=asked is not None)

    def tell(self, request: TellRequest) -> TrialAnswer:
        """Log the outcome of a trial; told again it is answered as at first."""
        is_pair = request.pulse and request.isi_ms is not None
        if request.trial in self._outcomes:
            return self._known(request.trial, _in_words(self._as_logged(request) if is_pair else request))
        self._require_next(request.trial, asked=is_pair)
        with self._refusals_of(request.trial, _in_words(request)):
            self._require_given_to(request.client)
            self._require_intensity(request)
            self.recorder.tell(
                request.isi_ms,
                request.mep_mv,
                isi_sd_ms=request.isi_sd_ms,
                background_rms_uv=request.background_rms_uv,
                pulse=request.pulse,
                confirm=request.confirm,
                intensity_pct_rmt=request.intensity_pct_rmt,
            )
        return self._concluded()

    def mistrial(self, request: MistrialRequest) -> TrialAnswer:
        """That a trial is lost; told again it is answered as at first."""
        if request.trial in self._outcomes:
            return self._known(request.trial, f"mistrial, {request.reason}", Kind.of_mistrial(request.reason))
        self._require_next(request.trial, asked=True)
        with self._refusals_of(request.trial, f"mistrial, {request.reason}"):
            self._require_given_to(request.client)
        self.recorder.mistrial(request.reason)
        return self._concluded()

    def _require_given_to(self, client: str | None) -> None:
        """Raise if another client, by its key, reports what came of the ISI that was given out."""
        asked = self.recorder.asked
        if client is not None and asked is not None and asked.isi_ms is not None:
            require_own(self.client, client, asked.trial)

    def _require_intensity(self, request: TellRequest) -> None:
        """Raise if a pair is reported without its intensity, as by software that has never set the one it was given."""
        asked = self.recorder.asked
        given = None if asked is None else asked.intensity_pct_rmt
        if given is not None and request.intensity_pct_rmt is None and request.pulse and request.isi_ms is not None:
            raise Refusal(
                422,
                "InvalidValueError",
                "pairs of this session have several intensities, and it is not stated which one was set",
                expected=f"intensity_pct_rmt = {given:g}, as ask has answered, or that which was delivered",
                remedy="Set the intensity that ask answers before each pulse, and report it with the outcome. If "
                "it was not set and is not known, make the trial a mistrial.",
                field="intensity_pct_rmt",
            )

    def _as_logged(self, request: TellRequest) -> TellRequest:
        """The outcome of a pair as the log has it, where the usual intensity is none."""
        is_usual = request.intensity_pct_rmt == self.recorder.strategy.usual_pct_rmt
        return request.model_copy(update={"intensity_pct_rmt": None}) if is_usual else request

    @contextmanager
    def _refusals_of(self, trial: int, words: str) -> Iterator[None]:
        """Within, an outcome of the open trial that is refused is in the log, once, with the reason."""
        try:
            yield
        except (Refusal, InvalidValueError) as error:
            if self.recorder.asked is not None:
                text = f"An outcome of trial {trial} was refused: {words}; {error.what}"
                self.recorder.remark(Event(kind="note", trial=trial, text=text, key=text))
            if error.found is Kind.ISIS_FAR:
                raise Refusal.of(error, 409, "InDoubt", field="confirm") from error
            raise

    def give_up(self) -> None:
        """Make an open trial a mistrial: nobody knows what came of it."""
        if self.recorder.asked is not None:
            self.recorder.mistrial(Kind.OUTCOME_UNKNOWN)
            self._concluded()

    def remark(self, log: Callable[..., None], request: NoteRequest) -> None:
        """Log a note or a change, once with its key; something else's key is refused."""
        with _other_key():
            log(request.text, key=request.key)

    def exclude(self, request: ExcludeRequest) -> None:
        """Let a trial not count, once with its key; one that is excluded stays so, unless its ISI is in doubt."""
        excluded = {trial.index for trial in self.recorder.trials if trial.excluded} - {*self.recorder.in_doubt}
        if request.key is not None or request.trial not in excluded:
            with _other_key():
                self.recorder.exclude(request.trial, request.reason, key=request.key)

    def include(self, request: IncludeRequest) -> None:
        """Let a trial count again, once with its key; one that counts already does so."""
        is_so = any(trial.index == request.trial and trial.counts for trial in self.recorder.trials)
        if request.key is not None or not is_so:
            with _other_key():
                self.recorder.include(request.trial, key=request.key)

    def _require_next(self, trial: int, *, asked: bool) -> None:
        """Raise if a trial cannot have an outcome, as it was not asked for."""
        stimulus, comes_next = self.recorder.asked, len(self.recorder.trials)
        if trial == comes_next and (stimulus is not None or not asked):
            return
        raise Refusal(
            409,
            "NotAsked",
            f"trial {trial} was not requested",
            got=trial,
            expected=f"trial {comes_next}{'' if stimulus else ', once it was requested'}",
            remedy="Call ask, deliver, and then tell.",
            field="trial",
        )

    def _known(self, number: int, words: str, reason: Kind | None = None) -> TrialAnswer:
        """The first answer about a trial, to who tells it again."""
        trial = self.recorder.trials[number]
        recorded = _recorded(trial)
        if reason == trial.reason if trial.status is Status.MISTRIAL else words == recorded:
            return self._outcomes[number]
        late = trial.reason is Kind.OUTCOME_UNKNOWN
        if late:
            text = f"An outcome of trial {number} came too late and is not used: {words}"
            self.recorder.note(text, key=f"late {number}: {words}")
        raise Refusal(
            409,
            "Late" if late else "OtherOutcome",
            f"trial {number} has another outcome already",
            got=words,
            expected=f"what is recorded: {recorded}",
            remedy="It stays as it is." + (" What came too late is in the log as a note." if late else ""),
            field="trial",
        )

    def _concluded(self) -> TrialAnswer:
        doubts = self._doubts.copy()
        self._doubts.clear()
        answer = TrialAnswer.of(self.recorder.trials[-1], self.recorder.decision(), doubts)
        self._outcomes[answer.trial] = answer
        return answer


@contextmanager
def _other_key() -> Iterator[None]:
    """Within, a key that is that of something else is a refusal."""
    try:
        yield
    except KeyTakenError as error:
        raise Refusal.of(error, 409, "OtherKey", field="key") from error


def not_open(name: str) -> Refusal:
    """That a session cannot be driven."""
    return Refusal(409, "NotOpen", "the session is not open", got=name, remedy="Resume it: /sessions/ID/resume.")


def _outcomes(record: SessionRecord) -> dict[int, TrialAnswer]:
    """The answers about the trials of a log when they were told."""
    decisions: dict[int, StopDecision] = {}
    for estimate in record.estimates:  # the first of a trial; later ones are of verdicts
        decisions.setdefault(estimate.trial, estimate.decision)
    unknown, doubts = StopKind.OWN.go_on(""), defaultdict[int | None, list[str]](list)
    for event in record.events:
        if event.kind == "doubt":
            doubts[event.trial].append(event.text)
    trials = ((trial, decisions.get(trial.index, unknown), doubts[trial.index]) for trial in record.table)
    return {trial.index: TrialAnswer.of(trial, decision, said) for trial, decision, said in trials}


def _recorded(trial: Trial) -> str:
    """What was told about a trial, in words."""
    if trial.status is Status.MISTRIAL:
        return f"mistrial, {trial.reason}"
    names = ("isi_ms", "mep_mv", "isi_sd_ms", "background_rms_uv", "intensity_pct_rmt")
    told = {name: getattr(trial, name) for name in names}
    return _in_words(TellRequest.model_construct(trial=trial.index, **told, pulse=not trial.tap_alone))


def _in_words(told: TellRequest) -> str:
    """What is told about a trial, in words that differ where its values do."""
    usual = {"isi_sd_ms": 0.0, "background_rms_uv": None, "pulse": True, "intensity_pct_rmt": None}
    values = told.model_dump(exclude={"trial", "client", "confirm"})
    return " ".join(f"{name}={value}" for name, value in values.items() if name not in usual or value != usual[name])
