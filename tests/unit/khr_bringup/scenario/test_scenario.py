"""Scenario files: those shipped are sound, and a mistake is one line with what is accepted."""

import pytest
import yaml

from khr_analysis.spectrum import FftAnalyserParameters
from khr_balance.controllers import (
    ANKLE_CONTROLLER,
    AnkleControllerParameters,
    HipControllerParameters,
)
from khr_balance.stage import StageParameters
from khr_bringup.node_registry import registry, table_of
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.expectation import Expectation
from khr_bringup.scenario.robots import constants_of, label_of, on_robot, robot_names
from khr_bringup.scenario.scenario import Scenario, with_installed_engine
from khr_common import KhrError, specifications
from khr_common.pacing import Punctuality
from khr_sim.physics import engines
from khr_sim.run_parameters import RunParameters

GOOD = 'gait:\n  ros__parameters:\n    motion: walk\n'


@pytest.mark.parametrize('path', scenarios.shipped(), ids=lambda path: path.stem)
def test_shipped_scenarios_are_accepted_and_titled(path):
    scenario = scenarios.load_scenario(str(path))
    assert scenario.title
    for node in registry():
        scenario.table(table_of(node))


def test_names_agree_with_the_files():
    for path in scenarios.shipped():
        scenario = scenarios.load_scenario(path.stem)
        words = path.stem.split('_')
        simulator = scenario.table(RunParameters)
        for word in words:
            if word.endswith('deg'):
                assert simulator.inclination_deg == float(word.removesuffix('deg'))
            if word.startswith('ka'):
                assert scenario.table(AnkleControllerParameters).gain == float(word[2:])
            if word.startswith('kh'):
                assert scenario.table(HipControllerParameters).gain == float(word[2:])
        staged = 'staged' in words
        assert (scenario.table(StageParameters).mode != 'none') == staged
        assert scenario.table(AnkleControllerParameters).enabled == (
            'ka' in path.stem or staged or 'push' in path.stem
        )
        assert scenario.table(HipControllerParameters).enabled == ('_kh' in path.stem or staged)
        assert (simulator.surface == 'rubber') == ('rubber' in words or 'push' in words)


@pytest.mark.parametrize('path', scenarios.shipped(), ids=lambda path: path.stem)
def test_whole_scenario_follows_changes_as_the_one_it_was_written_from(path, tmp_path):
    scenario = scenarios.load_scenario(str(path))
    file = tmp_path / path.name
    file.write_text(scenario.to_yaml())
    again = scenarios.read_scenario(file)
    changes = {
        ('simulator', 'seed'): 7,
        ('simulator', 'control_period'): 0.01,
        ('simulator', 'inclination_deg'): 1.5,
        ('gait', 'cycle_period'): 3.0,
    }
    for each in ({}, changes):
        assert again.changed(each).to_yaml() == scenario.changed(each).to_yaml()
    assert again.changed(changes).of('gyro')['seed'] == 7


@pytest.mark.parametrize('seed', [2, 3])
def test_a_seed_that_a_person_states_is_kept(seed, tmp_path):
    file = tmp_path / 'own.yaml'
    file.write_text(
        f'gyro: {{ros__parameters: {{seed: {seed}}}}}\nsimulator: {{ros__parameters: {{seed: 2}}}}\n'
    )
    scenario = scenarios.read_scenario(file)
    assert scenario.changed({('simulator', 'seed'): 5}).of('gyro')['seed'] == seed


def test_whole_scenario_reads_back_the_same():
    scenario = scenarios.load_scenario('walk_9.7deg_ka12_kh13')
    text = scenario.to_yaml()
    again = scenarios.parse(text, 'again.yaml', scenario.name)
    assert all(again.of(node) == again.of(node) | scenario.of(node) for node in registry())
    assert again.to_yaml() == text
    assert again.title == scenario.title


def test_defaults_file_holds_the_defaults_of_the_tables():
    document = yaml.safe_load((scenarios.CONFIG / 'defaults.yaml').read_text())
    assert set(document) == {f'/**/{node}' for node in registry()}
    defaults = scenarios.load_scenario(str(scenarios.CONFIG / 'defaults.yaml'))
    for node in registry():
        assert defaults.table(table_of(node)) == table_of(node)()


