"""The plant: from which instant on an answer acts, what ends a run, what its hash is made of."""

from dataclasses import replace

import pytest

from khr_common.errors import KhrError
from khr_common.interfaces import mix
from khr_description.robot import JOINTS
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from tests.fakes.postures import STANCE

LEANING = mix(STANCE, [dict.fromkeys(('l_ankle_pitch', 'r_ankle_pitch'), 0.05)])
TOE = JOINTS.index('l_ankle_pitch')


@pytest.fixture
def plant(request):
    made = Plant([replace(RunParameters(), control_delay=request.param, duration=0.06)])
    yield made
    made.close()


def ankles(plant, targets):
    """Return the ankle after each period in which the next of the targets was the answer."""
    found = []
    for target in targets:
        plant.answer([target])
        found.append(plant.advance()[0].joint_position[TOE])
    return found


@pytest.mark.parametrize('plant', [0, 1], indirect=True)
def test_an_answer_acts_the_control_delay_after_its_instant(plant):
    still, moving = (STANCE,) * 3, (LEANING, STANCE, STANCE)
    plant.start([STANCE])
    at_rest = ankles(plant, still)
    plant.start([STANCE])
    moved = ankles(plant, moving)
    first = plant.parameters[0].control_delay  # the period that is the first to differ
    assert [a == b for a, b in zip(at_rest, moved, strict=True)].index(False) == first


@pytest.mark.parametrize('plant', [1], indirect=True)
def test_a_delayed_answer_may_come_while_the_period_before_it_runs(plant):
    plant.start([STANCE])
    at_once = ankles(plant, (LEANING, STANCE))
    plant.start([STANCE])
    assert plant.ready
    plant.advance()
    plant.answer([LEANING])
    assert plant.advance()[0].joint_position[TOE] == at_once[1]
    assert not plant.ready


@pytest.mark.parametrize('plant', [0], indirect=True)
def test_advance_without_a_queued_answer_is_an_error(plant):
    plant.start([STANCE])
    assert not plant.ready
    with pytest.raises(KhrError, match='answer: missing; accepted: one to each sample'):
        plant.advance()


@pytest.mark.parametrize('plant', [0, 1], indirect=True)
def test_another_start_forgets_answers_and_repeats_the_hash(plant):
    hashes = []
    for _ in range(2):
        plant.start([STANCE])
        ankles(plant, (LEANING, STANCE))
        hashes.append(plant.trajectory_hash)
        plant.answer([LEANING])
    assert hashes[0] == hashes[1]


def test_a_correction_of_an_unknown_joint_is_refused():
    with pytest.raises(KhrError, match="joint: 'l_tail' is not accepted"):
        mix(STANCE, [{'l_tail': 0.1}])


@pytest.mark.parametrize('plant', [0, 1], indirect=True)
def test_the_end_that_an_answer_states_comes_when_it_would_act(plant):
    plant.start([STANCE])
    plant.answer([STANCE], end='referee')
    for _ in range(plant.parameters[0].control_delay):
        assert plant.end == ''
        plant.advance()
        plant.answer([STANCE])
    assert plant.end == 'referee'
    with pytest.raises(KhrError, match='answer: missing'):
        plant.advance()
