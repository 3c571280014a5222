"""The parameters of the node that drives the real robot, and its specification for the graph."""

from __future__ import annotations

from dataclasses import dataclass

from khr_common import fixed, parameter
from khr_common.block import NodeSpec
from khr_common.interfaces import (
    BOARD_CORRECTION,
    CLOCK,
    DIAGNOSTICS,
    FOOT_FORCES,
    GYRO,
    JOINT_REFERENCE,
    JOINT_STATES,
    ROBOT_DESCRIPTION,
    STATE,
    Topic,
)
from khr_hardware.joint_map import JointMap


@dataclass(frozen=True)
class BoardParameters:
    """The parameter table of the node ``board``.

    The parameters from ``control_period`` to ``command_timeout`` also exist in the simulator and
    take the simulator's values of the scenario. An empty text in a list is ignored.
    """

    port: str = fixed('/dev/ttyUSB0', 'Serial line of the board.')
    baud: int = fixed(
        0, 'Rate of the line: 115200, 625000 or 1250000; 0 tries all three.', '[0, 1250000]'
    )
    reply_timeout: float = fixed(
        0.02,
        'Timeout of the first byte of a reply, and of the rest; an exchange is tried three times.',
        '[0.005, 1] s',
    )
    map: str = fixed(
        '',
        "YAML file of servos and AD ports, or the name khr3hv_forces; by default the KHR-3HV's map.",
    )
    control_period: float = fixed(
        0.015, 'Output cycle of the board: 0.010, 0.015, 0.020 or 0.025.', '[0.01, 0.025] s'
    )
    duration: float = fixed(
        0.0,
        'Duration of the run; 0 runs until stopped (khr: duration of the motion).',
        '[0, 1e6] s',
    )
    sync: str = fixed('realtime', 'A real robot runs in real time only.', choices=('realtime',))
    answers: tuple[str, ...] = parameter(
        ('gait', 'ankle_controller', 'hip_controller'),
        'Nodes that provide the targets: the gait, and the controllers that correct it.',
        wiring=True,
    )
    command_timeout: float = parameter(
        0.1,
        'Maximum age: an older correction is dropped; with an older reference the robot holds.',
        '[0.02, 1] s',
    )
    mixing: str = fixed(
        'computer',
        "Where the feedback is added: computer (by the graph's controllers) or board (by its own "
        'mixing of the gyro; corrections of the controllers are then rejected).',
        choices=('computer', 'board'),
    )
    ankle_ratio: int = parameter(
        0,
        'With mixing board: K_A, counts of both ankles per AD step of the gyro (khr: from the gain '
        'of ankle_controller).',
        '[0, 127]',
    )
    hip_ratio: int = parameter(
        0,
        'With mixing board: K_H, counts of both hips per AD step of the gyro (khr: from the gain of '
        'hip_controller).',
        '[0, 127]',
    )
    ad_offset: int = fixed(
        0,
        "With mixing board: AD steps from the gyro's voltage at rest to its reference (khr: from "
        'reference_offset of the controllers).',
        '[-100, 100]',
    )
    urdf: str = fixed(
        '',
        'URDF file to publish; empty publishes no description (khr: the URDF of the simulator).',
    )
    priority: int = fixed(
        50,
        'Real-time priority (SCHED_FIFO) of the thread of the driver, as far as ulimit -r '
        'permits; 0 does not request it.',
        '[0, 99]',
    )
    dry_run: bool = fixed(False, 'Run without writing positions: no servo gets torque.')
    at_exit: str = parameter(
        'free',
        'State of the servos after the node ends or exceeds a limit: free (for a robot on a stand) '
        'or hold.',
        choices=('free', 'hold'),
    )
    ramp_speed_deg_s: float = parameter(
        30.0,
        'Largest speed of a joint on the ramp to the first reference; a change acts from the next '
        'start.',
        '[1, 60] deg/s',
    )
    positions_per_period: int = parameter(
        4,
        'Number of servo positions read in each period, in turn; a read takes about 1 ms. With 0 '
        'the topic joint_states has the targets.',
        '[0, 17]',
    )
    battery_warn: float = parameter(
        10.5, 'Battery voltage below which the node warns.', '[6, 13] V'
    )
    battery_stop: float = parameter(
        9.6, 'Battery voltage that ends the run if it is below for half a second.', '[0, 13] V'
    )
    torque_time: float = parameter(
        300.0,
        'Maximum time with torque: no command reads the temperature of a servo.',
        '[1, 3600] s',
    )


def published_topics(parameters: BoardParameters) -> tuple[Topic, ...]:
    """Return the topics that the node publishes with the sensors of its map."""
    joint_map = JointMap.load(parameters.map)
    lacking = {
        *(() if joint_map.gyro else (GYRO,)),
        *(() if joint_map.forces else FOOT_FORCES),
        *(() if parameters.mixing == 'board' else (BOARD_CORRECTION,)),
        *(() if parameters.urdf else (ROBOT_DESCRIPTION,)),
    }
    return tuple(topic for topic in BOARD.publishes if topic not in lacking)


BOARD = NodeSpec(
    'board',
    'khr_hardware',
    BoardParameters,
    subscribes=(JOINT_REFERENCE,),
    publishes=(
        CLOCK,
        JOINT_STATES,
        GYRO,
        *FOOT_FORCES,
        BOARD_CORRECTION,
        ROBOT_DESCRIPTION,
        STATE,
        DIAGNOSTICS,
    ),
    node='khr_hardware.nodes.board:BoardNode',
    drives=True,
    brings=published_topics,
)
