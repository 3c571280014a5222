"""The virtual board: memory as a client sees it, moves, trims, mixing, output cycles."""

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from khr_hardware.client import Client
from khr_hardware.errors import RefusedError
from khr_hardware.protocol import memory
from khr_hardware.protocol.commands import Packet
from khr_hardware.protocol.memory import FREE, HOLD, Config, Mixing
from tests.fakes.boards import TRIMS, Loopback, bench_board

SERVOS = st.sampled_from(sorted(TRIMS))
POSITIONS = st.integers(5000, 10000)


class ClientAgainstMemory(RuleBasedStateMachine):
    """A client moves servos, sets trims and mixings; a model of plain numbers says what comes."""

    @initialize()
    def start(self):
        self.board = bench_board(mixing_delay=0)
        self.client = Client(Loopback(self.board), retries=0)
        self.goal = dict.fromkeys(TRIMS, FREE)
        self.reference = dict.fromkeys(TRIMS, FREE)
        self.left = dict.fromkeys(TRIMS, 0)
        self.trim = dict(TRIMS)
        self.mixing = dict.fromkeys(TRIMS, 0)
        self.raw = {ics: 7500 + trim for ics, trim in TRIMS.items()}
        self.measured = dict.fromkeys(TRIMS, 7500)

    @rule(moves=st.dictionaries(SERVOS, POSITIONS, min_size=1), cycles=st.integers(1, 9))
    def move(self, moves, cycles):
        self.client.move(moves, cycles)
        for ics, goal in moves.items():
            if self.reference[ics] == FREE:
                self.reference[ics] = self.measured[ics]  # of the last cycle, with its trim
            self.goal[ics], self.left[ics] = goal, cycles

    @rule(ics=SERVOS)
    def free(self, ics):
        self.client.free([ics])
        self.reference[ics], self.left[ics] = FREE, 0

    @rule(ics=SERVOS, trim=st.integers(-1000, 1000))
    def set_trim(self, ics, trim):
        address = memory.record_address(ics) + memory.TRIM
        self.client.write_ram(address, trim.to_bytes(2, 'little', signed=True))
        self.trim[ics] = trim

    @rule(ics=SERVOS, factor=st.integers(-20, 20), slot=st.integers(0, 1))
    def mix(self, ics, factor, slot):
        self.client.set_mixing(ics, slot, Mixing.of_ad(1, factor))
        self.client.set_mixing(ics, 1 - slot, Mixing())
        self.mixing[ics] = factor

    @rule(raw=st.integers(500, 524), zero=st.integers(510, 514))
    def turn(self, raw, zero):
        self.board.robot.ad[1] = raw
        self.client.set_ad_reference(1, zero)
        assert self.client.ad_references()[1] == zero

    @rule(cycles=st.integers(1, 5))
    def wait(self, cycles):
        for _ in range(cycles):
            seen = self.board.ram[memory.AD_VALUES + 2 : memory.AD_VALUES + 4]
            rate = int.from_bytes(seen, 'little', signed=True)
            self.board.cycle()
            for ics in TRIMS:
                if self.reference[ics] == FREE:
                    assert self.board.sent[ics] == FREE
                    continue
                if self.left[ics]:
                    self.reference[ics] += round(
                        (self.goal[ics] - self.reference[ics]) / self.left[ics]
                    )
                    self.left[ics] -= 1
                position = self.reference[ics] + self.trim[ics] + self.mixing[ics] * rate
                self.raw[ics] = min(max(position, 3500), 11500)
                assert self.board.sent[ics] == self.raw[ics]
        assert self.client.ad()[1] == self.board.robot.ad[1] - self.client.ad_references()[1]
        self.measured = {ics: self.raw[ics] - self.trim[ics] for ics in TRIMS}
        assert {ics: self.client.measured(ics) for ics in TRIMS} == self.measured

    @invariant()
    def records_are_what_the_model_says(self):
        for ics in TRIMS:
            record = self.client.record(ics)
            assert record.trim == self.trim[ics]
            assert record.reference == self.reference[ics]
            moving = self.reference[ics] != FREE and self.left[ics]
            assert not moving or record.steps_left == self.left[ics]


