"""Draw docs/board.gif, software of others moving the robot: ``python -m tests.support.board_film``.

The unmodified client ``rcb4`` opens the virtual board, has the simulated robot take its stance,
squat, and rise again.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from rcb4.rcb4interface import RCB4Interface, deg_to_servovector

from khr_bringup.scenario import scenario as scenarios
from khr_bringup.virtual_robot import virtual_board
from khr_description.robot import JOINTS
from khr_hardware.joint_map import JointMap
from khr_report.film.film import Filmed, pictures, save_gif
from khr_report.film.scene import Frame, Look
from tests import ROOT
from tests.support.served import served

MAP = JointMap.load()
BENDS = (0.0, 0.6, 0.0)  # rad of the thighs
LOOK = Look(480, 400, rate=12.0, yaw=1.2, distance=1.0)


def angles_of(stance, bend):
    """Return what rcb4 is given for a pose, deg: thigh and shank bent alike, the soles flat."""
    pose = list(stance)
    for joint, share in (('hip_pitch', -1), ('knee', 2), ('ankle_pitch', -1)):
        for side in 'lr':
            pose[JOINTS.index(f'{side}_{joint}')] += share * bend
    positions = MAP.positions(pose)
    return [(positions[ics] - 7500) / deg_to_servovector for ics in sorted(positions)]


def stand_and_squat(link, robot, bends=BENDS, seconds=0.6):
    """Let rcb4 move the robot; return its height in each pose once it has settled, m."""
    rcb4, heights = RCB4Interface(), []
    assert rcb4.open(link, 1_250_000, flat=False)
    assert sorted(rcb4.search_servo_ids().tolist()) == sorted(MAP.numbers)
    rcb4.hold()
    for bend in bends:
        rcb4.angle_vector(angles_of(robot.stance, bend), time=seconds)
        assert rcb4.wait_interpolation(timeout=20.0)
        assert np.allclose(rcb4.angle_vector(), angles_of(robot.stance, bend), atol=6.0)
        begun = robot.time
        while robot.time < begun + 0.5:
            rcb4.get_config()
        heights.append(float(robot.truth.position[2]))
    rcb4.close()
    return heights


def draw(file):
    """Film it, from the moment when the robot is put on the ground."""
    scenario = scenarios.load_scenario('stand_0deg').set_to(['simulator.engine=mujoco'])
    board, robot = virtual_board(scenario, MAP)
    kept = []

    def keep():
        if robot.on_ground:
            kept.append(Frame(robot.truth, robot.pitch_rate, robot.outcome))
        return True

    with (
        tempfile.TemporaryDirectory() as folder,
        served(board, Path(folder), after_cycle=keep) as (_, link),
    ):
        stand_and_squat(link, robot, seconds=0.8)
    count = round(kept[-1].time * LOOK.rate)
    times = [number / LOOK.rate for number in range(count)]
    filmed = [Filmed(scenario, kept)]
    (sample,) = pictures(filmed, times[count // 2 : count // 2 + 1], LOOK)
    save_gif(file, pictures(filmed, times, LOOK), count, sample, LOOK.rate)
    robot.close()


if __name__ == '__main__':
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / 'docs' / 'board.gif')
