"""Processes of a run, or the run as a whole, are killed, stopped or signalled."""

import os
import signal
import time
from contextlib import suppress

from khr_bringup.scenario import scenario as scenarios
from tests.reliability.harms.harmed_run import BOTH, PHASES, SCENARIO, Run

TRIES = 20  # runs until a process is killed before it has ended by itself
KILLS = 300  # processes that are killed
VICTIMS = [('--processes', node) for node in scenarios.load_scenario(SCENARIO).nodes]
VICTIMS.append(('--one-process', 'graph'))


def kill(case, folder):
    """Kill one process of a run: it is named, the rest ends, nothing raw is printed."""
    chance = case.chance
    for number in range(TRIES):
        run = Run(folder / f'run{number}', case.mode)
        run.reach(case.phase, chance, case.victim)
        killed = run.kill(case.victim)
        faults = run.finish({0, 1}, f'{case.victim} was killed by SIGKILL')
        if killed or faults:
            return faults
    return [f'{case.victim} had ended each time before it was killed']


def stop(case, folder):
    """Freeze one process of a run: it is named within 30 s."""
    run = Run(folder / 'run', case.mode, 600.0)
    run.reach('run', case.chance)
    victim = run.look().get(case.victim)
    if victim is None:
        return [*run.finish({0, 1}), f'no {case.victim} to freeze']
    victim.suspend()
    began = time.monotonic()
    faults = run.finish({1}, '.')
    seconds = time.monotonic() - began
    return faults + ([f'took {seconds:.0f} s to end'] if seconds > 2 * 30.0 else [])


def parent(case, folder):
    """Kill khr itself: its children end, and the next run is not misled."""
    run = Run(folder / 'run', case.mode, 600.0)
    run.reach(case.phase, case.chance)
    run.process.kill()
    after = Run(folder / 'next', case.mode)
    faults = run.finish({-9})
    after.reach('run', case.chance)
    return faults + after.finish({0})


def interrupt(case, folder):
    """Interrupt a run in some phase: exit 130 (or 0 if it was over), no process left."""
    run = Run(folder / 'run', case.mode)
    run.reach(case.phase, case.chance)
    run.process.send_signal(signal.Signals[case.victim])
    codes = {'start': {0, 130, 1, -1, -2, -15}, 'run': {0, 130}, 'end': {0, 130, 1}}
    return run.finish(codes[case.phase])


def group(case, folder):
    """Press Ctrl-C in the terminal of a run: all its processes receive it."""
    run = Run(folder / 'run', case.mode)
    run.reach(case.phase, case.chance)
    with suppress(ProcessLookupError):
        os.killpg(run.process.pid, signal.SIGINT)
    return run.finish({0, 130, 1, -2} if case.phase == 'start' else {0, 130, 1})


def halt(case, folder):
    """Stop khr itself for some seconds: its run goes on, and the result is right."""
    run = Run(folder / 'run', case.mode)
    run.reach('start', case.chance)
    run.process.send_signal(signal.SIGSTOP)
    time.sleep(case.number)  # how long it is stopped: the harm itself
    run.process.send_signal(signal.SIGCONT)
    return run.finish({0})


# By kind: what does the harm, and the cases.
HARMS = {
    'SIGKILL of a process': (kill, [
        (*VICTIMS[number % len(VICTIMS)], PHASES[number // len(VICTIMS) % len(PHASES)], number)
        for number in range(KILLS)]),
    'SIGSTOP of a process': (stop, VICTIMS),
    'SIGKILL of khr': (parent, [
        (mode, '', phase, number)
        for mode in BOTH for phase in PHASES[:2] for number in range(6)]),
    'SIGINT, SIGTERM, SIGHUP to khr': (interrupt, [
        (mode, name, phase)
        for mode in BOTH for name in ('SIGINT', 'SIGTERM', 'SIGHUP') for phase in PHASES]),
    'Ctrl-C of the process group': (group, [(mode, '', phase) for mode in BOTH for phase in PHASES]),
    'SIGSTOP of khr': (halt, [(mode, '', '', seconds) for mode in BOTH for seconds in (1, 5, 20)]),
}  # fmt: skip