ClientAgainstMemory.TestCase.settings = settings(max_examples=10, stateful_step_count=20)
TestClientAgainstMemory = ClientAgainstMemory.TestCase


@pytest.fixture
def board():
    return bench_board()


@pytest.fixture
def client(board):
    return Client(Loopback(board), retries=0)


def test_hold_keeps_a_servo_where_it_was(board, client):
    client.move({12: HOLD})
    board.robot.positions[12] = 8000
    for _ in range(3):
        board.cycle()
        assert board.sent[12] == 7500 + TRIMS[12]
    client.move({12: 7510}, 2)
    board.cycle()
    assert board.sent[12] == 7505 + TRIMS[12]


def test_servos_hear_nothing_while_the_bus_is_off_or_at_another_rate(board, client):
    client.move({12: 7600})
    for word in (0x8090, 0x8091 | 0x4000):
        client.set_config(Config(word))
        board.cycle()
        assert board.sent == {}
    client.set_config(Config(0x8091))
    board.cycle()
    assert board.sent[12] == 7600 + TRIMS[12]


def test_a_servo_that_is_not_assigned_is_left_alone(board, client):
    client.move({12: 7600, 13: 7600})
    client.write_ram(memory.ICS_TABLE + 24, b'\xff\xff')
    board.cycle()
    assert 12 not in board.sent and board.sent[13] == 7600 + TRIMS[13]
    assert 12 not in client.assigned()


@pytest.mark.parametrize('delay', [0, 2])
def test_two_mixings_are_added_after_their_delay(delay):
    board = bench_board(mixing_delay=delay)
    client = Client(Loopback(board))
    client.move({18: 7500})
    client.set_mixing(18, 0, Mixing.of_ad(1, 12))
    client.set_mixing(18, 1, Mixing.of_ad(3, -2))
    board.cycle()
    board.robot.ad |= {1: 515, 3: 10}
    board.sample()
    sent = []
    for _ in range(4):
        sent.append(board.sent[18] - 7500 - TRIMS[18])
        board.cycle()
    assert sent == [0] * (1 + delay) + [36 - 20] * (3 - delay)


def test_rom_is_stored_and_power_on_restores_ram(board, client):
    client.command(Packet(0x00, b'\x32\x80\x0b\0abc'))  # at 0x0B80
    client.set_mixing(12, 0, Mixing.of_ad(1, 5))
    client.move({12: 7600})
    board.power_on()
    assert client.exchange(Packet(0x00, b'\x23\0\0\0\x80\x0b\0\x03'), 3) == b'abc'
    assert not client.record(12).mixings[0].active
    board.cycle()
    assert board.sent[12] == FREE and client.record(12).trim == TRIMS[12]


@pytest.mark.parametrize(
    'request_',
    [
        Packet(0x07, b'\x82'),
        Packet(0x00, b'\x13' + b'\0' * 6),
        Packet(0x00, b'\x20\0\0\0\0\0\x7f'),
        Packet(0x00, b'\x02\x8f\x04\0ab'),
        Packet(0x00, b'\x12\x13\x00\0ab'),
        Packet(0x00, b'\x21\0\0\0\0\x23\x02'),
        Packet(0x10, b'\0\0\0\0\x80\x01\x4c\x1d'),
        Packet(0x12, b'\x01\0\0\0\0\x03\x10'),
    ],
)
def test_what_is_not_modelled_or_wrong_gets_an_nck_and_changes_nothing(board, client, request_):
    before = bytes(board.ram)
    with pytest.raises(RefusedError):
        client.command(request_)
    assert bytes(board.ram) == before
