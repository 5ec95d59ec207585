"""The meanings of fields of a log whose classes have none beside them: a docstring there would be in every log."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

_TRIAL: Final = "number of the trial, from 0."

_HEADER: Final = {
    "schema_version": "version of the log's format.",
    "isiw_version": "version of isiw that wrote the header.",
    "created": "when the log was begun, ISO 8601, in UTC.",
    "subject": "code of the person; empty if none was given.",
    "seed": "seed of all randomness.",
}

_OF_A_DEVICE: Final = _HEADER | {
    "device": "what the device says of itself, as `isiw.DeviceInfo`.",
    "versions": "versions of Python, of the libraries that compute, and of the engine.",
    "config": "what software was asked for, to continue it: that of `isiw run` is under `isiw_run`, "
    "that of `isiw serve` under `isiw_serve`.",
}

_EDGE: Final = {
    f"{edge}_{part}": meaning
    for edge in ("start", "end")
    for part, meaning in (
        ("ms", f"{edge} of the reported window [ms]; None without a window."),
        ("low_ms", f"lower end of the 90 % interval of the {edge} [ms], ±Infinity beyond the range."),
        ("high_ms", f"upper end of the 90 % interval of the {edge} [ms], ±Infinity beyond the range."),
        ("beyond", f"probability that the {edge} lies beyond the range, given a window."),
    )
}

MEANINGS: Final[Mapping[str, Mapping[str, str]]] = {
    "/header": _OF_A_DEVICE
    | {
        "kind": '"session", "intervention" if a window was used and none searched for, or "imported" for trials that '
        "were delivered without isiw.",
        "source": "of an imported log, where the trials are from.",
        "given_by": "of an imported log, by when all trials had been given, as their dates say; empty if unknown.",
        "strategy": "name, seed and settings of the strategy; no name if it was built from a user's own objects.",
        "space": "the ISIs that may be delivered, as `isiw.DesignSpace`.",
        "limits": "what may be delivered, as `isiw.Limits`.",
        "signals": "what a sweep must satisfy, as `isiw.SignalLimits`.",
        "timeout_s": "deadline of one delivery [s].",
        "ask_deadline_s": "deadline for choosing an ISI [s]; None for none.",
        "visit": "what is noted of the visit, as `isiw.Visit`.",
        "protocol": "intervals, control trials, blocks and rests, as `isiw.VisitProtocol`.",
        "asks_from": "the first trial whose ISI was chosen with these versions.",
        "belief_version": "grows if the same settings come to another estimate; 1 in older logs.",
        "engine_version": "grows if the same settings are computed otherwise; 1 in older logs.",
        "earlier": "trials that were learnt before the first ISI was chosen.",
        "earlier_changed": "places, among the earlier trials, of those after which a change was noted.",
        "earlier_given": "how many stimuli these and lost ones were; `max_pulses` counts them.",
        "earlier_same_level": "whether electrodes, coil and intensity are those of the earlier trials.",
        "first_step": "of a search above the threshold: the profile below it that it goes on from; None for none.",
        "intervention": "the plan of an intervention, with the digest of its arm; None in a search.",
    },
    "/intent": {
        "trial": _TRIAL,
        "isi_ms": "commanded ISI [ms]; None for a control trial.",
        "t_s": "time on the session's clock [s].",
        "tap_alone": "whether it is a tap without the magnetic pulse.",
        "intensity_pct_rmt": "the intensity that the device sets [% RMT]; None where it sets none.",
        "intensity_pct_mso": "in a search for a threshold, the intensity [% of the maximum stimulator output].",
        "place_mm": "in a search for the hot spot, the place of the coil [mm].",
        "boot_id": "the start of the computer that boot_s counts from; empty if the system gives none.",
        "boot_s": "when it was, since that start, whatever the clock was set to [s].",
    },
    "/estimate": _EDGE
    | {
        "expected_f1": "F1 that the reported window is expected to have; None if the method does not say.",
        "best_isi_ms": "ISI of the largest expected MEP [ms]: median, and lower and upper end of its 90 % interval.",
        "hypotheses": "probability of each hypothesis of the model by name, given a window.",
        "grid_ms": "ISIs of the profile [ms].",
        "profile_mv": "median of the expected MEP at these ISIs [mV].",
        "band_low_mv": "lower end of its 90 % band [mV].",
        "band_high_mv": "upper end of its 90 % band [mV].",
        "split": "probability of more than one segment, given a window.",
        "unusual": "probabilities of what is unusual about the person, by name.",
        "excluded_mv": "largest enhancement that is excluded with 90 % probability [mV].",
        "excluded_pct_rmt": "the same as a shift of the intensity [% RMT].",
        "depressed_ms": "segments in which the tap depresses the MEP: starts and ends in turn [ms].",
        "depressed_probability": "probability that there are any; None if they were not looked for.",
        "change": "what probably changed during the session, whatever the ISI, as `isiw.change.Change`.",
        "beforehand": "probability of a window before the first trial.",
        "tap_may_explain": "whether the tap's own response may be what is larger within the window.",
        "tap_is_likely": "whether the tap alone was measured there and evokes as much.",
        "enhancement_mv": "size of the enhancement at the best ISI [mV]: median, and ends of its 90 % interval.",
        "enhancement_ratio": "how many times as large as of TMS alone it is: median, and ends of its 90 % interval.",
        "misfit": "what amplitudes say against the law of responses, as `isiw.change.Misfit`.",
        "trial": "the trial after which this was known.",
        "predicted_low_mv": "lower end of the band of nine of ten next MEPs at the ISIs of the profile [mV].",
        "predicted_high_mv": "its upper end [mV].",
        "chosen_by": 'what chose the next ISI: "initial", "plan", "acquisition", "fallback", or "again" if lost.',
        "scored_ms": "ISIs that were scored [ms].",
        "scores": "their scores by the acquisition function, less their cost.",
        "next_isi_ms": "the next ISI [ms]; None if the session stops or a control trial comes next.",
        "stop": "whether to stop.",
        "reason": "why, or why not, in sentences.",
        "stop_kind": "what the decision rests on.",
    },
    "/event": {
        "kind": "exclusion, inclusion, acceptance, correction: a verdict on a trial; limit: a limit is reached, or "
        "refused a stimulus; fault: an error; resume: the session continues; fallback: another ISI than the strategy's "
        "choice; fit: the model's fit failed; refused: it was not delivered; late: an answer past its deadline; "
        "pause: paused, or continued; doubt: somebody should look at the data; note: a remark; change: something "
        "changed that bears on all later MEPs; client: another client drives the session; block, stop, opening: a "
        "block of an intervention begins, its operator has ended it, or its arm was opened.",
        "finding": "of a doubt or a pause, what was found; of an exclusion or inclusion, that ISIs were in doubt.",
        "trial": "the trial that was judged, refused or late; else the last one before the event.",
        "text": "what happened, in sentences.",
        "key": "of a note or a change: a second one with the same key is not logged.",
        "corrected": "of a correction, the values that the trial really had; None for those that stay.",
        "late_s": "how long after it was due a block of an intervention began [s]; None of other events.",
        "client": "the key of the client that drives the session from here on; None if it stated none.",
    },
    "/threshold/pulse": {
        "trial": "number of the pulse, from 0.",
        "intensity_pct_mso": "intensity [% of the maximum stimulator output]; None if the log has lost it.",
        "mep_mv": "peak-to-peak amplitude of the MEP [mV]; None if it was only seen.",
        "response": "whether there was a response; None if the amplitude says it.",
        "reason": "why nothing was learnt from it; empty otherwise.",
        "place_mm": "in a search for the hot spot, the place of the coil [mm].",
    },
    "/threshold/belief": {
        "trial": "the pulse after which this was known.",
        "estimate": "the estimate of the threshold.",
        "decision": "whether to stop, and why.",
    },
    "/production_header": _HEADER
    | {
        "kind": '"production".',
        "seed": "seed of the lights of mode 2.",
        "blocks": "blocks of trials with a mode of feedback, a target and a scale.",
    },
    "/production": {
        "trial": "number of the trial through all blocks, from 0.",
        "block": "number of its block, from 0.",
        "produced_ms": "the interval that the person produced [ms].",
        "score_pct": "its score [%].",
        "light": "whether the light came on; None except in mode 2.",
    },
    "/header of a motor threshold": _OF_A_DEVICE
    | {
        "kind": '"threshold".',
        "search": "name, seed and settings of the search.",
        "muscle": "whose MEPs they are; empty if it was not stated.",
        "intensities": "the intensities that may be given.",
        "min_iti_s": "shortest time between two pulses [s].",
        "max_pulses": "largest number of pulses.",
    },
    "Any other topic: a channel's waveforms": {
        "trial": _TRIAL,
        "t0_ms": "time of the first sample on the sweep's clock [ms].",
        "rate_hz": "sampling rate [Hz].",
        "unit": "unit of the samples.",
        "values": "the samples.",
    },
}
"""By the title of the section without code marks, and by field."""
