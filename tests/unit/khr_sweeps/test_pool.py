"""A pool of worker processes: nothing is lost with a worker, nothing is left of the pool."""

import errno
import os
import signal
import subprocess
import sys
import textwrap
from math import sqrt

import psutil
import pytest

from khr_common import KhrError, RunError
from khr_sweeps.pool import LEAST_AHEAD, SINGLE_THREADED, LostWorkerError, compute, local_pool
from tests.fakes.jobs import pid_once, stay, unreadable


@pytest.fixture(scope='module')
def pool():
    with local_pool(2) as pool:
        yield pool


def test_results_and_errors_are_those_of_the_function(pool):
    futures = [pool.submit(sqrt, number) for number in range(50)]
    assert [future.result() for future in futures] == [sqrt(number) for number in range(50)]
    with pytest.raises(ValueError, match='math domain'):
        pool.submit(sqrt, -1).result()
    with pytest.raises(RuntimeError, match='Local: of its own'):
        pool.submit(unreadable).result()


def test_a_job_whose_worker_is_killed_is_done_again(pool, tmp_path):
    assert psutil.pid_exists(pool.submit(pid_once, str(tmp_path)).result())


@pytest.mark.slow
def test_a_job_that_kills_every_worker_is_given_up_and_the_others_go_on(pool):
    lost, other = pool.submit(os._exit, 3), pool.submit(sqrt, 4)
    assert other.result() == 2.0
    with pytest.raises(LostWorkerError):
        lost.result()
    assert list(compute(pool, os._exit, [('a', 3)])) == [[('a', None)]]


def test_workers_have_one_thread_each_and_the_caller_keeps_his(monkeypatch):
    for name, text in zip(SINGLE_THREADED, (None, '7', None), strict=True):
        monkeypatch.delenv(name, raising=False)
        if text:
            monkeypatch.setenv(name, text)
    before = dict(os.environ)
    with local_pool(1) as pool:
        there = [pool.submit(os.getenv, name).result() for name in SINGLE_THREADED]
    assert there == ['1', '7', '1'] and dict(os.environ) == before


def test_the_end_of_the_pool_ends_workers_whatever_they_do(tmp_path):
    pipes = [tmp_path / name for name in ('first', 'second', 'never')]
    for pipe in pipes:
        os.mkfifo(pipe)
    with local_pool(2) as pool:
        jobs = [pool.submit(stay, str(pipe)) for pipe in pipes]
        pids = [int(pipe.read_text()) for pipe in pipes[:2]]
        os.kill(pids[0], signal.SIGSTOP)
    assert not any(psutil.pid_exists(pid) for pid in pids)
    assert all(job.exception() for job in jobs[:2]) and jobs[2].cancelled()


PARENT = """
    import os, time
    from khr_sweeps.pool import local_pool
    with local_pool(1) as workers:
        print(workers.submit(os.getpid).result(), flush=True)
        workers.submit(time.sleep, 600).result()
"""


def test_a_busy_worker_ends_with_its_killed_parent():
    parent = subprocess.Popen(
        [sys.executable, '-c', textwrap.dedent(PARENT)], stdout=subprocess.PIPE
    )
    worker = psutil.Process(int(parent.stdout.readline()))
    parent.kill()
    parent.communicate()
    gone, left = psutil.wait_procs([worker], timeout=20)
    for each in left:
        each.kill()
    assert gone == [worker]


def test_only_a_window_of_the_tasks_is_ever_handed_out(pool):
    taken, done, largest = 0, 0, 0

    def tasks():
        nonlocal taken
        for number in range(500):
            taken += 1
            yield f'window-{number}', number

    results = {}
    for batch in compute(pool, abs, tasks()):
        done += len(batch)
        largest = max(largest, taken - done)
        results |= batch
    assert results == {f'window-{number}': number for number in range(500)}
    assert largest <= LEAST_AHEAD


def test_an_error_of_a_worker_is_one_line(pool):
    with pytest.raises(RunError) as failure:
        list(compute(pool, int, [('bad', 'no\nnumber')]))
    assert 'ValueError' in str(failure.value) and '\n' not in str(failure.value)


@pytest.mark.parametrize('workers', [0, -1, 100_000])
def test_a_senseless_number_of_workers_is_refused(workers):
    with (
        pytest.raises(KhrError, match=f'--jobs: {workers} .*integer in'),
        local_pool(workers, '--jobs'),
    ):
        pytest.fail('started')


def test_a_process_that_cannot_be_started_is_one_line(monkeypatch):
    def fail(*_):
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    with local_pool(1) as poor:
        monkeypatch.setattr('multiprocessing.util.spawnv_passfds', fail)
        with pytest.raises(RunError, match='Resource temporarily unavailable'):
            poor.submit(sqrt, 4).result()
        monkeypatch.undo()
        assert poor.submit(sqrt, 4).result() == 2.0


def test_a_script_without_a_main_guard_is_not_run_by_its_workers(tmp_path):
    script = tmp_path / 'script.py'
    script.write_text(
        'from khr_sweeps.pool import local_pool\nprint("once")\n'
        'with local_pool(1) as pool:\n    print(pool.submit(abs, -1).result())\n'
    )
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert (ended.stdout, ended.stderr) == ('once\n1\n', '')
