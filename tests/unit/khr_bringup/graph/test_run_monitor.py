"""When a run is over: every listener has acknowledged its last instant, and it has been judged.

A driver whose samples make no run: each fault is named by topic, quality and timestamp.
"""

import time
from collections import Counter
from dataclasses import replace

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import Imu
from std_msgs.msg import String

from khr_analysis.referee import Decision
from khr_bringup.graph import run_monitor
from khr_bringup.graph.following import START_TIMEOUT, _unfinished
from khr_bringup.graph.reports import Reports, View
from khr_bringup.graph.run_monitor import SensorWatch
from khr_common.errors import MalformedError
from khr_common.interfaces import GYRO, TRUE_RATE
from khr_common.nodes.messages import status
from khr_common.statuses import AFTER, CHANGED, ready_text
from tests.support.runs import wait_for

END = 12_000_000_000
VIEW = View(
    state='finished',
    state_values={'time_ns': str(END), 'end': 'duration'},
    final=True,
    listeners=('monitor', 'recorder'),
    received={'monitor': END, 'recorder': 7_170_000_000},
)


def at_root(view):
    reports = Reports(())
    reports.views[''] = view
    return reports


def long_ago():
    return time.monotonic() - START_TIMEOUT - 1.0


def test_a_listener_that_is_behind_is_waited_for_and_then_named():
    assert not VIEW.over
    assert _unfinished(at_root(replace(VIEW, news=time.monotonic()))) is None
    text = _unfinished(at_root(replace(VIEW, news=long_ago())))
    assert text == 'the run ended, but not all of it was received: recorder up to t = 7.170 s'


def test_a_run_that_all_have_acknowledged_is_over_once_it_is_judged():
    complete = replace(VIEW, received=dict.fromkeys(VIEW.listeners, END))
    assert complete.over
    unjudged = replace(complete, final=False, news=long_ago())
    assert not unjudged.over
    assert _unfinished(at_root(unjudged)) == 'the monitor did not judge the run'
    running = replace(VIEW, state='running', news=long_ago())
    assert not running.over and _unfinished(at_root(running)) is None


def test_a_repeated_report_is_no_news():
    """Listeners of a run that is stuck report the same sample again and again."""
    view = View()
    for stamp_ns, news in ((1, True), (1, False), (2, True)):
        view.news = 1.0
        view.take_ready(String(data=ready_text('monitor', stamp_ns, '')), '')
        assert (view.news > 1.0) == news


def in_bout(decision):
    reports = Reports(['red/monitor', 'blue/monitor', 'recorder'], ['red', 'blue'], referee=True)
    for view in reports.views.values():
        view.state, view.state_values = 'finished', VIEW.state_values
        view.received = dict.fromkeys(view.listeners, END)
        view.final = view.judges
    reports.decision = decision
    return reports


def test_a_bout_is_over_once_both_robots_are_judged_and_the_referee_has_decided():
    reports = in_bout(Decision('red', 'blue down for 3 s', 6.0))
    assert reports.over
    reports.views['blue'].final = False
    reports.views['red'].received['monitor'] = 0
    assert not reports.over
    assert reports.behind == ['red/monitor up to t = 0.000 s']
    assert reports.unjudged == ['the blue/monitor']
    undecided = in_bout(None)
    assert not undecided.over
    for view in undecided.views.values():
        view.news = long_ago()
    assert _unfinished(undecided) == 'the referee did not judge the run'


FIGURES = ('time', 'real_time_factor', 'pitch_rate', 'peak', 'time_ns', 'run', 'final', 'sync')
QUANTITIES = ('time_s', 'distance_m', 'largest_pitch_rad', 'vibration_rad_s', 'periods', 'end')
texts = st.sampled_from(['', 'nan', '-', '1e999', '3', '-0.5', '9' * 5000]) | st.text()
values = st.dictionaries(st.sampled_from([*FIGURES, *QUANTITIES]) | st.text(), texts)


