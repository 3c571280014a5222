"""The control loop without ROS."""

import subprocess
import sys

import numpy as np
import pytest

from khr_balance.gaits.kinematics import GaitError
from khr_bringup.changes import Change
from khr_bringup.node_registry import node_of, table_of
from khr_bringup.offline import BEFORE, run_offline
from khr_bringup.scenario.scenario import load_scenario
from khr_common import specifications


def test_an_error_of_a_block_names_its_node():
    guard = load_scenario('stand_0deg').changed(
        {
            ('gait', 'motion'): 'guard',
            ('recovery', 'enabled'): True,
            ('simulator', 'engine'): 'mujoco',
        }
    )
    with pytest.raises(GaitError, match=r'^recovery: .* leg: '):
        run_offline(guard)


EARLY = 't=0.1 duration=0.1 link=base_link frame=odom force=13,0,0 point=0,0,-0.019'


@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
@pytest.mark.parametrize(
    ('name', 'own'),
    [
        ('walk_8.88deg_ka12', {('gait', 'start_delay'): 0.1}),
        ('stand_tilting_staged', {('simulator', 'inclination_deg'): 6.0}),
        (
            'push_behind_step',
            {('simulator', 'pushes'): [EARLY], ('recovery', 'settle_time'): [0.1, 0.1]},
        ),
    ],
)
def test_parameters_set_before_the_first_sample_act_as_those_of_the_scenario(name, own, engine):
    """Each float that may change in a run, a little smaller: none keeps its former value."""
    of_run = {('simulator', 'duration'): 1.2, ('simulator', 'engine'): engine}
    scenario = load_scenario(name).changed(of_run | own)
    smaller = {}
    for table in map(table_of, scenario.nodes):
        for key, each in specifications(table).items():
            if not each.read_only and float in (each.kind, each.element):
                value = getattr(scenario.table(table), key)
                less = 0.99 * np.array(value)
                smaller[node_of(table), key] = less.tolist()
    changes = [Change(*place, value, BEFORE) for place, value in smaller.items()]

    def last(scenario, changes=()):
        seen = {}
        run = run_offline(
            scenario, lambda truth, loop, outcome: seen.update(loop.signals), changes
        )
        return run.trajectory_hash, run.judged, seen

    assert last(scenario, changes) == last(scenario.changed(smaller))


GARBAGE = """
import gc, weakref
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario

class Heavy:
    def __init__(self):
        self.itself = self

scenario = load_scenario('stand_0deg').changed({('simulator', 'duration'): 0.3})
for frozen in (False, True):
    if frozen:
        gc.freeze()
    heavy = Heavy()
    there = weakref.ref(heavy)
    run_offline(scenario)
    del heavy
    gc.collect()
    print(there() is None, gc.get_freeze_count() > 0)
"""


@pytest.mark.slow
def test_a_run_leaves_garbage_collection_as_the_caller_had_it():
    # in a process of its own, which has made no run yet
    done = subprocess.run(
        [sys.executable, '-c', GARBAGE], capture_output=True, text=True, check=True
    )
    assert done.stdout == 'True False\nTrue True\n'
