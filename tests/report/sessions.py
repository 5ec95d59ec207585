"""Sessions with waveforms to report on, and what a page of HTML says."""

from __future__ import annotations

from dataclasses import dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from isiw.design import DesignSpace
from isiw.devices.robot.tapper import Tapper, TapperSettings
from isiw.devices.simulated import SimulatedDevice
from isiw.log.record import SessionRecord, read_session
from isiw.log.schema import EstimateRecord
from isiw.session.loop import Session
from isiw.session.sink import SessionUpdate
from isiw.trials import Status, Trial
from isiw.visit import Visit, VisitProtocol
from known import instance
from scripted import scripted_strategy

HOSTILE = "<script>document.title='taken'</script><b>P07</b>"
SPACE = DesignSpace(0, 200, reference="impact")


@dataclass(frozen=True)
class Evoked:
    mep_mv: float


def tapped(path: Path, trials: int = 6, subject: str = HOSTILE) -> SessionRecord:
    """A session at the simulated robot, with a note, an exclusion and a control trial."""
    device = Tapper(
        lambda isi_ms: Evoked(0.05 + (isi_ms or 0.0) / 1e3), settings=TapperSettings(rate_hz=2000.0), seed=3
    )

    def on_trial(update: SessionUpdate) -> None:
        if update.trial.index == 1:
            session.note("The arm was moved. </script><img src='https://elsewhere.example/x.png'>")
        if update.trial.index == 3:
            session.exclude(2, "cough")

    session = Session(
        SimulatedDevice(device),
        scripted_strategy(trials, space=SPACE),
        log=path,
        subject=subject,
        visit=Visit(day=2, operator="MK", muscle="FCR"),
        protocol=VisitProtocol(tms_alone=0.2, taps_first=0),
        on_trial=on_trial,
    )
    session.run()
    return read_session(path)


def with_estimate(record: SessionRecord, **changes: Any) -> SessionRecord:
    """The same session with another last estimate, without waveforms."""
    entries = list(record.history)
    entries[-1] = instance(EstimateRecord, entries[-1]).model_copy(update=changes)
    return type(record)(record.path, record.header, tuple(entries), (), True)


def pulsed(record: SessionRecord) -> SessionRecord:
    """The same session with an electrical pulse in the place of the tap, and at its end one alone."""
    device = replace(record.header.device, name="stimulator", conditioning="electrical")
    history: list[Any] = [replace(e, t_valve_ms=None) if isinstance(e, Trial) else e for e in record.history]
    alone = Trial(record.table[-1].index + 1, Status.ACCEPTED, None, tap_alone=True, t_hit_ms=700.0)
    return replace(
        record,
        header=record.header.model_copy(update={"device": device}),
        history=(*history, alone),
        waveforms={key: channel for key, channel in record.waveforms.items() if key[1] == "emg"},
    )


class Page(HTMLParser):
    """The texts of a page by the tag around them, its attributes, and its data."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.texts: list[tuple[str, str]] = []
        self.attributes: list[tuple[str, str, str]] = []
        self._open: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        while self._open and self._open.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        if self._open and data.strip():
            self.texts.append((self._open[-1], data.strip()))

    def of(self, *tags: str) -> list[str]:
        return [text for tag, text in self.texts if tag in tags]

    @property
    def words(self) -> str:
        """All that a reader sees."""
        return " ".join(text for tag, text in self.texts if tag not in {"script", "style"})
