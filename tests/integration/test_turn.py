"""The turns on the spot: by how much, and how far the robot leaves its place."""

from math import atan2, degrees, hypot

import pytest

from khr_bringup.bout.bout import load_bout
from khr_bringup.bout.offline import run_bout

CYCLES = 2


@pytest.mark.slow
@pytest.mark.parametrize('engine', ['bullet', 'mujoco'])
@pytest.mark.parametrize('surface', ['rubber', 'smooth'])
def test_both_robots_turn_on_the_spot(engine, surface):
    poses = {'red': [], 'blue': []}

    def watch(_, __, truths, ___):
        for robot, truth in truths.items():
            x, y, z, w = truth.orientation
            heading = degrees(atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
            poses[robot].append((heading, *truth.position[:2]))

    changes = [f'gait.cycles={CYCLES}', f'referee.time_limit={2.0 + 3.4 * CYCLES}']
    changes += [f'simulator.engine={engine}', f'simulator.surface={surface}']
    (only,) = run_bout(load_bout('turn').set_to(changes), watch).rounds
    assert {each.verdict for each in only.outcomes.values()} == {'stood'}
    for robot, sign in (('red', -1.0), ('blue', 1.0)):
        (start, *here), (end, *there) = poses[robot][0], poses[robot][-1]
        turned = sign * ((end - start + 180.0) % 360.0 - 180.0) / CYCLES
        assert 12.0 < turned < 15.8
        assert hypot(there[0] - here[0], there[1] - here[1]) < 0.015 * CYCLES
