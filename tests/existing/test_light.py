"""A file is read, and perhaps refused, before anything is loaded that only an analysis needs."""

from __future__ import annotations

import subprocess
import sys

import pytest

from isiw.config.run import load_config
from isiw.existing.batch import way_of
from isiw.existing.layout import Layout

ONLY_ANALYSIS = {"matplotlib", "numba", "scipy", "torch", "mne", "isiw.log.reader", "isiw.config.run"}


@pytest.mark.slow
def test_neither_the_command_nor_the_process_that_reads_loads_what_only_an_analysis_needs() -> None:
    script = "import sys, isiw.cli, isiw.existing.batch, isiw.existing.child; print(*sys.modules)"
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)  # noqa: S603 - own script
    assert not ONLY_ANALYSIS & set(ended.stdout.split())


def test_without_a_configuration_trials_are_analysed_as_by_that_of_the_defaults() -> None:
    assert way_of(None, Layout()) == way_of(load_config(None), Layout())
