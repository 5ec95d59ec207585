"""The trials of a session as a DataFrame, with what their sweeps show beside the amplitude."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from isiw.lazy import pd
from isiw.log.reader import LoggedSession
from isiw.log.schema import EstimateRecord
from isiw.signals.measures import Measures, measures
from isiw.signals.tap import TapResponses
from isiw.sweeps import Sweep
from isiw.text.stimuli import TAP, StimulusWords
from isiw.trials import Trial


def measures_of(record: LoggedSession) -> Mapping[int, Measures]:
    """Measures of the sweeps of trials that count, beside the amplitude, by the trial's number."""
    emg = {trial: channel for (trial, name), channel in record.waveforms.items() if name == "emg"}
    signals, taps = record.header.signals, TapResponses(record.header.signals.mep_window_ms)
    for trial in record.table if any(trial.tap_mv for trial in record.table) else ():
        taps = taps.after(trial, Sweep({"emg": emg[trial.index]} if trial.index in emg else {}))
    return {t.index: measures(emg[t.index], t, signals, taps) for t in record.table.told if t.index in emg}


_COLUMNS: Final[Mapping[str, tuple[str, str]]] = {
    "onset_s": ("s", "when it was about to be delivered, since the first stimulus of the log"),
    "intent_utc": ("", "the same by the computer's clock, UTC"),
    "status": ("", "accepted, or mistrial: nothing is learnt from it"),
    "commanded_isi_ms": ("ms", "the commanded ISI; none for a control trial"),
    "reason": ("", "why it is a mistrial"),
    "isi_ms": ("ms", "the realised ISI"),
    "isi_sd_ms": ("ms", "SD of the realised ISI; 0 if it was measured"),
    "mep_mv": ("mV", "peak-to-peak amplitude of the MEP; 0 is below the detection limit"),
    "mep_low_mv": ("mV", "lower end of the interval that it lies in, if no more is known"),
    "mep_high_mv": ("mV", "upper end of that interval; empty if it has none"),
    "mep_sd_mv": ("mV", "SD of the amplitude, as what {0.one} alone evokes varies"),
    "tap_mv": ("mV", "what is left in it of what {0.one} alone evokes, in the mean; empty if that is not known"),
    "mep_onset_ms": ("ms", "onset of the MEP after the magnetic pulse; empty without a sweep or an MEP"),
    "mep_duration_ms": ("ms", "from its onset to its end"),
    "mep_area_mv_ms": ("mV.ms", "area of the rectified EMG from its onset to its end"),
    "silent_period_ms": ("ms", "of a contracted muscle, from the magnetic pulse until the EMG is back"),
    "background_rms_uv": ("uV", "RMS of the EMG before the magnetic pulse"),
    "t_valve_ms": ("ms", "the valve command, on the sweep's clock"),
    "t_hit_ms": ("ms", "the {0.moment}, on the sweep's clock"),
    "t_tms_ms": ("ms", "the magnetic pulse, on the sweep's clock"),
    "excluded": ("", "whether an operator excluded it afterwards"),
    "tap_alone": ("", "whether it was {0.one} without the magnetic pulse"),
    "intensity_pct_rmt": ("%", "intensity of the pulse, of the resting motor threshold; empty: as usual for the pairs"),
    "overruled": ("", "why it had been a mistrial before an operator accepted it"),
    "p_window": ("", "probability that there is a window, after this trial"),
    "window_start_ms": ("ms", "start of the window that was reported after this trial; empty if none was"),
    "window_end_ms": ("ms", "its end"),
    "start_ms": ("ms", "posterior median of the start, given a window; infinite beyond the range"),
    "start_low_ms": ("ms", "lower end of its 90 % interval"),
    "start_high_ms": ("ms", "upper end of its 90 % interval"),
    "end_ms": ("ms", "posterior median of the end, given a window; infinite beyond the range"),
    "end_low_ms": ("ms", "lower end of its 90 % interval"),
    "end_high_ms": ("ms", "upper end of its 90 % interval"),
    "expected_f1": ("", "posterior mean of the F1 of the reported window"),
    "next_isi_ms": ("ms", "the ISI that was chosen next"),
}


def meanings(columns: Mapping[str, tuple[str, str]], first: StimulusWords, **more: str) -> dict[str, tuple[str, str]]:
    """Unit and meaning of the columns of a table, of a stimulus."""
    return {name: (unit, meaning.format(first, **more)) for name, (unit, meaning) in columns.items()}


def trial_columns(first: StimulusWords) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each column of `trial_frame`, in their order."""
    return meanings(_COLUMNS, first)


TRIAL_COLUMNS: Final[Mapping[str, tuple[str, str]]] = trial_columns(TAP)
"""The same after a tap."""

_TEXTS: Final = ("status", "reason", "overruled")
_FLAGS: Final = ("excluded", "tap_alone")
_NUMBERS: Final = tuple(name for name in TRIAL_COLUMNS if name not in {*_TEXTS, *_FLAGS, "intent_utc"})
_ESTIMATE: Final = tuple(TRIAL_COLUMNS)[tuple(TRIAL_COLUMNS).index("p_window") :]


def trial_frame(record: LoggedSession) -> pd.DataFrame:
    """All trials as a DataFrame, a row a trial, columns as in `TRIAL_COLUMNS`, indexed by `index`."""
    estimates_by_trial = {estimate.trial: estimate for estimate in record.estimates}
    times = {trial: {"onset_s": onset.onset_s, "intent_utc": onset.at_ns} for trial, onset in record.onsets.items()}
    measured = measures_of(record)
    rows = [
        times.get(trial.index, {})
        | _outcome(trial)
        | measured.get(trial.index, Measures())._asdict()
        | _estimated(estimates_by_trial.get(trial.index))
        for trial in record.table
    ]
    index = pd.Index([trial.index for trial in record.table], name="index", dtype=int)
    frame = pd.DataFrame(rows, index=index, columns=list(TRIAL_COLUMNS))
    kinds = dict.fromkeys(_NUMBERS, "float64") | dict.fromkeys(_FLAGS, "bool")
    return frame.astype(kinds).assign(intent_utc=pd.to_datetime(frame["intent_utc"], unit="ns", utc=True))


def _outcome(trial: Trial) -> dict[str, Any]:
    low_mv, high_mv = trial.mep_interval_mv or (None, None)
    texts = {name: None if (value := getattr(trial, name)) is None else str(value) for name in _TEXTS}
    return vars(trial) | texts | {"mep_low_mv": low_mv, "mep_high_mv": None if high_mv == math.inf else high_mv}


def _estimated(estimate: EstimateRecord | None) -> dict[str, Any]:
    if estimate is None:
        return {}
    window = estimate.window
    special = {
        "p_window": estimate.probability,
        "window_start_ms": None if window is None else window.start_ms,
        "window_end_ms": None if window is None else window.end_ms,
    }
    return special | {name: getattr(estimate, name) for name in _ESTIMATE if name not in special}
