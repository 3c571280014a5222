"""The events of a run that charts mark, and parameter changes as nodes report them."""

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped

from khr_bringup.changes import Change, changes_in
from khr_bringup.recorded.events import Event, events_of, received_push, timed_pushes
from khr_common.nodes.messages import parameter_change, status

TIMES = np.arange(0.0, 5.0, 0.5)
PUSHES = [
    't=1.0 duration=0.1 link=base_link frame=odom force=3,0,4',
    '',
    't=9.0 duration=0.1 link=base_link frame=odom force=8,0,0',
]


def test_changes_pushes_stages_and_the_fall_come_in_their_order():
    message = WrenchStamped()
    message.header.stamp.sec, message.header.stamp.nanosec = 2, 500_000_000
    message.wrench.force.y = -1.234
    changes = [Change('ankle_controller', 'gain', 12.0, 500_000_000)]
    stages = np.where(TIMES < 3.0, 1.0, 2.0)
    pushes = [*timed_pushes(PUSHES), received_push(message)]
    assert events_of(4.0, changes, TIMES, stages, pushes) == [
        Event(0.5, 'ankle_controller.gain = 12'),
        Event(1.0, 'push 5 N'),
        Event(2.5, 'push 1.23 N'),
        Event(3.0, 'stage 2'),
        Event(4.0, 'fell'),
    ], 'the push after the end is left out'


def test_changes_are_read_and_malformed_entries_skipped():
    array = DiagnosticArray(
        status=[
            parameter_change('ankle_controller', 30_000_000, {'gain': 18.0, 'enabled': True}),
            parameter_change('simulator', -1, {'push_point': [0.0, 0.1, 0.0]}),
            parameter_change('nobody', 0, {'gain': 1.0}),
            status('gyro: parameters', 'changed', {'after_ns': 'soon', 'noise': '0.1'}),
            status('gyro: parameters', 'changed', {'after_ns': '0', 'noise': 'loud'}),
            status('gyro', 'well', {'noise': '0.1'}),
        ]
    )
    ankle = 'ankle_controller', 30_000_000
    assert changes_in([array]) == [
        Change(ankle[0], 'gain', 18.0, ankle[1]),
        Change(ankle[0], 'enabled', True, ankle[1]),
        Change('simulator', 'push_point', [0.0, 0.1, 0.0], -1),
    ]
    assert [change.time for change in changes_in([array])] == [0.03, 0.03, 0.0]
