"""The frames of the maker's references, byte for byte."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.errors import KhrError
from khr_hardware.errors import BadReplyError
from khr_hardware.protocol import commands, memory
from khr_hardware.protocol.commands import Packet, Splitter, acknowledged, decode, refusal
from khr_hardware.protocol.memory import Config, Mixing
from tests.fakes.boards import bench_board

NEUTRAL = dict.fromkeys([0, 2, 3, 4, 5, 8, 9, *range(12, 22)], 7500)
SERVOS = '2b 10 3d f3 3f 00 00 01' + ' 4c 1d' * 17 + ' a4'
VERSION = (
    '23 fd 43 42 2d 34 20 56 31 2e 30 20 20 20 20 20 20 30 39 30 37 31 35' + ' 20' * 10 + ' c7 08'
)


@pytest.mark.parametrize(
    ('command', 'expected'),
    [
        (commands.ACKNOWLEDGE, '04 fe 06 08'),
        (commands.VERSION, '03 fd 00'),
        (commands.read_ram(0x0022, 22), '0a 00 20 00 00 00 22 00 16 62'),
        (commands.move_servos(NEUTRAL, 1), SERVOS),
        (
            commands.write_ram(0x0206, Mixing.of_ad(1, 12).encode()),
            '0a 00 02 06 02 00 24 40 0c 84',
        ),
    ],
)
def test_a_command_is_these_bytes(command, expected):
    assert command.encode() == bytes.fromhex(expected)
    assert decode(bytes.fromhex(expected)) == command


@pytest.mark.parametrize(
    ('request_', 'reply'),
    [
        ('04 fe 06 08', '04 fe 06 08'),
        ('03 fe 01', '04 fe 06 08'),
        ('03 fd 00', VERSION),
        ('0a 00 02 06 02 00 24 40 0c 84', '04 00 06 0a'),  # a mixing of ICS 18
        ('07 0f 12 01 00 80 a9', '04 0f 06 19'),  # free one
        (SERVOS, '04 10 06 1a'),
        ('0e 11 05 00 00 00 00 01 00 80 05 4c 1d 13', '04 11 06 1b'),  # each by its own cycles
        ('0b 12 03 00 00 00 00 01 1e 3c 7b', '04 12 06 1c'),  # stretch
        ('09 00 12 02 12 00 a8 fd d4', '04 00 06 0a'),  # write a record, and read it
        ('0a 00 21 00 00 00 04 12 02 43', '05 00 4c 1d 6e'),
        ('09 00 32 80 0b 00 01 02 c9', '04 00 06 0a'),  # write ROM, and read it
        ('0b 00 23 00 00 00 80 0b 00 02 bb', '05 00 ff ff 03'),
        ('0a 00 20 00 00 00 22 00 16 62', '19 00 c2 01 00 00 64 00' + ' 00' * 16 + ' 40'),
        ('0b 10 05 00 00 00 00 01 4c 1d 8a', '04 10 15 29'),  # one position for two servos
        ('07 0b 80 0b 00 00 9d', '04 0b 15 24'),  # programs in ROM are not run
        ('03 77 7a', '04 77 15 90'),
    ],
)
def test_the_virtual_board_replies_with_these_bytes(request_, reply):
    found = bench_board().answer(decode(bytes.fromhex(request_)))
    assert found.encode() == bytes.fromhex(reply)


@given(st.integers(0, 255), st.binary(max_size=200))
def test_a_frame_reads_back(command, body):
    frame = Packet(command, body)
    assert decode(frame.encode()) == frame


@given(st.integers(0, 255), st.binary(max_size=100), st.data())
def test_one_wrong_byte_is_always_told(command, body, data):
    whole = bytearray(Packet(command, body).encode())
    place = data.draw(st.integers(0, len(whole) - 1))
    whole[place] ^= data.draw(st.integers(1, 255))
    with pytest.raises(BadReplyError):
        decode(bytes(whole))


@given(st.lists(st.binary(max_size=60), max_size=5), st.data())
def test_a_stream_cut_anywhere_holds_the_same_frames(bodies, data):
    frames = [Packet(0x00, body) for body in bodies]
    stream = b''.join(frame.encode() for frame in frames)
    splitter, found = Splitter(), []
    while stream:
        cut = data.draw(st.integers(1, len(stream)))
        found += splitter.feed(stream[:cut])
        stream = stream[cut:]
    assert found == frames and not splitter.pending


def test_frames_are_found_behind_rubbish():
    splitter = Splitter()
    assert splitter.feed(b'\xff\x00\x02\x01' + acknowledged(0xFE).encode()) == [acknowledged(0xFE)]
    assert refusal(0x10).refused and not acknowledged(0x10).refused


@pytest.mark.parametrize(
    'ask',
    [
        lambda: commands.read_ram(0, 127),
        lambda: commands.read_ram(0x048F, 2),
        lambda: commands.move_servos({35: 7500}),
        lambda: commands.move_servos({0: -1}),
        lambda: commands.move_servos({0: 7500}, 0),
        lambda: Mixing.of_ad(1, 128),
        lambda: Config(0).with_cycle(0.012),
    ],
)
def test_what_the_board_cannot_take_is_refused_in_a_line(ask):
    with pytest.raises(KhrError, match=r'\A[^\n]*accepted: [^\n]*\Z'):
        ask()


def test_the_configuration_of_the_makers_project():
    config = Config(0x809B)
    assert (config.ics, config.program, config.jumps) == (True, True, True)
    assert (config.cycle, config.baud, config.ics_code) == (0.015, 1_250_000, 0)
    assert config.quiet() == Config(0x8091)
    assert config.with_cycle(0.020) == Config(0x80AB)


def test_mixings_read_ad_channels():
    """The first two are those of the maker's project."""
    assert Mixing(0x4026, 9).ad_channel == 2 and Mixing(0x4024, 8).ad_channel == 1
    assert Mixing(0x8012, 1).ad_channel is None and Mixing(memory.NO_SOURCE, 9).ad_channel is None
    assert Mixing(0x4023, 1).ad_channel is None and Mixing(0x4038, 1).ad_channel is None
    mixing = Mixing.of_ad(10, -127)
    assert (mixing.ad_channel, mixing.factor, mixing.active) == (10, -127, True)
    assert not Mixing.of_ad(0, 0).active
