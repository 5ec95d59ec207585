"""What tests of several rooms are handed."""

from __future__ import annotations

import io
import os
import signal
import threading
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import hypothesis
import pytest

if TYPE_CHECKING:
    from isiw.design import DesignSpace

hypothesis.settings.register_profile("isiw", deadline=None)  # how fast a machine is, is not what is tested
hypothesis.settings.load_profile("isiw")

# A shell lets what it runs in the background ignore these.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGQUIT") and signal.getsignal(signal.SIGQUIT) is signal.SIG_IGN:
    signal.signal(signal.SIGQUIT, signal.SIG_DFL)


@pytest.hookimpl(wrapper=True, optionalhook=True)
def pytest_xdist_auto_num_workers() -> Generator[None, int, int]:
    """One more than there are cores: many tests wait for a thread, a process or a deadline."""
    return (yield) + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Each worker has a stretch of the tests, and takes of another's where its own are done.

    So tests of one room meet in one worker, which makes once what they share, and loads once what they alone need.
    """
    from xdist.scheduler import WorkStealingScheduling  # noqa: PLC0415 - where there are no workers it may be missing

    return WorkStealingScheduling(config, log) if config.getoption("dist") == "load" else None


@pytest.fixture(scope="session", autouse=True)
def no_disk() -> Generator[None, None, None]:
    """Nothing waits for the disk; what is left on it after a power cut is made by `session/crashes.py`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> None:
    """Workers share the cores, and answers are the same again with one thread only."""
    import torch  # noqa: PLC0415 - the process that starts the workers has no use for it, and they wait for that

    torch.set_num_threads(1)


def _framed(_: object, to: str | Path | IO[Any], **_options: object) -> None:
    if isinstance(to, str | Path):
        Path(to).write_bytes(b"a picture")
    else:
        to.write("<svg></svg>" if isinstance(to, io.TextIOBase) else b"a picture")


@pytest.fixture
def frames_alone(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are put together, but drawn only for tests about them: that takes longer than a session."""
    if request.node.get_closest_marker("needs_pictures") is None:
        monkeypatch.setattr("matplotlib.figure.Figure.savefig", _framed)


@pytest.fixture
def few_sweeps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lab's prior is learnt in little time, for tests that are not about its numbers."""
    monkeypatch.setattr("isiw.priors.population.SWEEPS", 60)
    monkeypatch.setattr("isiw.priors.population.BURN_IN", 20)


@pytest.fixture
def released() -> Iterator[threading.Event]:
    """What hangs, hangs until this is set, at the end of the test."""
    event = threading.Event()
    yield event
    event.set()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium, for tests with the mark `browsing.IN_CHROMIUM`."""
    from browsing import chromium  # noqa: PLC0415 - it imports playwright

    with chromium() as browser:
        yield browser


@pytest.fixture
def space() -> DesignSpace:
    from scripted import SPACE  # noqa: PLC0415 - it imports torch

    return SPACE


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Recordings of others, which lie beside the repository; tests that need them are skipped where they do not."""
    folder = Path(os.environ.get("ISIW_SHARED_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"the recordings are not at hand: {folder} is no folder; ISIW_SHARED_DATA names another")
    return folder


@pytest.fixture(scope="session")
def recordings_folder(shared_data: Path) -> Path:
    """Recorded EMG sweeps."""
    return shared_data / "uef"
