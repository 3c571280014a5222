"""Runs of the shipped experiments whose signals are invented: what is drawn is known."""

import functools
from dataclasses import MISSING, dataclass, fields, replace

import numpy as np

from khr_balance.gaits.gait import Gait
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.run_signals import Series
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.experiments import Run, specification_of
from khr_studies.thesis_figures.registry import FIGURES
from khr_sweeps.trial import RESULTS

WEIGHT = 15.0  # N
TONE = 4.0 / 2.31  # Hz, with RATE the pitch rate of every walk
RATE = 0.3  # rad/s
READ = 0.8  # of it the gyro reads
FELL_AT = 2.5  # s


@dataclass(frozen=True, eq=False)
class Invented:
    """Stands for a Run."""

    point: dict
    seed: int
    row: dict
    scenario: object
    series: Series
    fell = Run.fell
    stayed_up = Run.stayed_up


def difference(inclination_deg: float) -> float:
    """Return the invented Delta of the support foot, N."""
    return 2.0 * inclination_deg - 3.0


def signals(scenario, seed: int, end: float) -> Series:
    """Invent the signals of a run of a scenario."""
    time = 0.015 * np.arange(int(end / 0.015) + 1)
    simulator, gait = scenario.table(RunParameters), scenario.table(GaitParameters)
    size, still = len(time), np.zeros(len(time))
    toe = (WEIGHT + difference(simulator.inclination_deg)) / 2.0 + 0.1 * seed
    support = [toe, WEIGHT - toe]
    loads = [*support, 0.0, 0.0] if gait.first_foot == 'right' else [0.0, 0.0, *support]
    rate = RATE * np.cos(2.0 * np.pi * TONE * time)
    pairs = {
        'contact_force': np.tile(loads, (size, 1)),
        'foot_force': np.tile(loads, (size, 1)),
        'correction': np.zeros((size, 2)),
        'pitch_rate': rate,
        'gyro_rate': READ * rate,
        'slip': 0.01 * time,
        'time': time,
    }
    names = [each.name for each in fields(Series) if each.default is MISSING]
    return Series(**{name: pairs.get(name, still) for name in names})


@functools.cache
def length(gait) -> float:
    """Return how long a motion lasts, s."""
    return Gait(gait).duration


@functools.cache
def invented(experiment: str, limit_deg: float) -> list[Invented]:
    """Return two seeds of an experiment, in which the robot falls beyond an inclination."""
    runs = []
    for trial in specification_of(experiment, fast=False).trials('invented'):
        if trial.seed < 2:
            fell = trial.scenario.table(RunParameters).inclination_deg > limit_deg
            end = FELL_AT + 0.5 if fell else length(trial.scenario.table(GaitParameters))
            row = {
                'verdict': 'fell' if fell else 'walked',
                'stayed_up': not fell,
                'fell_at_s': FELL_AT if fell else None,
            }
            runs.append(
                Invented(
                    trial.point,
                    trial.seed,
                    row,
                    trial.scenario,
                    signals(trial.scenario, trial.seed, end),
                )
            )
    return runs


def runs_for(number: str, limit_deg: float) -> dict[str, list[Invented]]:
    """Return runs of all experiments that a figure asks for."""
    return {name: invented(name, limit_deg) for name in FIGURES[number].experiments}


def kept_runs(experiment, folder, series_of, fell, cases=None) -> list[Run]:
    """Return two seeds of an experiment, in the order of its cases, with their signals in files.

    Of a trial, ``series_of`` returns the signals, and ``fell`` whether the robot falls.
    """
    whole, made = replace(specification_of(experiment, False), seeds=2), []
    order = list(whole.cases)
    for trial in whole.trials('version'):
        if trial.point['case'] in (cases or order):
            path = folder / f'{trial.id}.npz'
            series_of(trial).save(path)
            row = dict.fromkeys(RESULTS) | {'verdict': 'slipped', 'stayed_up': not fell(trial)}
            made.append(Run(trial.point, trial.seed, row, trial.scenario, path))
    return sorted(made, key=lambda run: order.index(run.point['case']))
