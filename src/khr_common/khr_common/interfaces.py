"""The interfaces of the node graph, each stated once: joints, frames, regions, topics.

Names follow REP 103, 105, 120 and 145, with ``l_heel`` and ``r_heel`` added. Topic names are
relative, the clock's too, so that a namespace holds a second robot with a time of its own. Robots
of one world share the clock at the root.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from typing import Literal

from khr_common.errors import KhrError

SIDES = ('l', 'r')
ARM = ('shoulder_pitch', 'shoulder_roll', 'elbow_pitch')
LEG = ('hip_roll', 'hip_pitch', 'knee', 'ankle_pitch', 'ankle_roll')
# Pitch axes are +y and roll axes +x on both sides; in the zero pose the legs are straight, the
# soles flat and the arms down.
JOINTS: tuple[str, ...] = (  # their order in every vector
    'head_yaw',
    *(f'{side}_{joint}' for side in SIDES for joint in ARM),
    *(f'{side}_{joint}' for side in SIDES for joint in LEG),
)
JOINT_INDEX = {name: index for index, name in enumerate(JOINTS)}

HARDWARE = 'khr3hv'  # the robot's name in diagnostics
WORLD, BODY, IMU_FRAME = 'odom', 'base_link', 'imu_link'
TORSO = 'torso'  # the link that carries the mass of the body
REGIONS = {  # of the feet that carry a force sensor: their frames, by name
    'left_toe': 'l_toe',
    'left_heel': 'l_heel',
    'right_toe': 'r_toe',
    'right_heel': 'r_heel',
}

NAME = re.compile(r'(~/|/)?[a-z_]\w*(/[a-z_]\w*)*', re.ASCII | re.IGNORECASE)  # of topic or node

# Flow of a topic: a message in every control period, with the timestamp of its sample; latched;
# or at events.
Flow = Literal['period', 'latched', 'event']

# JointStates that any driver or recording may publish.
MEASURED = ('joint_states', 'ground_truth/inclination')


@dataclass(frozen=True)
class Topic:
    """A topic of the graph; two of the same name are the same topic."""

    name: str  # relative to the robot's namespace, unless it begins with a slash
    kind: str = field(compare=False)  # message type, such as sensor_msgs/msg/Imu
    meaning: str = field(compare=False)  # of its messages, with units
    flow: Flow = field(default='period', compare=False)  # of its messages
    frame: str = field(default='', compare=False)  # of its messages, if all have the same one
    # of the positions of a JointState, in order
    names: tuple[str, ...] = field(default=(), compare=False)

    def __hash__(self) -> int:  # topics are looked up in every period
        return hash(self.name)

    @property
    def of_run(self) -> bool:
        """Return whether its ``frame_id`` holds the identity of the run instead of a frame.

        Only this project's nodes send such messages; ``joint_states`` is any driver's.
        """
        return self.kind == JOINT_STATE and not self.name.endswith(MEASURED)

    @property
    def line(self) -> str:
        """Return name, message type and flow, as a parameter holds them."""
        return f'{self.name} {self.kind} {self.flow}'

    def under(self, robot: str) -> Topic:
        """Return the topic of a robot among several, with its frame; of one alone the same."""
        if not robot:
            return self
        return replace(self, name=full_name(robot, self.name), frame=frame_of(robot, self.frame))


def other_side(side: str) -> str:
    """Return 'l' for 'r', and 'r' for 'l'."""
    return 'r' if side == 'l' else 'l'


def full_name(robot: str, name: str) -> str:
    """Return a name in the namespace of a robot among several; of one alone the name itself."""
    return f'{robot}/{name}' if robot else name


def frame_of(robot: str, frame: str) -> str:
    """Return a frame of a robot among several; the world is common, and an empty one stays."""
    return frame if frame in ('', WORLD) else full_name(robot, frame)


IMU, JOINT_STATE = 'sensor_msgs/msg/Imu', 'sensor_msgs/msg/JointState'
WRENCH = 'geometry_msgs/msg/WrenchStamped'
STATUS = 'diagnostic_msgs/msg/DiagnosticStatus'
STATUS_ARRAY = 'diagnostic_msgs/msg/DiagnosticArray'
TEXT, TRANSFORMS = 'std_msgs/msg/String', 'tf2_msgs/msg/TFMessage'


def _numbers(name: str, meaning: str, names: tuple[str, ...]) -> Topic:
    """Return a topic of named numbers: a JointState, standard and with a timestamp."""
    return Topic(name, JOINT_STATE, meaning, names=names)


# Ground truth of robot and slope.
CLOCK = Topic('clock', 'rosgraph_msgs/msg/Clock', 'Simulated time; asks for the next answers.')
JOINT_STATES = _numbers(
    'joint_states', 'Joint angles, rad, speeds, rad/s, and torques, N m.', JOINTS
)
TRUE_POSE = Topic(
    'ground_truth/odom', 'nav_msgs/msg/Odometry', 'Pose and twist of the torso.', frame=WORLD
)
TRUE_RATE = Topic(
    'ground_truth/imu',
    IMU,
    'Angular velocity of the torso, mean over the period, rad/s.',
    frame=IMU_FRAME,
)
TRUE_SOLES = Topic(
    'ground_truth/soles', 'geometry_msgs/msg/PoseArray', 'Poses of l_sole and r_sole.', frame=WORLD
)
TRUE_INCLINATION = _numbers(
    'ground_truth/inclination',
    'Inclination of the ground, rad, positive if the robot faces downhill.',
    ('inclination',),
)
TRUE_FORCES = tuple(
    Topic(
        f'ground_truth/contact/{region}',
        WRENCH,
        'Force of the ground, mean over the period, N.',
        frame=frame,
    )
    for region, frame in REGIONS.items()
)
ROBOT_DESCRIPTION = Topic('robot_description', TEXT, 'The URDF.', 'latched')

# The wheels of ROS have no tf2_msgs: there a run has no tf.
TF_AVAILABLE = find_spec('tf2_msgs') is not None
TF = Topic('tf', TRANSFORMS, 'Frames that move: odom to base_link, and each joint.', 'event')
TF_STATIC = Topic('tf_static', TRANSFORMS, 'Frames that do not move.', 'latched')

# Sensor readings.
GYRO = Topic(
    'imu/data_raw', IMU, 'Angular velocity as the board reads it, rad/s.', frame=IMU_FRAME
)
FOOT_FORCES = tuple(
    Topic(f'foot_force/{region}', WRENCH, 'Normal force as the sensor reads it, N.', frame=frame)
    for region, frame in REGIONS.items()
)

# Joint commands.
JOINT_REFERENCE = _numbers('joint_reference', 'Joint angles of the gait, rad.', JOINTS)


def correction(node: str, joints: tuple[str, ...]) -> Topic:
    """Return the topic of a controller's correction, which the board adds to the reference."""
    return _numbers(f'{node}/correction', 'Added to the reference of these joints, rad.', joints)


