"""A session: the closed loop from the first ask to the decision, and resuming one from its log.

Names are loaded when they are used: a loop of a lab's own needs neither the terminal nor a simulated person.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
