"""A disk that takes no more stops the recording, not the robot: what was measured is printed."""

import resource
import subprocess

import pytest

from tests.support.runs import KHR

pytestmark = pytest.mark.slow
RUN = [*KHR, 'run', 'stand_0deg', '--duration']


def run(limit, *arguments):
    """Run khr with a limit on the size of files, in bytes."""
    return subprocess.run(
        [*RUN, *map(str, arguments)],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )


def test_a_full_disk_stops_the_recording_only(tmp_path):
    folder = tmp_path / 'run'
    ended = run(400_000, 6, '--one-process', '--no-draw', '--out', folder)
    assert ended.returncode == 1, ended.stderr
    assert 'recording stopped' in ended.stderr and 'File too large' in ended.stderr
    assert 'stood' in ended.stdout
    assert ended.stdout.splitlines()[-1].startswith('trajectory hash ')
    assert not [path for path in folder.glob('log/*') if 'Traceback' in path.read_text()]


def test_a_folder_that_takes_no_file_is_one_line(tmp_path):
    ended = run(100, 1, '--offline', '--out', tmp_path / 'run')
    assert ended.returncode == 1
    assert ended.stderr.count('\n') == 1
    assert "scenario.yaml': File too large" in ended.stderr
    assert not (tmp_path / 'run').exists()
