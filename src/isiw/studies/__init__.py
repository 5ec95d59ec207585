"""Studies: strategies × cohorts × people, each a simulated session, to one table.

`Study` says what is run, `conduct` runs it into a folder that survives whatever ends it, `replay` runs one session of
it once more, and `summarise` says what it came to.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