@pytest.mark.parametrize(
    ('text', 'says'),
    [
        ('gaite:\n  ros__parameters:\n    motion: walk\n', ['gaite', 'no such node', 'gait']),
        ('gait:\n  ros__parameters:\n    stroll: walk\n', ['gait', 'stroll', 'motion']),
        ('gait:\n  ros__parameters:\n    motion: run\n', ['motion', "'run'", 'walk']),
        ('simulator:\n  ros__parameters:\n    inclination_deg: 7\n', ['inclination_deg', '7.0']),
        ('gait:\n  motion: walk\n', ['gait', 'ros__parameters']),
        ('gait:\n  ros__parameters: walk\n', ['gait', 'mapping']),
        ('/**:\n  ros__parameters:\n    hip_hight: 1\n', ['/**', 'did you mean hip_height?']),
        ('walk\n', ['parameter file']),
        ('gait: [\n', ['line 2', 'YAML']),
        (GOOD + GOOD, ['line 4', "'gait' is given twice"]),
        (GOOD + '/**/' + GOOD, ['gait: given twice']),
    ],
)
def test_mistakes_are_named(tmp_path, text, says):
    path = tmp_path / 'mine.yaml'
    path.write_text(text)
    with pytest.raises(KhrError) as refusal:
        scenarios.load_scenario(str(path))
    message = str(refusal.value)
    assert str(path) in message
    assert '\n' not in message
    for word in says:
        assert word in message


OF_888 = ' or '.join(f'walk_8.88deg_{of}' for of in ('ka12', 'ka12_rubber', 'ka15', 'ka18'))


@pytest.mark.parametrize(
    ('name', 'near'),
    [
        ('walk_8.88', OF_888),
        ('config/scenarios/walk_9.7deg_ka18_x.yaml', 'walk_9.7deg_ka18'),
        ('wlak_3deg', 'walk_3deg'),
        ('', None),
    ],
)
def test_unknown_scenario_says_which_was_meant_and_what_lists_all(name, near):
    with pytest.raises(KhrError) as refusal:
        scenarios.load_scenario(name)
    assert 'no such scenario; ' in str(refusal.value) and '"khr scenarios"' in str(refusal.value)
    assert ('did you mean' in str(refusal.value)) == (near is not None)
    assert near is None or f'did you mean {near}?' in str(refusal.value)


@pytest.mark.parametrize(
    ('text', 'says'),
    [
        ('ankle_controller.gain', 'node.parameter=value'),
        ('ankle_controller.gian=3', 'gian'),
        ('ankle_controller.gain=-3', '-3.0'),
        ('ankle_controller.gain={', 'YAML'),
    ],
)
def test_changes_are_checked(text, says):
    with pytest.raises(KhrError) as refusal:
        scenarios.load_scenario('walk_0deg').changed(scenarios.changes_of([text]))
    assert says in str(refusal.value)


def test_changes_stand_in_the_title_and_read_back():
    scenario = scenarios.load_scenario('walk_8.88deg_ka12')
    changed = scenario.set_to(['ankle_controller.enabled=false', 'simulator.pushes=[\n]'])
    assert changed.values['ankle_controller']['enabled'] is False
    assert changed.values['simulator']['pushes'] == []
    kept, _, _ = scenario.title.partition(', ankle gain')
    assert changed.title == f'{kept}, without control, simulator.pushes=[ ]'
    assert scenario.set_to(['ankle_controller.gain=40']).title == f'{kept}, K_A 40 (gyro)'
    assert scenarios.parse(changed.to_yaml(), 'again.yaml', 'again').title == changed.title
    assert scenario.set_to([]) == scenario
    twice = scenario.set_to([f'simulator.friction={friction}' for friction in (0.5, 0.6)])
    assert twice.title == f'{scenario.title}, simulator.friction=0.6', 'the last counts'


