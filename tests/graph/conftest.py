"""Fixtures of real runs."""

import signal

import pytest

from tests.support.runs import khr, start_khr


@pytest.fixture(scope='session')
def standing(tmp_path_factory):
    """Four seconds of standing on the flat, one process per node, recorded."""
    folder = tmp_path_factory.mktemp('runs') / 'standing'
    return khr(
        'run',
        'stand_0deg',
        '--processes',
        '--duration',
        4,
        '--out',
        folder,
        '--expect',
        'stood',
        folder=folder,
        measured=True,
    )


@pytest.fixture
def in_background():
    """Start runs that a test does not wait for; none is left behind."""
    processes = []

    def start(*arguments, measured=False):
        processes.append(start_khr(*arguments, measured=measured))
        return processes[-1]

    yield start
    for process in processes:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=30)
