"""From waveforms to numbers: impact, MEP, background, and the judgement of a trial."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
