"""One scenario, three ways to run it, one trajectory."""

import pytest

from tests.support.runs import khr

pytestmark = pytest.mark.slow
SCENARIOS = [
    ('walk_8.88deg_ka18', 'bullet'),
    ('lift_7.6deg_ka12', 'bullet'),
    ('walk_8.88deg_ka18', 'mujoco'),
]


@pytest.mark.parametrize(('scenario', 'engine'), SCENARIOS)
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
            'run',
            'walk_0deg',
            way,
            '--no-record',
            '--duration',
            '1',
            '--set',
            'simulator.control_delay=0',
            '--out',
            tmp_path / way.strip('-'),
        ).hash
        for way in ('--offline', '--one-process')
    }
    assert len(hashes) == 1
