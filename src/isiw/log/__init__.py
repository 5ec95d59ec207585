"""The log of record: one MCAP file a session, events in, events out. Names are loaded when they are used."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
