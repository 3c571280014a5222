"""The client gives a value that the board holds, or an error; it never waits without an end."""

from random import Random

import pytest
from serial import SerialTimeoutException

from khr_hardware.client import FENCES, RETRIES, Client
from khr_hardware.errors import BadReplyError, BoardError, NoReplyError, PortError, RefusedError
from khr_hardware.protocol import memory
from khr_hardware.protocol.commands import refusal
from khr_hardware.protocol.memory import Config
from tests.fakes.boards import TRIMS, Loopback, bench_board


class Spoiler:
    """Spoil replies as a bad line does, in ways that its checks can tell."""

    def __init__(self, seed, share):
        self.random, self.share = Random(seed), share
        self.late = b''
        self.spoilt = 0

    def __call__(self, reply):
        arriving, self.late = self.late, b''
        if self.random.random() > self.share:
            return arriving + reply
        self.spoilt += 1
        kind = self.random.choice(['byte', 'lost', 'cut', 'more', 'twice', 'late', 'nck', 'none'])
        place = self.random.randrange(len(reply))
        if kind == 'byte':
            wrong = reply[place] ^ self.random.randrange(1, 256)
            reply = reply[:place] + bytes([wrong]) + reply[place + 1 :]
        elif kind == 'lost':
            reply = reply[:place] + reply[place + 1 :]
        elif kind == 'cut':
            reply = reply[:place]
        elif kind == 'more':
            reply = reply[:place] + self.random.randbytes(1) + reply[place:]
        elif kind == 'twice':
            reply = reply + reply
        elif kind == 'late':
            reply, self.late = b'', reply
        elif kind == 'nck':
            reply = refusal(reply[1]).encode()
        else:
            reply = b''
        return arriving + reply


FREELY = range(0x1A0, 0x200)  # RAM of records that no servo of the bench has


def exchange(client: Client, board, rng):
    """Ask for something, or write it, and compare with the board's memory.

    Raises:
        BoardError: if the exchange failed.
    """
    kind, ics = rng.choice(['read', 'read', 'write', 'record', 'move']), rng.choice(sorted(TRIMS))
    if kind == 'read':
        address, size = rng.randrange(0x100, 0x180), rng.choice([2, 8, 22, 32, 126])
        assert client.read_ram(address, size) == board.ram[address : address + size]
    elif kind == 'write':
        data = rng.randbytes(rng.choice([1, 3, 40]))
        address = rng.randrange(FREELY.start, FREELY.stop - len(data))
        client.write_ram(address, data)
        assert board.ram[address : address + len(data)] == data
    elif kind == 'record':
        assert client.record(ics) == board.record(ics)
    else:
        position = rng.randrange(7000, 8000)
        client.move({ics: position})
        assert board.record(ics).end == position


@pytest.mark.slow
def test_corrupted_streams_give_no_wrong_value():
    """Each stream is some exchanges over a line that spoils a part of the replies."""
    board = bench_board()
    rng = Random(1)
    good = failed = spoilt = 0
    for seed in range(1500):
        spoiler = Spoiler(seed, share=rng.choice([0.2, 0.5, 0.9]))
        client = Client(Loopback(board, spoiler))
        for _ in range(2):
            try:
                exchange(client, board, rng)
                good += 1
            except BoardError as error:
                assert '\n' not in str(error)
                failed += 1
        spoilt += spoiler.spoilt
        assert client.counts.retries <= RETRIES * client.counts.exchanges
    assert min(good, failed, spoilt) > 75


def test_a_reply_that_comes_late_is_never_taken_for_another():
    """The two reads are alike but for their address: only the fence tells their replies."""
    board = bench_board()
    late = []

    def hold_back(reply):
        if not late:
            late.append(reply)
            return b''
        held, late[0] = late[0], b''
        return held + reply

    board.ram[0x100:0x104] = b'abcd'
    client = Client(Loopback(board, hold_back), retries=0)
    with pytest.raises(NoReplyError):
        client.read_ram(0x100, 2)
    assert client.read_ram(0x102, 2) == b'cd'
    assert client.counts.timeouts == 1 and client.counts.stray == 5


def test_the_reply_to_an_earlier_fence_does_not_pass_for_the_last():
    """On a line that is always one reply behind, no fence is ever answered in time."""
    behind = [b'']

    def lag(reply):
        behind.append(reply)
        return behind.pop(0)

    client = Client(Loopback(bench_board(), lag), retries=0)
    with pytest.raises(NoReplyError, match='does not answer'):
        client.read_ram(0x100, 2)


