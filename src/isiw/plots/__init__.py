"""Pictures: of sessions, of a study, and of the timing of taps. They draw, and compute nothing."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
