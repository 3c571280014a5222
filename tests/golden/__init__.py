"""Trajectory hashes that every x86-64 processor gives: ``python -m tests.golden`` compares them.

``--write`` renews them, which a change of a trajectory needs; its commit says so. A run is of a
scenario's first seconds: chaos makes of one bit that differs another trajectory within two.
"""

import json
from pathlib import Path

from khr_bringup.bout.bout import load_bout
from khr_bringup.bout.offline import run_bout
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario

FILE = Path(__file__).with_name('hashes.json')
ENGINES = ('bullet', 'mujoco')
SCENARIOS = {  # simulated s
    'walk_0deg': 2.0,
    'walk_8.88deg_ka12': 2.0,
    'walk_9.7deg_ka12_kh13': 2.0,
    'lift_9.5deg_ka12_kh13': 2.0,
    'push_behind': 2.0,
    'push_behind_step': 3.5,
    'stand_tilting_staged': 2.0,
}
BOUTS = {'shove': 2.0, 'shove_step': 3.5}  # simulated s
EMULATED = ('walk_8.88deg_ka12', 0.6)  # an emulator takes some 15 s for it


def measure(scenario, engine, seconds):
    """Return the trajectory hash of a scenario's first seconds."""
    changes = {('simulator', 'engine'): engine, ('simulator', 'duration'): seconds}
    return run_offline(load_scenario(scenario).changed(changes)).trajectory_hash


def measure_bout(bout, engine, seconds):
    """Return the trajectory hash of a bout's first seconds."""
    changes = [f'simulator.engine={engine}', f'referee.time_limit={seconds}']
    (only,) = run_bout(load_bout(bout).set_to(changes)).rounds
    return only.trajectory_hash


def measure_all():
    """Return all hashes by scenario, seconds and engine."""
    runs = [*SCENARIOS.items(), EMULATED]
    return {
        key(scenario, seconds, engine): measure(scenario, engine, seconds)
        for scenario, seconds in runs
        for engine in ENGINES
    } | {
        key(bout, seconds, engine): measure_bout(bout, engine, seconds)
        for bout, seconds in BOUTS.items()
        for engine in ENGINES
    }


def key(scenario, seconds, engine):
    return f'{scenario}, {seconds:g} s, {engine}'


def expected():
    """Return the hashes that are kept."""
    return json.loads(FILE.read_text())
