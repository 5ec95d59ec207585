"""The parametric window model, as a Pyro program. Names are loaded when they are used, as Pyro takes long to load."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
