"""Requests that are refused, and what is answered to them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from fastapi import Response

from isiw.errors import IsiwError, LimitExceededError, LogError, RequestError, told
from isiw.server.answers import Error, ErrorAnswer
from isiw.text import plain

_LONGEST_VALUE: Final = 200


class Refusal(RequestError):  # noqa: N818 - an answer as much as an error
    """A request that is refused."""

    def __init__(
        self,
        status: int,
        kind: str,
        what: str,
        *,
        got: object = None,
        expected: str | None = None,
        remedy: str | None = None,
        field: str | None = None,
        retry_s: float | None = None,
    ) -> None:
        super().__init__(what, got=got, expected=expected, remedy=remedy)
        self.status, self.kind, self.field, self.retry_s = status, kind, field, retry_s


def as_refusal(error: BaseException) -> Refusal:
    """Any error as a refusal."""
    if isinstance(error, Refusal):
        return error
    if isinstance(error, IsiwError):
        status = 409 if isinstance(error, LimitExceededError | LogError) else 422
        details = {"got": error.got, "expected": error.expected, "remedy": error.remedy}
        return Refusal(status, type(error).__name__, error.what, **details)  # type: ignore[arg-type] # as they are
    return failed(error)


def failed(error: BaseException) -> Refusal:
    """The answer where the server has failed, and the request is not at fault."""
    return Refusal(
        500,
        "InternalError",
        f"the server has failed: {told(error)}",
        remedy="Deliver nothing. The log is safe; resume the session.",
    )


def answered(refusal: Refusal, *, as_200: bool = False, headers: Mapping[str, str] | None = None) -> Response:
    """The answer to a request that is refused."""
    error = Error(
        type=refusal.kind,
        status=refusal.status,
        message=plain(str(refusal)),
        got=None if refusal.got is None else plain(_shortened(refusal.got)),
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


def _shortened(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}…"
