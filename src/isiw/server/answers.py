"""Answers and refusals: each a JSON object, whose `ok` says whether it was done."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final, Literal, Self

from fastapi import Response
from pydantic import BaseModel, ConfigDict, Field

from isiw.decision import StopDecision
from isiw.errors import IsiwError, LimitExceededError, LogError, RequestError, error_text
from isiw.figures import Estimate, Reported
from isiw.findings import Kind
from isiw.session.state import State
from isiw.summary import JUDGED_SINCE, summary
from isiw.text.sanitize import plain
from isiw.trials import Status, Stimulus, Trial, TrialTable

_LONGEST_VALUE: Final = 200

_JUDGED_SINCE: Final = "Whether trials were excluded or included after this, in the log of a closed session."


class Refusal(RequestError):  # noqa: N818 - an answer as much as an error
    """A request that is refused."""

    def __init__(
        self,
        status: int,
        kind: str,
        what: str,
        *,
        field: str | None = None,
        retry_s: float | None = None,
        **details: Any,
    ) -> None:
        super().__init__(what, **details)
        self.status, self.kind, self.field, self.retry_s = status, kind, field, retry_s

    @classmethod
    def of(cls, error: IsiwError, status: int, kind: str = "", field: str | None = None) -> Self:
        """The refusal that an error of isiw is; its kind is the error's class unless it is stated."""
        details: dict[str, Any] = {"got": error.got, "expected": error.expected, "remedy": error.remedy}
        return cls(status, kind or type(error).__name__, error.what, field=field, **details)


def as_refusal(error: BaseException) -> Refusal:
    """Any error as a refusal."""
    if isinstance(error, Refusal):
        return error
    if isinstance(error, IsiwError):
        return Refusal.of(error, 409 if isinstance(error, LimitExceededError | LogError) else 422)
    return failed(error)


def failed(error: BaseException) -> Refusal:
    """The answer if the server has failed, and the request is not at fault."""
    return Refusal(
        500,
        "InternalError",
        f"the server has failed: {error_text(error)}",
        remedy="Deliver nothing. The log is safe; resume the session.",
    )


def answered(refusal: Refusal, *, as_200: bool = False, headers: Mapping[str, str] | None = None) -> Response:
    """The answer to a request that is refused."""
    text = repr(refusal.got)
    got = plain(text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}…")
    error = Error(
        type=refusal.kind,
        status=refusal.status,
        message=plain(str(refusal)),
        got=None if refusal.got is None else got,
        expected=refusal.expected,
        remedy=refusal.remedy,
        field=refusal.field,
        retry_s=refusal.retry_s,
    )
    retry = {} if refusal.retry_s is None else {"Retry-After": str(math.ceil(refusal.retry_s))}
    return Response(
        ErrorAnswer(error=error).model_dump_json(),
        200 if as_200 else refusal.status,
        {**(headers or {}), **retry},
        "application/json",
    )


class _Answer(BaseModel):
    model_config = ConfigDict(frozen=True, ser_json_inf_nan="strings")


class OkAnswer(_Answer):
    """It was done."""

    ok: Literal[True] = True


class Error(_Answer):
    """The fault, and the way out."""

    type: str = Field(description="What kind of error, for software.")
    status: int = Field(description="The HTTP status, also if the answer has another one by errors=200.")
    message: str = Field(description="All of it in words, for people.")
    got: str | None = None
    expected: str | None = None
    remedy: str | None = None
    field: str | None = Field(default=None, description="The field of the request that it is about.")
    retry_s: float | None = Field(default=None, description="After which time the same request will be answered [s].")


class ErrorAnswer(_Answer):
    """It was not done."""

    ok: Literal[False] = False
    error: Error


class DecisionAnswer(OkAnswer):
    """The decision to stop now or not, and why."""

    stop: bool
    reason: str
    judged_since: bool = Field(default=False, description=_JUDGED_SINCE)


