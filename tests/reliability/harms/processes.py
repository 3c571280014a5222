"""Processes of a run, or the run as a whole, are killed, stopped or signalled."""

import os
import random
import signal
import time
from contextlib import suppress
from pathlib import Path

from khr_bringup.scenario import scenario as scenarios
from tests.reliability.harms.harmed_run import BOTH, PHASES, SCENARIO, Case, Run

TRIES = 20  # runs until a process is killed before it has ended by itself


def kill(case: Case, folder: Path) -> list[str]:
    """Kill one process of a run: it is named, the rest ends, nothing raw is printed."""
    chance = random.Random(case.name)
    for number in range(TRIES):
        run = Run(folder / f'run{number}', case.mode)
        run.reach(case.phase, chance, case.victim)
        killed = run.kill(case.victim)
        faults = run.finish({0, 1}, f'{case.victim} was killed by SIGKILL')
        if killed or faults:
            return faults
    return [f'{case.victim} had ended each time before it was killed']


def stop(case: Case, folder: Path) -> list[str]:
    """Freeze one process of a run: it is named within 30 s."""
    run = Run(folder / 'run', case.mode, 600.0)
    run.reach('run', random.Random(case.name))
    victim = run.look().get(case.victim)
    if victim is None:
        return [*run.finish({0, 1}), f'no {case.victim} to freeze']
    victim.suspend()
    began = time.monotonic()
    faults = run.finish({1}, '.')
    seconds = time.monotonic() - began
    return faults + ([f'took {seconds:.0f} s to end'] if seconds > 2 * 30.0 else [])


def parent(case: Case, folder: Path) -> list[str]:
    """Kill khr itself: its children end, and the next run is not misled."""
    run = Run(folder / 'run', case.mode, 600.0)
    run.reach(case.phase, random.Random(case.name))
    run.process.kill()
    after = Run(folder / 'next', case.mode)
    faults = run.finish({-9})
    after.reach('run', random.Random(0))
    return faults + after.finish({0})


def interrupt(case: Case, folder: Path) -> list[str]:
    """Interrupt a run in some phase: exit 130 (or 0 if it was over), no process left."""
    run = Run(folder / 'run', case.mode)
    run.reach(case.phase, random.Random(case.name))
    run.process.send_signal(signal.Signals[case.victim])
    return run.finish(
        {'start': {0, 130, 1, -1, -2, -15}, 'run': {0, 130}, 'end': {0, 130, 1}}[case.phase]
    )


def group(case: Case, folder: Path) -> list[str]:
    """Press Ctrl-C in the terminal of a run: all its processes receive it."""
    run = Run(folder / 'run', case.mode)
    run.reach(case.phase, random.Random(case.name))
    with suppress(ProcessLookupError):
        os.killpg(run.process.pid, signal.SIGINT)
    return run.finish({0, 130, 1, -2} if case.phase == 'start' else {0, 130, 1})


def halt(case: Case, folder: Path) -> list[str]:
    """Stop khr itself for some seconds: its run goes on, and the result is right."""
    run = Run(folder / 'run', case.mode)
    run.reach('start', random.Random(case.name))
    run.process.send_signal(signal.SIGSTOP)
    time.sleep(case.seed)  # how long it is stopped: the harm itself
    run.process.send_signal(signal.SIGCONT)
    return run.finish({0})


HARMS = {
    'SIGKILL of a process': kill,
    'SIGSTOP of a process': stop,
    'SIGKILL of khr': parent,
    'SIGINT, SIGTERM, SIGHUP to khr': interrupt,
    'Ctrl-C of the process group': group,
    'SIGSTOP of khr': halt,
}


def cases(seed: int, kills: int) -> list[Case]:
    """Return the cases of these harms, with so many processes killed."""
    victims = [('--processes', node) for node in scenarios.load_scenario(SCENARIO).nodes]
    victims.append(('--one-process', 'graph'))
    return [
        *(Case('SIGKILL of a process', *victims[number % len(victims)],
               PHASES[number // len(victims) % len(PHASES)], seed + number)
          for number in range(kills)),
        *(Case('SIGSTOP of a process', mode, node, '', seed) for mode, node in victims),
        *(Case('SIGKILL of khr', mode, '', phase, seed + n)
          for mode in BOTH for phase in PHASES[:2] for n in range(max(1, kills // 50))),
        *(Case('SIGINT, SIGTERM, SIGHUP to khr', mode, name, phase, seed)
          for mode in BOTH for name in ('SIGINT', 'SIGTERM', 'SIGHUP') for phase in PHASES),
        *(Case('Ctrl-C of the process group', mode, '', phase, seed)
          for mode in BOTH for phase in PHASES),
        *(Case('SIGSTOP of khr', mode, '', '', seconds) for mode in BOTH for seconds in (1, 5, 20)),
    ]  # fmt: skip
