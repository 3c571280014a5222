"""Exchanges of every kind with a board whose memory is at hand."""

from khr_hardware.client import Client
from khr_hardware.protocol import memory
from tests.fakes.boards import TRIMS

FREELY = range(0x1A0, 0x200)  # RAM of records that no servo of the bench has


def exchange(client: Client, board, rng):
    """Ask for something, or write it, and compare with the board's memory.

    Raises:
        BoardError: if the exchange failed.
    """
    kind = rng.choice(['read', 'read', 'write', 'version', 'record', 'config', 'measured', 'move'])
    ics = rng.choice(sorted(TRIMS))
    if kind == 'read':
        address, size = rng.randrange(0x100, 0x180), rng.choice([2, 8, 22, 126])
        assert client.read_ram(address, size) == board.ram[address : address + size]
    elif kind == 'write':
        data = rng.randbytes(rng.choice([1, 3, 40]))
        address = rng.randrange(FREELY.start, FREELY.stop - len(data))
        client.write_ram(address, data)
        assert board.ram[address : address + len(data)] == data
    elif kind == 'version':
        assert client.version() == memory.VERSION
    elif kind == 'record':
        assert client.record(ics) == board.record(ics)
    elif kind == 'config':
        assert client.config() == board.config
    elif kind == 'measured':
        assert client.measured(ics) == board.record(ics).measured
    else:
        position = rng.randrange(7000, 8000)
        client.move({ics: position})
        assert board.record(ics).end == position