class SessionAnswer(OkAnswer):
    """The state of a session."""

    id: str
    open: bool = Field(description="Whether it is open; otherwise it has to be resumed.")
    state: State = Field(description="Its state, in the words of the live page and the terminal.")
    subject: str
    trials: int = Field(description="How many have an outcome; the next one has this number.")
    told: int = Field(description="How many of these count.")
    open_trial: int | None = Field(default=None, description="The trial that began and has no outcome yet.")
    open_isi_ms: float | None = Field(default=None, description="Its ISI [ms].")
    open_intensity_pct_rmt: float | None = Field(default=None, description="Its intensity [% RMT], as ask has it.")
    wait_s: float = Field(default=0.0, description="How long until the next stimulus is allowed [s].")
    stop: bool
    reason: str = Field(description="Why to stop, or to continue.")
    judged_since: bool = Field(default=False, description=_JUDGED_SINCE)

    @classmethod
    def of(cls, trials: TrialTable, asked: Stimulus | None, **stands: Any) -> Self:
        """The answer about a session with these trials, one of which may be open."""
        names = ("trial", "isi_ms", "intensity_pct_rmt")
        opened: dict[str, Any] = {f"open_{name}": getattr(asked, name, None) for name in names}
        return cls(trials=len(trials), told=len(trials.told), **opened, **stands)


class SessionEntry(BaseModel):
    """A session of the folder."""

    id: str
    open: bool


class SessionsAnswer(OkAnswer):
    """The sessions of the folder."""

    sessions: list[SessionEntry]


class AskAnswer(OkAnswer):
    """The next stimuli. They are on disk as about to be delivered."""

    trial: int = Field(description="Its number, for tell or mistrial.")
    isi_ms: float = Field(description="The ISI to deliver [ms].")
    intensity_pct_rmt: float | None = Field(
        description="The intensity to set for it [% RMT]; null where all pairs of the session have the usual one."
    )
    again: bool = Field(description="Whether it was answered before: deliver it only if it was not delivered yet.")


class TrialAnswer(OkAnswer):
    """The record of a trial, and the decision after it; told again, the same."""

    trial: int
    status: Status
    reason: Kind | None = None
    isi_ms: float | None = None
    mep_mv: float | None = None
    stop: bool
    stop_reason: str
    doubts: list[str] = Field(default_factory=list, description="What looks like a wrong unit or a fault of the rig.")

    @classmethod
    def of(cls, trial: Trial, decision: StopDecision, doubts: list[str]) -> Self:
        """The answer about a trial."""
        known = {name: getattr(trial, name) for name in ("status", "reason", "isi_ms", "mep_mv")}
        return cls(trial=trial.index, **known, stop=decision.stop, stop_reason=decision.reason, doubts=doubts)


class TrialRow(BaseModel):
    """A trial as it counts now."""

    trial: int
    status: Status
    reason: Kind | None
    commanded_isi_ms: float | None
    isi_ms: float | None
    mep_mv: float | None
    excluded: bool
    intensity_pct_rmt: float | None

    @classmethod
    def of(cls, trial: Trial) -> Self:
        """The row of a trial."""
        names = ("status", "reason", "commanded_isi_ms", "isi_ms", "mep_mv", "excluded", "intensity_pct_rmt")
        return cls(trial=trial.index, **{name: getattr(trial, name) for name in names})


class TrialsAnswer(OkAnswer):
    """All trials of a session."""

    trials: list[TrialRow]


class EstimateAnswer(Reported, OkAnswer):
    """The estimate of the window; the names are those of the log's `/estimate`."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=True)

    text: str = Field(description="In words.")
    judged_since: bool = Field(default=False, description=_JUDGED_SINCE)

    @classmethod
    def about(cls, estimate: Estimate, too_little: str | None = None, *, judged_since: bool = False) -> Self:
        """The answer of an estimate; if too little was measured, without what is said of a window."""
        known = estimate.model_dump(include={*Reported.model_fields})
        if too_little is None:
            text = f"{summary(estimate)}\n{JUDGED_SINCE}" if judged_since else summary(estimate)
            return cls(text=text, judged_since=judged_since, **known)
        profile = ("grid_ms", "profile_mv", "band_low_mv", "band_high_mv")
        kept = {name: known[name] for name in profile}
        return cls(text=too_little, judged_since=judged_since, probability=None, **kept)
