"""Requests of clients: each call's fields, from JSON or from a form."""

from __future__ import annotations

import json
from typing import Annotated, Any, Final, Generic, TypeVar
from urllib.parse import parse_qsl

from fastapi import Request
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from isiw.checks import MOST_TRIALS
from isiw.config.sections import PersonsVisit, Space, StrategyConfig, require_together, require_units
from isiw.design import VALVE_SPACE
from isiw.devices.limits import PulseLimits
from isiw.errors import InvalidValueError, IsiwError
from isiw.log.schema import TrialNumber
from isiw.server.answers import Refusal
from isiw.server.clients import KEY
from isiw.text.parsing import DoubledKeyError, once_each, read_json
from isiw.text.toml_files import UNKNOWN, expected_instead, first_to_tell, known_keys, meant_instead
from isiw.trials import Status, Trial
from isiw.visit import VisitProtocol

FORM: Final = "application/x-www-form-urlencoded"
JSON: Final = "application/json"

NAME: Final = r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$"
"""What a session may be called: never a path."""

MOST_FIELDS: Final = 50
MOST_WAIT_S: Final = 30.0
MOST_GIVEN: Final = 1000

Text = Annotated[str, Field(max_length=10_000)]

_Kind = TypeVar("_Kind", bound=BaseModel)


