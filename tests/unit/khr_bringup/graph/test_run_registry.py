"""Which run a command means: the only one, the one of the domain that was named."""

import json
import os
import socket
import subprocess
import sys
import textwrap
from contextlib import ExitStack
from dataclasses import asdict

import pytest

from khr_bringup.graph import run_registry
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


def test_without_a_run_there_is_none_to_mean():
    with pytest.raises(KhrError, match='no run is going on; start one'):
        choose()


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


def test_who_squats_all_that_others_can_reach_stops_no_run(tmp_path):
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


def test_the_entry_of_a_killed_run_is_forgotten(tmp_path):
    stale = {'domain': 229, 'pid': os.getpid(), 'scenario': 'walk', 'folder': 'x'}
    (register() / '229.json').write_text(json.dumps(stale))
    (register() / '228.json').write_text('{')
    assert not running()
    assert not list(register().glob('*.json'))


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


def test_two_runs_have_two_identities(tmp_path):
    with registered('walk', tmp_path) as first, registered('walk', tmp_path) as second:
        assert len(first.run) == 32 and first.run != second.run


CROWDED = """
    import fcntl, sys, rclpy
    from pathlib import Path
    held = [Path(f'/dev/shm/fastrtps_port{port}_el') for port in range(*map(int, sys.argv[1:]))]
    files = [path.open('w') for path in held]
    for file in files:
        fcntl.flock(file, fcntl.LOCK_EX)
    try:
        rclpy.init(args=['--ros-args', '--disable-external-lib-logs'])
        rclpy.create_node('crowded')
        rclpy.shutdown()
    finally:
        for path in held:
            path.unlink()
"""


def test_what_the_middleware_complains_of_is_not_on_the_command_s_standard_error(tmp_path):
    said = {}
    with registered('walk', tmp_path) as entry:
        first = ports_of(entry.domain).start + run_registry.FIRST_PARTICIPANT
        for name in ('environment', 'quiet_environment'):
            script = [sys.executable, '-c', textwrap.dedent(CROWDED), str(first), str(first + 8)]
            own = {**os.environ, **getattr(entry, name)()}
            said[name] = subprocess.run(script, capture_output=True, env=own, check=True).stderr
    assert b'RTPS_TRANSPORT_SHM' in said['environment'], 'it has nothing to complain of here'
    assert said['quiet_environment'] == b''


@pytest.mark.parametrize(
    'changed',
    [
        {'pid': 10**30},
        {'pid': -1},
        {'domain': '../x'},
        {'domain': 100},
        {'since': 'now'},
        {'x': 1},
    ],
    ids=str,
)
def test_what_is_no_entry_of_a_run_is_not_listed(tmp_path, changed):
    with registered('walk_0deg', tmp_path) as entry:
        foreign = register() / 'foreign.json'
        foreign.write_text(json.dumps({**asdict(entry), **changed}))
        assert running() == [entry]
        assert not foreign.exists()


def test_an_entry_nested_without_end_is_not_listed():
    deep = register() / 'deep.json'
    deep.write_text('[' * 100_000)
    assert not running() and not deep.exists()
