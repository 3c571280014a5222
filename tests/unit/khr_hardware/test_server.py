"""A virtual board behind a pseudo-terminal, driven by our client and by one nobody here wrote."""

import time

import numpy as np
import pytest
from rcb4.rcb4interface import RCB4Interface

from khr_common.errors import KhrError
from khr_hardware.client import connect
from khr_hardware.errors import BoardError, NoReplyError, PortError
from khr_hardware.protocol import commands, memory
from khr_hardware.protocol.memory import FREE, Config
from khr_hardware.virtual.server import KINDS, Fault, Faults, Server, Wire
from tests.fakes.boards import TRIMS, bench_board
from tests.support.served import served

RATES = (1_250_000,) * 3 + (115_200,) * 3  # it opens the line at each three times
WAYS = [{}, {'flat': False}, {'servos': False}]  # in which the rcb4 client opens a board


@pytest.mark.parametrize('way', WAYS, ids=['flat', 'as it is', 'no servos'])
def test_the_unmodified_rcb4_client_drives_it(way, tmp_path):
    """The servos go where it says."""
    board = bench_board()
    with served(board, tmp_path) as (_, line):
        rcb4 = RCB4Interface()
        assert rcb4.open(line, 1_250_000, **way)
        if 'servos' in way:
            assert board.record(18).trim == TRIMS[18]
            rcb4.close()
            return
        assert rcb4.search_servo_ids().tolist() == sorted(TRIMS)
        assert board.record(18).trim == (TRIMS[18] if way else 0)
        rcb4.hold()
        rcb4.neutral(time=0.1)
        assert rcb4.wait_interpolation(timeout=5.0)
        assert np.allclose(rcb4.angle_vector(), 0.0, atol=0.04)
        asked = np.linspace(-10.0, 10.0, len(TRIMS))
        rcb4.angle_vector(asked, time=0.1)
        assert rcb4.wait_interpolation(timeout=5.0)
        assert np.allclose(rcb4.angle_vector(), asked, atol=0.04)  # it cuts off the count
        assert rcb4.send_stretch(60)
        assert board.robot.stretch == dict.fromkeys(TRIMS, 60)
        rcb4.free()
        assert all(board.record(ics).reference == FREE for ics in TRIMS)
        rcb4.close()


def test_the_rcb4_client_switches_the_rate_and_a_board_hears_no_other(tmp_path):
    with served(bench_board(), tmp_path) as (_, line):
        for opened, rate in zip((1_250_000,) * 4 + (115_200,) * 2, RATES, strict=True):
            rcb4 = RCB4Interface()
            assert rcb4.open(line, opened, target_baudrate=rate, servos=False)
            rcb4.close()
        with pytest.raises(NoReplyError, match='1250000'):
            connect(line, 1_250_000)
        client, rate = connect(line)
        assert rate == 115_200
        client.set_config(Config(client.config().word | 0x40))
        client.close()
        client, rate = connect(line)
        assert rate == 625_000 and client.config().baud == 625_000
        client.close()
        for _ in range(3):  # it does not switch to this rate by itself
            rcb4 = RCB4Interface()
            assert rcb4.open(line, 625_000, target_baudrate=None, servos=False)
            assert rcb4.get_version()
            rcb4.close()


def test_stepped_a_cycle_passes_with_each_move_and_no_other_time(tmp_path):
    board = bench_board()
    with served(board, tmp_path, stepped=True) as (server, line):
        client, _ = connect(line)
        for position in (7500, 7510, 7520):
            client.move({12: position})
            client.ad()
            assert client.measured(12) == position
        assert server.cycles == board.robot.cycles == 3
        client.close()


@pytest.mark.parametrize('kind', KINDS)
def test_the_client_lives_through_every_fault(kind, tmp_path):
    """What it returns meanwhile is right, and afterwards all is as before."""
    faults = Faults([Fault.parse(f'kind={kind} start=0 count=2 duration=0.03')])
    board = bench_board()
    with served(board, tmp_path, stepped=True, faults=faults) as (_, line):
        client, _ = connect(line, 1_250_000, timeout=0.2)
        good = 0
        for _ in range(200):
            try:
                assert client.ad()[:2] == (450, 0)
                good += 1
            except BoardError:
                assert not client.closed
            if good == 3:
                break
        assert good == 3
        client.close()


def test_on_a_wire_a_reply_takes_as_long_as_its_bytes_and_the_board(tmp_path):
    """11 bits a byte; the table of an exchange in ms: write 17 positions, all AD, a position."""
    moves, ad, one = (
        commands.move_servos(dict.fromkeys(range(17), 7500)),
        commands.read_ram(memory.AD_VALUES, 22),
        commands.read_ram(memory.record_address(18) + memory.MEASURED, 2),
    )
    board = bench_board()
    spent = {
        baud: [1e3 * Wire().time(each, board.answer(each), baud) for each in (moves, ad, one)]
        for baud in (115_200, 1_250_000)
    }
    assert spent[115_200] == pytest.approx([5.21, 5.25, 2.26], abs=0.01)
    assert spent[1_250_000] == pytest.approx([1.13, 2.22, 0.96], abs=0.01)
    wired = served(board, tmp_path, wire=Wire(reply=0.5))
    with wired as (_, line), pytest.raises(NoReplyError):
        connect(line, 1_250_000, timeout=0.01)


def test_a_computer_that_is_slower_than_the_board_answers_all_the_same(tmp_path):
    board = bench_board()
    cycle, period = board.cycle, board.config.cycle
    board.cycle = lambda: (time.sleep(1.1 * period), cycle())
    with served(board, tmp_path) as (server, line):
        client, _ = connect(line, 1_250_000, timeout=0.5)
        for _ in range(5):
            assert client.ad()[:2] == (450, 0)
        client.close()
    assert server.cycles > 5


def test_a_line_is_of_one_client_and_ends_it_when_it_goes(tmp_path):
    with served(bench_board(), tmp_path) as (_, line):
        client, _ = connect(line)
        with pytest.raises(PortError, match='accepted'):
            connect(line)
    with pytest.raises(PortError, match='gone'):
        client.ad()


def test_a_file_that_is_there_is_not_overwritten(tmp_path):
    (tmp_path / 'board').write_text('mine')
    with pytest.raises(PortError, match='accepted'):
        Server(bench_board(), tmp_path / 'board')
    assert (tmp_path / 'board').read_text() == 'mine'


@pytest.mark.parametrize('text', ['kind=fire', 'kind=lost count=0', 'lost'])
def test_a_fault_that_does_not_read_is_refused(text):
    with pytest.raises(KhrError, match='accepted'):
        Fault.parse(text)
