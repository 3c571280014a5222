"""The largest push that the simulated robot survives, and its table."""

import numpy as np
import pandas as pd
import pytest

from khr_common import KhrError
from khr_report.output import make_folder
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.push import Push
from khr_sim.run_parameters import RunParameters
from khr_sim.servo import BACK_EMF
from khr_studies.push import limits as push_limits
from khr_studies.push import page as push_page
from khr_studies.push import study as push_recovery
from khr_studies.push.motions import legs
from khr_studies.push.study import GYROS, START, PushCondition, bracket, push_robot, stance
from tests import ROOT
from tests.support.mechanics import PLAIN_SERVOS

pytestmark = pytest.mark.slow

DOCUMENT = ROOT / 'docs' / 'models.md'
FOOT = 2.0 * stance().pendulum.half_foot


@pytest.fixture
def brief(monkeypatch):
    """Watch the robot only as long as these tests look."""
    monkeypatch.setattr(push_recovery, 'WATCH', 0.3)


def cell(push, who, column):
    """Return the two forces of a cell of the document's table."""
    block = DOCUMENT.read_text(encoding='utf-8').split(push_page.PART.markers[0])[1]
    lines = [line.strip('| ').split(' | ') for line in block.splitlines() if line[:1] == '|']
    place = lines[0].index(column)
    row = next(line for line in lines if line[:2] == [push, who])
    return [float(number) for number in row[place].split(' to ')]


def test_the_document_s_forces_are_survived_and_fatal():
    condition, who = PushCondition(duration=0.1), 'robot, from behind'
    survived, fatal = cell('0.1 s', who, 'K_A = 0')
    assert survived < fatal <= survived * 1.02
    held, fallen = (
        push_robot(condition, force)  # as far as the table is rounded
        for force in (survived - 0.005, fatal + 0.005)
    )
    assert not held.fell, 'run: python -m khr_studies.push.page docs/models.md'
    assert fallen.fell, 'run: python -m khr_studies.push.page docs/models.md'
    # (4.7): whoever stays within the foot stands, whoever falls leaves it on the pushed side.
    assert np.all((held.values > -FOOT) & (held.values < 0.0))
    # At the edge it may still rock back and fall the other way; further beyond it does not.
    beyond = push_robot(condition, 1.2 * fatal)
    assert beyond.values[-1] > 0.0 and np.all(beyond.values > -FOOT)


@pytest.mark.parametrize('direction', ['behind', 'front'])
def test_a_push_carries_the_mass_to_the_side_it_is_asked_to(direction, brief):
    condition = PushCondition(duration=0.1, direction=direction)
    motion = push_robot(condition, 5.0)
    before = motion.time <= 0.0
    assert before.sum() == round(START / 0.015) + 1
    distance = stance().tipping(direction)[0].half_foot
    assert motion.values[before] == pytest.approx(-distance, abs=0.004)  # the play of its gears
    first = (motion.time > 0.0) & (motion.time < 0.2)
    assert np.max(motion.values[first]) > motion.values[before][-1] + 0.005
    assert not motion.fell
    push = Push.parse(condition.scenario(5.0).table(RunParameters).pushes[0])
    assert push.force[0] == (5.0 if direction == 'behind' else -5.0)


@pytest.mark.parametrize(
    ('gain', 'gyro', 'most'), [(12.0, 'packaged', 0.002), (18.0, 'circuit', 0.006)]
)
def test_without_a_push_it_stands_still(brief, gain, gyro, most):
    """Before, its controller leans it; under the largest gain and the fastest gyro it rings."""
    motion = push_robot(PushCondition(gain=gain, duration=1.0, gyro=gyro), 0.0)
    assert not motion.fell
    assert np.ptp(motion.values[motion.time >= 0.0]) < most


def test_the_gyro_of_a_condition_is_in_its_loop(brief):
    runs = [push_robot(PushCondition(gain=18.0, gyro=gyro), 6.0).values for gyro in GYROS]
    runs.append(push_robot(PushCondition(gain=0.0), 6.0).values)
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert np.max(np.abs(runs[one] - runs[other])) > 1e-4


@pytest.mark.parametrize('limit', [0.3, 4.0, 17.0])
def test_a_bracket_holds_the_limit_wherever_the_guess_is(limit):
    tried = []

    def falls(force):
        tried.append(force)
        return force > limit

    found = bracket(falls, 4.0, tolerance=0.01)
    assert found.survived <= limit < found.fatal < found.survived * 1.010001
    assert {found.survived, found.fatal} <= set(tried)
    assert len(tried) < 20
    assert bracket(lambda _: True, 4.0).middle == 0.0, 'who falls unpushed survives nothing'


