"""Motions from files: their angles, and what a scenario holds of them."""

import pytest

from khr_analysis.spectrum import FftAnalyserParameters
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.offline import run_offline
from khr_bringup.scenario.motion_file import write_motion
from khr_bringup.scenario.scenario import load_scenario, parse
from khr_common.errors import KhrError
from tests import ROOT

MUJOCO = 'simulator.engine=mujoco'
SCENARIO = 'gait:\n  ros__parameters: {motion: file, motion_file: knee.csv}\n'


def played(scenario, file):
    """Return a scenario that plays its own motion from a file."""
    return scenario.set_to(write_motion(scenario.table(GaitParameters), file))


@pytest.mark.parametrize(
    ('name', 'ending'), [('walk_7.68deg_ka12', 'csv'), ('lift_8.88deg_ka14', 'yaml')]
)
def test_the_own_motion_from_a_file_has_the_same_angles_bit_for_bit(name, ending, tmp_path):
    scenario = load_scenario(name)
    copy = played(scenario, tmp_path / f'motion.{ending}')
    built_in, own = (gait_of(each.table(GaitParameters)) for each in (scenario, copy))
    assert own.duration == built_in.duration
    steps = range(round(own.duration / 0.015))
    assert [own.reference(0.015 * n) for n in steps] == [
        built_in.reference(0.015 * n) for n in steps
    ]


@pytest.mark.slow
@pytest.mark.parametrize('name', ['squat', 'march'])
def test_the_robot_stays_up_in_the_motions_of_the_examples(name):
    scenario = load_scenario(str(ROOT / f'examples/{name}.yaml')).set_to(['gait.cycles=2', MUJOCO])
    assert run_offline(scenario).outcome.stayed_up


def test_the_scenario_holds_the_frames_so_that_it_stands_alone(tmp_path):
    file, scenario = tmp_path / 'knee.csv', tmp_path / 'own.yaml'
    file.write_text('time_s,l_knee_deg\n0,54.6\n1,60\n')
    scenario.write_text(SCENARIO)
    stored = load_scenario(str(scenario)).to_yaml()
    file.unlink()
    again = parse(stored, str(tmp_path / 'elsewhere/scenario.yaml'), 'again')
    assert gait_of(again.table(GaitParameters)).duration == 3.0
    with pytest.raises(KhrError, match=r"own\.yaml: gait: motion_file: 'knee\.csv': no such file"):
        load_scenario(str(scenario))


def test_another_file_replaces_the_frames(tmp_path):
    scenario = load_scenario('walk_0deg')
    for end in (1, 2):
        file = tmp_path / f'{end}.csv'
        file.write_text(f'time_s,l_knee_deg\n0,54.6\n{end},60\n')
        scenario = scenario.set_to(['gait.motion=file', f'gait.motion_file={file}'])
        assert gait_of(scenario.table(GaitParameters)).duration == end + 2.0


@pytest.mark.parametrize(
    ('end', 'cycles', 'cyclic', 'window'),
    [(1.5, 3, True, 1.5), (30.0, 3, False, 2.31), (1.5, 0, False, 1.5)],
)
def test_the_repeated_part_is_the_cycle_of_the_gait_and_the_window_of_the_spectrum(
    end, cycles, cyclic, window, tmp_path
):
    file = tmp_path / 'knee.csv'
    file.write_text(f'time_s,l_knee_deg\n0,54.6\n{end / 2},55\n{end},54.6\n')
    played = [f'gait.motion_file={file}', 'gait.motion=file', f'gait.repeat=[0.0, {end}]']
    scenario = load_scenario('walk_0deg').set_to([*played, f'gait.cycles={cycles}'])
    assert scenario.table(GaitParameters).cyclic == cyclic
    assert scenario.table(FftAnalyserParameters).window_length == window


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        (
            'time_s,l_knee_deg\n0,10\n0.1,90\n',
            r'own: knee\.csv: l_knee: .*rad/s at .*frames 1 to 2',
        ),
        ('time_s,l_knee_deg\n0,x\n', r"own: knee\.csv: frame 1: l_knee_deg: 'x' is not accepted"),
    ],
)
def test_a_motion_that_cannot_be_is_refused_before_anything_runs(text, reason, tmp_path):
    (tmp_path / 'knee.csv').write_text(text)
    with pytest.raises(KhrError, match=reason):
        parse(SCENARIO, str(tmp_path / 'own'), 'own')


def test_a_motion_without_file_and_a_file_of_another_kind_are_refused():
    with pytest.raises(KhrError, match='accepted: a motion_file in a scenario'):
        load_scenario('walk_0deg').set_to(['gait.motion=file'])
    with pytest.raises(KhrError, match=r'accepted: a name that ends in \.csv, \.yaml, \.yml'):
        load_scenario('walk_0deg').set_to(['gait.motion_file=walk.bvh'])
