"""A run is closed to other machines unless it is asked to be open."""

import pytest

from tests.reliability.strangers.other_machine import other_machine, spied, why_not
from tests.support.runs import LONG, addresses, wait_until_running

REASON = why_not()
pytestmark = [pytest.mark.nightly, pytest.mark.skipif(bool(REASON), reason=REASON)]
RUN = ('run', 'stand_0deg', *LONG, '--no-record')


def test_another_machine_neither_sees_nor_changes_a_run(in_background, tmp_path):
    with other_machine() as machine:
        process = in_background(*RUN, '--processes', '--out', tmp_path / 'run')
        domain = wait_until_running(tmp_path / 'run')
        assert addresses(process) == {'127.0.0.1'}
        assert spied(machine, domain) == {'nodes': [], 'clocks': 0, 'changed': False}


def test_another_machine_takes_part_if_it_is_asked_to(in_background, tmp_path):
    with other_machine() as machine:
        process = in_background(*RUN, '--network', '--out', tmp_path / 'run')
        domain = wait_until_running(tmp_path / 'run')
        found = spied(machine, domain)
        process.terminate()
        _, err = process.communicate(timeout=60)
    assert 'simulator' in found['nodes'] and found['clocks'] and found['changed']
    assert 'UDP ports are open on all interfaces' in err
