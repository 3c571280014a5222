"""Bout files: what each robot gets, what both share, and what is refused."""

import pytest

from khr_analysis.outcome import MonitorParameters
from khr_balance.controllers import AnkleControllerParameters
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.bout.bout import is_bout, load_bout, parse_bout, shipped_bouts
from khr_bringup.scenario.control_text import control_of
from khr_bringup.scenario.scenario import shipped
from khr_common.errors import KhrError
from khr_sim.run_parameters import RunParameters
from khr_sim.sensors import GyroParameters

TEXT = """# Two stand
/referee:
  ros__parameters: {rounds: 3, time_limit: 20.0, down_time: 2, blue_start: [1, 0, 90]}
/**/simulator:
  ros__parameters: {surface: rubber, seed: 5}
/**/ankle_controller:
  ros__parameters: {enabled: true, gain: 12.0}
/red/ankle_controller:
  ros__parameters: {gain: 18.0}
blue:
  gait:
    ros__parameters: {motion: guard}
/red/gait:
  ros__parameters: {motion: stand}
"""
FINE = TEXT.replace('down_time: 2,', 'down_time: 2.0,').replace('[1, 0, 90]', '[0.5, 0, 90]')


def bout(text=FINE):
    return parse_bout(text, 'file.yaml', 'file')


def test_each_robot_gets_its_own_blocks_over_those_of_both():
    red, blue = bout().robots.values()
    gains = [each.table(AnkleControllerParameters) for each in (red, blue)]
    assert [each.gain for each in gains] == [18.0, 12.0]
    assert all(each.enabled for each in gains)
    assert [each.table(GaitParameters).motion for each in (red, blue)] == ['stand', 'guard']
    assert {each.table(RunParameters).surface for each in (red, blue)} == {'rubber'}
    assert bout().title == 'Two stand'
    assert bout().starts[1] == pytest.approx((0.5, 0.0, 1.5708), abs=1e-4)


def test_the_referee_alone_ends_a_round():
    for each in bout().robots.values():
        simulator = each.table(RunParameters)
        assert (simulator.duration, simulator.stop_when_tilted_deg) == (20.0, 180.0)
        assert each.table(MonitorParameters).fall_time == 2.0


def test_no_two_robots_have_the_same_seed_in_any_round_or_bout():
    seeds = [
        each.table(GyroParameters).seed
        for seed in (5, 6)
        for number in range(3)
        for each in bout().set_to([f'simulator.seed={seed}']).in_round(number).values()
    ]
    assert len(set(seeds)) == 12


def test_a_bout_as_written_is_the_same_bout():
    again = parse_bout(bout().to_yaml(), 'again.yaml', 'file')
    assert again.to_yaml() == bout().to_yaml()
    for number in (0, 2):
        ours, theirs = (each.in_round(number) for each in (bout(), again))
        for robot, scenario in ours.items():
            for node in scenario.nodes:
                assert theirs[robot].whole(node) == scenario.whole(node), node


def test_changes_are_of_both_of_one_or_of_the_rules():
    texts = ['ankle_controller.gain=9', 'blue.hip_controller.enabled=true', 'referee.rounds=5']
    staged = ['ankle_controller.staged=true', 'stage.mode=auto']  # each needs the other
    assert {each.whole('stage')['mode'] for each in bout().set_to(staged).robots.values()} == {
        'auto'
    }
    changed = bout().set_to(texts)
    red, blue = (each.table(AnkleControllerParameters) for each in changed.robots.values())
    assert (red.gain, blue.gain, changed.rules.rounds) == (9.0, 9.0, 5)
    controls = [control_of(robot) for robot in changed.robots.values()]
    assert controls == ['K_A 9 (gyro)', 'K_A 9 (gyro), K_H 12']
    assert changed.title == ', '.join(['Two stand', *texts])


@pytest.mark.parametrize(
    ('text', 'instead'),
    [
        ('simulator.duration=5', 'referee.time_limit'),
        ('red.simulator.stop_when_tilted_deg=40', 'referee.fall_tilt_deg'),
        ('blue.gyro.seed=3', 'simulator.seed'),
        ('foot_force.seed=3', 'simulator.seed'),
    ],
)
def test_a_change_that_a_bout_would_overwrite_is_refused_with_the_key_to_change(text, instead):
    with pytest.raises(KhrError, match=f'; accepted: {instead}, from which') as error:
        bout().set_to([text])
    assert text.partition('=')[0].endswith(str(error.value).partition(':')[0])
    assert bout(bout().to_yaml()).rules == bout().rules, 'a file that states all values is read'


def test_every_key_of_the_monitor_that_the_rules_set_is_refused():
    for key, value in bout().rules.down.items():
        with pytest.raises(KhrError, match=rf'^monitor\.{key}: .*; accepted: referee\.'):
            bout().set_to([f'monitor.{key}={value}'])


@pytest.mark.parametrize(
    ('before', 'after', 'said'),
    [
        ('rounds: 3', 'round: 3', 'referee: round: no such parameter; did you mean rounds?'),
        ('[0.5, 0, 90]', '[2, 0, 0]', 'referee: blue_start: .* a place in the ring'),
        ('\nblue:', '\nbleu:', 'namespace bleu: no such robot; did you mean blue?'),
        ('/red/gait', '/red/gate', 'gate: no such node'),
    ],
)
def test_a_mistake_is_one_line_with_the_way_out(before, after, said):
    assert before in FINE
    with pytest.raises(KhrError, match=said) as error:
        bout(FINE.replace(before, after))
    assert str(error.value).startswith('file.yaml: ')
    assert '\n' not in str(error.value)


def test_robots_share_one_world_but_pushes_and_errors_are_their_own():
    own = '/red/simulator:\n  ros__parameters: {%s}\n'
    with pytest.raises(KhrError, match=r'blue: simulator: friction: .*, the value of red: both'):
        bout(FINE + own % 'friction: 0.5')
    with pytest.raises(KhrError, match=r'blue: simulator: seed: 5 is not accepted'):
        bout(FINE + own % 'seed: 3')
    pushed = bout(
        FINE + own % "pushes: ['t=1 duration=0.1 link=base_link frame=odom force=1,0,0']"
    )
    red, blue = (each.table(RunParameters).pushes for each in pushed.robots.values())
    assert red != blue


def test_an_unknown_bout_is_named_with_the_most_similar_one():
    with pytest.raises(KhrError, match=r'^shovel: no such bout; did you mean shove\?'):
        load_bout('shovel')


@pytest.mark.parametrize('path', shipped_bouts(), ids=lambda path: path.stem)
def test_a_shipped_bout_loads_and_has_a_title(path):
    assert load_bout(str(path)).title
    assert is_bout(str(path))
    assert is_bout(path.stem)


def test_a_scenario_is_no_bout(tmp_path):
    assert not any(is_bout(str(path)) for path in shipped()[:3])
    assert not is_bout(str(tmp_path))
