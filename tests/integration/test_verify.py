"""Recorded runs are repeated from their bags; those that cannot be are refused."""

import shutil

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from khr_bringup import scenario as scenarios
from khr_bringup.code_version import MARK, code_version
from khr_bringup.errors import BringupError
from khr_bringup.offline import run_offline
from khr_bringup.verify import read, verify
from tests.fakes.bags import change, make_bag, push, state
from tests.support.runs import khr

SCENARIO = scenarios.load('stand_0deg').changed(
    {
        ('simulator', 'duration'): 0.3,
        ('simulator', 'initial_tilt_deg'): 0.5,
        ('ankle_controller', 'enabled'): True,
    }
)


@pytest.fixture(scope='module')
def result():
    return run_offline(SCENARIO)


def end(found, **other):
    values = {
        'time_ns': str(round(found.time * 1e9)),
        'end': found.end,
        'trajectory_hash': found.trajectory_hash,
    }
    return '/simulator/state', state(**(values | other))


# ---- repeated ----


def test_a_real_recorded_run_is_repeated_bit_for_bit(tmp_path, capsys):
    run = khr(
        'run',
        'walk_8.88deg_ka18',
        '--one-process',
        '--duration',
        1,
        '--out',
        tmp_path / 'run',
        folder=tmp_path / 'run',
    )
    assert run.code == 0, run.err
    assert verify(run.folder) == 0
    out = capsys.readouterr().out.splitlines()
    assert read(run.folder).scenario.title  # which the line with the version does not replace
    version = code_version(engine='bullet')
    assert f'{MARK}{version}\n' in (run.folder / 'scenario.yaml').read_text()
    assert out[1:] == [f'recorded {run.hash}', f'repeated {run.hash}', 'same']


def test_the_bag_itself_will_do_as_well_as_its_run_s_folder(result, tmp_path):
    folder = make_bag(tmp_path, SCENARIO.to_yaml(), end(result))
    assert verify(folder) == verify(folder / 'bag') == verify(folder / 'bag' / 'bag.mcap') == 0


def test_an_interrupted_run_is_repeated_as_far_as_it_went(tmp_path, result):
    until = SCENARIO.changed({('simulator', 'duration'): 100.0})
    folder = make_bag(
        tmp_path,
        until.to_yaml(),
        ('/simulator/state', state('running')),
        end(result, end='stopped'),
    )
    assert verify(folder) == 0


@pytest.mark.parametrize(
    'changed', [{('simulator', 'initial_tilt_deg'): 0.4}, {('simulator', 'stretch_knee'): 76}]
)
def test_another_scenario_gives_another_trajectory(tmp_path, result, capsys, changed):
    folder = make_bag(tmp_path, SCENARIO.changed(changed).to_yaml(), end(result))
    assert verify(folder) == 1
    assert capsys.readouterr().out.splitlines()[-1] == 'different'


# ---- refused ----


def refused(folder):
    with pytest.raises(BringupError) as refusal:
        verify(folder)
    text = str(refusal.value)
    assert str(folder) in text and '\n' not in text
    return text


def test_a_run_changed_from_outside_is_not_repeated(tmp_path, result):
    text = refused(
        make_bag(
            tmp_path,
            SCENARIO.to_yaml(),
            end(result),
            ('/simulator/push', push()),
            ('/parameter_events', change('/ankle_controller', 'gain', 18.0)),
            ('/parameter_events', change('/other_node', 'gain', 1.0)),
            ('/parameter_events', change('/gyro', 'use_sim_time', 1.0)),
        )
    )
    assert 'ankle_controller.gain was set to 18.0; a push over its topic' in text
    assert 'other_node' not in text and 'use_sim_time' not in text


def test_a_run_against_the_wall_clock_is_not_repeated(tmp_path, result):
    live = SCENARIO.changed({('simulator', 'sync'): 'realtime'})
    assert 'wall clock' in refused(make_bag(tmp_path, live.to_yaml(), end(result)))


@pytest.mark.parametrize(
    ('text', 'says'),
    [
        (SCENARIO.to_yaml().replace('noise:', 'hiss:'), 'hiss'),
        (SCENARIO.to_yaml().replace('    stretch_knee: 75\n', ''), 'simulator.stretch_knee'),
        (SCENARIO.to_yaml().replace('motion: stand', 'motion: jump'), 'jump'),
        ('not: [yaml', 'YAML'),
        (f'{SCENARIO.to_yaml()}{MARK}0123456789abcdef\n', '0123456789abcdef'),
    ],
)
def test_another_version_s_scenario_is_refused(tmp_path, result, text, says):
    found = refused(make_bag(tmp_path, text, end(result)))
    assert 'another version of the project' in found and says in found


def test_a_bag_without_scenario_or_end_is_refused(tmp_path, result):
    assert 'no scenario' in refused(make_bag(tmp_path / 'a', None, end(result)))
    assert 'no end' in refused(
        make_bag(
            tmp_path / 'b', SCENARIO.to_yaml(), ('/simulator/state', state('running', time_ns='0'))
        )
    )
    assert 'no end' in refused(
        make_bag(tmp_path / 'c', SCENARIO.to_yaml(), end(result, trajectory_hash='', time_ns='0'))
    )


def test_what_is_no_bag_is_refused(tmp_path):
    (tmp_path / 'text.mcap').write_text('no bag')
    assert 'not a readable bag' in refused(tmp_path / 'text.mcap')
    assert 'not there' in refused(tmp_path / 'absent')


def test_a_run_without_a_bag_is_refused_as_such(tmp_path):
    (tmp_path / 'outcome.json').write_text('{}')
    assert 'no bag in it: an --offline or --no-record run leaves none' in refused(tmp_path)


@pytest.fixture(scope='module')
def whole(tmp_path_factory, result):
    return make_bag(tmp_path_factory.mktemp('whole'), SCENARIO.to_yaml(), end(result))


@given(st.data())
@settings(max_examples=25, suppress_health_check=[HealthCheck.differing_executors])
def test_a_bag_cut_anywhere_is_refused(whole, tmp_path_factory, data):
    damaged = tmp_path_factory.mktemp('damaged')
    shutil.copytree(whole, damaged, dirs_exist_ok=True)
    file = damaged / 'bag' / 'bag.mcap'
    content = file.read_bytes()
    file.write_bytes(content[: data.draw(st.integers(0, len(content) - 1))])
    refused(damaged)


@given(st.data())
@settings(max_examples=25, suppress_health_check=[HealthCheck.differing_executors])
def test_a_damaged_bag_is_refused_or_read_as_far_as_it_is_whole(whole, tmp_path_factory, data):
    damaged = tmp_path_factory.mktemp('damaged')
    shutil.copytree(whole, damaged, dirs_exist_ok=True)
    file = damaged / 'bag' / 'bag.mcap'
    content = bytearray(file.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    file.write_bytes(content)
    try:
        found = read(damaged)
    except BringupError as error:
        assert '\n' not in str(error)
    else:
        assert found.time_ns >= 0
