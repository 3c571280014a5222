"""The serial line to the board: 8 data bits, even parity, one stop bit."""

from __future__ import annotations

import os
import termios
from contextlib import suppress
from typing import Any, Protocol

import serial

from khr_hardware.errors import PortError

WRITE_TIMEOUT = 0.1  # s


class Port(Protocol):
    """The part of ``serial.Serial`` that the client uses."""

    def write(self, data: bytes) -> int | None:
        """Send bytes."""

    def read(self, size: int = 1) -> bytes:
        """Return ``size`` bytes, or fewer after the timeout."""

    @property
    def in_waiting(self) -> int:
        """Return the number of received bytes."""

    def close(self) -> None:
        """Close the port."""


def open_port(path: str, baud: int, timeout: float) -> Port:
    """Open a serial line for this process exclusively.

    After ``timeout`` s a read returns fewer bytes than requested. An FTDI adapter buffers received
    bytes for 16 ms unless low latency is set; a pseudo-terminal has no such setting.

    Raises:
        PortError: if the line cannot be opened.
    """
    try:
        line: Any = serial.Serial(
            path,
            baud,
            parity=serial.PARITY_EVEN,
            timeout=timeout,
            write_timeout=WRITE_TIMEOUT,
            exclusive=True,
        )
    except (OSError, ValueError, termios.error) as error:  # SerialException is an OSError
        code = getattr(error, 'errno', None)
        reason = os.strerror(code) if code else str(error)
        raise PortError(
            f'{path}: {reason}; accepted: the serial line of a board, not opened by another process'
        ) from error
    with suppress(OSError, ValueError, NotImplementedError):
        line.set_low_latency_mode(True)
    port: Port = line
    return port
