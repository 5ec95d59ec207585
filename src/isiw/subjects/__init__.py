"""Simulated people: the cohorts on which strategies are compared, and the truth about each person."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
