"""Acquisition functions: from a posterior and candidate ISIs to scores."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
