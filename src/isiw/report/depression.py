"""What a session says about ISIs that depress the MEP: where they are, or that nobody looked for them."""

from __future__ import annotations

from isiw.log.reader import SessionRecord
from isiw.window import SURE, rules_out

THRESHOLD_PCT_RMT = 100.0


def depression_sentence(record: SessionRecord) -> str:
    """Where the MEP is depressed, or that the strategy does not look for it above the motor threshold."""
    stimulus = record.header.stimulus.name
    estimate, intensity_pct = record.estimates[-1], record.header.visit.intensity_pct_rmt
    if estimate.depressed_probability is not None:
        chance = f" (probability that it does so anywhere: {estimate.depressed_probability:.2f})"
        if estimate.depressed is not None:
            likely = "" if estimate.depressed_probability >= SURE else "probably "
            return f"The {stimulus} {likely}depresses the MEP at ISIs of {estimate.depressed}{chance}."
        if rules_out(estimate.depressed_probability):
            return f"No ISIs were found at which the {stimulus} depresses the MEP{chance}."
        return f"It is undecided whether the {stimulus} depresses the MEP at any ISI{chance}."
    if intensity_pct is None or intensity_pct <= THRESHOLD_PCT_RMT:
        return ""
    return (
        f"This strategy looks for enhancement alone. At {intensity_pct:g} % of RMT the {stimulus} may depress "
        "the MEP too: the strategy supra-threshold looks for both."
    )
