"""The nodes and topics of a run, and its wiring, which is apart from its scenario."""

import pytest
import yaml

from khr_bringup.bout.bout import load_bout
from khr_bringup.graph.wiring import Robots, Wiring
from khr_bringup.node_registry import registry
from khr_bringup.running import robots_of
from khr_bringup.scenario.driver import Driver
from khr_bringup.scenario.scenario import load_scenario, parse
from khr_common import build, specifications
from khr_common.errors import KhrError
from khr_sim.run_parameters import RunParameters

WALK = load_scenario('walk_7.68deg_ka12')
CONNECTING = {
    (node, name)
    for node, each in registry().items()
    for name, specification in specifications(each.spec.table).items()
    if specification.wiring
}


def test_a_scenario_holds_no_wiring(tmp_path):
    stated = {
        (node.rpartition('/')[2], name)
        for node, body in yaml.safe_load(WALK.to_yaml()).items()
        for name in body['ros__parameters']
    }
    wiring = Wiring.derive(Robots.alone(WALK), tmp_path)
    derived = {(node, name) for node, values in wiring.values.items() for name in values}
    assert CONNECTING and not stated & CONNECTING
    assert derived - CONNECTING == {('simulator', 'duration')}
    with pytest.raises(KhrError, match=r'recorder: folder is not accepted: it is set when'):
        WALK.changed({('recorder', 'folder'): 'elsewhere'})


def test_wiring_in_a_scenario_of_an_earlier_version_is_dropped():
    document = yaml.safe_load(WALK.to_yaml())
    document['/**/simulator']['ros__parameters']['answers'] = ['nobody']
    document['/**/recorder']['ros__parameters']['scenario_file'] = '/elsewhere.yaml'
    old, own = (parse(text, 'a.yaml', 'a') for text in (yaml.safe_dump(document), WALK.to_yaml()))
    assert old.values == own.values


def test_wiring_is_read_as_it_was_written(tmp_path):
    wiring = Wiring.derive(Robots.alone(WALK), tmp_path)
    assert Wiring.read(wiring.write(tmp_path)) == wiring
    assert set(wiring.listeners) == {'monitor', 'fft_analyser', 'recorder'}
    assert wiring.values['recorder']['folder'] == str(tmp_path / 'bag')


def test_a_run_without_recorder_or_end(tmp_path):
    wiring = Wiring.derive(
        Robots.alone(WALK), tmp_path, record=False, endless=True, joint_frames=False
    )
    assert 'recorder' not in wiring.values and 'recorder' not in wiring.listeners
    assert 'duration' not in wiring.values['simulator']
    assert wiring.values['transforms'] == {'joints': False}


def test_the_node_that_ends_a_run_on_a_driver_receives_its_duration(tmp_path):
    driven = WALK.driven_by(Driver('foreign', 'plant'))
    wiring = Wiring.derive(Robots.alone(driven), tmp_path)
    assert wiring.values['run_phase'] == {'duration': wiring.values['simulator']['duration']}
    assert wiring.driver_parameters(driven)['answers'] == driven.answers
    assert all('period' not in line.split() for line in wiring.values['recorder']['topics'][1:])


def test_the_simulator_gets_each_robot_as_it_is_without_a_graph(tmp_path):
    bout = load_bout('shove')
    values = Wiring.derive(robots_of(bout, 1), tmp_path).values['simulator']
    table = build(RunParameters, {'robots': values['robots']})
    assert table.starts() == [(-0.085, 0.0, 0.0), (0.085, 0.0, 180.0)]
    for robot, scenario in bout.in_round(1).items():
        own = scenario.table(RunParameters)
        found = table.of_robots()[robot]
        assert (found.seed, found.pushes) == (own.seed, own.pushes)
    assert values['duration'] == bout.rules.time_limit
    assert 'red/monitor' in values['listeners'] and 'recorder' in values['listeners']
