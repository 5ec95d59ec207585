"""Manual interval production: the task for a person at a keyboard, simulated people, and a computer in their place."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
