"""One device is driven by one session."""

from __future__ import annotations

import hashlib
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from isiw.devices.protocol import Device, DeviceInfo
from isiw.errors import DeviceError

_driven: set[int] = set()
_guard = threading.Lock()


@contextmanager
def driven(device: Device, info: DeviceInfo) -> Iterator[None]:
    """Within, no other session drives this device: the same object, or any of the same address on this computer."""
    with ExitStack() as held:
        held.enter_context(_object_claimed(device, info))
        if info.address:
            held.enter_context(_address_claimed(info))
        yield


@contextmanager
def _object_claimed(device: Device, info: DeviceInfo) -> Iterator[None]:
    with _guard:
        if id(device) in _driven:
            raise _taken(info.name)
        _driven.add(id(device))
    try:
        yield
    finally:
        _driven.discard(id(device))


@contextmanager
def _address_claimed(info: DeviceInfo) -> Iterator[None]:
    digest = hashlib.sha256(info.address.encode(errors="backslashreplace")).hexdigest()[:16]
    path = Path(tempfile.gettempdir()) / f"isiw-device-{digest}.lock"
    lock = FileLock(path, mode=0o666)  # so that another account of this computer can take it, once it is free
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        raise _taken(f"{info.name} at {info.address}") from error
    except OSError as error:
        raise DeviceError(
            f"the device's lock cannot be taken: {error.strerror}",
            got=str(path),
            remedy="If another account of this computer made it, let that account delete it once no session runs.",
        ) from error
    try:
        yield
    finally:
        lock.release()


def _taken(which: str) -> DeviceError:
    return DeviceError(
        "the device is driven by another session",
        got=which,
        remedy="End that session first. Two sessions would not know of each other's stimuli.",
    )
