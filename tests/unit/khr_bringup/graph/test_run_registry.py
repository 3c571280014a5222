"""Which run a command means: the only one, the one of the domain that was named."""

import fcntl
import json
import os
import socket
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

import pytest

from khr_bringup.graph import run_registry, shared_memory
from khr_bringup.graph.graph import note_progress
from khr_bringup.graph.run_registry import choose, ports_of, register, registered, running
from khr_bringup.result import Progress
from khr_common import RunError
from khr_common.errors import KhrError


@pytest.fixture(autouse=True)
def own_register(tmp_path, monkeypatch):
    # The names of domains are one space for all who use the machine, other tests among them:
    # these numbers no run takes by itself, and their ports are above the ephemeral ones.
    monkeypatch.setattr(run_registry, 'DOMAINS', range(230, 214, -1))
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    monkeypatch.delenv('ROS_DOMAIN_ID', raising=False)


def test_a_run_of_another_folder_has_to_be_named(tmp_path, monkeypatch):
    with registered('walk', tmp_path / 'results') as only:
        monkeypatch.chdir(tmp_path)
        with pytest.raises(KhrError, match=f'in this folder; .*{tmp_path}/results'):
            choose()
        assert choose(only.domain) == only
        monkeypatch.setenv('ROS_DOMAIN_ID', str(only.domain))
        assert choose() == only


def test_state_and_scenario_of_a_run_are_in_the_register(tmp_path):
    shown = []
    with registered('walk', tmp_path) as entry:
        assert [(each.scenario, each.state) for each in running()] == [('walk', 'starting')]
        show = note_progress(entry, shown.append)
        for state in ('running', 'running', 'finished'):
            show(Progress(1.0, state))
            assert [(each.scenario, each.state) for each in running()] == [('walk', state)]
        following = entry.next_run('stand', tmp_path / 'next')
        assert (following.domain, following.locks) == (entry.domain, entry.locks)
        assert following.run != entry.run
    assert len(shown) == 3


def test_the_only_run_is_meant_whatever_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '42')
    with registered('walk', tmp_path) as only:
        assert choose() == only
        with pytest.raises(KhrError, match='in domain 42'):
            choose(42)
    assert not running()
    with pytest.raises(KhrError, match='no run is going on; start one'):
        choose()


def test_of_several_the_domain_decides_by_option_or_as_for_every_ros_tool(tmp_path, monkeypatch):
    with registered('walk', tmp_path) as first, registered('stand', tmp_path) as second:
        assert first.domain != second.domain
        with pytest.raises(KhrError, match=r'--domain or ROS_DOMAIN_ID: .*walk.*stand'):
            choose()
        assert choose(second.domain) == second
        monkeypatch.setenv('ROS_DOMAIN_ID', str(first.domain))
        assert choose() == first
        assert choose(second.domain) == second, 'the option is the nearer word'


def test_a_domain_is_taken_as_long_as_anybody_has_inherited_it(tmp_path):
    with registered('walk', tmp_path) as entry:
        child = subprocess.Popen(
            [sys.executable, '-c', 'input()'], stdin=subprocess.PIPE, pass_fds=entry.locks
        )
    assert not running()
    with pytest.raises(KhrError, match='is taken by another run'):
        registered('walk', tmp_path, entry.domain).__enter__()
    with registered('stand', tmp_path) as other:
        assert other.domain != entry.domain
    child.communicate(b'')
    with registered('walk', tmp_path, entry.domain):
        pass


def test_another_user_gets_another_domain(tmp_path, monkeypatch):
    with registered('walk', tmp_path) as first:
        monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path / 'other'))
        (tmp_path / 'other').mkdir()
        with registered('walk', tmp_path) as second:
            assert second.domain != first.domain
            assert len(first.run) == 32 and second.run != first.run
            assert running() == [second]


