"""What tests of several rooms are handed."""

from __future__ import annotations

import signal
from pathlib import Path

import hypothesis
import pytest
import torch

from isiw.design import DesignSpace
from scripted import SPACE

torch.set_num_threads(1)  # workers share the cores, and answers are the same again with one thread only
hypothesis.settings.register_profile("isiw", deadline=None)  # how fast a machine is, is not what is tested
hypothesis.settings.load_profile("isiw")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as a shell sets it for what it runs in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def space() -> DesignSpace:
    return SPACE


@pytest.fixture(scope="session")
def recordings_folder() -> Path:
    """Recorded EMG sweeps."""
    return Path(__file__).parent / "data" / "uef"
