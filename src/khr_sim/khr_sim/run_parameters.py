"""The simulator node: its parameters and specification."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from khr_common import KhrError, ParameterError, fixed, parameter
from khr_common import interfaces as topics
from khr_common.block import NodeSpec
from khr_common.interfaces import NAME
from khr_description.robot import link_names
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.push import Push
from khr_sim.physics.truth import SIGNALS

LONGEST_ARM = 1.0  # m from the origin of a link to the point of a push

GAIT, REFEREE = 'gait', 'referee'
# Parameters that may differ between the robots of one world.
OF_ROBOT = ('seed', 'initial_tilt_deg', 'zero_error_deg', 'pushes')
SOURCES = (GAIT, 'ankle_controller', 'hip_controller')


@dataclass(frozen=True)
class RunParameters(SimulatorParameters):
    """Parameters of the simulation, and of time, answers and pushes.

    A list with one empty text is an empty list, as ROS 2 has no typed empty list.
    """

    sync: str = fixed(
        'lockstep',
        'Wait for the answers of each period (lockstep), or run against the wall clock (realtime).',
        choices=('lockstep', 'realtime'),
    )
    control_delay: int = fixed(
        1,
        'Periods between a sample and the motion that its answers cause; 1 as on the real '
        'board, so that physics and controllers overlap.',
        '[0, 1] periods',
    )
    answers: tuple[str, ...] = parameter(
        SOURCES,
        'Nodes that answer each sample, and that lockstep waits for: the gait with joint '
        'angles, and controllers with corrections, which are added in this order.',
        wiring=True,
    )
    robots: tuple[str, ...] = parameter(
        ('',),
        'Robots of a bout, each as JSON: its name, its start (x and y in m, heading in deg), and '
        'the parameters that differ between robots. Empty for one robot.',
        wiring=True,
    )
    listeners: tuple[str, ...] = parameter(
        ('',),
        'Nodes that must be up before the run starts, and must receive all samples.',
        wiring=True,
    )
    lockstep_timeout: float = parameter(
        5.0, 'Timeout in wall time for an answer; the run then ends.', '[0.1, 3600] s'
    )
    start_timeout: float = parameter(
        0.0,
        'Timeout in wall time for the start of all nodes; 0 waits forever.',
        '[0, 3600] s',
        wiring=True,
    )
    realtime_factor: float = parameter(
        1.0, 'Ratio of simulated to wall time in realtime mode.', '[0.01, 100]'
    )
    pace: float = parameter(
        0.0,
        'Limit of the ratio of simulated to wall time in lockstep; 0 is unlimited.',
        '[0, 100]',
    )
    command_timeout: float = parameter(
        0.1, 'Age limit of a correction in realtime mode; older ones are dropped.', '[0.001, 10] s'
    )
    duration: float = fixed(
        0.0,
        'Simulated time of the run; 0 runs until stopped (khr: to the end of the motion).',
        '[0, 1e+06] s',
    )
    pushes: tuple[str, ...] = fixed(
        ('',),
        'Timed pushes, each "t=5.0 duration=0.1 link=base_link frame=odom force=8,0,0 '
        'point=0,0,0.05" in s, N and m.',
    )
    push_link: str = parameter(
        'base_link', 'Link that a message on the topic push acts on if its frame is odom.'
    )
    push_point: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0),
        'Point of action of a push by message, in the frame of its link.',
        'm',
        length=3,
    )
    push_duration: float = parameter(0.1, 'Duration of a push by message.', '[0.001, 60] s')
    push_limit: float = fixed(1000.0, 'Largest force of a push.', '[0, 100000] N')

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.push_link not in link_names():
            raise ParameterError.refused('push_link', self.push_link, ' | '.join(link_names()))
        if math.hypot(*self.push_point) > LONGEST_ARM:
            raise ParameterError.refused(
                'push_point', self.push_point, f'up to {LONGEST_ARM:g} m away'
            )
        for name in filter(None, self.answers):
            if not NAME.fullmatch(name):
                raise ParameterError.refused('answers', name, 'the name of a node')
        for text in filter(None, self.robots):
            if not _is_robot(text):
                raise ParameterError.refused(
                    'robots', text, 'JSON with name, start (x, y, heading) and parameters'
                )
        try:
            for text in filter(None, self.pushes):
                self.check_push(Push.parse(text))
        except KhrError as error:
            raise ParameterError(f'pushes: {error}') from error

    def of_robots(self) -> Mapping[str, RunParameters]:
        """Return the parameters of each robot, by name; the name of a robot alone is empty."""
        shared = vars(self)
        return {
            robot.get('name', ''): RunParameters(**shared | _tuples(robot.get('parameters', {})))
            for robot in self._robots
        }

    def starts(self) -> list[tuple[float, float, float]]:
        """Return x and y in m and heading in deg of the start of each robot."""
        return [tuple(robot.get('start', (0.0, 0.0, 0.0))) for robot in self._robots]

    @property
    def _robots(self) -> list[dict[str, Any]]:
        return [_robot(text) for text in self.robots]

    def check_push(self, push: Push) -> None:
        """Check a push against robot and limits.

        Raises:
            KhrError: if the link is unknown, the force too large, or its point too far away.
        """
        force, arm = math.hypot(*push.force), math.hypot(*push.point)
        for name, value, accepted, fine in (
            ('link', push.link, ' | '.join(link_names()), push.link in link_names()),
            ('force', push.force, f'up to {self.push_limit:g} N', force <= self.push_limit),
            ('point', push.point, f'up to {LONGEST_ARM:g} m away', arm <= LONGEST_ARM),
        ):
            if not fine:
                raise KhrError.refused(name, value, accepted)


SIMULATOR = NodeSpec(
    'simulator',
    'khr_sim',
    RunParameters,
    subscribes=(
        topics.JOINT_REFERENCE,
        topics.ANKLE_CORRECTION,
        topics.HIP_CORRECTION,
        topics.DECIDED,
        topics.PUSH,
        topics.READY,
    ),
    publishes=(
        *SIGNALS,
        topics.ROBOT_DESCRIPTION,
        topics.STATE,
        topics.PUSHED,
        topics.DIAGNOSTICS,
    ),
    node='khr_sim.nodes.simulator:SimulatorNode',
)


def _robot(text: str) -> dict[str, Any]:
    try:
        found = json.loads(text or '{}')
    except ValueError:
        found = None
    return found if isinstance(found, dict) else {}


def _is_robot(text: str) -> bool:
    robot = _robot(text)
    name, start = robot.get('name'), robot.get('start', [0.0] * 3)
    own = robot.get('parameters', {})
    return (
        isinstance(name, str)
        and NAME.fullmatch(name) is not None
        and isinstance(start, list)
        and [*map(type, start)] == [float] * 3
        and isinstance(own, dict)
    )


def _tuples(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: tuple(each) if isinstance(each, list) else each for key, each in values.items()}


def robot_line(name: str, start: Sequence[float], parameters: RunParameters) -> str:
    """Return a robot of a bout as the parameter ``robots`` has it.

    Args:
        name: its namespace.
        start: x and y in m, heading in deg.
        parameters: of which it has some apart.
    """
    own = {key: getattr(parameters, key) for key in OF_ROBOT}
    return json.dumps({'name': name, 'start': list(start), 'parameters': own})