def test_a_domain_with_somebody_in_it_is_handed_out_only_to_who_asks_for_it(tmp_path):
    with registered('walk', tmp_path) as entry:
        domain = entry.domain
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(('0.0.0.0', ports_of(domain).start + 10))
        with registered('walk', tmp_path) as other:
            assert other.domain != domain
        with registered('walk', tmp_path, domain) as asked:
            assert asked.domain == domain


def test_a_user_who_takes_all_names_and_ports_stops_no_run(tmp_path):
    with ExitStack() as squatter:
        for domain in run_registry.DOMAINS:
            name = squatter.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
            name.bind(f'\0khr-domain-{domain}')
            port = squatter.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            port.bind(('127.0.0.1', ports_of(domain).start + run_registry.CLAIM))
        with registered('walk', tmp_path) as first, registered('walk', tmp_path) as second:
            assert {each.domain for each in running()} == {first.domain, second.domain}


def test_an_entry_that_is_being_written_is_left_alone(tmp_path):
    with registered('walk', tmp_path) as entry:
        part = register() / f'.{os.getpid()}-{entry.domain - 1}.json'
        part.write_text('{')
        assert running() == [entry]
        assert part.exists()


@pytest.mark.parametrize(
    'entry',
    [
        {'domain': 229, 'pid': os.getpid()},  # of a killed run
        {'domain': '../x'},
        {'pid': 10**30},
        {'x': 1},
        '[' * 100_000,
    ],
    ids=lambda entry: str(entry)[:20],
)
def test_an_entry_of_no_present_run_is_forgotten(tmp_path, entry):
    with registered('walk', tmp_path) as own:
        foreign = register() / 'foreign.json'
        changed = entry if isinstance(entry, str) else json.dumps({**asdict(own), **entry})
        foreign.write_text(changed)
        assert running() == [own]
        assert not foreign.exists()


def test_the_middleware_of_a_command_logs_nowhere(tmp_path):
    with registered('walk', tmp_path) as entry:
        profile = Path(entry.quiet_environment()[run_registry.PROFILE]).read_text()
    assert '<use_default>FALSE</use_default>' in profile and '<consumer>' not in profile


def test_a_register_that_others_can_write_is_refused(tmp_path, monkeypatch):
    register().chmod(0o777)
    with pytest.raises(RunError, match='only this user can write'):
        register()
    register_of_another = tmp_path / 'elsewhere'
    register_of_another.mkdir()
    (register_of_another / f'khr-runs-{os.getuid()}').symlink_to(tmp_path)
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(register_of_another))
    with pytest.raises(RunError, match='only this user can write'):
        register()


# ---- what dead processes left is swept from shared memory ----


@pytest.fixture
def memory(tmp_path, monkeypatch):
    monkeypatch.setattr(shared_memory, 'MEMORY', tmp_path)
    for name in (
        'fastrtps_0123456789abcdef',
        'fastrtps_0123456789abcdef_el',
        'fastrtps_port7661',
        'fastrtps_port7661_el',
        'sem.fastrtps_port7661_mutex',
        'fastrtps_fedcba9876543210',  # no lock yet: its process may be about to take it
        'fastrtps_port9999',
        'sem.mp-of_another',
    ):
        (tmp_path / name).write_bytes(b'')
    return tmp_path


def names(memory):
    return sorted(path.name for path in memory.iterdir())


def test_the_dead_of_a_domain_are_swept_with_their_locks(memory):
    assert shared_memory.remove_dead_segments(range(7650, 7900)) == 2
    assert names(memory) == ['fastrtps_fedcba9876543210', 'fastrtps_port9999', 'sem.mp-of_another']


def test_segments_that_a_process_holds_stay(memory):
    before = names(memory)
    with (
        (memory / 'fastrtps_0123456789abcdef_el').open() as segment,
        (memory / 'fastrtps_port7661_el').open() as port,
    ):
        fcntl.flock(segment, fcntl.LOCK_EX)
        fcntl.flock(port, fcntl.LOCK_SH)
        assert shared_memory.remove_dead_segments(range(7650, 7900)) == 0
    assert names(memory) == before