def mix(reference: Sequence[float], corrections: Sequence[Mapping[str, float]]) -> list[float]:
    """Add corrections, by joint name, to a reference of all joints, in rad.

    The corrections are summed in their order, which must be the same in bit-equal runs.

    Raises:
        KhrError: if a correction names a joint that the robot does not have.
    """
    target = list(reference)
    for correction in corrections:
        for joint, angle in correction.items():
            if joint not in JOINT_INDEX:
                raise KhrError.refused('joint', joint, ' | '.join(JOINTS))
            target[JOINT_INDEX[joint]] += angle
    return target


ANKLE_CORRECTION = correction('ankle_controller', ('l_ankle_pitch', 'r_ankle_pitch'))
HIP_CORRECTION = correction('hip_controller', ('l_hip_pitch', 'r_hip_pitch'))
RECOVERY_CORRECTION = correction(
    'recovery',
    tuple(
        f'{side}_{joint}'
        for joint in ('ankle_pitch', 'knee', 'hip_pitch', 'ankle_roll', 'hip_roll')
        for side in SIDES
    ),
)
RECOVERY_STATE = _numbers(
    'recovery/state',
    'Phase of the recovery (0 waiting, 1 swing, 2 settling, 3 closing, 4 returning), estimated '
    'centre of mass and capture point ahead of the middle of the soles, m, and the share of the '
    'other corrections that acts.',
    ('phase', 'com', 'capture_point', 'share'),
)
BOARD_CORRECTION = _numbers(
    'board/correction',
    'Correction that the controller board adds to the reference by its own mixing, rad.',
    (*ANKLE_CORRECTION.names, *HIP_CORRECTION.names),
)
STAGE = _numbers(
    'stage',
    'Stage (1 to 3), inclination as read back from the feet, rad, and the share of each '
    'correction that acts.',
    ('stage', 'inclination', 'ankle_controller', 'hip_controller'),
)
STAGE_CHANGES = Topic('stage/changes', STATUS_ARRAY, 'Each stage when it is entered.', 'latched')
PUSH = Topic('push', WRENCH, 'Asks for a push, N, from its stamp on.', 'event')
PUSHED = Topic(
    'simulator/push',
    WRENCH,
    'Each push that was asked for and acts, N, from its stamp on.',
    'event',
)

# Results.
SPECTRUM = Topic(
    'spectrum', 'std_msgs/msg/Float64MultiArray', 'Spectrum of the pitch rate.', 'event'
)
PEAKS = Topic('spectrum/peaks', STATUS_ARRAY, 'Its labelled peaks.', 'event')
RATE_AMPLITUDE = 'amplitude_rad_s'  # name of amplitudes in both, of an angular velocity
OUTCOME = Topic('outcome', STATUS, 'Verdict and quantities of the run so far.', 'latched')

# Bouts.
DECIDED = _numbers(
    'referee',
    'Whether the round is decided (1), and who has won it: 1 red, 2 blue, 0 neither.',
    ('decided', 'winner'),
)
DECISION = Topic('referee/decision', STATUS, 'Winner, reason and time of a round.', 'latched')

# How the run goes.
STATE = Topic('simulator/state', STATUS, 'State of the run, and why it ended.', 'latched')
FINISHED = 'finished'  # the state of a run after its last sample
READY = Topic('ready', TEXT, 'How far each listener has received the run.', 'latched')
DIAGNOSTICS = Topic(
    'diagnostics', STATUS_ARRAY, 'Health of the nodes, and their parameter changes.', 'event'
)
LOG = Topic('/rosout', 'rcl_interfaces/msg/Log', 'Log messages of the nodes.', 'event')
SCENARIO = Topic('/scenario', TEXT, 'The scenario as it ran; only in a bag.', 'latched')
