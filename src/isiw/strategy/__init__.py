"""The ask/tell strategy: what it is made of, and the named ones. Names are loaded when they are used."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
