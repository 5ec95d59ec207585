"""A session in words, and as a page, for people. What draws the page is loaded when a page is asked for."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
