"""Commands that compute for long are interrupted or killed, and results changed."""

import shutil
import signal
import subprocess
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from khr_sweeps.results.folder import read_results
from tests.reliability.harms.harmed_run import LIMIT, badly_ended, command, left
from tests.support.runs import KHR

STUDIES = {
    'film': ['film', 'stand_0deg'],
    'reproduce': ['reproduce', '--fast', '--workers', '2'],
    'sweep': ['sweep', 'sweep.yaml', '--workers', '2'],
}
# Commands whose results are kept for the next time; the figure is of one run.
KEPT = {'sweep': ['sweep', 'sweep.yaml'], 'reproduce': ['reproduce', '--fast', '--only', '5.5']}
# Exit codes by signal: 0 if the command was over before; a signal's own while it still imports.
ENDS = {
    'SIGINT': {0, 130, -signal.SIGINT},
    'SIGTERM': {0, 130, 143, -signal.SIGTERM},
    'SIGKILL': {0, -signal.SIGKILL},
}
SWEEP = """
scenario: stand_0deg
set:
  simulator.duration: 0.3
  simulator.initial_tilt_deg: 0.3
seeds: 4
grid:
  ankle_controller.gain: [3.0, 6.0, 9.0]
"""
LONG_SWEEP = SWEEP.replace('seeds: 4', 'seeds: 40')


def study(case, folder):
    """Interrupt or kill a command that computes for long: nothing goes on, and it can resume."""
    words = [*KHR, *STUDIES[case.victim], '--out', str(folder / 'out')]
    (folder / 'sweep.yaml').write_text(LONG_SWEEP)
    process = subprocess.Popen(
        words,
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    time.sleep(case.chance.uniform(1.0, 20.0))  # when it is harmed
    seen = []
    with suppress(psutil.Error):
        seen = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(signal.Signals[case.phase])
    try:
        _, err = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        process.kill()
        return [f'did not end within {LIMIT:g} s']
    faults = left(seen) + badly_ended(process.returncode, err, ENDS[case.phase])
    if case.victim == 'sweep':
        again = command(*words, cwd=folder)
        faults += [f'resumed: {each}' for each in badly_ended(again.returncode, again.stderr)]
        if not faults and _rows(folder / 'out') != _good_rows():
            faults.append('resumed to other results')
    return faults


@cache
def _good_rows():
    """Return the results of the sweep that is harmed, from one that is not."""
    with TemporaryDirectory() as folder:
        Path(folder, 'sweep.yaml').write_text(LONG_SWEEP)
        command(*KHR, *STUDIES['sweep'], '--out', 'out', cwd=folder).check_returncode()
        return _rows(Path(folder) / 'out')


def poison(case, folder):
    """Change kept results: what is changed is computed again, and all is as it was before."""
    good, harmed = folder / 'good', folder / 'harmed'
    good.mkdir()
    (good / 'sweep.yaml').write_text(SWEEP)
    words = [*KHR, *KEPT[case.victim], '--workers', '1', '--out', 'out']
    command(*words, cwd=good).check_returncode()
    shutil.copytree(good, harmed)
    (rows,) = harmed.glob('**/rows.sqlite')
    _change(rows, case.chance)
    again = command(*words, cwd=harmed)
    faults = badly_ended(again.returncode, again.stderr)
    if _rows(rows.parent) != _rows(good / rows.parent.relative_to(harmed)):
        faults.append('other results than before')
    if _points(harmed) != _points(good):
        faults.append('another figure than before')
    return faults


def _change(rows, chance):
    """Put other letters into the data of results."""
    content = bytearray(rows.read_bytes())
    for _ in range(3):
        start = content.index(b'"trajectory_hash"', chance.randrange(len(content) // 2))
        content[start + 20 + chance.randrange(16)] = chance.randrange(32, 127)
    rows.write_bytes(content)


def _points(folder):
    """Return the points of the figures that a reproduction has drawn."""
    return [path.read_bytes() for path in sorted(folder.glob('out/figures/*.csv'))]


def _rows(folder):
    """Return the trajectory hashes of a sweep by the ids of its runs."""
    rows = read_results(folder)
    return dict(zip(rows['id'].to_pylist(), rows['trajectory_hash'].to_pylist(), strict=True))


# By kind: what does the harm, and the cases.
HARMS = {
    'film, sweep, reproduction stopped': (
        study,
        [('', victim, name, number) for victim in STUDIES for name in ENDS for number in (0, 1)],
    ),
    'results changed': (
        poison,
        [('', victim, '', number) for victim in KEPT for number in range(3)],
    ),
}
