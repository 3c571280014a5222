import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_balance.gaits.gait import Gait
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.key_frames import read_key_frames
from khr_balance.gaits.kinematics import GaitError
from khr_common import build
from khr_common.interfaces import JOINT_INDEX

KNEE = 'time_s,l_knee_deg\n0,54.6\n1,60\n2,54.6\n'


def gait(text, **values):
    frames = read_key_frames(text, 'm.csv').to_csv()
    values = {'motion': 'file', 'motion_file': 'm.csv', 'frames': frames, **values}
    return Gait(build(GaitParameters, values))


def knee(motion, time):
    return np.degrees(motion.reference(time)[JOINT_INDEX['l_knee']])


def test_joints_follow_their_keys_after_the_start_and_others_keep_the_stance():
    motion = gait(KNEE, start_delay=0.5, end_pause=0.25)
    assert motion.duration == 2.75
    assert [knee(motion, t) for t in (0.0, 1.5, 2.75)] == pytest.approx([54.6, 60.0, 54.6])
    standing = Gait(build(GaitParameters, {'motion': 'stand'})).reference(0.0)
    assert motion.reference(1.5)[JOINT_INDEX['r_knee']] == pytest.approx(
        standing[JOINT_INDEX['r_knee']]
    )


def test_a_part_is_played_as_often_as_the_parameter_cycles_says():
    motion = gait(KNEE, repeat=[0.0, 2.0], cycles=3, start_delay=1.0)
    assert motion.duration == 1.0 + 3 * 2.0 + 1.0
    assert motion.cycle(3) == (5.0, 7.0)
    assert [knee(motion, t) for t in (2.0, 4.0, 5.0, 6.0)] == pytest.approx([60, 60, 54.6, 60])


def test_a_repeated_step_moves_on():
    step = (
        'time_s,com_x_mm,com_y_mm,l_sole_x_mm,l_sole_z_mm,r_sole_x_mm\n'
        '0,0,0,0,0,0\n1,0,-30,0,0,0\n1.5,0,-30,2,10,0\n2,0,-30,5,0,0\n3,5,0,5,0,5\n'
    )
    motion = gait(step, repeat=[0.0, 3.0], cycles=2)
    # An upright stance again after each repetition, though the robot has moved on.
    assert motion.reference(4.0) == pytest.approx(motion.reference(1.0), abs=1e-6)
    assert motion.reference(7.0) == pytest.approx(motion.reference(1.0), abs=1e-6)


def test_smooth_keys_are_passed_without_rest():
    keys = 'time_s,l_knee_deg\n0,50\n1,55\n2,60\n'
    step = 0.01
    rest, smooth = (gait(keys, between=between) for between in ('rest', 'smooth'))
    assert knee(rest, 2.0 + step) - knee(rest, 2.0 - step) == pytest.approx(0.0, abs=0.01)
    assert knee(smooth, 2.0 + step) - knee(smooth, 2.0 - step) > 0.1


def test_yaml_and_csv_are_the_same_frames():
    text = 'time_s,com_x_m,l_sole_z_mm\n0,0.00001,\n0.1,,12.5\n'
    frames = read_key_frames(text, 'm.csv')
    assert frames.columns == {'com_x': (1e-5, None), 'l_sole_z': (None, 0.0125)}
    assert read_key_frames(frames.to_yaml(), 'm.yaml', 'yaml') == frames
    assert read_key_frames(frames.to_csv(), 'm.csv') == frames


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('time_s,tail_deg\n0,1\n', 'tail_deg: no such column; accepted, each with its unit: time'),
        ('time_s,l_knee_mm\n0,1\n', 'l_knee_mm: no such unit; accepted: l_knee_rad or l_knee_deg'),
        ('time_s,l_knee_deg\n0,10\n1,-90\n', r"frame 2: l_knee_deg: '-90' .*accepted: \["),
        ('time_s,l_knee_deg\n0,nan\n', "frame 1: l_knee_deg: 'nan' is not accepted"),
        ('time_s,l_knee_deg\n1,10\n1,11\n', 'frame 2: time_s: 1 is not .*accepted: above 1'),
        ('time_s,l_knee_deg\n,10\n', 'frame 1: accepted: a frame with time_s'),
        ('time_s,l_knee_deg\n0\n', 'frame 1: 1 values are not accepted; accepted: 2'),
        ('time_s,l_knee_deg,l_knee_rad\n0,1,1\n', 'a column is given twice'),
        ('time_s,l_knee_deg,com_x_m\n0,1,0\n', 'accepted: joints only, or com_x'),
        ('time_s,l_knee_deg\n', 'no frame in it'),
        ('time_s,l_sole_z_mm\n0,-1\n', r"frame 1: l_sole_z_mm: '-1' .*accepted: \[0, 100\]"),
    ],
)
def test_refuses_in_one_line_with_file_frame_and_accepted_values(text, reason):
    with pytest.raises(GaitError, match=rf'^m\.csv: .*{reason}') as error:
        read_key_frames(text, 'm.csv')
    assert '\n' not in str(error.value)


CELLS = st.one_of(st.floats().map(str), st.sampled_from(['', '0', '1', '2', 'x', '"', '\0']))
NAMES = st.sampled_from(['com_x_mm', 'com_y_m', 'l_sole_z_m', 'torso_roll_deg', 'l_knee_rad', ''])


@given(st.lists(NAMES, max_size=4), st.lists(st.lists(CELLS, max_size=5), max_size=4))
def test_any_table_is_frames_or_refused(names, rows):
    text = '\n'.join(','.join(row) for row in [['time_s', *names], *rows])
    try:
        gait(text)
    except GaitError as error:
        assert '\n' not in str(error)


@pytest.mark.parametrize(
    ('text', 'values', 'reason'),
    [
        (
            'time_s,l_knee_deg\n0,50\n3000,50\n',
            {'repeat': [0.0, 3000.0], 'cycles': 2},
            'm.csv: 6002 s with all repetitions is not accepted; accepted: up to 3600 s',
        ),
        (
            'time_s,l_knee_deg\n0,10\n1,20\n1.1,120\n',
            {},
            'l_knee: .* rad/s at 2.05 s of the run, frames 2 to 3 is not accepted; accepted: up to',
        ),
        ('time_s,com_x_m,l_sole_x_m\n0,0,0\n1,,0.2\n', {}, 'leg: .*frames 1 to 2'),
        (
            KNEE,
            {'repeat': [0.0, 1.5]},
            r'repeat: \[0.0, 1.5\] is not accepted; accepted: the times',
        ),
        (KNEE, {'repeat': [0.0, 1.0]}, 'm.csv: frame 2: l_knee: .*accepted: 0.95.*frame 1'),
        (
            'time_s,com_x_m,l_sole_x_m,r_sole_x_m\n0,0,0,0\n1,0.01,0.01,0.02\n',
            {'repeat': [0.0, 1.0]},
            'm.csv: frames 1 and 2: feet and centre of mass move on by different lengths',
        ),
    ],
)
def test_refuses_a_motion_that_the_robot_cannot_perform(text, values, reason):
    with pytest.raises(GaitError) as error:
        gait(text, **values)
    assert re.search(reason, str(error.value))