def test_the_stance_is_the_robot_s():
    own = stance()
    assert own.pendulum.mass == pytest.approx(1.5)
    assert own.pendulum.half_foot == pytest.approx(0.055)  # the flat sole of 110 mm
    assert 0.19 < own.pendulum.length < 0.207  # the maker's 207 mm, knees bent
    (toe, about_toe), (heel, _) = (own.tipping(side) for side in ('behind', 'front'))
    assert toe.half_foot + heel.half_foot == pytest.approx(FOOT)
    assert toe.half_foot - heel.half_foot == pytest.approx(-2.0 * own.ahead)
    assert 1.1 < about_toe / (toe.mass * (toe.length**2 + toe.half_foot**2)) < 1.4
    # Ankle over knee over hip, the maker's 64.5 mm, 129.5 mm and 194.5 mm with straight legs.
    heights = [own.pendulum.length - lever for lever in own.levers]
    assert heights == pytest.approx([0.0645, 0.1225, 0.1795], abs=0.005)


def test_the_legs_give_as_the_identified_loop_does():
    own = stance()
    slow, fast = (
        legs(own, SimulatorParameters(servo_model='pid', pid_kp=kp, pid_kd=kd))
        for kp, kd in ((35.0, 2.0), (69.0, 4.0))
    )
    assert slow.proportional < fast.proportional < 69.0 / 35.0 * slow.proportional
    braking = [pid.derivative * (own.levers[0] / own.pendulum.length) ** 2 for pid in (slow, fast)]
    assert braking[1] - braking[0] == pytest.approx(braking[0] - 2.0 * BACK_EMF)


def test_the_legs_give_as_their_springs_do(brief):
    own, parameters = stance(), SimulatorParameters(**PLAIN_SERVOS)
    servo = legs(own, parameters)
    # An ankle alone: two motors in series with their gears, their lever shorter than the height.
    motor = parameters.stiffness_per_stretch * parameters.stretch_ankle_pitch
    ankle = 2.0 / (1.0 / motor + 1.0 / parameters.gear_stiffness)
    lever = own.levers[0] / own.pendulum.length
    assert ankle < servo.proportional < ankle / lever**2
    # The robot itself, its servos without dry friction, leans by that angle under a lasting
    # push, and some more: gravity's moment is the same at every joint, whatever its lever.
    force = 1.0
    smooth = PLAIN_SERVOS | {'servo_friction': 0.0}
    changes = tuple((('simulator', key), value) for key, value in smooth.items())
    motion = push_robot(PushCondition(duration=1.5, changes=changes), force)
    leant = motion.values[(motion.time > 1.0) & (motion.time < 1.5)].mean() - motion.values[0]
    stiffness = servo.proportional - own.pendulum.gravity_moment
    assert 1.0 < leant / (force * own.pendulum.length**2 / stiffness) < 1.3


def test_the_table_has_a_line_per_push_and_body(monkeypatch, tmp_path):
    monkeypatch.setattr(
        push_limits, 'largest_push', lambda condition: push_recovery.PushLimit(1.0, 1.01)
    )
    monkeypatch.setattr(push_limits, 'model_push', lambda condition, form, body: 2.0)
    conditions = push_limits.conditions()
    assert len(conditions) == len(set(conditions)) == 2 * 3 * (1 + 2 + 2)
    assert all(each.gyro == 'packaged' for each in conditions if not each.gain)
    found = push_limits.push_table(conditions)
    lines = push_page.largest_pushes(found).splitlines()
    assert len(lines) == 2 + 3 * 7
    assert len({line.count('|') for line in lines}) == 1
    make_folder(tmp_path / 'new')
    path = push_page.write(found, tmp_path / 'new')[0]
    assert pd.read_csv(path).shape == (30, 10)
    with pytest.raises(KhrError, match=r'^--out: .*accepted: '):
        make_folder(path)


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('gain', 61.0),
        ('duration', float('nan')),
        ('direction', 'left'),
        ('gyro', 'none'),
        ('force', -1.0),
        ('force', float('nan')),
    ],
)
def test_what_is_out_of_range_is_refused_by_name(name, value):
    given = {'force': 1.0, name: value}
    with pytest.raises(KhrError) as refusal:
        push_robot(force=given.pop('force'), condition=PushCondition(**given))
    text = str(refusal.value)
    assert name in text and str(value) in text and 'accepted: ' in text and '\n' not in text