class _Request(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class GivenPulses(_Request):
    """Pulses of TMS alone that were given before, such as those over the recruitment curve, in their order."""

    mep_mv: tuple[float, ...] = Field(max_length=MOST_GIVEN, description="Their amplitudes [mV].")
    intensity_pct_rmt: tuple[float, ...] = Field(max_length=MOST_GIVEN, description="Their intensities [% RMT].")

    @property
    def trials(self) -> tuple[Trial, ...]:
        """The pulses as trials."""
        if len(self.mep_mv) != len(self.intensity_pct_rmt):
            raise InvalidValueError(
                "the pulses that were given before have an amplitude and an intensity each",
                got=f"{len(self.mep_mv)} and {len(self.intensity_pct_rmt)}",
            )
        pulses = enumerate(zip(self.mep_mv, self.intensity_pct_rmt, strict=True))
        return tuple(
            Trial(number, Status.ACCEPTED, None, mep_mv=mep_mv, intensity_pct_rmt=pct)
            for number, (mep_mv, pct) in pulses
        )


class CreateRequest(_Request):
    """A new session: its id, and the sections of a configuration file, as for `isiw run`."""

    id: str = Field(pattern=NAME, description="Letters, digits, - and _; the log is ID.mcap.")
    seed: int = Field(default=0, ge=0, lt=2**63, description="Seed of the strategy.")
    visit: PersonsVisit = PersonsVisit()
    space: Space = Field(
        default=VALVE_SPACE, description="Without it, ISIs count from the valve command, from 0 to 500 ms."
    )
    strategy: StrategyConfig = StrategyConfig()
    limits: PulseLimits = PulseLimits()
    protocol: VisitProtocol = VisitProtocol()
    earlier: GivenPulses | None = Field(
        default=None, description="TMS alone that was given before; limits.max_pulses counts it."
    )
    client: str | None = Field(
        default=None,
        pattern=KEY,
        description="The client's own random key: each ask carries it, and no other client is given a trial.",
    )


class ResumeRequest(_Request):
    """Resuming a session from its log."""

    lost_pulses: int | None = Field(
        default=None,
        ge=0,
        lt=MOST_TRIALS,
        description="Needed if the log's end is missing: how many stimuli were given that are not in it.",
    )
    client: str | None = Field(
        default=None, pattern=KEY, description="The key of the client that drives the session from here on."
    )
    takeover: bool = Field(
        default=False, description="Whether another client drove it that has ended; that one's key is refused then."
    )


class AskRequest(_Request):
    """Which trial is asked for, and how long the answer may take."""

    trial: TrialNumber | None = Field(
        default=None,
        description="The number of the trial that comes next. Named again with the client's key, it is a retry, and "
        "answered as before.",
    )
    client: str | None = Field(
        default=None, pattern=KEY, description="The key that was stated when the session was created or resumed."
    )
    wait_s: float = Field(
        default=10.0, ge=0.0, le=MOST_WAIT_S, description="How long to wait here for the inter-trial interval [s]."
    )
    deadline_s: float = Field(
        default=10.0, ge=0.0, le=60.0, description="After this time [s] the next ISI is an evenly spaced one."
    )


_CLIENT: Any = Field(
    default=None, pattern=KEY, description="The client's key, if any; another's than that which asked is refused."
)


class TellRequest(_Request):
    """The outcome of a trial."""

    trial: TrialNumber = Field(description="Its number, as ask has answered it.")
    isi_ms: float | None = Field(
        description="The realised ISI [ms]; null for TMS alone, which needs no ask, as the trial that comes next."
    )
    mep_mv: float = Field(description="Peak-to-peak amplitude [mV]; 0 is below the detection limit.")
    isi_sd_ms: float = Field(default=0.0, description="SD of the realised ISI [ms]; 0 if it was measured.")
    background_rms_uv: float | None = Field(default=None, description="EMG before the pulse [µV RMS], if known.")
    pulse: bool = Field(
        default=True,
        description="False for a tap alone, which needs no ask: mep_mv is what the MEP window would hold at isi_ms.",
    )
    confirm: bool = Field(
        default=False, description="True confirms realised ISIs that are far from those asked; otherwise InDoubt."
    )
    intensity_pct_rmt: float | None = Field(
        default=None,
        description="The intensity that was set [% RMT]: needed of a pair whose ask stated one; of any other pulse, "
        "null for that of the pairs.",
    )
    client: str | None = _CLIENT


class MistrialRequest(_Request):
    """That a trial is lost."""

    trial: TrialNumber = Field(description="Its number, as ask has answered it.")
    reason: Text = Field(
        default="rejected", description="A reason that isiw knows, such as no impact; any other becomes a note."
    )
    client: str | None = _CLIENT


class NoteRequest(_Request):
    """A remark for the log, or what changed."""

    text: Text
    key: str | None = Field(
        default=None,
        pattern=KEY,
        description="Of the client's choice: the same note or change is logged once only, another is refused.",
    )


class IncludeRequest(_Request):
    """Which trial counts again."""

    trial: TrialNumber
    key: str | None = Field(
        default=None,
        pattern=KEY,
        description="Of the client's choice: said again with it, it changes nothing, whatever was said since.",
    )


class ExcludeRequest(IncludeRequest):
    """Which trial should not count, and why."""

    reason: Text = ""


class GoOnRequest(_Request):
    """That a paused session goes on."""

    pause: int = Field(ge=1, description="The number of the pause that was shown; no other one is answered by this.")


class BodyOf(Generic[_Kind]):
    """A dependency of a route: its body as a request of this kind."""

    def __init__(self, kind: type[_Kind]) -> None:
        self.kind = kind

    async def __call__(self, request: Request) -> _Kind:
        """The body of a request."""
        return _read(self.kind, request.headers.get("content-type", ""), await request.body())


def _read(kind: type[_Kind], content_type: str, body: bytes) -> _Kind:
    media_type = content_type.partition(";")[0].strip().lower()
    if media_type == FORM:
        body = _form_as_json(kind, body)
    elif body and media_type != JSON:
        raise Refusal(
            415, "UnsupportedMediaType", "the body is of an unknown type", got=media_type, expected=f"{JSON} or {FORM}"
        )
    body = body or b"{}"
    try:
        request = kind.model_validate_json(body, strict=True)
    except ValidationError as error:
        raise _refused(kind, first_to_tell(error.errors())) from error
    try:
        sent = read_json(body)  # a request does not know which of its fields were sent
    except ValueError as error:
        raise Refusal(400, "MalformedBody", f"the body cannot be read: {error}") from error
    require_units(sent)
    require_together(sent)
    return request


def _form_as_json(kind: type[BaseModel], body: bytes) -> bytes:
    """A form as JSON: texts as they are, all other fields as JSON has them; an empty one is null."""
    try:
        pairs = parse_qsl(body.decode(), keep_blank_values=True, errors="strict", max_num_fields=MOST_FIELDS)
        fields = once_each(pairs)
        values = {name: value if _is_text(kind, name, value) else _value(value) for name, value in fields.items()}
    except ValueError as error:
        raise Refusal(400, "MalformedBody", f"the form cannot be read: {error}") from error
    return json.dumps(values).encode(errors="replace")


def _is_text(kind: type[BaseModel], name: str, value: str) -> bool:
    field = kind.model_fields.get(name)
    return field is None or field.annotation is str or (field.annotation == str | None and value != "")


def _value(text: str) -> Any:
    try:
        return read_json(text) if text else None
    except DoubledKeyError:
        raise
    except ValueError:
        return text


def _refused(kind: type[BaseModel], error: ErrorDetails) -> Refusal:
    """The refusal of a body, by the name of its field."""
    field = ".".join(map(str, error["loc"])) or None
    own = error.get("ctx", {}).get("error")
    if isinstance(own, IsiwError):
        return Refusal.of(own, 422, field=field)
    if error["type"] == "json_invalid":
        return Refusal(400, "MalformedBody", "the body is no JSON", expected=error["msg"])
    known = known_keys(kind, error["loc"][:-1]) if error["type"] in UNKNOWN else []
    missing = error["type"] == "missing"
    what = "is unknown" if known else "is missing" if missing else "cannot be used"
    return Refusal(
        422,
        "InvalidValueError",
        f"the field {field} {what}" if field else "the body cannot be used",
        got=None if missing else error["input"],
        expected=f"one of {', '.join(known)}" if known else None if missing else expected_instead(error),
        remedy=meant_instead(error, known) or None,
        field=field,
    )
