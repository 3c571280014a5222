"""Ten viewers open a live page, and a playback of two runs, and leave again, beside busy loops."""

import logging
import random
import re
import subprocess
import threading
import time
from pathlib import Path

import psutil

from tests.support.browser import free_port, viewer
from tests.support.load import busy
from tests.support.runs import finish, khr, start_khr, wait_for

VIEWERS = 10  # of each page
LONGEST = 5.0  # s of wall time that a viewer stays
WALK = ('run', 'walk_6.99deg_ka12', '--set', 'simulator.engine=mujoco')


def trouble(folder: Path, seconds: float, seed: int = 0) -> tuple[list[str], str]:
    """Let viewers come and go for ``seconds`` of wall time.

    Args:
        folder: for the runs.
        seconds: of wall time.
        seed: of when each viewer comes, how long it stays, and whether it reads.

    Returns:
        What fell short, and how many visits there were.
    """
    # The client logs an error of its own if the other side hangs up while it does.
    logging.getLogger('websockets.client').setLevel(logging.CRITICAL)
    recorded, live = folder / 'recorded', folder / 'live'
    khr(*WALK, '--duration', 4, '--out', recorded, timeout=300)
    # No faster than the clock, so it is still there when the last viewer has left.
    long = (*WALK, '--set', 'simulator.pace=1', '--duration', seconds + 5.0)
    port = free_port()
    run = start_khr(*long, '--view', '--out', live)
    play = start_khr('view', recorded, '--against', recorded, '--no-browser', '--port', port)
    faults, visits = list[str](), list[int]()
    ports = [_port(run), _port(play)]
    with busy(psutil.cpu_count() or 1):
        end = time.monotonic() + seconds
        guests = [
            threading.Thread(
                target=_visit,
                args=(each, end, random.Random(f'{seed} {each} {n}'), faults, visits),
            )
            for n in range(VIEWERS)
            for each in ports
        ]
        for guest in guests:
            guest.start()
        for guest in guests:
            guest.join()
    play.send_signal(2)
    ended = {'khr view': finish(play, recorded, 60), 'khr run': finish(run, live, seconds + 300.0)}
    for name, each in ended.items():
        if each.code != 0:
            faults.append(f'{name}: exit {each.code}: {each.err.strip()[-300:]}')
    said = {name: each.err for name, each in ended.items()}
    said |= {path.name: path.read_text(errors='replace') for path in live.glob('log/*.log')}
    faults += [
        f'{name}: {text.strip()[-300:]}' for name, text in said.items() if 'Traceback' in text
    ]
    alone = khr(*long, '--offline', '--out', folder / 'alone', timeout=seconds + 300.0)
    if not faults and ended['khr run'].hash != alone.hash:
        faults.append(f'hash {ended["khr run"].hash}, without viewers {alone.hash}')
    return faults, f'{len(visits)} visits in {seconds:g} s, {sum(visits) / 1e6:.0f} MB read'


def _port(process: subprocess.Popen[str]) -> int:
    stderr = process.stderr
    assert stderr is not None
    line = wait_for(lambda: re.search(r'page: http://127.0.0.1:(\d+)/', stderr.readline()), 'page')
    return int(line[1])


def _visit(
    port: int, end: float, chance: random.Random, faults: list[str], visits: list[int]
) -> None:
    """Open a page and leave it, again and again; one of five viewers reads nothing."""
    while time.monotonic() < end:
        time.sleep(chance.uniform(0.0, 1.0))  # when it comes
        try:
            with viewer(port, reads=chance.random() > 0.2) as got:
                time.sleep(chance.uniform(0.0, LONGEST))  # how long it stays
            visits.append(sum(got))
        except Exception as error:  # of whatever kind: the viewer could not look
            faults.append(f'a viewer: {type(error).__name__}: {error}')
