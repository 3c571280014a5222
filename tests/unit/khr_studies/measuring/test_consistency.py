"""Figures, scoreboard and scenarios try one condition in one way, and contradictions are found."""

from concurrent.futures import Future
from pathlib import Path

import pandas as pd
import pytest

from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.robots import constants_of
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.bench import Bench, limit_of_seed, walk
from khr_studies.measuring.consistency import (
    contradictions,
    experiment_runs,
    page_condition,
    ragged_limits,
)
from khr_studies.measuring.critical import START
from khr_studies.measuring.experiments import Run, experiment_files, specification_of, sweeps_of
from khr_studies.measuring.run_table import run_table
from khr_studies.measuring.thesis_values import STAGE_2, walking
from khr_sweeps.trial import complete
from tests.fakes.benches import outcome

SHIPPED = [path.stem for path in scenarios.shipped() if path.stem.startswith(('lift', 'walk'))]
TRIED = [name for name in experiment_files() if name.startswith(('lift', 'walk', 'map', 'lines'))]


@pytest.mark.parametrize('fast', [False, True])
@pytest.mark.parametrize('name', TRIED)
def test_an_experiment_tries_a_condition_as_the_scoreboard_does(name, fast):
    for trial in specification_of(name, fast).trials('v'):
        condition, inclination_deg, seed = page_condition(trial.scenario)
        again = condition.scenario(inclination_deg, seed)
        assert seed == trial.seed and complete(again) == complete(trial.scenario)


@pytest.mark.parametrize('name', SHIPPED)
def test_a_shipped_scenario_is_its_condition_without_an_error_of_posture(name):
    scenario = scenarios.load_scenario(name)
    condition, inclination_deg, _ = page_condition(scenario)
    assert complete(condition.scenario(inclination_deg)) == complete(scenario)


def run(condition, inclination_deg, seed, verdict, **changes):
    scenario = condition.scenario(inclination_deg, seed).changed(
        {tuple(key.split('__')): value for key, value in changes.items()}
    )
    return Run(
        {}, seed, {'verdict': verdict, 'stayed_up': verdict != 'fell'}, scenario, Path('absent')
    )


STANDS = {'source': 'a row of the scoreboard', **STAGE_2.columns(7.6, 1), 'stayed_up': True}
FALLS = {**STANDS, 'source': 'x', 'stayed_up': False}


@pytest.mark.parametrize(
    ('verdict', 'changes', 'pairs'),
    [
        ('fell', {}, 1),
        ('fell', {'gait__start_delay': 6.8}, 1),  # what no page names must not decide
        ('stood', {'gait__start_delay': 6.8}, 0),
        ('fell', {'simulator__friction': 0.3}, 0),  # another condition, and named so
        (None, {}, 0),
    ],
)
def test_a_run_that_contradicts_the_scoreboard_is_found(verdict, changes, pairs):
    runs = experiment_runs({'lift_stages': [run(STAGE_2, 7.6, 1, verdict, **changes)]})
    found = contradictions(pd.concat([run_table([STANDS]), runs]))
    assert len(found) == pairs
    if found:
        assert found[0] == (
            'stand, K_A 12 at 7.6 deg, seed 1: stays up by a row of the scoreboard, '
            'not by experiment lift_stages'
        )


def test_another_seed_or_ground_is_no_contradiction_but_may_be_ragged():
    others = [{**FALLS, 'seed': 2}, {**FALLS, 'inclination_deg': 7.5}, {**FALLS, 'engine': 'x'}]
    assert not contradictions(run_table([STANDS, *others]))
    assert ragged_limits(run_table([STANDS, {**FALLS, 'inclination_deg': 7.5}])) == [
        'stand, K_A 12, seed 1: lost at 7.5 deg, stays up at 7.6 deg'
    ]
    assert ragged_limits(run_table([STANDS, {**FALLS, 'inclination_deg': 7.7}])) == []


class Pool:
    """Measures at once: all walks fall, all limits are one run that walks."""

    def __init__(self):
        self.asked = []

    def submit(self, function, condition, *arguments):
        self.asked.append(condition)
        done = Future()
        if function is limit_of_seed:
            seed, start, _ = arguments
            run = {**condition.columns(start, seed), **outcome('walked')}
            done.set_result([run | {'limit_deg': start}])
        else:
            done.set_result({**condition.columns(*arguments), **outcome('fell')})
        return done


def test_the_table_of_a_bench_holds_all_its_runs():
    bench = Bench(Pool(), 2, 0.2)
    bench.start_limit(walking(12.0))
    bench.start(walk, walking(12.0), START)
    runs = bench.runs()
    assert len(runs) == 4 and set(runs['seed']) == {0, 1}
    assert len(contradictions(runs)) == 2


def test_a_bench_on_another_engine_measures_and_says_so():
    engine = (('simulator', 'engine'), 'mujoco')
    bench = Bench(pool := Pool(), 1, 0.2, settings=(engine,))
    bench.start(walk, walking(12.0), 8.0)
    assert [condition.changes for condition in pool.asked] == [(engine,)]
    assert bench.runs()['engine'].tolist() == ['mujoco']
    assert not bench.walks(walking(12.0), 8.0)['stayed_up'].any()  # asked for by its own name
    assert len(pool.asked) == 1


@pytest.mark.parametrize(
    ('engine', 'robot', 'place'), [('mujoco', '', 'mujoco'), ('bullet', 'stiff', 'robots/stiff')]
)
def test_experiments_on_another_engine_or_robot_have_folders_of_their_own(engine, robot, place):
    (own,) = sweeps_of(['walk_soles'], True)
    # Otherwise khr figure and khr reproduce would discard one another's runs.
    assert own in sweeps_of(['walk_soles'], True, RunParameters().engine)
    (other,) = (found := sweeps_of(['walk_soles'], True, engine, robot))
    assert other == own.parent / place / own.name
    constants = constants_of(robot) | {('simulator', 'engine'): engine}
    for scenario in found[other].scenarios.values():
        assert scenario.table(RunParameters).engine == engine
        for (node, key), value in constants.items():
            assert scenario.whole(node)[key] == value
