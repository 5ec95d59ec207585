"""The trials of an earlier session as answers, to try another strategy on the same data."""

from __future__ import annotations

import math

from isiw.devices.protocol import DeviceInfo
from isiw.errors import DeviceError
from isiw.trials import MOST_ISI_SD_MS, Measurement, Stimulus, Trial, TrialTable
from isiw.types import Reference


class RecordedTrials:
    """A simulation that answers each stimulus with the recorded trial of the nearest ISI, each trial once.

    A session that asks what was asked before gets the same answers; another one gets the nearest there are, at the ISIs
    at which they were really recorded. These may be far from what is asked, so another strategy needs a space with a
    `tolerance_ms` wider than its range: beyond it a session takes the recorded trial for a mistrial and learns nothing
    from it. Its limits end the session when all recorded pairs of stimuli are used up:

        record = isiw.read_session("session.mcap")
        space = dataclasses.replace(record.header.space, tolerance_ms=1000.0)
        pairs = sum(trial.isi_ms is not None for trial in record.table.told)
        device = isiw.SimulatedDevice(isiw.RecordedTrials(record.table, space.reference))
        limits = isiw.Limits.of_space(space, max_pulses=pairs)
        isiw.Session(device, isiw.make_strategy(space=space), log="again.mcap", limits=limits).run()

    Args:
        table: the recorded trials; only those that a strategy may learn from are used, and whose ISIs are known.
        reference: the event that their ISIs count from.
    """

    def __init__(self, table: TrialTable, reference: Reference) -> None:
        self.info = DeviceInfo(name="replay of recorded trials", reference=reference, simulated=True)
        self._left: list[Trial] = [trial for trial in table.told if trial.isi_sd_ms <= MOST_ISI_SD_MS]

    def answer(self, stimulus: Stimulus) -> Measurement:
        """The recorded answer nearest to the next pair of stimuli.

        Raises:
            DeviceError: no trial is left.
        """
        asked_ms = stimulus.isi_ms
        fitting = [trial for trial in self._left if (trial.isi_ms is None) == (asked_ms is None)]
        if not fitting:
            raise DeviceError(
                "no recorded trial is left to answer with",
                remedy="Give the limits as many max_pulses as there are recorded pairs, or replay a longer recording. "
                "Where trials were mistrials for their ISI, give the space a tolerance_ms wider than its range.",
            )
        trial = min(fitting, key=lambda candidate: _distance_ms(candidate, asked_ms))
        self._left.remove(trial)
        return Measurement(
            trial.mep_mv or 0.0,
            trial.isi_ms,
            trial.isi_sd_ms,
            trial.background_rms_uv,
            trial.t_valve_ms,
            trial.t_hit_ms,
            trial.t_tms_ms,
        )


def _distance_ms(trial: Trial, asked_ms: float | None) -> float:
    """How far a trial lies from the ISI asked for, by what was commanded where that is known."""
    at_ms = trial.isi_ms if trial.commanded_isi_ms is None else trial.commanded_isi_ms
    return 0.0 if asked_ms is None or at_ms is None else math.fabs(at_ms - asked_ms)