@given(st.sampled_from(['monitor', 'simulator', 'x']), texts, values)
def test_every_message_is_taken_or_refused(name, message, values):
    reports = Reports([])
    view = reports.view
    for action in (
        lambda: view.take_diagnostics(DiagnosticArray(status=[status(name, message, values)])),
        lambda: view.take_state(status(name, message, values), ''),
        lambda: view.take_outcome(status(name, message, values), ''),
    ):
        try:
            action()
        except MalformedError as error:
            view.refuse(str(error))
    state = reports.progress.state
    assert len(state) <= 200 and state.isprintable()
    assert not view.judged
    assert sum(view.refused.values()) == sum(
        int(line.split('; ')[-1].split()[0]) for line in view.complaints[len(view.warnings) :]
    )


def test_changes_beyond_those_that_are_kept_are_counted_out_loud(monkeypatch):
    monkeypatch.setattr('khr_bringup.graph.reports.MOST_CHANGES', 3)
    view = Reports([]).view
    for number in range(5):
        values = {AFTER: str(number), 'gain': str(float(number))}
        changed = status(f'ankle_controller{CHANGED}', '', values)
        view.take_diagnostics(DiagnosticArray(status=[changed]))
    assert [change.value for change in view.changes] == [0.0, 1.0, 2.0]
    assert view.warnings == ['only the first 3 changes of parameters are listed']


def test_pauses_do_not_count(monkeypatch):
    view = View()
    for now, state in (
        (0.0, 'waiting'),
        (10.0, 'running'),
        (14.0, 'paused'),
        (99.0, 'running'),
        (101.0, 'finished'),
    ):
        monkeypatch.setattr(time, 'monotonic', lambda now=now: now)
        view.take_state(status('simulator', state, {'run': '', 'time_ns': '0'}), '')
    assert (view.started, view.ran) == (10.0, 6.0)


@pytest.fixture
def sent(monkeypatch):
    """Return a function that publishes an Imu per (topic, stamp in s), and returns the watch."""
    monkeypatch.setattr(run_monitor, 'PERIOD', 0.0)
    rclpy.init(domain_id=87)
    node = rclpy.create_node('driver')

    def send(*samples, watched=(GYRO, TRUE_RATE)):
        watch = SensorWatch(node, watched)
        publishers = {name: node.create_publisher(Imu, name, 10) for name, _ in samples}
        for name, publisher in publishers.items():
            for stamp in (stamp for other, stamp in samples if other == name):
                message = Imu()
                message.header.stamp.sec = stamp
                publisher.publish(message)
        wanted = Counter(name for name, _ in samples)

        def all_came():
            rclpy.spin_once(node, timeout_sec=0.05)
            return all(len(watch._stamps[topic]) == wanted[topic.name] for topic in watched)

        wait_for(all_came, 'the samples')
        return watch

    yield send
    node.destroy_node()
    rclpy.shutdown()


def test_equal_timestamps_have_no_fault(sent):
    watch = sent((GYRO.name, 1), (GYRO.name, 2), (TRUE_RATE.name, 2))
    assert watch.faults() == [] == watch.notes


def test_a_missing_topic_is_named_with_the_one_of_its_type(sent):
    watch = sent(('imu/data', 1), (TRUE_RATE.name, 1))
    assert watch.faults() == ['imu/data_raw: no publisher (/imu/data is of its type: remap it)']


def test_timestamps_that_differ_are_zero_or_stay_are_named(sent):
    watch = sent((GYRO.name, 1), (TRUE_RATE.name, 3), (TRUE_RATE.name, 4))
    (text,) = watch.faults()
    assert text.startswith('timestamps that differ') and 'imu/data_raw 1.000 s' in text


@pytest.mark.parametrize(('stamp', 'says'), [(0, 'are zero'), (7, 'stays at 7.000 s')])
def test_timestamps_that_stay_are_named(sent, stamp, says):
    watch = sent((GYRO.name, stamp), (GYRO.name, stamp), watched=(GYRO,))
    wait_for(lambda: watch.faults() or watch._node, 'the fault')
    (text,) = watch.faults()
    assert says in text


@pytest.mark.parametrize('later', [1_000, 5])
def test_a_clock_that_is_set_is_noted_once(sent, later):
    stamps = [(name, stamp) for name in (GYRO.name, TRUE_RATE.name) for stamp in (100, 101, later)]
    (note,) = sent(*stamps).notes
    assert note.startswith('imu/data_raw: its timestamps jump by ') and f'{later - 101} s' in note
