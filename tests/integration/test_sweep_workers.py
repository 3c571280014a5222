"""Sweeps on real worker processes, interrupted and with damaged signals."""

import os
import signal
import subprocess
from pathlib import Path

import psutil

from khr_sweeps.results.folder import read_results
from tests.support.in_process import khr_here
from tests.support.runs import KHR, wait_for
from tests.support.sweeps import PATIENCE, check_complete, check_signals, specification, written


def check_closed(processes):
    """Check that processes have no socket, and that another user cannot open their files."""
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


def test_an_interrupted_sweep_says_so_keeps_its_table_and_was_closed_to_others(tmp_path):
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
    parent = psutil.Process(command.pid)
    check_closed([parent, *parent.children(recursive=True)])
    os.killpg(command.pid, signal.SIGINT)  # as a terminal does: the workers get it too
    out, err = command.communicate(timeout=PATIENCE)
    assert command.returncode == 130
    assert err == 'khr: interrupted; repeat the command to go on\n' and ' of 200' in out
    check_signals(folder)
    assert 1 <= read_results(folder / 'results.parquet').num_rows < 200
