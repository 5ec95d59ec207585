"""Priors learnt from earlier sessions: of a lab's own people, and of the same person another day."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
