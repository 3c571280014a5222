"""One scenario, three ways to run it, one trajectory; and every change of stage in the bag."""

from itertools import pairwise

import pytest

from tests.support.in_process import khr_here
from tests.support.runs import khr, stamp_ns

pytestmark = pytest.mark.slow
# Fast ground and low thresholds: all three stages in two seconds.
QUICK = (
    *('stand_tilting_staged', '--duration', 1.95),
    *('--set', 'simulator.inclination_rate_deg_s=2.0', '--set', 'stage.ramp_time=0.2'),
    *('--set', 'stage.ankle_above_deg=0.2', '--set', 'stage.hip_above_deg=1.0'),
)
PERIODS = 131  # of 15 ms in 1.95 s, the instant 0 included


@pytest.fixture(scope='module')
def processes(tmp_path_factory):
    """The run with a process for each node, recorded."""
    out = tmp_path_factory.mktemp('runs') / 'processes'
    ended = khr('run', *QUICK, '--processes', '--out', out, folder=out, measured=True)
    assert ended.code == 0, ended.err
    return ended


def test_offline_one_process_and_ten_give_the_same_bits(processes, tmp_path):
    offline = khr_here('run', *QUICK, '--offline', '--no-draw', '--out', tmp_path / 'offline')
    one = khr('run', *QUICK, '--one-process', '--no-record', '--out', tmp_path / 'one')
    assert processes.hash == one.hash == offline.hash
    assert len(one.hash) == 64


def test_the_bag_has_the_stage_of_every_period_and_every_change(processes):
    bag = processes.bag()
    stages = [
        (stamp_ns(message), dict(zip(message.name, message.position, strict=True)))
        for _, message in bag['/stage']
    ]
    assert [stamp for stamp, _ in stages] == [i * 15_000_000 for i in range(PERIODS)]
    entered = [
        (0, 1),
        *(
            (stamp, after['stage'])
            for (_, before), (stamp, after) in pairwise(stages)
            if before['stage'] != after['stage']
        ),
    ]
    assert [number for _, number in entered] == [1, 2, 3]
    noted = [
        (stamp_ns(message), int({pair.key: pair.value for pair in status.values}['stage']))
        for _, message in bag['/stage/changes']
        for status in message.status
    ]
    assert noted == entered
    shares = dict(stages)
    for node in ('ankle_controller', 'hip_controller'):
        corrections = bag[f'/{node}/correction']
        assert len(corrections) == PERIODS
        for _, message in corrections:
            if shares[stamp_ns(message)][node] == 0.0:
                assert list(message.position) == [0.0, 0.0]
    assert any(message.position[0] for _, message in bag['/ankle_controller/correction'])
