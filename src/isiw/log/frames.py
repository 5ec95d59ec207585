"""A session's trials as a table: when each was, what came of it, and what was believed after it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, Final

from isiw.lazy import pd
from isiw.log.onsets import Onset
from isiw.log.schema import EstimateRecord
from isiw.text.stimuli import TAP, StimulusWords, meanings
from isiw.trials import Trial, TrialTable

_COLUMNS: Final[Mapping[str, tuple[str, str]]] = {
    "onset_s": ("s", "when it was about to be delivered, since the first stimulus of the log"),
    "intent_utc": ("", "the same by the computer's clock, UTC"),
    "status": ("", "accepted, or mistrial: nothing is learnt from it"),
    "commanded_isi_ms": ("ms", "the ISI that was asked for; none for a control trial"),
    "reason": ("", "why it is a mistrial"),
    "isi_ms": ("ms", "the realised ISI"),
    "isi_sd_ms": ("ms", "SD of the realised ISI; 0 where it was measured"),
    "mep_mv": ("mV", "peak-to-peak amplitude of the MEP; 0 is below the detection limit"),
    "background_rms_uv": ("uV", "RMS of the EMG before the magnetic pulse"),
    "t_valve_ms": ("ms", "the valve command, on the sweep's clock"),
    "t_hit_ms": ("ms", "the {0.moment}, on the sweep's clock"),
    "t_tms_ms": ("ms", "the magnetic pulse, on the sweep's clock"),
    "excluded": ("", "whether an operator excluded it afterwards"),
    "tap_alone": ("", "whether it was {0.one} without the magnetic pulse"),
    "overruled": ("", "why it had been a mistrial before an operator accepted it"),
    "p_window": ("", "probability that there is a window, after this trial"),
    "window_start_ms": ("ms", "start of the window that was believed in after this trial; none where none was"),
    "window_end_ms": ("ms", "its end"),
    "start_ms": ("ms", "posterior median of the start, given a window; infinite beyond the range"),
    "start_low_ms": ("ms", "lower end of its 90 % interval"),
    "start_high_ms": ("ms", "upper end of its 90 % interval"),
    "end_ms": ("ms", "posterior median of the end, given a window; infinite beyond the range"),
    "end_low_ms": ("ms", "lower end of its 90 % interval"),
    "end_high_ms": ("ms", "upper end of its 90 % interval"),
    "expected_f1": ("", "posterior mean of the F1 of the reported window"),
    "next_isi_ms": ("ms", "the ISI that was asked for next"),
}


def trial_columns(first: StimulusWords) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each column of `trial_frame`, in their order."""
    return meanings(_COLUMNS, first)


TRIAL_COLUMNS: Final[Mapping[str, tuple[str, str]]] = trial_columns(TAP)
"""The same after a tap."""

_TEXTS: Final = ("status", "reason", "overruled")
_FLAGS: Final = ("excluded", "tap_alone")
_NUMBERS: Final = tuple(name for name in TRIAL_COLUMNS if name not in {*_TEXTS, *_FLAGS, "intent_utc"})
_BELIEF: Final = tuple(TRIAL_COLUMNS)[tuple(TRIAL_COLUMNS).index("p_window") :]


def trial_frame(table: TrialTable, onsets: Mapping[int, Onset], estimates: Iterable[EstimateRecord]) -> pd.DataFrame:
    """All trials as a DataFrame, a row a trial, columns as in `TRIAL_COLUMNS`, indexed by `index`."""
    beliefs = {estimate.trial: estimate for estimate in estimates}
    rows = [_timing(onsets.get(trial.index)) | _outcome(trial) | _belief(beliefs.get(trial.index)) for trial in table]
    index = pd.Index([trial.index for trial in table], name="index", dtype=int)
    frame = pd.DataFrame(rows, index=index, columns=list(TRIAL_COLUMNS))
    kinds = dict.fromkeys(_NUMBERS, "float64") | dict.fromkeys(_FLAGS, "bool")
    return frame.astype(kinds).assign(intent_utc=pd.to_datetime(frame["intent_utc"], unit="ns", utc=True))


def _timing(onset: Onset | None) -> dict[str, Any]:
    return {} if onset is None else {"onset_s": onset.onset_s, "intent_utc": onset.at_ns}


def _outcome(trial: Trial) -> dict[str, Any]:
    values = {field.name: getattr(trial, field.name) for field in dataclasses.fields(Trial) if field.name != "index"}
    return values | {name: None if values[name] is None else str(values[name]) for name in _TEXTS}


def _belief(estimate: EstimateRecord | None) -> dict[str, Any]:
    if estimate is None:
        return {}
    window = estimate.window
    special = {
        "p_window": estimate.probability,
        "window_start_ms": None if window is None else window.start_ms,
        "window_end_ms": None if window is None else window.end_ms,
    }
    return special | {name: getattr(estimate, name) for name in _BELIEF if name not in special}
