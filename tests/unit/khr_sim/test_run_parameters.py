"""Names in the parameters of a run: what ROS would refuse later is refused at once."""

from dataclasses import replace

import pytest

from khr_analysis.recorder_parameters import RecorderParameters
from khr_common import ParameterError
from khr_sim.run_parameters import RunParameters, robot_line

OWN = RunParameters()


@pytest.mark.parametrize(
    ('change', 'says'),
    [
        (lambda: replace(OWN, answers=('a b',)), "answers: 'a b'"),
        (lambda: replace(OWN, robots=('{bad',)), "robots: '{bad'"),
        (lambda: replace(OWN, robots=('{"name": "1 x"}',)), 'robots: '),
        (lambda: replace(OWN, robots=('{"name": "red", "start": 5}',)), 'robots: '),
        (lambda: RecorderParameters(extra_topics=('a//b std_msgs/msg/String event',)), 'topics: '),
    ],
)
def test_a_name_that_is_none_is_refused(change, says):
    with pytest.raises(ParameterError, match=f'^{says}.*accepted: '):
        change()


def test_names_with_a_namespace_are_accepted():
    robot = robot_line('red', (0.0, 0.0, 0.0), OWN)
    assert replace(OWN, answers=('red/gait', 'referee'), robots=(robot,)).of_robots().keys() == {
        'red'
    }
    topic = '/lab/_own/cmd std_msgs/msg/String event'
    assert RecorderParameters(extra_topics=(topic,)).recorded()[-1].name == '/lab/_own/cmd'
