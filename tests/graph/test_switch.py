"""Another scenario on a live graph: as a whole, or not at all."""

import pytest
import yaml

from khr_bringup.recorded.bags import read_messages
from khr_bringup.scenario.scenario import load_scenario
from khr_common.interfaces import SCENARIO
from tests.support.runs import LONG, call, finish, joined, khr, wait_until, wait_until_running

pytestmark = pytest.mark.slow


@pytest.fixture
def run(in_background, tmp_path):
    folder = tmp_path / 'run'
    process = in_background('run', 'stand_0deg', *LONG, '--out', folder)
    process.folder, process.domain = folder, wait_until_running(folder)
    return process


@pytest.fixture(params=['walk_8.88deg_ka12', 'by force, at another period'])
def other(request, tmp_path):
    """A scenario that falls soon, and one whose controllers need other signals than before."""
    if not request.param.startswith('by'):
        return request.param
    file = tmp_path / 'other.yaml'
    scenario = load_scenario('lift_7.6deg_ka12').changed(
        {('simulator', 'control_period'): 0.02, ('simulator', 'duration'): 3.0}
    )
    file.write_text(scenario.to_yaml())
    return file


def test_the_run_after_a_switch_is_that_of_the_scenario_from_its_start(run, tmp_path, other):
    done = khr('switch', other, '--domain', run.domain)
    assert done.code == 0, done.err
    ended = finish(run, run.folder)
    assert ended.code == 0, ended.err
    fresh = khr('run', other, '--offline', '--out', tmp_path / 'fresh')
    assert ended.hash == fresh.hash
    for bag, motion in (
        ('bag', 'stand'),
        ('bag_2', load_scenario(str(other)).values['gait']['motion']),
    ):
        (text,) = read_messages(run.folder / bag, [SCENARIO])[SCENARIO]
        assert f'motion: {motion}' in text.data


@pytest.mark.parametrize(
    ('text', 'says'),
    [
        ('/**/stage:\n  ros__parameters:\n    mode: auto\n', 'needs stage'),
        ('/**/gait:\n  ros__parameters:\n    stride: 1.0e+9\n', 'stride'),
    ],
)
def test_a_refused_scenario_changes_nothing(run, tmp_path, text, says):
    scenario = tmp_path / 'other.yaml'
    scenario.write_text(text)
    before = parameters(run)
    done = khr('switch', scenario, '--domain', run.domain)
    assert done.code == 2
    assert says in done.err and len(done.err.strip().splitlines()) == 1
    assert parameters(run) == before
    with joined(run.folder) as node:
        wait_until(node, seconds=1.0)
    assert not (run.folder / 'bag_2').exists()
    assert not (run.folder / 'scenario_2.yaml').exists()


def test_one_node_that_refuses_keeps_all_from_switching(run):
    """Whoever prepares for another run by hand finds the same checks."""
    from rcl_interfaces.srv import SetParametersAtomically
    from rclpy.parameter import Parameter

    with joined(run.folder) as node:

        def prepare(target, **values):
            parameters = [Parameter(k, value=v).to_parameter_msg() for k, v in values.items()]
            request = SetParametersAtomically.Request(parameters=parameters)
            return call(node, SetParametersAtomically, f'{target}/prepare', request).result

        assert prepare('gait', motion='walk').successful
        refused = prepare('gait', motion='fly')
        assert not refused.successful and 'walk' in refused.reason
        assert not prepare('simulator', answers=['gait']).successful
        assert prepare('gait').successful  # forgets
    shown = khr('get', 'gait', 'motion', '--domain', run.domain).out
    assert yaml.safe_load(shown) == {'motion': 'stand'}


def parameters(run):
    return [
        khr('get', node, '--domain', run.domain).out
        for node in ('simulator', 'gait', 'ankle_controller')
    ]
