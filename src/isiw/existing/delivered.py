"""Trials of one person that were delivered without isiw: what was given, what came of it, and what is known besides."""

from __future__ import annotations

import datetime as dt
import math
import statistics
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, NoReturn

import isiw
from isiw.checks import MOST_TRIALS
from isiw.design import MOST_ISIS, DesignSpace
from isiw.errors import InvalidValueError, LogError
from isiw.existing.layout import EMG_UNITS, ISI_UNITS_MS
from isiw.findings import AMPLITUDE_MV, Kind
from isiw.log.codes import spelling
from isiw.log.continuing import require_search
from isiw.signals.limits import SignalLimits
from isiw.signals.plausible import implausible_scale
from isiw.sweeps import Channel
from isiw.text.sanitize import counted
from isiw.trials import Trial, TrialTable
from isiw.types import Conditioning, Reference
from isiw.visit import Visit

_QUIET_MV: Final = 1.5e-3  # the noise of an amplifier has more from peak to peak
LONGEST_ISI_MS: Final = 5000.0  # no tap is studied after a longer interval; a larger number is in another unit


@dataclass(frozen=True, eq=False)
class Delivered:
    """Trials of one person that were delivered without isiw.

    Args:
        trials: the trials, in the order of delivery.
        reference: the event that their ISIs count from.
        subject: the person's code.
        visit: what is known of the visit.
        source: where they are from, in words.
        created: when the first one was delivered, as ISO 8601 in UTC; empty if unknown.
        given_by: when all of them had been delivered, at the latest that their dates allow; empty if unknown.
        signals: what sweeps were judged by.
        sweeps: the waveforms, by trial and channel; empty if amplitudes alone are known.
        blocks: the first trial of each block, and what the block is called.
        conditioning: the conditioning stimulus.
        simulated: true if nobody was stimulated: the person is simulated.
        units: the units in which ISIs and amplitudes are stated where they are from.
        units_by: the column of the ISIs, and that of the amplitudes or the channel, if it says its unit itself.
        unused: the columns of a table of which nothing was read.
        notes: what the operator should know of how they were read.
        files: the SHA-256 of each file that was read, by its name.

    Raises:
        InvalidValueError: no pair of stimuli, more trials than any session has, or numbers that are probably in another
            unit or column.
    """

    trials: TrialTable
    reference: Reference
    subject: str = ""
    visit: Visit = field(default_factory=Visit)
    source: str = ""
    created: str = ""
    given_by: str = ""
    signals: SignalLimits = field(default_factory=SignalLimits)
    sweeps: Mapping[int, Mapping[str, Channel]] = field(default_factory=dict)
    blocks: Mapping[int, str] = field(default_factory=dict)
    conditioning: Conditioning = "tap"
    simulated: bool = False
    units: tuple[str, str] = ("ms", "mV")
    units_by: tuple[str, str] = ("", "")
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if len(self.trials) >= MOST_TRIALS:
            raise InvalidValueError(f"{self.named} has more trials than any session", got=len(self.trials))
        isis_ms = [trial.isi_ms for trial in self.trials if trial.isi_ms is not None]
        if not isis_ms:
            what = f"{self.named} has no pair of stimuli"
            raise InvalidValueError(what, remedy="Which column holds the ISIs, or which marker is of the tap?")
        judged = [trial for trial in self.trials if trial.told or trial.reason is Kind.IMPLAUSIBLE]
        self._require_units(isis_ms, [trial.mep_mv for trial in judged if trial.mep_mv is not None])

    @property
    def named(self) -> str:
        """The trials in words, for a message."""
        return f"{self.source or 'the data'}{f', {self.subject},' if self.subject else ''}"

    def __str__(self) -> str:
        return f"{self.subject or 'unnamed'}: {self.trials}"

    @property
    def isis_ms(self) -> list[float]:
        """The ISIs of the trials that count [ms], those of control trials left out."""
        return [trial.isi_ms for trial in self.trials if trial.told and trial.isi_ms is not None]

    def space(self) -> DesignSpace:
        """The range of the ISIs that were delivered, in whole ms."""
        isis_ms = self.isis_ms
        if not isis_ms:
            reasons = sorted({str(trial.reason) for trial in self.trials if trial.reason is not None})
            remedy = "A trial counts if it has an ISI and an amplitude, and if no column excludes it."
            raise InvalidValueError(f"no trial of {self.named} counts", got=", ".join(reasons) or None, remedy=remedy)
        low, high = math.floor(round(min(isis_ms), 6)), math.ceil(round(max(isis_ms), 6))  # of times in s, too
        if not 1 <= high - low < MOST_ISIS:
            what = f"the ISIs of {self.named} are {'all the same' if high == low else 'too far apart for a window'}"
            remedy = "A window is found among several ISIs. Which column holds them, and in which unit?"
            raise InvalidValueError(what, got=(min(isis_ms), max(isis_ms)), remedy=remedy)
        return DesignSpace(float(low), float(high), reference=self.reference)

    def _require_units(self, isis_ms: Sequence[float], meps_mv: Sequence[float]) -> None:
        """Raise if ISIs and amplitudes are probably swapped, or in other units than is stated."""
        seen = [mep_mv for mep_mv in meps_mv if mep_mv > 0]
        longest_ms, usual_mv = max(map(abs, isis_ms)), statistics.median(seen) if seen else 0.0
        repeated = len(set(seen)) <= len(seen) / 2 and len(set(isis_ms)) > len(isis_ms) / 2
        if len(seen) >= 6 and repeated and usual_mv > statistics.median(map(abs, isis_ms)):
            what = f"the columns of {self.named} are probably swapped: the amplitudes repeat as ISIs do"
            got = f"ISIs such as {isis_ms[0]:.4g} and amplitudes such as {seen[0]:.4g} mV"
            raise InvalidValueError(what, got=got, remedy="Name them: --column isi=NAME --column mep=NAME.")
        of_isis, of_meps = self.units
        if longest_ms != 0 and not 1 <= longest_ms <= LONGEST_ISI_MS:
            longest = longest_ms / ISI_UNITS_MS[of_isis]
            fits = [unit for unit in ("ms", "s", "us") if 1 <= longest * ISI_UNITS_MS[unit] <= LONGEST_ISI_MS]
            self._refuse_unit("ISIs", "isi", f"at most {longest:g} {of_isis}", of_isis, fits)
        if implausible_scale(meps_mv) is not None or usual_mv > AMPLITUDE_MV.most or 0 < usual_mv < _QUIET_MV:
            usual = usual_mv / EMG_UNITS[of_meps]
            fits = [unit for unit in ("mV", "uV", "V", "nV") if 0.01 <= usual * EMG_UNITS[unit] <= AMPLITUDE_MV.most]
            self._refuse_unit("amplitudes", "mep", f"{usual:.3g} {of_meps} in the median", of_meps, fits)

    def _refuse_unit(self, what: str, key: str, got: str, stated: str, fits: Sequence[str]) -> NoReturn:
        by = self.units_by[key == "mep"]
        too = f' and --where "{by}=*", since its name or header says another' if by else ""
        said = f"If they are in {fits[0]}, say --unit {fits[0]}{too}; if" if fits else "If"
        other = "channel holds the EMG, say --channel emg" if self.sweeps else f"column holds them, say --column {key}"
        what = f"the {what} of {self.named} cannot be in {stated}"
        raise InvalidValueError(what, got=got, remedy=f"{said} another {other}=NAME.")


