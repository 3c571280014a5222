"""A line to a virtual board in the same process, where nothing takes any time."""

from __future__ import annotations

from collections.abc import Callable

from khr_hardware.protocol.frames import Splitter
from khr_hardware.virtual.board import VirtualBoard

Tamper = Callable[[bytes], bytes]  # what a reply becomes on its way


class Loopback:
    """A port whose board answers at once; what does not come at once does not come in time.

    Args:
        board: at the other end.
        tamper: spoils replies; by default nothing does.
    """

    def __init__(self, board: VirtualBoard, tamper: Tamper = lambda reply: reply) -> None:
        self.board = board
        self.tamper = tamper
        self._received = bytearray()
        self._splitter = Splitter()
        self._open = True

    def write(self, data: bytes) -> int:
        """Let the board answer what comes."""
        self._check()
        for frame in self._splitter.feed(data):
            self._received += self.tamper(self.board.answer(frame).encode())
        self._splitter.forget()
        return len(data)

    def read(self, size: int = 1) -> bytes:
        """Return what has come, up to a size."""
        self._check()
        data = bytes(self._received[:size])
        del self._received[:size]
        return data

    @property
    def in_waiting(self) -> int:
        """Return how many bytes have come."""
        self._check()
        return len(self._received)

    def close(self) -> None:
        """Close the port."""
        self._open = False

    def _check(self) -> None:
        if not self._open:
            raise OSError('the port is closed')
