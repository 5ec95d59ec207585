"""Using a window: pairs at the best ISI with pulses of TMS alone before and after, and what a log says of them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
