"""The calls of the server, one function each."""

from __future__ import annotations

import asyncio
import io
import threading
import time
from collections.abc import AsyncIterator
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Header, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import StreamingResponse
from pydantic import BaseModel

from isiw.plots import session_figure
from isiw.server.answers import (
    AskAnswer,
    DecisionAnswer,
    ErrorAnswer,
    EstimateAnswer,
    OkAnswer,
    Refusal,
    SessionAnswer,
    SessionsAnswer,
    TrialAnswer,
    TrialsAnswer,
)
from isiw.server.driven import DrivenSession
from isiw.server.requests import (
    NAME,
    AskRequest,
    BodyOf,
    CreateRequest,
    ExcludeRequest,
    IncludeRequest,
    MistrialRequest,
    NoteRequest,
    ResumeRequest,
    TellRequest,
)
from isiw.server.sessions import Sessions

POLL_S: Final = 0.1
QUIET_S: Final = 15.0
"""After so long without a trial, a client that follows hears that the server is still there [s]."""

_drawing = threading.Lock()
"""Matplotlib draws one picture at a time."""


def _errors(*statuses: int) -> dict[int | str, dict[str, Any]]:
    return {status: {"model": ErrorAnswer} for status in (401, 403, 408, 413, 422, 500, 503, *statuses)}


async def _status_of_errors(
    errors: Annotated[
        Literal["200"] | None,
        Query(description="Answer errors with status 200, for clients that cannot read the body of an error status."),
    ] = None,
) -> None:
    """Document `errors`; it is read where an error is answered."""
    del errors


router = APIRouter(dependencies=[Depends(_status_of_errors)])


async def _sessions(request: Request) -> Sessions:
    sessions: Sessions = request.app.state.sessions
    return sessions


Folder = Annotated[Sessions, Depends(_sessions)]
Name = Annotated[str, Path(alias="id", pattern=NAME, description="The session's id.")]


def _json(answer: BaseModel) -> Response:
    return Response(answer.model_dump_json(), media_type="application/json")


@router.get("/sessions", responses=_errors(), response_model=SessionsAnswer)
def list_sessions(folder: Folder) -> Response:
    """All sessions of the folder."""
    return _json(SessionsAnswer(sessions=folder.names()))


@router.post("/sessions", responses=_errors(400, 409, 415), response_model=SessionAnswer)
def create(folder: Folder, body: Annotated[CreateRequest, Depends(BodyOf(CreateRequest))]) -> Response:
    """Begin a session. Safe to repeat until something was asked for."""
    return _json(folder.create(body))


@router.get("/sessions/{id}", responses=_errors(404, 409), response_model=SessionAnswer)
def stands(folder: Folder, name: Name) -> Response:
    """The state of a session."""
    return _json(folder.stands(name))


@router.post("/sessions/{id}/resume", responses=_errors(400, 404, 409, 415), response_model=SessionAnswer)
def resume(folder: Folder, name: Name, body: Annotated[ResumeRequest, Depends(BodyOf(ResumeRequest))]) -> Response:
    """Continue a session. A trial without an outcome becomes a mistrial "outcome unknown".

    While another client drives it, that is refused unless it says `takeover`.
    """
    return _json(folder.resume(name, body))


@router.post("/sessions/{id}/ask", responses=_errors(400, 404, 409, 415, 429), response_model=AskAnswer)
async def ask(
    request: Request, folder: Folder, name: Name, body: Annotated[AskRequest, Depends(BodyOf(AskRequest))]
) -> Response:
    """The next ISI, on disk as about to be delivered. Safe to repeat where it names the trial and the client."""
    opened, end_s = await run_in_threadpool(folder.opened, name), time.monotonic() + body.wait_s
    while (wait_s := opened.recorder.wait_s()) > 0:  # without holding a thread
        opened.require_no_wait(end_s - time.monotonic())
        await asyncio.sleep(wait_s)
    if await request.is_disconnected():  # nobody would hear the ISI, which is given out once
        raise Refusal(408, "Disconnected", "the client has hung up meanwhile, so no trial began")

    def asked() -> AskAnswer:
        with folder.driving(name) as session:
            return session.ask(body)

    return _json(await run_in_threadpool(asked))


@router.post("/sessions/{id}/tell", responses=_errors(400, 404, 409, 415, 429), response_model=TrialAnswer)
def tell(folder: Folder, name: Name, body: Annotated[TellRequest, Depends(BodyOf(TellRequest))]) -> Response:
    """The outcome of a trial. Safe to repeat."""
    with folder.driving(name) as session:
        return _json(session.tell(body))


@router.post("/sessions/{id}/mistrial", responses=_errors(400, 404, 409, 415), response_model=TrialAnswer)
def mistrial(
    folder: Folder, name: Name, body: Annotated[MistrialRequest, Depends(BodyOf(MistrialRequest))]
) -> Response:
    """That a trial is lost: it counts as a stimulus, and nothing is learnt from it. Safe to repeat."""
    with folder.driving(name) as session:
        return _json(session.mistrial(body))


