"""Another user of this machine joins a run: each way in of the table in docs/security.md."""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from importlib.resources import files

import pytest

from khr_bringup.graph.run_registry import running
from khr_common.interfaces import CLOCK, JOINT_REFERENCE
from tests import ROOT
from tests.support.runs import LONG, finish, khr, wait_until_running

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(400),
    pytest.mark.skipif(os.getuid() != 0, reason='to act as another user takes root'),
]
FIXED = {'folder', 'scenario_file', 'topics', 'extra_topics'}


# Ports that are none of a domain: who listens there is not noticed by who looks at its ports.
HIDDEN = '<locator><udpv4><port>{}</port><address>127.0.0.1</address></udpv4></locator>'
LOCATORS = 'defaultUnicastLocatorList'


@contextmanager
def nobody(folder, *words, hidden=True):
    """Start what the user ``nobody`` tries on the run of a folder, hidden as well as may be."""
    (entry,) = (each for each in running() if each.folder == str(folder))
    # Shared memory is closed to another user, who leaves it out and has the loopback.
    head, users, rest = (
        files('khr_bringup').joinpath('fastdds.xml').read_text().partition('<userTransports>')
    )
    own = folder.parent / 'profile.xml'
    rest = rest.replace('<transport_id>shared_memory</transport_id>', '', 1)
    if hidden:
        plain = HIDDEN.replace('<port>{}</port>', '')
        rest = rest.replace(plain, HIDDEN.format(7000), 1).replace(
            '<builtin>', f'<{LOCATORS}>{HIDDEN.format(7001)}</{LOCATORS}><builtin>'
        )
    own.write_text(head + users + rest)
    process = subprocess.Popen(
        [sys.executable, '-m', 'tests.reliability.strangers.other_user', *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env={**os.environ, **entry.environment(), 'FASTRTPS_DEFAULT_PROFILES_FILE': str(own)},
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def tries(folder, *words):
    """Return what came of all that ``nobody`` tried."""
    with nobody(folder, *words) as process:
        out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    found = json.loads(out)
    assert found.pop('user') != 0
    return found


@pytest.mark.nightly
def test_what_another_user_changes_is_kept_and_repeated(in_background, tmp_path):
    """Each parameter of each node, pause and switch; and garbage wherever many may send."""
    folder = tmp_path / 'run'
    process = in_background('run', 'stand_0deg', *LONG, '--out', folder)
    wait_until_running(folder)
    found = tries(folder, 'services')
    assert not any(found['same'][f'recorder.{name}'][0] for name in FIXED)
    assert found['same']['ankle_controller.gain'][0] and found['gain'][0]
    assert (found['pause'], found['resume']) == ('paused', 'running')
    assert not found['no scenario'][0], 'a path is no text of a scenario'
    sent = tries(folder, 'topics')
    assert sent.pop('clock') and all(sent.values()) and 'push' in sent
    process.terminate()
    ended = finish(process, folder)
    assert ended.code == 130 and 'Traceback' not in ended.err
    assert 'joint_reference: refused' in ended.err and 'intruder' in ended.err
    changes = json.loads((folder / 'outcome.json').read_text())['changes']
    assert [each['value'] for each in changes] == [3.5]
    verified = khr('verify', folder)
    assert verified.code == 0, verified.out + verified.err


def test_who_takes_part_ends_the_run_by_name(in_background, tmp_path):
    """Whatever it does: here it only looks on."""
    folder = tmp_path / 'run'
    process = in_background('run', 'stand_0deg', *LONG, '--out', folder)
    wait_until_running(folder)
    with nobody(folder, 'look', hidden=False):
        ended = finish(process, folder)
    assert ended.code == 1
    assert 'the user nobody takes part in domain' in ended.err, ended.err
    assert 'Traceback' not in ended.err


@pytest.mark.nightly
@pytest.mark.parametrize('topic', [CLOCK, JOINT_REFERENCE], ids=lambda topic: topic.name)
def test_who_publishes_in_a_node_s_place_ends_the_run_by_name(in_background, tmp_path, topic):
    """With the identity of the run too, which whoever listens can read."""
    folder = tmp_path / 'run'
    process = in_background('run', 'stand_0deg', *LONG, '--out', folder)
    wait_until_running(folder)
    with nobody(folder, topic.name):
        ended = finish(process, folder)
    assert ended.code == 1
    assert f'{topic.name}: ' in ended.err and 'intruder' in ended.err, ended.err
    assert 'Traceback' not in ended.err