def test_free_goes_out_though_no_fence_is_answered():
    board, lost = bench_board(), [False]
    client = Client(Loopback(board, lambda reply: b'' if lost[0] else reply))
    client.move({18: 7600})
    board.cycle()
    assert board.sent[18] != memory.FREE
    lost[0] = True
    for ask in (client.acknowledge, lambda: client.free([18])):
        with pytest.raises(NoReplyError):
            ask()
    board.cycle()
    assert board.sent[18] == memory.FREE


def test_after_a_silence_the_first_thing_is_a_fence():
    board = bench_board()
    queue, silent = [], [True]

    def hold_back(reply):
        queue.append(reply)
        if silent[0]:
            return b''
        held = b''.join(queue)
        queue.clear()
        return held

    board.ram[0x100:0x104] = b'abcd'
    client = Client(Loopback(board, hold_back), retries=0)
    with pytest.raises(NoReplyError, match='does not answer'):
        client.read_ram(0x100, 2)
    assert len(queue) == 1 + FENCES
    silent[0] = False
    assert client.read_ram(0x102, 2) == b'cd'


def test_a_refusal_is_tried_again_and_then_an_error():
    refusing = [RETRIES]

    def busy(reply):
        if refusing[0] > 0:
            refusing[0] -= 1
            return refusal(reply[1]).encode()
        return reply

    client = Client(Loopback(bench_board(), busy))
    assert client.ad()[0] == 450
    assert client.counts.refused == client.counts.retries == RETRIES
    refusing[0] = RETRIES + 1
    with pytest.raises(RefusedError):
        client.ad()


@pytest.mark.parametrize(
    ('spoil', 'counted'),
    [
        (lambda reply: b'', 'timeouts'),
        (lambda reply: reply[:-1], 'short'),
        (lambda reply: b'\x09' + reply[1:], 'size'),
        (lambda reply: reply[:-1] + bytes([reply[-1] ^ 1]), 'checksum'),
        (lambda reply: bytes([4, 0xFD, 6, 0x07]), 'command'),
        (lambda reply: reply + b'\x00', 'stray'),
    ],
)
def test_each_kind_of_error_is_counted(spoil, counted):
    client = Client(Loopback(bench_board(), spoil), retries=0)
    with pytest.raises((NoReplyError, BadReplyError)):
        client.set_config(Config(0x8091))
    assert int(client.counts.figures()[counted]) >= 1
    assert int(client.counts.figures()['failed']) >= 1


def test_a_write_that_takes_too_long_is_tried_again(monkeypatch):
    """pyserial says so as well if the computer stalls when all is written: the line is there."""
    port = Loopback(bench_board())
    client, write, slow = Client(port), port.write, iter([True])

    def stall(data):
        write(data)
        if next(slow, False):
            raise SerialTimeoutException('Write timeout')

    monkeypatch.setattr(port, 'write', stall)
    assert client.ad()[0] == 450
    assert (client.closed, client.counts.timeouts, client.counts.retries) == ('', 1, 1)


def test_a_port_that_is_gone_stays_gone():
    port = Loopback(bench_board())
    client = Client(port)
    client.acknowledge()
    port.close()
    for use in (client.ad, lambda: client.free([0])):
        with pytest.raises(PortError, match='gone'):
            use()
    assert client.closed


def test_the_client_reads_what_the_board_is_and_more_than_one_reply_holds():
    board = bench_board()
    client = Client(Loopback(board))
    assert client.version() == memory.VERSION and client.config() == Config(0x8091)
    assert client.assigned() == sorted(TRIMS)
    client.set_ad_reference(2, 90)
    assert client.ad_references()[1:3] == (512, 90) and client.ad()[:3] == (450, 0, 10)
    assert client.read_ram(0, 255) == bytes(board.ram[:255])


def test_a_setting_leaves_the_byte_behind_it():
    board = bench_board()
    client = Client(Loopback(board))
    for write, end in (
        (lambda: client.set_config(Config(0x8091)), memory.CONFIG + 2),
        (lambda: client.set_ad_reference(2, 90), memory.AD_REFERENCES + 6),
    ):
        board.ram[end] = 0xA5
        write()
        assert board.ram[end] == 0xA5
