"""One scenario, three ways to run it, one trajectory; and every change of stage in the bag."""

from functools import cache
from itertools import pairwise

import pytest

from tests.support.runs import khr, stamp_ns

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ('scenario', 'engine'),
    [
        ('walk_8.88deg_ka18', 'bullet'),
        ('lift_7.6deg_ka12', 'bullet'),
        ('walk_8.88deg_ka18', 'mujoco'),
    ],
)
def test_offline_one_process_and_nine_give_the_same_bits(scenario, engine, tmp_path):
    hashes = {}
    for way in ('--offline', '--one-process', '--processes'):
        folder = tmp_path / way.strip('-')
        choice = '--set', f'simulator.engine={engine}'
        result = khr(
            'run', scenario, way, *choice, '--no-record', '--duration', '3', '--out', folder
        )
        assert result.code == 0, result.err
        hashes[way] = result.hash
    assert len(set(hashes.values())) == 1, hashes


def test_without_delay_graph_and_offline_agree_too(tmp_path):
    hashes = {
        khr(
            *('run', 'walk_0deg', way, '--no-record', '--duration', '1'),
            *('--set', 'simulator.control_delay=0', '--out'),
            tmp_path / way.strip('-'),
        ).hash
        for way in ('--offline', '--one-process')
    }
    assert len(hashes) == 1


# Fast ground and low thresholds: all three stages in two seconds.
QUICK = (
    *('stand_tilting_staged', '--duration', 1.95),
    *('--set', 'simulator.inclination_rate_deg_s=2.0', '--set', 'stage.ramp_time=0.2'),
    *('--set', 'stage.ankle_above_deg=0.2', '--set', 'stage.hip_above_deg=1.0'),
)
PERIODS = 131  # of 15 ms in 1.95 s, the instant 0 included


@pytest.fixture(scope='module')
def run_in(tmp_path_factory):
    """Return a function that gives the run in one of three ways, run when first asked for."""
    top = tmp_path_factory.mktemp('runs')

    @cache
    def run(way):
        out = top / way.strip('-')
        ended = khr('run', *QUICK, way, '--out', out, folder=out, measured=way == '--processes')
        assert ended.code == 0, ended.err
        return ended

    return run


def test_offline_one_process_and_ten_give_the_same_bits(run_in):
    ways = ('--offline', '--one-process', '--processes')
    assert len({run_in(way).hash for way in ways}) == 1


def test_the_bag_has_the_stage_of_every_period_and_every_change(run_in):
    bag = run_in('--processes').bag()
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


def test_a_control_below_its_stage_publishes_zero(run_in):
    bag = run_in('--processes').bag()
    shares = {
        stamp_ns(message): dict(zip(message.name, message.position, strict=True))
        for _, message in bag['/stage']
    }
    for node in ('ankle_controller', 'hip_controller'):
        corrections = bag[f'/{node}/correction']
        assert len(corrections) == PERIODS
        for _, message in corrections:
            if shares[stamp_ns(message)][node] == 0.0:
                assert list(message.position) == [0.0, 0.0]
    assert any(message.position[0] for _, message in bag['/ankle_controller/correction'])
