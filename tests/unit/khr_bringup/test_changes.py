"""Parameter changes, as nodes report them on ``diagnostics``."""

from diagnostic_msgs.msg import DiagnosticArray

from khr_bringup.changes import Change, changes_in
from khr_common.nodes.messages import parameter_change, status


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
