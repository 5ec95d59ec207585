"""The data a lab already has: trials that were delivered without isiw, what it says about them, and logs of them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
