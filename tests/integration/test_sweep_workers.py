"""Sweeps on real worker processes, with deaths on the way."""

import os
import signal
import subprocess
from pathlib import Path

import psutil
import pytest

from khr_sweeps.results.folder import ROWS, read_results
from khr_sweeps.results.store import read_store
from tests.support.in_process import khr_here
from tests.support.runs import KHR
from tests.support.sweeps import (
    PATIENCE,
    check_complete,
    check_signals,
    khr,
    specification,
    wait_for,
    written,
)


def workers_of(command):
    """Return the worker processes of a command, without the tracker of their semaphores."""
    children = psutil.Process(command.pid).children()
    return [child for child in children if any('spawn_main' in word for word in child.cmdline())]


def check_closed(processes):
    """Nothing of the processes is a socket, and another user cannot open what they have."""
    for process in processes:
        folder = Path(f'/proc/{process.pid}/fd')
        kinds = [os.readlink(each) for each in folder.iterdir() if int(each.name) > 2]
        assert any(kind.startswith('pipe:') for kind in kinds)
        assert not [kind for kind in kinds if kind.startswith('socket:')]
        if os.geteuid() == 0:
            refused = subprocess.run(
                ['ls', folder], user='nobody', cwd='/', capture_output=True, check=False
            )
            assert b'Permission denied' in refused.stderr


@pytest.mark.slow
def test_a_sweep_killed_midway_goes_on_without_losing_or_repeating_a_run(tmp_path, start):
    file, folder = specification(tmp_path, 12, 0.6), tmp_path / 'out'
    command = (*KHR, 'sweep', file, '--out', folder, '--workers', 2)
    first = start(*command)
    wait_for(lambda: written(folder, 2) or first.poll() is not None, 'the second run')
    workers, children = workers_of(first), psutil.Process(first.pid).children(recursive=True)
    assert 1 <= len(workers) <= 2, 'the second may start late'
    check_closed([psutil.Process(first.pid), *children])
    workers[0].suspend()  # a stopped worker ends as well
    first.kill()
    assert 'Traceback' not in first.communicate()[1]
    _, alive = psutil.wait_procs(children, timeout=PATIENCE)
    assert not alive, 'processes outlived their sweep'
    check_signals(folder)
    kept = read_store(folder / ROWS, dict)[1]
    assert 2 <= len(kept) < 12
    again = khr(*command[len(KHR) :])
    assert (again.returncode, again.stderr) == (0, '')
    assert '12 of 12' in again.stdout
    assert read_store(folder / ROWS, dict)[1][: len(kept)] == kept
    check_complete(file, folder)
    file.write_text(file.read_text().replace('5.0', '6.0'))
    refused = khr(*command[len(KHR) :])
    assert refused.returncode == 2
    assert 'other axes' in refused.stderr and refused.stderr.count('\n') == 1


@pytest.mark.slow
def test_a_worker_killed_midway_loses_nothing(tmp_path, start):
    file, folder = specification(tmp_path, 12, 0.6), tmp_path / 'out'
    command = start(*KHR, 'sweep', file, '--out', folder, '--workers', 2)
    wait_for(lambda: written(folder, 2) or command.poll() is not None, 'the second run')
    for worker in workers_of(command):
        worker.kill()
    out, err = command.communicate(timeout=PATIENCE)
    assert (command.returncode, err) == (0, '')
    assert '12 of 12' in out
    check_complete(file, folder)


def test_signals_that_are_lost_or_damaged_are_computed_again(tmp_path):
    file, folder = specification(tmp_path, 4, 0.3), tmp_path / 'out'
    command = ('sweep', file, '--out', folder, '--workers', 1)
    assert khr_here(*command).code == 0
    whole, *_, damaged, lost = (folder / 'series').iterdir()
    content = bytearray(damaged.read_bytes())
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    lost.unlink()
    before = whole.read_bytes()
    again = khr_here(*command)
    assert again.code == 0 and '4 of 4' in again.out
    assert again.err.endswith('2 damaged results dropped\n')
    check_complete(file, folder)
    assert whole.read_bytes() == before


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
