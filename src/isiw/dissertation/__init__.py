"""The dissertation's own methods [Kim2020]: regressions, particle filter, sweep, counts, timing, intervals."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