def test_all_nodes_share_control_period_and_seed_unless_one_has_its_own():
    changed = scenarios.load_scenario('walk_0deg').set_to(
        ['simulator.control_period=0.02', 'simulator.seed=7', 'gyro.seed=3']
    )
    tables = {name: table_of(name) for name in registry()}
    for scenario in (changed, scenarios.parse(changed.to_yaml(), 'again.yaml', 'again')):
        for node in ('simulator', 'gyro', 'foot_force', 'fft_analyser', 'monitor'):
            assert scenario.table(tables[node]).control_period == 0.02
        for node in (name for name, table in tables.items() if 'seed' in specifications(table)):
            assert scenario.table(tables[node]).seed == (3 if node == 'gyro' else 7)


def test_every_leg_lift_takes_its_ankle_gain_from_the_force_sensors():
    lifts = [path.stem for path in scenarios.shipped() if path.stem.startswith('lift_')]
    sources = [
        scenarios.load_scenario(name).table(ANKLE_CONTROLLER.table).source for name in lifts
    ]
    assert set(sources) == {'force'}


@pytest.mark.parametrize(('inclination_deg', 'start'), [(0.0, 2.0), (7.6, 5.8), (-3.0, 3.5)])
def test_a_leg_lift_starts_when_the_board_has_been_tilted(inclination_deg, start):
    lift = scenarios.load_scenario('lift_0deg').changed(
        {('simulator', 'inclination_deg'): inclination_deg}
    )
    assert lift.table(table_of('gait')).start_delay == start
    stated = lift.changed({('gait', 'start_delay'): 1.25})
    assert stated.table(table_of('gait')).start_delay == 1.25
    on_the_slope = lift.changed({('simulator', 'level_start'): False})
    assert on_the_slope.table(table_of('gait')).start_delay == table_of('gait')().start_delay


def test_the_spectrum_follows_the_period_of_the_gait():
    walk = scenarios.load_scenario('walk_0deg').changed({('gait', 'cycle_period'): 2.4})
    assert walk.table(FftAnalyserParameters).window_length == 2.4
    for controller in ('ankle_controller', 'hip_controller'):
        assert walk.table(table_of(controller)).reference_frequency == 4.0 / 2.4
    own = walk.changed({('fft_analyser', 'window_length'): 4.8})
    assert own.table(FftAnalyserParameters).window_length == 4.8


def test_nodes_of_a_run_are_those_that_it_needs():
    assert 'stage' not in scenarios.load_scenario('walk_0deg').nodes
    assert 'stage' in scenarios.load_scenario('stand_tilting_staged').nodes
    assert scenarios.load_scenario('walk_0deg').answers == [
        'gait',
        'ankle_controller',
        'hip_controller',
    ]


@pytest.mark.parametrize(
    'text',
    [
        '/robot/gyro: {ros__parameters: {noise: 1e-3}}',
        'robot: {/gyro: {ros__parameters: {noise: 1E-3}}}',
        '/**: {ros__parameters: {noise: 0.001}}',
        '/**/gyro: {ros__parameters: {noise: 1.e-3}}\n/**: {ros__parameters: {noise: 0.5}}',
        '/gyro: {ros__parameters: {noise: 0.1e-2, use_sim_time: false, '
        'qos_overrides: {/clock: {subscription: {depth: 1}}}}}',
    ],
)
def test_a_parameter_file_of_ros_2_is_a_scenario(text):
    assert scenarios.parse(text, 'mine.yaml', 'mine').of('gyro')['noise'] == 0.001


def test_integers_in_a_list_of_floats_are_floats():
    text = 'simulator: {ros__parameters: {push_point: [0, 0.5, 1e-1]}}'
    point = scenarios.parse(text, 'mine.yaml', 'mine').of('simulator')['push_point']
    assert point == [0.0, 0.5, 0.1] and {*map(type, point)} == {float}


def test_without_pybullet_mujoco_is_the_engine(monkeypatch, capsys):
    monkeypatch.setattr(scenarios, '_installed', lambda _: False)
    scenarios._name_the_engine.cache_clear()  # another test of this process may have let it say so
    chosen = with_installed_engine(Scenario('plain', {}))
    assert chosen.table(RunParameters).engine == 'mujoco'
    assert '"make bullet" compiles PyBullet' in capsys.readouterr().err


