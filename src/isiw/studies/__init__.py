"""Studies: strategies × cohorts × people, each a simulated session, to one table.

`Study` says what is run, `conduct` runs it into a folder that survives whatever ends it, `replay` runs one session of
it once more, and `summarise` says what it came to.
"""

from isiw.studies.execution import DaskCluster, Failure, Processes
from isiw.studies.plan import Study, StudyStrategy, Unit, load_study, run_unit
from isiw.studies.players import Player
from isiw.studies.running import Replay, conduct, paired_sessions, replay, run_study, unit_of_row
from isiw.studies.sessions import SimulatedSession, play, simulate
from isiw.studies.store import Store, begin_store, open_store
from isiw.studies.summary import differences, means_table, summarise

__all__ = [
    "DaskCluster",
    "Failure",
    "Player",
    "Processes",
    "Replay",
    "SimulatedSession",
    "Store",
    "Study",
    "StudyStrategy",
    "Unit",
    "begin_store",
    "conduct",
    "differences",
    "load_study",
    "means_table",
    "open_store",
    "paired_sessions",
    "play",
    "replay",
    "run_study",
    "run_unit",
    "simulate",
    "summarise",
    "unit_of_row",
]
