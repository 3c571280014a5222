"""The parameters of a simulator that takes part in a node graph."""

from __future__ import annotations

import math
from dataclasses import dataclass

from khr_common import ParameterError, parameter
from khr_common.errors import KhrError
from khr_common.text.quoting import quoted
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.push import Push
from khr_sim.robot import link_names

LONGEST_ARM = 1.0  # m from a link's origin to where a push acts

GAIT = 'gait'
SOURCES = (GAIT, 'ankle_controller', 'hip_controller')


@dataclass(frozen=True)
class RunParameters(SimulatorParameters):
    """The robot's own parameters and those of time, answers and pushes.

    Empty text in a list stands for nothing: ROS 2 has no typed empty list.
    """

    sync: str = parameter(
        'lockstep',
        'Wait for the stamped answers of every period, or run freely against the wall clock.',
        choices=('lockstep', 'realtime'),
        read_only=True,
    )
    control_delay: int = parameter(
        1,
        'Periods between a sample and the motion that answers it; 1 as on the real board, '
        'and physics and controllers overlap.',
        unit='periods',
        minimum=0,
        maximum=1,
        read_only=True,
    )
    answers: tuple[str, ...] = parameter(
        SOURCES,
        'Nodes whose answers the board takes, and lockstep waits for: the gait, whose joint '
        'angles it follows, and controllers, whose corrections it adds in this order.',
        wiring=True,
    )
    listeners: tuple[str, ...] = parameter(
        ('',), 'Nodes that must be there before the run starts and receive all of it.', wiring=True
    )
    lockstep_timeout: float = parameter(
        5.0,
        'Wall time after which a missing answer ends the run.',
        unit='s',
        minimum=0.1,
        maximum=3600.0,
    )
    start_timeout: float = parameter(
        0.0,
        'Wall time after which a node that never appeared ends the run; 0 waits for ever.',
        unit='s',
        minimum=0.0,
        maximum=3600.0,
        wiring=True,
    )
    realtime_factor: float = parameter(
        1.0, 'Simulated by wall time in realtime mode.', minimum=0.01, maximum=100.0
    )
    pace: float = parameter(
        0.0,
        'Simulated by wall time that lockstep does not exceed; 0 goes as fast as it can.',
        minimum=0.0,
        maximum=100.0,
    )
    command_timeout: float = parameter(
        0.1,
        'Age at which realtime mode drops a correction.',
        unit='s',
        minimum=0.001,
        maximum=10.0,
    )
    duration: float = parameter(
        0.0,
        'Simulated time of the run; 0 runs until stopped (khr: as long as the motion).',
        unit='s',
        minimum=0.0,
        maximum=1e6,
        read_only=True,
    )
    pushes: tuple[str, ...] = parameter(
        ('',),
        'Timed pushes, each "t=5.0 duration=0.1 link=base_link frame=odom force=8,0,0 '
        'point=0,0,0.05" in s, N and m.',
        read_only=True,
    )
    push_link: str = parameter(
        'base_link', 'Link that a message on the topic push acts on if its frame is odom.'
    )
    push_point: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0),
        'Point that such a push acts at, in the frame of its link.',
        unit='m',
        length=3,
    )
    push_duration: float = parameter(
        0.1, 'Duration of such a push.', unit='s', minimum=0.001, maximum=60.0
    )
    push_limit: float = parameter(
        1000.0, 'Largest force of any push.', unit='N', minimum=0.0, maximum=1e5, read_only=True
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.push_link not in link_names():
            raise ParameterError(
                f'push_link: {quoted(self.push_link)} is not accepted; '
                f'accepted: {" | ".join(link_names())}'
            )
        if math.hypot(*self.push_point) > LONGEST_ARM:
            raise ParameterError(
                f'push_point: {quoted(self.push_point)} is not accepted; '
                f'accepted: up to {LONGEST_ARM:g} m away'
            )
        try:
            for text in filter(None, self.pushes):
                self.check_push(Push.parse(text))
        except KhrError as error:
            raise ParameterError(f'pushes: {error}') from error

    def check_push(self, push: Push) -> None:
        """Check what acts on the robot.

        Raises:
            KhrError: if the robot has no such link, or the force or its point is too far off.
        """
        force, arm = math.hypot(*push.force), math.hypot(*push.point)
        for name, value, accepted, fine in (
            ('link', push.link, ' | '.join(link_names()), push.link in link_names()),
            ('force', push.force, f'up to {self.push_limit:g} N', force <= self.push_limit),
            ('point', push.point, f'up to {LONGEST_ARM:g} m away', arm <= LONGEST_ARM),
        ):
            if not fine:
                raise KhrError(f'{name}: {quoted(value)} is not accepted; accepted: {accepted}')
