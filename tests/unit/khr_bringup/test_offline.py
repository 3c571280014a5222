"""The control loop without ROS."""

import subprocess
import sys

import pytest

from khr_balance.gaits.kinematics import GaitError
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario


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
