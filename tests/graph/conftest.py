"""Fixtures of real runs."""

import pytest

from tests.support.runs import khr


@pytest.fixture(scope='session')
def standing(tmp_path_factory):
    """Four seconds of standing on the flat, one process per node, recorded."""
    folder = tmp_path_factory.mktemp('runs') / 'standing'
    return khr(
        *('run', 'stand_0deg', '--processes', '--duration', 4, '--out', folder),
        *('--expect', 'stood'),
        folder=folder,
        measured=True,
    )
