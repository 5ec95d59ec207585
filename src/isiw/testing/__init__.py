"""Conformance suites: what every implementation of one of isiw's protocols must pass.

Run them from your own tests, and `check_device` for hardware with the coil on a phantom.
"""

from isiw.testing.devices import check_device
from isiw.testing.suites import check_acquisition, check_model, check_strategy

__all__ = ["check_acquisition", "check_device", "check_model", "check_strategy"]