def anywhere(reference: Reference) -> DesignSpace:
    """A space that any ISI can have come from."""
    return DesignSpace(-10_000.0, 10_000.0, 10.0, reference=reference)


def read_log(path: str | Path) -> Delivered:
    """The trials of a log of a search for a window, as they count after an operator's verdicts."""
    record = isiw.read_session(path)
    require_search(record.path, record.header)
    if record.losses:
        raise LogError("the log is damaged, so that trials may be missing", got=str(path), remedy=f"{record.losses[0]}")
    header = record.header
    sweeps = dict[int, dict[str, Channel]]()
    for (number, name), channel in record.waveforms.items():
        sweeps.setdefault(number, {})[name] = channel
    given_by, at_ns = header.given_by, [onset.at_ns for onset in record.onsets.values()]
    if not header.imported:  # its last stimulus was about to be delivered then, if that is known of all
        last = dt.datetime.fromtimestamp(max(at_ns, default=0) / 1e9 + 1, dt.UTC)
        given_by = last.isoformat(timespec="seconds") if 0 < len(at_ns) >= len(record.table) else ""
    return Delivered(
        record.table,
        header.space.reference,
        source=header.source or record.path.name,
        given_by=given_by,
        sweeps=sweeps,
        simulated=header.device.simulated,
        **{name: getattr(header, name) for name in ("subject", "visit", "created", "signals", "conditioning")},
    )


def renumbered(trials: Sequence[Trial]) -> TrialTable:
    """Trials as a table, numbered from 0 on."""
    return TrialTable(tuple(one if one.index == n else replace(one, index=n) for n, one in enumerate(trials)))


def spelt_otherwise(codes: Iterable[str]) -> dict[str, InvalidValueError]:
    """By codes that are spellings of one, why nobody can be analysed as two people."""
    alike = defaultdict[str, set[str]](set)
    for code in codes:
        alike[spelling(code)].add(code)
    remedy = "For the same person write one code everywhere; for another, one that differs in more."
    only = "differs from another one only in case, spaces, hyphens or underscores"
    return {code: InvalidValueError(f"the code {code} {only}", got=", ".join(sorted(group - {code})), remedy=remedy)
            for group in alike.values() if len(group) > 1 for code in sorted(group)}  # fmt: skip


def codes_of(people: Sequence[Delivered]) -> str:
    """People by their codes, in words, for a message."""
    names = [f"{one.subject or 'unnamed'}{f' day {one.visit.day}' if one.visit.day else ''}" for one in people]
    more = f" and {counted(len(names) - 5, 'more', 'more')}" if len(names) > 5 else ""
    return ", ".join(names[:5]) + more
