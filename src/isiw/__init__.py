"""isiw: between which inter-stimulus intervals does the tap enhance the MEP, and how sure are we?

The public surface, listed in `__init__.pyi`, is loaded when it is used, so that `import isiw` costs next to nothing.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, _public = lazy_loader.attach_stub(__name__, __file__)
__all__ = ["__version__", *_public]  # noqa: PLE0604 - the names are strings, listed in the stub
