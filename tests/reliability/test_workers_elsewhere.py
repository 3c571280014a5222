"""Workers on another machine compute for who shows a certificate, and for nobody else."""

import socket
import ssl
import subprocess
import sys

import pytest

from khr_common import KhrError
from khr_sweeps.cluster import Scheduler, open_pool
from tests.reliability.strangers.other_machine import THERE, other_machine, why_not
from tests.support.runs import khr, wait_for
from tests.support.sweeps import PATIENCE, check_complete, make_certificates, specification

REASON = why_not()
PORT = 8786
ADDRESS = f'tls://{THERE}:{PORT}'


@pytest.fixture
def machine(tmp_path):
    """Another machine with a scheduler and a worker, as the document starts them."""
    tls, processes = make_certificates(tmp_path), []
    shown = [
        *('--tls-ca-file', tls / 'ca.pem', '--tls-cert', tls / 'cert.pem'),
        *('--tls-key', tls / 'key.pem', '--dashboard-address', '127.0.0.1:0'),
    ]

    def dask(*words):
        command = ['ip', 'netns', 'exec', name, sys.executable, '-m', 'dask', *words, *shown]
        output = (tmp_path / words[0]).open('w')
        processes.append(subprocess.Popen(command, stdout=output, stderr=output))

    with other_machine() as name:
        dask('scheduler', '--host', ADDRESS)
        dask(
            'worker', ADDRESS, '--nworkers', '1', '--nthreads', '1', '--local-directory', tmp_path
        )
        yield name, tls
        for process in reversed(processes):
            process.terminate()
            process.wait(PATIENCE)


def open_ports(name):
    """Return the ports of a machine that others can reach."""
    lines = subprocess.run(
        ['ip', 'netns', 'exec', name, 'ss', '-Hltn'], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    places = [line.split()[3].rpartition(':') for line in lines]
    return {int(port) for host, _, port in places if host != '127.0.0.1'}


def check_asks_for_a_certificate(port):
    """Who shows none is told so, and nothing else."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with (
        socket.create_connection((THERE, port), PATIENCE) as plain,
        pytest.raises(ssl.SSLError, match='CERTIFICATE_REQUIRED'),
        context.wrap_socket(plain) as secured,
    ):
        pytest.fail(f'{port} said {secured.recv(1)}')


@pytest.mark.nightly
@pytest.mark.skipif(bool(REASON), reason=REASON)
def test_workers_of_another_machine_compute_for_who_has_the_credentials(machine, tmp_path):
    name, tls = machine
    wait_for(lambda: 'Registered to' in (tmp_path / 'worker').read_text(), 'worker', PATIENCE)
    file, folder = specification(tmp_path, 2, 0.3), tmp_path / 'out'
    ended = khr('sweep', file, '--out', folder, '--scheduler', ADDRESS, '--tls', tls)
    assert (ended.code, ended.err) == (0, '')
    check_complete(file, folder)
    ports = open_ports(name)
    assert PORT in ports
    for port in ports:
        check_asks_for_a_certificate(port)
    stranger = Scheduler(f'tcp://{THERE}:{PORT}', unauthenticated=True)
    with pytest.raises(KhrError, match='no scheduler answers'), open_pool(1, stranger):
        pytest.fail('a stranger got in')
