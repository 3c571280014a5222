"""A line to a virtual board in the same process, where nothing takes any time, and its servos."""

from collections.abc import Callable, Mapping

from khr_hardware.protocol.commands import Splitter
from khr_hardware.protocol.memory import FREE
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


class TableServos:
    """Servos on a table, without load: each is where it was sent at the end of the cycle.

    Args:
        positions: of the servos at the start, by ICS number.
        ad: of the AD channels, in steps.
    """

    def __init__(self, positions: Mapping[int, int], ad: Mapping[int, int] | None = None) -> None:
        self.positions = dict(positions)
        self.ad = dict(ad or {})
        self.driven: dict[int, int] = {}
        self.stretch: dict[int, int] = {}
        self.cycles = 0

    def measure(self) -> Mapping[int, int]:
        """Return where the servos are."""
        return self.positions

    def sense(self) -> Mapping[int, int]:
        """Return what the AD channels convert."""
        return self.ad

    def drive(self, positions: Mapping[int, int], cycle: float) -> None:
        """Bring servos to where they are sent; those that are set free stay."""
        self.cycles += 1
        self.driven.update(positions)
        for ics, position in positions.items():
            if ics in self.positions and position != FREE:
                self.positions[ics] = position

    def stiffen(self, stretch: Mapping[int, int]) -> None:
        """Keep the stretch of servos."""
        self.stretch.update(stretch)
