"""A virtual board behind a pseudo-terminal, driven by our client and by one nobody here wrote."""

from random import Random

import numpy as np
import pytest
from rcb4.rcb4interface import RCB4Interface

from khr_hardware.client import connect
from khr_hardware.errors import BoardError, HardwareError, NoReplyError, PortError
from khr_hardware.protocol import memory
from khr_hardware.protocol.memory import FREE, Config
from khr_hardware.virtual.faults import KINDS, Fault, Faults
from khr_hardware.virtual.server import Server
from tests.fakes.boards import TRIMS, bench_board
from tests.support.exchanges import exchange
from tests.support.served import served

WAYS = [{}, {'flat': False}, {'servos': False}]  # in which the rcb4 client opens a board


@pytest.mark.parametrize('way', WAYS, ids=['flat', 'as it is', 'no servos'])
def test_the_unmodified_rcb4_client_drives_it(way, tmp_path):
    """It opens three times at one rate, and the servos go where it says."""
    board = bench_board()
    with served(board, tmp_path) as (_, line):
        for _ in range(3):
            rcb4 = RCB4Interface()
            assert rcb4.open(line, 1_250_000, **way)
            if 'servos' in way:
                assert board.record(18).trim == TRIMS[18]
                rcb4.close()
                continue
            assert rcb4.search_servo_ids().tolist() == sorted(TRIMS)
            trim = board.record(18).trim
            assert trim == (TRIMS[18] if way else 0)
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


def test_the_rcb4_client_reads_ad_trims_and_mixings_and_clears_them(tmp_path):
    board = bench_board()
    with served(board, tmp_path) as (_, line):
        own, _ = connect(line)
        own.set_mixing(18, 0, memory.Mixing.of_ad(1, 12))
        own.close()
        rcb4 = RCB4Interface()
        rcb4.open(line, 1_250_000, servos=False)
        values = rcb4.write_move_ram_to_com_command(memory.AD_VALUES, 22)
        assert int.from_bytes(bytes(values[:2]), 'little') == 450
        changed = rcb4.flatten_board()
        assert changed['trim'] == {ics: trim for ics, trim in TRIMS.items() if trim}
        assert changed['mixing'] == {18: [(0x4024, 12)]}
        rcb4.close()
    assert not board.record(18).mixings[0].active


def test_the_rcb4_client_switches_the_rate_and_a_board_hears_no_other(tmp_path):
    with served(bench_board(), tmp_path) as (_, line):
        rcb4 = RCB4Interface()
        assert rcb4.open(line, 1_250_000, target_baudrate=115_200, servos=False)
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


def test_over_a_pseudo_terminal_a_spoilt_line_gives_no_wrong_value(tmp_path):
    rng, faults, board = Random(2), Faults(), bench_board()
    good = failed = 0
    with served(board, tmp_path, stepped=True, faults=faults) as (_, line):
        client, _ = connect(line, 1_250_000, timeout=0.01)
        for _ in range(300):
            if rng.random() < 0.3:
                kind = rng.choice(['lost', 'late', 'corrupt', 'nck'])
                faults.add(Fault(kind, count=rng.choice([1, 2, 4]), duration=0.015))
            try:
                exchange(client, board, rng)
                good += 1
            except BoardError as error:
                assert '\n' not in str(error) and not client.closed
                failed += 1
        assert good > 100 and failed and client.counts.stray
        client.close()


def test_a_line_that_goes_ends_the_client(tmp_path):
    with served(bench_board(), tmp_path) as (_, line):
        client, _ = connect(line)
    with pytest.raises(PortError, match='gone'):
        client.ad()


def test_a_line_that_someone_has_open_is_refused(tmp_path):
    with served(bench_board(), tmp_path) as (_, line):
        client, _ = connect(line)
        with pytest.raises(PortError, match='accepted'):
            connect(line)
        client.close()


def test_a_file_that_is_there_is_not_overwritten(tmp_path):
    (tmp_path / 'board').write_text('mine')
    with pytest.raises(PortError, match='accepted'):
        Server(bench_board(), tmp_path / 'board')
    assert (tmp_path / 'board').read_text() == 'mine'


@pytest.mark.parametrize('text', ['', 'kind=fire', 'kind=lost count=0', 'lost', 'kind=lost x=1'])
def test_a_fault_that_does_not_read_is_refused(text):
    with pytest.raises(HardwareError, match='accepted'):
        Fault.parse(text)