def test_a_stated_engine_stays(monkeypatch):
    monkeypatch.setattr(scenarios, '_installed', lambda _: False)
    stated = Scenario('stated', {'simulator': {'engine': 'bullet'}})
    assert with_installed_engine(stated) is stated


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
def test_an_engine_that_is_not_installed_is_one_line(monkeypatch, engine):
    monkeypatch.setattr(engines, 'find_spec', lambda _: None)
    scenario = Scenario('short', {'simulator': {'engine': engine, 'duration': 0.1}})
    with pytest.raises(
        KhrError, match=f"engine: '{engine}' is not installed; accepted: "
    ) as error:
        run_offline(scenario)
    assert '\n' not in str(error.value)


# ---- what is expected ----

LOCKSTEP = scenarios.load_scenario('stand_0deg')
WALL_CLOCK = LOCKSTEP.changed({('simulator', 'sync'): 'realtime'})
HELD = Punctuality(periods=9).result()
NOT_HELD = Punctuality(periods=9, late=5).result()


@pytest.mark.parametrize(
    ('text', 'verdict', 'realtime', 'says'),
    [
        ('', 'fell', NOT_HELD, ''),
        ('walked', 'walked', NOT_HELD, ''),
        ('walked', 'fell', HELD, 'expected walked, the outcome is fell'),
        ('walked', '', None, 'expected walked, the outcome is unknown'),
        ('walked,realtime', 'walked', NOT_HELD, '5 of 9 periods late'),
        ('realtime', 'walked', None, 'did not report'),
    ],
)
def test_an_expectation_that_is_not_met_says_so(text, verdict, realtime, says):
    unmet = Expectation.parse(text, '--expect', WALL_CLOCK).unmet(verdict, realtime)
    assert says in unmet and bool(unmet) == bool(says) and '\n' not in unmet


@pytest.mark.parametrize('text', ['flown', 'walked,fell', 'realtime,', ','])
def test_an_expectation_of_no_outcome_is_refused(text):
    with pytest.raises(KhrError, match=r'--expect: .* walked \| stood .* realtime'):
        Expectation.parse(text, '--expect', WALL_CLOCK)


@pytest.mark.parametrize(('scenario', 'offline'), [(LOCKSTEP, False), (WALL_CLOCK, True)])
def test_real_time_is_expected_of_the_wall_clock_alone(scenario, offline):
    with pytest.raises(KhrError, match=r'simulator\.sync=realtime'):
        Expectation.parse('realtime', '--expect', scenario, offline)


# ---- robots: named constants under the values of a scenario ----


def test_robot_gives_the_parameters_that_the_scenario_leaves_out():
    walk = scenarios.load_scenario('walk_6.99deg_ka12').changed({('gyro', 'bandwidth'): 3.0})
    assert robot_names() == ['leaning', 'stiff']
    leaning = on_robot(walk, 'leaning')
    assert leaning.of('ankle_controller')['reference_offset'] == -0.7072
    assert leaning.of('gyro')['bandwidth'] == 3.0, 'the scenario states it'
    assert leaning.of('ankle_controller')['gain'] == walk.of('ankle_controller')['gain']
    assert leaning.title.endswith('robot leaning')


def test_robot_is_a_file_as_well_and_an_unknown_one_is_refused(tmp_path):
    file = tmp_path / 'soft.yaml'
    file.write_text('simulator:\n  ros__parameters:\n    gear_stiffness: 20.0\n')
    assert constants_of(str(file)) == {('simulator', 'gear_stiffness'): 20.0}
    label = label_of(str(file))
    with pytest.raises(KhrError, match="'soft': no such robot; accepted: leaning, stiff, or"):
        constants_of('soft')
    file.write_text('simulator:\n  ros__parameters:\n    gear_stiffness: -1.0\n')
    with pytest.raises(KhrError, match=r'soft.yaml: simulator: gear_stiffness: -1.0'):
        constants_of(str(file))
    assert label.startswith('soft-') and label_of(str(file)) != label
    assert label_of('stiff') == 'stiff'
