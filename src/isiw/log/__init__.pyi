from .kinds import LogKind as LogKind
from .kinds import imported_sentence as imported_sentence
