"""What no node of the run has sent is refused by name; the trajectory stays what it is."""

import pytest

from khr_common.interfaces import CLOCK
from tests.reliability.strangers.traffic import EMPTY, publisher, read, send, shared, topics
from tests.support.runs import LONG, call, finish, joined, khr, wait_until

SHORT = ('--duration', '40')  # not over before a test on a loaded machine has halted it


@pytest.mark.nightly
def test_malformed_messages_on_shared_topics_change_nothing(in_background, tmp_path):
    from std_srvs.srv import SetBool

    folder = tmp_path / 'run'
    process = in_background('run', 'stand_0deg', '--processes', *SHORT, '--out', folder)
    attacked = [
        topic for topic in topics().values() if shared(topic) and topic.name in read('stand_0deg')
    ]
    with joined(folder) as node:
        wait_until(node, seconds=0.1)
        call(node, SetBool, 'simulator/pause', SetBool.Request(data=True))
        senders = [(publisher(node, topic), topic) for topic in attacked]
        for sender, topic in senders:
            send(sender, topic)
        for sender, _ in senders:
            sender.publish(EMPTY)
        call(node, SetBool, 'simulator/pause', SetBool.Request(data=False))
        ended = finish(process, folder)
    assert ended.code == 0, ended.err
    assert 'joint_reference: refused' in ended.err and 'test_client' in ended.err
    assert 'Traceback' not in ended.err + ''.join(
        log.read_text() for log in (folder / 'log').glob('*.log')
    )
    told = [status for _, array in ended.bag()['/diagnostics'] for status in array.status]
    refused = {each.name.partition(': ')[2] for each in told if each.message.startswith('refused')}
    assert refused >= {'joint_reference', 'ankle_controller/correction', 'ready', 'push'}
    alone = khr('run', 'stand_0deg', '--offline', *SHORT, '--out', tmp_path / 'alone')
    assert ended.hash == alone.hash


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
