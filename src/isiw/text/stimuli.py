"""The words for the conditioning stimulus wherever it is spoken of: a tap on the tendon, or an electrical pulse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from isiw.types import Conditioning, Reference


@dataclass(frozen=True)
class StimulusWords:
    """The words for a conditioning stimulus, or for several of them.

    `name` and `moment`, from which ISIs count, stand behind "the"; `one` has its article; `given` says what and where
    to; `mark` is short, for a picture; `hit` stands before "time"; `pulse` is the magnetic pulse beside it. `by_valve`
    says whether a valve is commanded before it.
    """

    name: str
    one: str
    given: str
    moment: str
    mark: str
    hit: str
    pulse: str
    by_valve: bool

    @property
    def alone(self) -> str:
        """The stimulus without the magnetic pulse."""
        return f"{self.name} alone"

    def origin(self, reference: Reference) -> str:
        """The event that ISIs count from, behind "the"."""
        return "valve command" if reference == "valve" else self.moment

    def isi_axis(self, reference: Reference) -> str:
        """The label of the axis of a picture over ISIs."""
        return f"ISI after the {self.origin(reference)} [ms]"

    def shown(self, reference: Reference) -> str:
        """The event that ISIs count from, in a picture of a pair of stimuli."""
        return "valve command" if reference == "valve" else self.mark


STIMULI: Final[Mapping[Conditioning, StimulusWords]] = MappingProxyType(
    {
        "tap": StimulusWords(
            name="tap",
            one="a tap",
            given="a tap on the tendon",
            moment="impact",
            mark="hit of the hammer",
            hit="hit",
            pulse="pulse",
            by_valve=True,
        ),
        "electrical": StimulusWords(
            name="electrical pulse",
            one="an electrical pulse",
            given="an electrical pulse to the nerve",
            moment="electrical pulse",
            mark="electrical pulse",
            hit="electrical pulse",
            pulse="magnetic pulse",
            by_valve=False,
        ),
    }
)
"""The words for each conditioning stimulus."""

TAP: Final = STIMULI["tap"]
