"""Events that BIDS has in a file beside a recording."""

from __future__ import annotations

from pathlib import Path

from isiw.lazy import pd


def bids_events(path: Path) -> pd.DataFrame | None:
    """The events that BIDS has beside a recording; None if there are none."""
    beside = path.with_name(f"{path.stem.rpartition('_')[0]}_events.tsv")
    if not beside.is_file() or beside.name == "_events.tsv":
        return None
    frame = pd.read_csv(beside, sep="\t", na_values=["n/a"])
    return frame.rename(columns={"trial_type": "name"} if "trial_type" in frame else {"value": "name"})
