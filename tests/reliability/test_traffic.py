"""What no node of the run has sent is refused by name; the trajectory stays what it is."""

import pytest

from khr_common.interfaces import CLOCK, JOINT_REFERENCE
from tests.reliability.strangers.traffic import EMPTY, publisher, read, send, shared, topics
from tests.support.runs import LONG, finish, joined, khr, wait_for, wait_until

SHORT = ('--duration', '40')  # not over before a test on a loaded machine has halted it


@pytest.fixture(scope='module')
def right(tmp_path_factory):
    folder = tmp_path_factory.mktemp('right') / 'run'
    return khr('run', 'stand_0deg', '--offline', *SHORT, '--out', folder, folder=folder).hash


@pytest.mark.slow
@pytest.mark.parametrize('mode', ['--one-process', '--processes'])
def test_malformed_messages_on_shared_topics_change_nothing(in_background, tmp_path, right, mode):
    from std_srvs.srv import SetBool

    from tests.support.runs import call

    folder = tmp_path / 'run'
    process = in_background('run', 'stand_0deg', mode, *SHORT, '--out', folder)
    attacked = [
        topic for topic in topics().values() if shared(topic) and topic.name in read('stand_0deg')
    ]
    with joined(folder) as node:
        wait_until(node, seconds=0.1)
        call(node, SetBool, 'simulator/pause', SetBool.Request(data=True))
        senders = {topic: publisher(node, topic) for topic in attacked}
        refused = refusals(node)

        def attack():
            for topic, sender in senders.items():
                send(sender, topic)
            return refused() >= {'joint_reference', 'ankle_controller/correction', 'ready', 'push'}

        wait_for(attack, 'the refusals')
        for sender in senders.values():
            sender.publish(EMPTY)
        call(node, SetBool, 'simulator/pause', SetBool.Request(data=False))
    ended = finish(process, folder)
    assert ended.code == 0, ended.err
    assert ended.hash == right
    assert 'joint_reference: refused' in ended.err and 'test_client' in ended.err
    assert 'Traceback' not in ended.err + ''.join(
        log.read_text() for log in (folder / 'log').glob('*.log')
    )


def refusals(node):
    """Return a function that says which topics have been named in /diagnostics so far."""
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.executors import SingleThreadedExecutor

    found = set()
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def on_diagnostics(array):
        found.update(s.message.split(':')[0] for s in array.status if 'refused' in s.message)

    node.create_subscription(DiagnosticArray, '/diagnostics', on_diagnostics, 10)

    def look():
        for _ in range(50):  # our own messages on /diagnostics arrive here too
            executor.spin_once(timeout_sec=0.01)
        return found

    return look


@pytest.mark.slow
def test_a_second_source_of_an_owned_topic_ends_the_run_by_name(in_background, tmp_path):
    folder = tmp_path / 'run'
    process = in_background('run', 'stand_0deg', *LONG, '--no-record', '--out', folder)
    with joined(folder) as node:
        wait_until(node, seconds=0.1)
        send(publisher(node, CLOCK), CLOCK)
        ended = finish(process, folder)
    assert ended.code == 1
    assert f'{CLOCK.name}: published by test_client beside' in ended.err
    assert 'Traceback' not in ended.err


@pytest.mark.slow
def test_a_second_gait_of_another_run_is_refused_and_the_result_is_right(
    in_background, tmp_path, right
):
    from rclpy.executors import SingleThreadedExecutor

    from khr_common.nodes.messages import blank_message, message_class, serialized

    folder = tmp_path / 'run'
    process = in_background('run', 'stand_0deg', *SHORT, '--out', folder)
    with joined(folder) as node:
        wait_until(node, seconds=0.1)
        sender = publisher(node, JOINT_REFERENCE)
        message = blank_message(JOINT_REFERENCE)
        message.position = [0.5] * 17

        def answer(instant):
            message.header.stamp = instant.clock
            sender.publish(serialized(message))

        node.create_subscription(message_class(CLOCK.kind), CLOCK.name, answer, 10)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        while process.poll() is None:
            executor.spin_once(timeout_sec=0.1)
    ended = finish(process, folder)
    assert ended.code == 0, ended.err
    assert ended.hash == right
    assert 'joint_reference: refused: of another run; from gait or test_client' in ended.err
