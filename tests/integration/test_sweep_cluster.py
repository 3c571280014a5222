"""Sweeps on real workers: local processes and a Dask cluster, with deaths on the way."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from functools import partial

import numpy as np
import psutil
import pytest
from distributed import Client

from khr_bringup.run_signals import Series, run_with_series
from khr_common import KhrError, RunError
from khr_experiments.experiments import runs_of
from khr_sweeps import cluster
from khr_sweeps.folder import JOURNAL, read_results, series_path
from khr_sweeps.reading import load
from tests.support import runs
from tests.support.runs import KHR

PATIENCE = 60.0  # s
STARTING = 20.0  # s to start the command on a loaded machine
wait_for = partial(runs.wait_for, seconds=PATIENCE)


def khr(*arguments):
    return subprocess.run(
        [*KHR, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE, check=False
    )


def written(folder, count):
    journal = folder / JOURNAL
    return journal.is_file() and journal.read_bytes().count(b'\n') >= count


@pytest.fixture
def start():
    """Start processes that do not outlive the test."""
    processes = []

    def start(*arguments):
        processes.append(
            subprocess.Popen(
                list(map(str, arguments)),
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        return processes[-1]

    yield start
    for process in processes:
        process.kill()
        process.communicate(timeout=PATIENCE)


def specification(folder, count, duration):
    file = folder / 'small.yaml'
    file.write_text(
        f'scenario: stand_0deg\nduration: {duration}\nseeds: {count // 2}\n'
        'set:\n  simulator.initial_tilt_deg: 0.5\nkeep: series\n'
        'grid:\n  simulator.inclination_deg: [0.0, 5.0]\n'
    )
    return file


def check_complete(file, folder):
    """Every run of the sweep is there once, with the trajectory that it has offline."""
    rows = read_results(folder / 'results.parquet').to_pylist()
    version = json.loads((folder / 'sweep.json').read_text())['version']
    trials = {trial.id: trial for trial in load(file).trials(version)}
    assert Counter(row['id'] for row in rows) == Counter(trials.keys())
    for row in (rows[0], rows[-1]):
        offline, series = run_with_series(trials[row['id']].scenario)
        assert row['trajectory_hash'] == offline.trajectory_hash
        kept = Series.load(series_path(folder, row['id']))
        assert np.array_equal(kept.pitch, series.pitch.astype(np.float32))
    check_signals(folder)


def check_signals(folder):
    """Whatever is in the journal has its signals, whole."""
    for run in runs_of(folder):
        assert run.series.time[-1] == pytest.approx(run.row['time_s'])


@pytest.mark.slow
def test_a_sweep_killed_midway_goes_on_without_losing_or_repeating_a_run(tmp_path, start):
    file, folder = specification(tmp_path, 12, 0.6), tmp_path / 'out'
    command = (*KHR, 'sweep', file, '--out', folder, '--workers', 2)
    first = start(*command)
    wait_for(lambda: written(folder, 2) or first.poll() is not None, 'the second run')
    children = psutil.Process(first.pid).children(recursive=True)
    first.kill()
    assert 'Traceback' not in first.communicate()[1]
    _, alive = psutil.wait_procs(children, timeout=PATIENCE)
    assert not alive, 'workers outlived their sweep'
    check_signals(folder)
    kept = (folder / JOURNAL).read_bytes()
    assert 2 <= kept.count(b'\n') < 12
    again = khr(*command[len(KHR) :])
    assert (again.returncode, again.stderr) == (0, '')
    assert '12 of 12' in again.stdout
    assert (folder / JOURNAL).read_bytes().startswith(kept[: kept.rfind(b'\n') + 1])
    check_complete(file, folder)
    file.write_text(file.read_text().replace('5.0', '6.0'))
    refused = khr(*command[len(KHR) :])
    assert refused.returncode == 2
    assert 'other axes' in refused.stderr and refused.stderr.count('\n') == 1


@dataclass
class Cluster:
    address: str
    scheduler: subprocess.Popen
    workers: dict[str, subprocess.Popen]


@pytest.fixture
def dask(tmp_path, start):
    """A scheduler and two workers, as a user would start them on three machines."""
    command, contact = (sys.executable, '-m', 'dask'), tmp_path / 'scheduler.json'
    scheduler = start(
        *command,
        'scheduler',
        '--host',
        '127.0.0.1',
        '--port',
        0,
        '--no-dashboard',
        '--no-jupyter',
        '--scheduler-file',
        contact,
    )
    wait_for(contact.is_file, 'the scheduler')
    address = wait_for(
        lambda: contact.read_text() and json.loads(contact.read_text()), 'its address'
    )['address']
    return Cluster(
        address,
        scheduler,
        {
            name: start(
                *command,
                'worker',
                address,
                '--no-nanny',
                '--nthreads',
                1,
                '--no-dashboard',
                '--name',
                name,
                '--local-directory',
                tmp_path,
            )
            for name in ('first', 'second')
        },
    )


@pytest.mark.slow
def test_a_worker_killed_midway_loses_nothing(tmp_path, start, dask):
    file, folder = specification(tmp_path, 24, 0.3), tmp_path / 'out'
    with Client(dask.address, timeout=PATIENCE) as client:
        client.wait_for_workers(2, timeout=PATIENCE)
        names = {
            each['name']: where
            for where, each in client.scheduler_info(n_workers=-1)['workers'].items()
        }
        command = start(*KHR, 'sweep', file, '--out', folder, '--scheduler', dask.address)
        wait_for(
            lambda: written(folder, 4) and client.processing()[names['first']],
            'a run on the first worker',
        )
        dask.workers['first'].kill()
        out, err = command.communicate(timeout=PATIENCE)
        assert set(client.scheduler_info(n_workers=-1)['workers']) == {names['second']}
    assert (command.returncode, err) == (0, '')
    assert '24 of 24' in out
    check_complete(file, folder)


@pytest.mark.slow
def test_a_scheduler_that_dies_is_one_line_and_the_sweep_goes_on_elsewhere(tmp_path, start, dask):
    file, folder = specification(tmp_path, 12, 0.6), tmp_path / 'out'
    command = start(*KHR, 'sweep', file, '--out', folder, '--scheduler', dask.address)
    wait_for(lambda: written(folder, 1) or command.poll() is not None, 'the first run')
    dask.scheduler.kill()
    _, err = command.communicate(timeout=PATIENCE)
    assert command.returncode == 1
    assert 'the scheduler has stopped' in err and err.count('\n') == 1
    again = khr('sweep', file, '--out', folder)
    assert again.returncode == 0, again.stderr
    check_complete(file, folder)


def test_an_interrupted_sweep_says_so_and_keeps_its_table(tmp_path):
    file, folder = specification(tmp_path, 200, 0.6), tmp_path / 'out'
    command = subprocess.Popen(
        [*KHR, 'sweep', str(file), '--out', str(folder), '--workers', '1'],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        # whoever started the tests in the background had SIGINT ignored; a terminal has not
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    wait_for(lambda: written(folder, 1) or command.poll() is not None, 'the first run')
    os.killpg(command.pid, signal.SIGINT)  # as a terminal does: the workers get it too
    out, err = command.communicate(timeout=PATIENCE)
    assert command.returncode == 130
    assert 'Traceback' not in err and ' of 200' in out
    check_signals(folder)
    assert 1 <= read_results(folder / 'results.parquet').num_rows < 200


def test_no_scheduler_is_one_line_soon(tmp_path):
    began = time.monotonic()
    result = khr(
        'sweep',
        specification(tmp_path, 2, 0.3),
        '--out',
        tmp_path / 'out',
        '--scheduler',
        'tcp://127.0.0.1:9',
    )
    assert time.monotonic() - began < cluster.CONNECT_TIMEOUT + STARTING
    assert result.returncode == 2
    assert "'tcp://127.0.0.1:9'" in result.stderr and result.stderr.count('\n') == 1


@pytest.mark.parametrize(
    'address',
    ['nonsense', 'tcp://', 'tcp://127.0.0.1', 'tcp://:1', 'tcp://h:x', 'udp://127.0.0.1:9', ''],
)
def test_what_is_no_address_is_refused(address):
    with pytest.raises(KhrError) as refusal, cluster.connected(1, address):
        pytest.fail('connected to nobody')
    assert repr(address) in str(refusal.value) and '\n' not in str(refusal.value)


def test_a_stranger_behind_the_port_is_refused_soon():
    began = time.monotonic()
    with socket.create_server(('127.0.0.1', 0)) as mute:
        address = f'tcp://127.0.0.1:{mute.getsockname()[1]}'
        with pytest.raises(KhrError, match=address), cluster.connected(1, address):
            pytest.fail('connected to a stranger')
    assert time.monotonic() - began < cluster.CONNECT_TIMEOUT + STARTING


@pytest.fixture(scope='module')
def client():
    with Client(
        processes=False, n_workers=1, threads_per_worker=2, dashboard_address=None
    ) as client:
        yield client


def test_only_a_window_of_the_tasks_is_ever_handed_out(client):
    taken, done, largest = 0, 0, 0

    def tasks():
        nonlocal taken
        for number in range(500):
            taken += 1
            yield f'window-{number}', number

    results = {}
    for batch in cluster.compute(client, abs, tasks()):
        done += len(batch)
        largest = max(largest, taken - done)
        results |= batch
    assert results == {f'window-{number}': number for number in range(500)}
    assert largest <= cluster.LEAST_AHEAD


def test_an_error_of_a_worker_is_one_line(client):
    with pytest.raises(RunError) as failure:
        list(cluster.compute(client, int, [('bad', 'no\nnumber')]))
    assert 'ValueError' in str(failure.value) and '\n' not in str(failure.value)
