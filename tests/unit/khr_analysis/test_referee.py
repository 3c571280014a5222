"""The rules of a bout: knockdown, ring, time, and two that go down together."""

from math import cos, radians, sin

import pytest

from khr_analysis.outcome import OBSERVED, Outcome
from khr_analysis.referee import RefereeBlock, RefereeParameters, beyond, judge
from khr_common import ParameterError, build
from khr_common.interfaces import TRUE_POSE, TRUE_SOLES

RULES = build(RefereeParameters, {'time_limit': 30.0, 'down_time': 3.0})
INSIDE = {'red': (0.0, 0.0, 0.2), 'blue': (0.3, 0.0, 0.2)}


def outcomes(**fallen):
    """Return the outcomes of both robots, down since some time or up."""
    return {
        robot: Outcome(
            'stood' if since is None else 'fell', 0.0, since, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        )
        for robot, since in ({'red': None, 'blue': None} | fallen).items()
    }


@pytest.mark.parametrize(
    ('time', 'fallen', 'expected'),
    [
        (7.9, {'blue': 5.0}, None),
        (8.0, {'blue': 5.0}, ('red', 'blue down for 3 s')),
        (8.0, {'red': 5.0, 'blue': 5.6}, None),  # both are counted
        (8.6, {'red': 5.0, 'blue': 5.6}, ('draw', 'both down for 3 s')),
        (8.3, {'red': 5.0}, ('blue', 'red down for 3 s')),  # blue has risen
        (29.9, {}, None),
        (30.0, {'blue': 29.0}, ('draw', 'time')),
    ],
)
def test_the_robot_that_stays_down_loses(time, fallen, expected):
    decision = judge(RULES, time, outcomes(**fallen), INSIDE)
    assert (decision and decision[:2]) == expected
    assert decision is None or decision.time == time


def test_the_robot_that_leaves_the_ring_loses_at_once_also_lying():
    out = {'red': (0.1, -0.95, 0.05)}
    decision = judge(RULES, 1.0, outcomes(red=0.5, blue=0.2), INSIDE | out)
    assert decision[:2] == ('blue', 'red out of the ring')
    both = {robot: (0.95, 0.0, 0.1) for robot in INSIDE}
    assert judge(RULES, 1.0, outcomes(), both)[:2] == ('draw', 'both out of the ring')


@pytest.mark.parametrize(
    ('place', 'outside'),
    [((0.89, 0.0), False), ((-0.91, 0.0), True), ((0.63, 0.63), False), ((0.65, -0.65), True)],
)
def test_the_ring_is_an_octagon(place, outside):
    assert beyond(place, 1.8) == outside


@pytest.mark.parametrize(
    ('values', 'text'),
    [
        ({'red_start': [-1.0, 0.0, 0.0]}, 'red_start: .*a place in the ring'),
        ({'blue_start': [-0.2, 0.0, 180.0]}, 'blue_start: .*0.16 m from red_start'),
        (
            {'red_start': [0.1, 0.0, 90.0], 'blue_start': [-0.09, 0.0, 90.0]},
            'blue_start: .*0.27 m from',
        ),
        ({'red_start': [0.0, 0.0]}, 'red_start: .*3 of them'),
    ],
)
def test_rules_that_cannot_be_are_refused(values, text):
    with pytest.raises(ParameterError, match=text):
        build(RefereeParameters, values)


def seen(red_tilt_deg=0.0, blue_x=0.3):
    """Return the ground truth of both robots: red tilted about y, blue at a place."""
    signals = {}
    for robot, tilt, x in (('red', red_tilt_deg, 0.0), ('blue', 0.0, blue_x)):
        half = radians(tilt) / 2.0
        turn = (0.0, sin(half), 0.0, cos(half))
        soles = (x, 0.04, 0.0, 0.0, 0.0, 0.0, 1.0, x, -0.04, 0.0, 0.0, 0.0, 0.0, 1.0)
        values = {TRUE_POSE: (x, 0.0, 0.2, *turn), TRUE_SOLES: soles}
        for topic in OBSERVED:
            signals[topic.under(robot)] = values.get(topic, (0.0, 0.0, 4.0))
    return signals


def test_the_referee_of_a_graph_judges_the_truth_of_both_until_it_has_decided():
    block = RefereeBlock(RULES)
    assert set(block.subscribes) == set(seen())
    answers = [block.update(time, seen(red_tilt_deg=90.0)) for time in (0.0, 2.9, 3.0)]
    assert answers == [((0.0, 0.0),), ((0.0, 0.0),), ((1.0, 2.0),)]  # blue has won
    assert block.decision == ('blue', 'red down for 3 s', 3.0)
    assert block.update(3.1, seen(blue_x=2.0)) == answers[-1]


def test_the_rules_say_when_a_robot_is_down():
    block = RefereeBlock(build(RefereeParameters, {'fall_tilt_deg': 90.0, 'down_time': 1.0}))
    for time in (0.0, 2.0):
        assert block.update(time, seen(red_tilt_deg=80.0)) == ((0.0, 0.0),)
