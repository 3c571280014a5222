"""Commands that compute for long are interrupted or killed, and results changed."""

import random
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
from tests.reliability.harms.harmed_run import GONE, LIMIT, Case
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


def study(case: Case, folder: Path) -> list[str]:
    """Interrupt or kill a command that computes for long: nothing goes on, and it can resume."""
    command = [*KHR, *STUDIES[case.victim], '--out', str(folder / 'out')]
    (folder / 'sweep.yaml').write_text(LONG_SWEEP)
    process = subprocess.Popen(
        command, cwd=folder,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    time.sleep(random.Random(case.name).uniform(1.0, 20.0))  # when it is harmed
    seen = []
    with suppress(psutil.Error):
        seen = psutil.Process(process.pid).children(recursive=True)
    process.send_signal(signal.Signals[case.phase])
    try:
        _, err = process.communicate(timeout=LIMIT)
    except subprocess.TimeoutExpired:
        process.kill()
        return [f'did not end within {LIMIT:g} s']
    _, alive = psutil.wait_procs(seen, timeout=GONE)
    faults = [f'{len(alive)} processes left after {GONE:g} s'] if alive else []
    for each in alive:
        each.kill()
    if process.returncode not in ENDS[case.phase]:
        faults.append(f'exit {process.returncode}: {err.strip()[-300:]}')
    if 'Traceback' in err:
        faults.append(f'a traceback: {err.strip().splitlines()[-1][:200]}')
    return faults + (_resumed(folder, command) if case.victim == 'sweep' else [])


def _resumed(folder: Path, command: list[str]) -> list[str]:
    """Let a sweep go on to its end; its results are those of one that was not harmed."""
    again = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if again.returncode != 0:
        return [f'resumed: exit {again.returncode}: {again.stderr[-300:]}']
    return [] if _rows(folder / 'out') == _good_rows() else ['resumed to other results']


@cache
def _good_rows() -> dict[str, object]:
    """Return the results of the sweep that is harmed, from one that is not."""
    with TemporaryDirectory() as folder:
        Path(folder, 'sweep.yaml').write_text(LONG_SWEEP)
        command = [*KHR, *STUDIES['sweep'], '--out', f'{folder}/out']
        subprocess.run(command, cwd=folder, capture_output=True, check=True)
        return _rows(Path(folder) / 'out')


def poison(case: Case, folder: Path) -> list[str]:
    """Change kept results: what is changed is computed again, and all is as it was before."""
    good, harmed = folder / 'good', folder / 'harmed'
    good.mkdir()
    (good / 'sweep.yaml').write_text(SWEEP)
    command = [*KHR, *KEPT[case.victim], '--workers', '1', '--out', 'out']
    subprocess.run(command, cwd=good, check=True, capture_output=True)
    shutil.copytree(good, harmed)
    (rows,) = harmed.glob('**/rows.sqlite')
    _change(rows, random.Random(case.name))
    again = subprocess.run(command, cwd=harmed, capture_output=True, text=True, check=False)
    faults = [] if again.returncode == 0 else [f'exit {again.returncode}: {again.stderr[-300:]}']
    if _rows(rows.parent) != _rows(good / rows.parent.relative_to(harmed)):
        faults.append('other results than before')
    if _points(harmed) != _points(good):
        faults.append('another figure than before')
    if 'Traceback' in again.stderr:
        faults.append(f'a traceback: {again.stderr.strip().splitlines()[-1][:200]}')
    return faults


def _change(rows: Path, chance: random.Random) -> None:
    """Put other letters into the data of results."""
    content = bytearray(rows.read_bytes())
    for _ in range(3):
        start = content.index(b'"trajectory_hash"', chance.randrange(len(content) // 2))
        content[start + 20 + chance.randrange(16)] = chance.randrange(32, 127)
    rows.write_bytes(content)


def _points(folder: Path) -> list[bytes]:
    """Return the points of the figures that a reproduction has drawn."""
    return [path.read_bytes() for path in sorted(folder.glob('out/figures/*.csv'))]


def _rows(folder: Path) -> dict[str, object]:
    """Return the trajectory hashes of a sweep by the ids of its runs."""
    rows = read_results(folder)
    return dict(zip(rows['id'].to_pylist(), rows['trajectory_hash'].to_pylist(), strict=True))


HARMS = {'film, sweep, reproduction stopped': study, 'results changed': poison}


def cases(seed: int) -> list[Case]:
    """Return the cases of these harms."""
    return [
        *(Case('film, sweep, reproduction stopped', '', victim, number, seed + n)
          for victim in STUDIES for number in ('SIGINT', 'SIGTERM', 'SIGKILL') for n in range(2)),
        *(Case('results changed', '', victim, '', seed + n) for victim in KEPT for n in range(3)),
    ]  # fmt: skip
