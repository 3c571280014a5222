"""Sweeps on the workers of a Dask scheduler, with deaths on the way."""

import json
import shutil
import socket
import ssl
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread

import pytest

from khr.cli.verbs.options import scheduler_of
from khr_common import KhrError
from khr_sweeps import cluster
from khr_sweeps.cluster import CREDENTIALS, Scheduler, open_pool
from tests.support.runs import KHR, khr, wait_for
from tests.support.sweeps import (
    PATIENCE,
    check_complete,
    make_certificates,
    specification,
    written,
)


@dataclass
class Cluster:
    address: str
    tls: Path
    scheduler: subprocess.Popen
    workers: dict[str, subprocess.Popen]


@pytest.fixture
def start():
    """Start processes that do not outlive the test."""
    processes = []

    def start(*arguments):
        words = list(map(str, arguments))
        pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE}
        processes.append(subprocess.Popen(words, text=True, **pipes))
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.communicate(timeout=PATIENCE)


@pytest.fixture
def dask(tmp_path, start):
    """A scheduler and two workers, as a user would start them on three machines."""
    tls = make_certificates(tmp_path)
    shown = [
        *('--tls-ca-file', tls / 'ca.pem', '--tls-cert', tls / 'cert.pem'),
        *('--tls-key', tls / 'key.pem', '--dashboard-address', '127.0.0.1:0'),
    ]
    command, contact = (sys.executable, '-m', 'dask'), tmp_path / 'scheduler.json'
    scheduler = start(
        *(*command, 'scheduler', '--host', '127.0.0.1', '--port', 0, '--protocol', 'tls'),
        *(*shown, '--scheduler-file', contact),
    )
    wait_for(contact.is_file, 'the scheduler')
    address = wait_for(
        lambda: contact.read_text() and json.loads(contact.read_text()), 'its address'
    )['address']
    worker = (*command, 'worker', address, '--no-nanny', '--nthreads', 1, *shown)
    workers = {
        name: start(*worker, '--name', name, '--local-directory', tmp_path)
        for name in ('first', 'second')
    }
    return Cluster(address, tls, scheduler, workers)


def joined(dask):
    return '--scheduler', dask.address, '--tls', dask.tls


@pytest.mark.nightly
def test_a_scheduler_that_dies_is_one_line_and_the_sweep_goes_on_elsewhere(tmp_path, start, dask):
    file, folder = specification(tmp_path, 12, 0.6), tmp_path / 'out'
    command = start(*KHR, 'sweep', file, '--out', folder, *joined(dask))
    wait_for(lambda: written(folder, 1) or command.poll() is not None, 'the first run')
    dask.scheduler.kill()
    _, err = command.communicate(timeout=PATIENCE)
    assert command.returncode == 1
    assert 'the scheduler has stopped' in err and err.count('\n') == 1
    again = khr('sweep', file, '--out', folder)
    assert again.code == 0, again.err
    check_complete(file, folder)


@pytest.fixture(scope='module')
def tls(tmp_path_factory):
    return make_certificates(tmp_path_factory.mktemp('credentials'))


def refusal(*given, **options):
    with pytest.raises(KhrError) as refused, open_pool(1, Scheduler(*given, **options)):
        pytest.fail('connected to nobody')
    assert '\n' not in str(refused.value)
    return str(refused.value)


@pytest.mark.parametrize(
    'address',
    ['nonsense', 'tcp://', 'tcp://127.0.0.1', 'tcp://:1', 'tcp://h:x', 'tls://127.0.0.1:9', ''],
)
def test_what_is_no_address_is_refused(address):
    said = refusal(address, unauthenticated=True)
    assert repr(address) in said and 'tcp://HOST:PORT' in said


def test_a_scheduler_that_anybody_can_use_is_refused_unless_asked_for():
    said = refusal('tcp://127.0.0.1:9')
    assert 'whoever reaches its port runs code' in said and '--tls' in said
    assert 'no scheduler answers' in refusal('tcp://127.0.0.1:9', unauthenticated=True)


def test_nobody_behind_the_port_is_one_line(tls):
    assert 'no scheduler answers' in refusal('tls://127.0.0.1:9', tls)
    assert 'tls://HOST:PORT' in refusal('tcp://127.0.0.1:9', tls)


@pytest.mark.parametrize('protected', [False, True])
def test_a_stranger_behind_the_port_is_refused_soon(tls, protected, monkeypatch):
    monkeypatch.setattr(cluster, 'CONNECT_TIMEOUT', 0.2)
    with socket.create_server(('127.0.0.1', 0)) as mute:
        place = f'127.0.0.1:{mute.getsockname()[1]}'
        how = (f'tls://{place}', tls) if protected else (f'tcp://{place}', None, True)
        assert place in refusal(*how)


@pytest.mark.parametrize('name', CREDENTIALS)
def test_credentials_that_are_none_are_named_before_anything_is_reached(tls, tmp_path, name):
    mine = shutil.copytree(tls, tmp_path / 'tls')
    (mine / name).write_text('no certificate')
    assert f"--tls: '{mine}': not certificates with their key" in refusal('tls://h:9', mine)


def test_credentials_must_be_there_and_closed_to_others(tls, tmp_path):
    assert 'No such file' in refusal('tls://127.0.0.1:9', tmp_path)
    mine = shutil.copytree(tls, tmp_path / 'tls')
    (mine / 'key.pem').chmod(0o644)
    assert 'mode 644' in refusal('tls://127.0.0.1:9', mine)


def test_credentials_of_another_authority_do_not_get_in(tls, tmp_path):
    """The other side shows a certificate as well, and asks for one."""
    other = make_certificates(tmp_path)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(other / 'cert.pem', other / 'key.pem')
    with socket.create_server(('127.0.0.1', 0)) as server:

        def serve():
            with (
                suppress(OSError),
                context.wrap_socket(server.accept()[0], server_side=True) as one,
            ):
                one.send(b'welcome')

        thread = Thread(target=serve)
        thread.start()
        said = refusal(f'tls://127.0.0.1:{server.getsockname()[1]}', tls)
        thread.join()
    assert 'CERTIFICATE_VERIFY_FAILED' in said


@pytest.mark.parametrize('options', [['--tls', '.'], ['--unauthenticated']])
def test_protection_without_a_scheduler_is_refused(options):
    with pytest.raises(KhrError, match=f'{options[0]}.*without --scheduler'):
        scheduler_of(None, Path('.') if '--tls' in options else None, '--tls' not in options)
