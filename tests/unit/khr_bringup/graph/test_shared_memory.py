"""Only what dead processes left is swept from shared memory."""

import fcntl

import pytest

from khr_bringup.graph import shared_memory


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


def test_what_a_process_holds_stays(memory):
    before = names(memory)
    with (
        (memory / 'fastrtps_0123456789abcdef_el').open() as segment,
        (memory / 'fastrtps_port7661_el').open() as port,
    ):
        fcntl.flock(segment, fcntl.LOCK_EX)
        fcntl.flock(port, fcntl.LOCK_SH)
        assert shared_memory.remove_dead_segments(range(7650, 7900)) == 0
    assert names(memory) == before
