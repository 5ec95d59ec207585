"""Before any window: the resting motor threshold and the hot spot [Kim2020, 4.2.1]."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
