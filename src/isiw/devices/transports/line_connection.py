"""A connection to an instrument that exchanges lines of text: a serial port, or TCP.

TCP is a plain socket rather than pyserial's `socket://`, which allows 5 s to connect, whatever it is told, and sleeps
for 0.3 s whenever it is closed: too long for `stop`, which has 5 s in all.
"""

from __future__ import annotations

import socket
from typing import Protocol
from urllib.parse import urlsplit

from isiw.errors import ConfigError, InvalidValueError

_TCP = "socket://"
_MOST_BYTES = 4096
_GLANCE_S = 0.05


class Connection(Protocol):
    """Bytes to and from an instrument; whatever fails is an OSError."""

    def send(self, data: bytes) -> None:
        """Send all of it, or fail within the time that the connection was opened with."""

    def receive(self, *, wait: bool = True) -> bytes:
        """What has come, a few thousand bytes at most; nothing where nothing came, after a glance of 50 ms at most."""

    def close(self) -> None:
        """Close it; calling it again is harmless."""


def open_connection(address: str, baud: int, timeout_s: float) -> Connection:
    """Open a connection."""
    return _Tcp(address, timeout_s) if address.startswith(_TCP) else _Serial(address, baud, timeout_s)


def require_address(address: str) -> None:
    """Raise where an address cannot be one."""
    if not address or (address.startswith(_TCP) and None in _host_and_port(address)):
        raise InvalidValueError(
            "the address of an instrument is incomplete",
            got=address,
            expected='"COM3", "/dev/ttyUSB0" or "socket://192.168.0.20:5000"',
        )


def _host_and_port(address: str) -> tuple[str | None, int | None]:
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError:
        return None, None
    return host, port


class _Tcp:
    """A TCP connection."""

    def __init__(self, address: str, timeout_s: float) -> None:
        host, port = _host_and_port(address)
        self._timeout_s = timeout_s
        self._socket = socket.create_connection((host or "", port or 0), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        self._socket.settimeout(self._timeout_s)
        self._socket.sendall(data)

    def receive(self, *, wait: bool = True) -> bytes:
        self._socket.settimeout(_GLANCE_S if wait else 0.0)
        try:
            data = self._socket.recv(_MOST_BYTES)
        except (TimeoutError, BlockingIOError):
            return b""
        if not data:
            raise ConnectionResetError("the instrument closed the connection")
        return data

    def close(self) -> None:
        self._socket.close()


class _Serial:
    """A serial port; no other program can open it meanwhile."""

    def __init__(self, address: str, baud: int, timeout_s: float) -> None:
        try:
            import serial  # noqa: PLC0415 - optional: only who has a serial port needs it
        except ImportError as error:
            raise ConfigError(
                "a serial port needs the package pyserial",
                got=address,
                remedy='Install it: pip install "isiw[serial]".',
            ) from error
        try:
            self._port = serial.serial_for_url(
                address, baudrate=baud, timeout=_GLANCE_S, write_timeout=timeout_s, exclusive=True
            )
        except ValueError as error:  # a rate or an address that pyserial does not know
            raise OSError(str(error)) from error

    def send(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except TypeError as error:  # another thread closed it
            raise OSError("the port is closed") from error

    def receive(self, *, wait: bool = True) -> bytes:
        try:
            size = self._port.in_waiting
            return bytes(self._port.read(max(1, min(size, _MOST_BYTES)))) if size or wait else b""
        except TypeError as error:  # another thread closed it
            raise OSError("the port is closed") from error

    def close(self) -> None:
        self._port.close()
