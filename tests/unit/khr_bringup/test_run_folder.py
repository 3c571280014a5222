"""The folder of a run: one run has it, and it is left alone if none began."""

import signal
import subprocess
import sys

import pytest

from khr_bringup.run_folder import SCENARIO, claim, claim_folder
from khr_common.errors import KhrError


def test_an_empty_folder_that_another_run_takes_meanwhile_is_refused(tmp_path, monkeypatch):
    # Both have looked and found nothing; the file of the other comes between look and claim.
    monkeypatch.setattr('khr_bringup.run_folder._empty', lambda _: True)
    claim(tmp_path, 'out')
    with pytest.raises(KhrError, match=r'out: .* has been taken by another run'):
        claim(tmp_path, 'out')


def test_a_folder_whose_run_was_killed_before_it_began_is_taken_over(tmp_path):
    code = f"""
import os, signal
from pathlib import Path
from khr_bringup.run_folder import claim
claim(Path({str(tmp_path)!r}), '--out')
os.kill(os.getpid(), signal.SIGKILL)
"""
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == -signal.SIGKILL
    assert [path.name for path in tmp_path.iterdir()] == [SCENARIO]
    assert claim(tmp_path, '--out') == tmp_path
    with pytest.raises(KhrError, match='taken by another run'):
        claim(tmp_path, '--out')


def test_nothing_is_left_of_a_run_that_did_not_begin(tmp_path):
    with pytest.raises(KeyError), claim_folder(tmp_path / 'new', 'walk'):
        raise KeyError
    assert not list(tmp_path.iterdir())
    (tmp_path / 'empty').mkdir()
    with pytest.raises(KeyError), claim_folder(tmp_path / 'empty', 'walk'):
        raise KeyError
    assert not list((tmp_path / 'empty').iterdir())


def test_a_run_that_began_keeps_its_folder(tmp_path):
    with pytest.raises(KeyError), claim_folder(tmp_path / 'new', 'walk') as folder:
        (folder / SCENARIO).write_text('as run')
        raise KeyError
    assert (tmp_path / 'new' / SCENARIO).read_text() == 'as run'
    assert (tmp_path / 'new').stat().st_mode & 0o777 == 0o700