@router.post("/sessions/{id}/note", responses=_errors(400, 404, 409, 415), response_model=OkAnswer)
def note(folder: Folder, name: Name, body: Annotated[NoteRequest, Depends(BodyOf(NoteRequest))]) -> Response:
    """Log a remark. Safe to repeat with a key."""
    with folder.driving(name) as session:
        session.remark(session.recorder.note, body)
    return _json(OkAnswer())


@router.post("/sessions/{id}/change", responses=_errors(400, 404, 409, 415), response_model=OkAnswer)
def change(folder: Folder, name: Name, body: Annotated[NoteRequest, Depends(BodyOf(NoteRequest))]) -> Response:
    """That something changed that may bear on all later MEPs, such as the coil's place. Safe to repeat with a key."""
    with folder.driving(name) as session:
        session.remark(session.recorder.note_change, body)
    return _json(OkAnswer())


@router.post("/sessions/{id}/exclude", responses=_errors(400, 404, 409, 415), response_model=SessionAnswer)
def exclude(folder: Folder, name: Name, body: Annotated[ExcludeRequest, Depends(BodyOf(ExcludeRequest))]) -> Response:
    """Let a trial not count. Safe to repeat; with a key also late."""
    with folder.driving(name) as session:
        session.exclude(body)
        return _json(session.stands())


@router.post("/sessions/{id}/include", responses=_errors(400, 404, 409, 415), response_model=SessionAnswer)
def include(folder: Folder, name: Name, body: Annotated[IncludeRequest, Depends(BodyOf(IncludeRequest))]) -> Response:
    """Let a trial count again that was excluded. Safe to repeat; with a key also late."""
    with folder.driving(name) as session:
        session.include(body)
        return _json(session.stands())


@router.post("/sessions/{id}/close", responses=_errors(404, 409), response_model=SessionAnswer)
def close(folder: Folder, name: Name) -> Response:
    """Close a session; its log is complete then. Safe to repeat."""
    return _json(folder.close(name))


@router.get("/sessions/{id}/estimate", responses=_errors(404, 409), response_model=EstimateAnswer)
def estimate(folder: Folder, name: Name) -> Response:
    """The estimate of the window."""
    return _json(folder.estimate(name))


@router.get("/sessions/{id}/decision", responses=_errors(404, 409), response_model=DecisionAnswer)
def decision(folder: Folder, name: Name) -> Response:
    """The decision to stop or not, and why."""
    stands = folder.stands(name)
    return _json(DecisionAnswer(stop=stands.stop, reason=stands.reason, judged_since=stands.judged_since))


@router.get("/sessions/{id}/trials", responses=_errors(404, 409), response_model=TrialsAnswer)
def trials(folder: Folder, name: Name) -> Response:
    """All trials as they count now."""
    return _json(TrialsAnswer(trials=folder.trials(name)))


_PICTURES: Final = {"png": "image/png", "svg": "image/svg+xml"}


@router.get(
    "/sessions/{id}/picture",
    response_class=Response,
    responses={**_errors(404, 409), 200: {"content": {kind: {} for kind in _PICTURES.values()}}},
)
def picture(
    folder: Folder, name: Name, kind: Annotated[Literal["png", "svg"], Query(alias="format")] = "png"
) -> Response:
    """The session as a picture: profile, trials, window, and how the edges developed."""
    drawn = io.BytesIO()
    with _drawing:
        session_figure(folder.record(name)).savefig(drawn, format=kind)
    return Response(drawn.getvalue(), media_type=_PICTURES[kind])


@router.get(
    "/sessions/{id}/progress",
    response_class=StreamingResponse,
    responses={**_errors(404, 409), 200: {"content": {"text/event-stream": {}}}},
)
def progress(
    folder: Folder,
    name: Name,
    last: Annotated[
        str, Header(alias="Last-Event-ID", pattern="^(-1|[0-9]{1,9})$", description="The last trial that is known.")
    ] = "-1",
) -> StreamingResponse:
    """The trials of an open session as Server-Sent Events, until it is closed; each has the data that tell answers."""
    return StreamingResponse(_followed(folder.opened(name), int(last)), media_type="text/event-stream")


async def _followed(session: DrivenSession, last: int) -> AsyncIterator[str]:
    quiet_s = 0.0
    yield ": isiw\n\n"
    while True:
        closed = session.closed  # before looking for trials, so that the last one is not missed
        for outcome in session.outcomes_after(last):
            last, quiet_s = outcome.trial, 0.0
            yield f"event: trial\nid: {last}\ndata: {outcome.model_dump_json()}\n\n"
        if closed:
            yield "event: closed\ndata: {}\n\n"
            return
        await asyncio.sleep(POLL_S)
        quiet_s += POLL_S
        if quiet_s >= QUIET_S:
            quiet_s = 0.0
            yield ": still here\n\n"
