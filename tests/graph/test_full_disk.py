"""A disk that takes no more stops the recording, with a message, and not the robot."""

import resource
import subprocess

import pytest

from tests.support.runs import KHR

pytestmark = pytest.mark.slow


def test_a_full_disk_stops_the_recording_only(tmp_path):
    folder = tmp_path / 'run'

    def limit_file_size():
        resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))

    ended = subprocess.run(
        [
            *KHR,
            'run',
            'stand_0deg',
            '--processes',
            '--duration',
            '6',
            '--out',
            str(folder),
            '--expect',
            'stood',
        ],
        preexec_fn=limit_file_size,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    assert 'recording stopped' in ended.stderr
    assert 'Traceback' not in (folder / 'log' / 'recorder.log').read_text()
