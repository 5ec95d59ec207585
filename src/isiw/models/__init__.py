"""Models of a person's responses, each in a module of its own, behind the protocols that are gathered here."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
