from .continuing import imported_sentence as imported_sentence
from .kinds import LogKind as LogKind
